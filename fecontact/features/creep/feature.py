"""Names under which this feature offers its commands, functions, readings and maps."""

COMMANDS = {"Look": ("command.creep",)}
NAMES = ("running.creep",)
READINGS = {"creep": "creep_comparison.compare_creep_forces"}
DEAR_READINGS = {"creep_laws": "laws.judge_creep_laws"}
TABLE_COLUMNS = {"creep": "table_forces.make_force_columns"}
TELLINGS = {"creep": "telling.CREEP"}
MAPS = {"force": "maps.FORCE_MAP"}
NUMBERS = {"t_gamma": "maps.T_GAMMA_MAP"}
LAWS = {"law": "maps.LAW_MAP"}
