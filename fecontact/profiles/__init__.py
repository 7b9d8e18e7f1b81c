"""Rail and wheel lines of exact segments, the library of standard ones, and readers of files."""
