"""Entry points of this feature."""

COMMANDS = {"Solve": ("command.curve",)}
NAMES = ("conditions.Conditions", "running.curve")
LOADED_CONICITIES = ("loaded.compute_loaded_conicities",)
