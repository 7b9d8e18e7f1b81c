"""What the command line calls: studies, maps, validation."""
