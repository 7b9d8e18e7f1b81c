"""Finite elements of one wheel and one rail; sees no contact theory."""
