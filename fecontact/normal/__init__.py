"""Theories of the normal contact: Hertz, and cheap ones on a gap line; sees no finite elements."""
