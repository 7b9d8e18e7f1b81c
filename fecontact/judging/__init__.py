"""Hertz and the finite elements side by side: measures, ladder, uncertainty, verdict."""
