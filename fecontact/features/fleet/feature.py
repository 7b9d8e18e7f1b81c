"""What this feature offers."""

COMMANDS = {"Solve": ("command.fleet",)}
NAMES = ("running.run_fleet", "checking.check_fleet", "checking.open_fleet")
