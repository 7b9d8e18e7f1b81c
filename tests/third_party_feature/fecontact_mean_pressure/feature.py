"""Entry points of this feature: the place of each thing that it offers, below its package."""

COMMANDS = {"Look": ("mean_pressure",)}
NAMES = ("mean_pressure_MPa",)
READINGS = {"mean_pressure": "read_mean_pressure"}
TELLINGS = {"mean_pressure": "MEAN_PRESSURE"}
