"""The frictionless contact problem on a grid of pressure nodes; knows no bodies."""
