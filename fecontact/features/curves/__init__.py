"""Steady running of a wheelset and of a bogie on curved track.

The feature has equilibrium, loaded contact and stability.
"""
