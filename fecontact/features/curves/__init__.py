"""Steady running of a wheelset and of a bogie on curved track: equilibrium, loaded contact, stability."""
