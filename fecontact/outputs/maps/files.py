"""The files of a map: tables, JSON and pictures."""

from __future__ import annotations

from pathlib import Path

from fecontact.files import write_sealed
from fecontact.map.cells import ApplicabilityMap
from fecontact.outputs.maps.cheapest import law_view
from fecontact.outputs.maps.figure import map_figure
from fecontact.outputs.maps.verdicts import force_view, verdict_view
from fecontact.outputs.records.map import Record, law_row, map_record, stiffness_rows
from fecontact.outputs.records.rows import cell_row
from fecontact.outputs.tables.csv_file import write_csv


def write_map(
    made: ApplicabilityMap, out: Path, name: str = "map", *, provenance: Record | None = None, drawn: bool = True
) -> None:
    """Write NAME.csv, NAME.json and NAME.png, into a folder; for the whole map stiffness.csv, if it has any."""
    rows = [cell_row(cell, position.placement) for position in made.positions for cell in position.cells]
    write_csv(rows, out / f"{name}.csv")
    if name == "map":
        stiffness = [row for position in made.positions for row in stiffness_rows(position)]
        if stiffness:
            write_csv(stiffness, out / "stiffness.csv")
        else:
            # one of other loads would not belong to this map
            (out / "stiffness.csv").unlink(missing_ok=True)
    write_sealed(out / f"{name}.json", map_record(made, provenance), [out / f"{name}.csv"])
    if not (drawn and made.positions):
        return
    map_figure(verdict_view(made), out / f"{name}.png")
    # those of another friction, or of theories before, would not belong to this map
    for old in ("force.png", "force.svg", "theory.csv", "theory.png", "theory.svg"):
        (out / f"{name}_{old}").unlink(missing_ok=True)
    if made.case.creep.asked:
        map_figure(force_view(made), out / f"{name}_force.png")
    if made.laws_judged:
        write_laws(made, out, name)


def write_laws(made: ApplicabilityMap, out: Path, name: str = "map") -> None:
    """Write NAME_theory.csv and NAME_theory.png into a folder: the laws of creep forces, and the cheapest."""
    write_csv([law_row(cell) for cell in made.cells], out / f"{name}_theory.csv")
    map_figure(law_view(made), out / f"{name}_theory.png")
