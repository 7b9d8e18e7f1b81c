"""Theories of the normal contact: Hertz, and fast theories on a gap line; imports no finite elements."""
