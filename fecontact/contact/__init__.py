"""Frictionless contact problem on a grid of pressure nodes.

This folder imports nothing about bodies.
"""
