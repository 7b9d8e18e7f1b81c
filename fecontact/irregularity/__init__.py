"""Irregularities of wheel and rail along the track, and the texts that give them."""
