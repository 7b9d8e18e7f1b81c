"""Inputs: described where their fields stand, with unit and range; their texts, and classes that check them."""
