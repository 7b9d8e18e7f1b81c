"""Work in worker processes and its results on disk; imports neither physics nor outputs."""
