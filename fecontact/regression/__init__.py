"""Two sets of results side by side, and results beside references; needs nothing that makes them."""
