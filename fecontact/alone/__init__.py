"""Theories of the pressure without finite elements: one at a position, and tables of them."""
