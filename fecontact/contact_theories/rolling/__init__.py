"""Rolling contact with friction: creep laws, FASTSIM, and the exact theory on the half-space."""
