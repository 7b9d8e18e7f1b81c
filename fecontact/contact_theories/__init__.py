"""Theories of the normal contact: Hertz, and fast theories on a gap line.

This folder imports no finite elements.
"""
