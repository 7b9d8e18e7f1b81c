"""Finite elements of a wheel and a rail, without contact theories."""
