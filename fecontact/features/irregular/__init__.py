"""Hertz's spring over corrugation, flats and welds, judged by the half-space.

The feature has this spring (Otero Yugat, Part I, eq. 6) and similar models.
"""
