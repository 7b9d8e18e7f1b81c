"""Maps on the terminal."""

from __future__ import annotations

from textwrap import fill

from fecontact.map.cells import ApplicabilityMap
from fecontact.outputs.maps.measures import MapMeasure, map_answer, measure_table
from fecontact.outputs.records.theories import share_records
from fecontact.outputs.tables.theories import shares_table
from fecontact.outputs.terminal.console import Lines

# Where no terminal says how wide it is.
_WIDE = 120


def map_lines(made: ApplicabilityMap, measure: MapMeasure, theory: str, *, width: int | None) -> Lines:
    """A map by a measure, or by a theory of the pressure; by the cheapest theory with the share of each.

    The answer in sentences comes first.
    """
    yield from (fill(one, width or _WIDE) for one in map_answer(made, measure, theory))
    yield ""
    yield measure_table(made, measure, theory=theory, width=width)
    if measure == "theory":
        yield shares_table(share_records(made))
