"""What this feature offers."""

COMMANDS = {"Solve": ("command.curve",)}
NAMES = ("curve.Conditions", "running.curve")
LOADED_CONICITIES = ("loaded.loaded_conicities",)
