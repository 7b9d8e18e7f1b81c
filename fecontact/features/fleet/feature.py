"""Names under which this feature offers its commands and functions."""

COMMANDS = {"Solve": ("command.fleet",)}
NAMES = ("running.run_fleet", "checking.check_fleet", "checking.open_fleet")
RESULT_FILES = {"fleet.json": "fleet"}
