"""The cheapest creep theories of a map, many cells by several processes."""

from __future__ import annotations

from pathlib import Path

from fecontact.jobs.workers import evaluators
from fecontact.map.cells import ApplicabilityMap
from fecontact.outputs.theory_map import write_theory_map

# A cell takes some seconds, and a process two to begin.
_WORTH_PROCESSES = 8


def write_theories(made: ApplicabilityMap, out: Path, workers: int) -> None:
    """Write the files of the cheapest theories of a map, so many cells at a time."""
    worth_processes = len(made.cells) + 1 if workers < 2 else _WORTH_PROCESSES
    with evaluators(len(made.cells), worth_processes, workers) as map_over:
        write_theory_map(made, out, map_over=map_over)
