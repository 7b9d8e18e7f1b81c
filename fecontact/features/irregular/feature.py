"""Entry points of this feature."""

COMMANDS = {"Look": ("command.irregular",)}
NAMES = ("running.irregular",)
