"""What the commands do, one module for those that belong together: each parses, calls and prints."""
