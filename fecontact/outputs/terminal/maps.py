"""Maps on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fecontact.map.cells import ApplicabilityMap
from fecontact.outputs.maps.measures import MapMeasure, measure_table
from fecontact.outputs.records.theories import share_records
from fecontact.outputs.tables.theories import shares_table
from fecontact.outputs.terminal.console import print_table, standard_console

if TYPE_CHECKING:
    from rich.console import Console


def print_map(
    made: ApplicabilityMap, measure: MapMeasure, theory: str, *, width: int | None, console: Console | None = None
) -> None:
    """Print a map by a measure, or by a theory of the pressure; by the cheapest theory with the share of each."""
    console = console or standard_console()
    # as it is: lines are cut already, and numbers have no colours
    console.out(measure_table(made, measure, theory=theory, width=width), highlight=False)
    if measure == "theory":
        print_table(console, shares_table(share_records(made)))
