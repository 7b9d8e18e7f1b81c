"""What this feature offers."""

COMMANDS = {"Solve": ("command.fleet",)}
NAMES = ("running.run_fleet", "running.check_fleet", "running.open_fleet")
