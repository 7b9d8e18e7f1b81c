"""What the surface of a wheel or a rail has along the track beside its profile, and the texts that give it."""
