"""Work in worker processes and its results on disk; knows neither physics nor outputs."""
