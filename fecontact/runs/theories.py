"""The cheapest creep theories of a map, many cells by several processes."""

from __future__ import annotations

from pathlib import Path

from fecontact.jobs.workers import process_crew
from fecontact.map.cells import ApplicabilityMap
from fecontact.outputs.theory_map import write_theory_map

# A cell takes some seconds, and a process two to begin.
_WORTH_PROCESSES = 8


def write_theories(made: ApplicabilityMap, out: Path, workers: int) -> None:
    """Write the files of the cheapest theories of a map, so many cells at a time."""
    if workers < 2 or len(made.cells) < _WORTH_PROCESSES:
        write_theory_map(made, out)
        return
    crew = process_crew(workers, threads=1)
    with crew.open(crew.workers) as executor:
        write_theory_map(made, out, map_over=executor.map)
