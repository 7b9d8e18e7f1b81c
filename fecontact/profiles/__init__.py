"""Rail and wheel profiles: exact segments, the library of standard profiles, and readers of files."""
