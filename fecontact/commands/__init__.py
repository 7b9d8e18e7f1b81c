"""Commands, grouped in modules: each command parses, calls and prints."""
