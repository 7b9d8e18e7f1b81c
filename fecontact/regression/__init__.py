"""Comparison of two sets of results, and of results with references.

It imports nothing that makes results.
"""
