"""Closed forms; sees no finite elements."""
