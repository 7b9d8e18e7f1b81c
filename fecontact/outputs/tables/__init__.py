"""Tables as values, which the terminal and reports show."""
