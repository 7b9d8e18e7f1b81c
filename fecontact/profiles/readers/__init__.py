"""Readers of profile files."""
