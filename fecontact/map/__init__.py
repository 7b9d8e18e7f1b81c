"""Where Hertz holds over lateral shift and load."""
