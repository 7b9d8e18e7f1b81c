"""The frictionless contact problem on a grid of pressure nodes; imports nothing about bodies."""
