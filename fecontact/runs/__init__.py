"""Functions behind the command line: studies, maps, validation."""
