"""Feature: where Hertz holds over lateral shift and load: positions under many loads, their limits, pictures."""
