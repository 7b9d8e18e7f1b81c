"""Rolling with friction on the half-space: the exact theory behind the simplified laws, for any pressure."""
