"""What this feature offers."""

COMMANDS = {"Start": ("command.demo",), "Solve": ("command.map_",)}
NAMES = ("running.map_",)
RESULTS = {"map": "reading.load"}
JUDGED = {"map": "reading.judge"}
MAP_ROWS = ("reading.rows",)
MAP_FIGURE = ("files.figure_of",)
MAP_COLUMNS = ("reading.columns",)
STORED = {"position": "storing.read_position"}
