"""Outputs of a comparison of two tables of results."""
