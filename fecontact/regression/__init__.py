"""Comparison of two sets of results, and of results with references; imports nothing that makes results."""
