"""Maps on the terminal."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING

from fecontact.map.cells import ApplicabilityMap
from fecontact.outputs.maps.measures import MapMeasure, map_answer, measure_table
from fecontact.outputs.records.theories import share_records
from fecontact.outputs.tables.theories import shares_table
from fecontact.outputs.terminal.console import print_table, standard_console

if TYPE_CHECKING:
    from rich.console import Console

# Where no terminal says how wide it is.
_WIDE = 120


def print_map(
    made: ApplicabilityMap, measure: MapMeasure, theory: str, *, width: int | None, console: Console | None = None
) -> None:
    """Print a map by a measure, or by a theory of the pressure; by the cheapest theory with the share of each.

    The answer in sentences comes first.
    """
    console = console or standard_console()
    sentences = map_answer(made, measure, theory)
    console.out("\n".join(fill(one, width or _WIDE) for one in sentences), end="\n\n", highlight=False)
    # as it is: lines are cut already, and numbers have no colours
    console.out(measure_table(made, measure, theory=theory, width=width), highlight=False)
    if measure == "theory":
        print_table(console, shares_table(share_records(made)))
