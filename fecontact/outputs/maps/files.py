"""The files of a map: tables, JSON and pictures."""

from __future__ import annotations

from pathlib import Path

from fecontact.comparison.theories import HERTZ, THEORIES
from fecontact.files import write_sealed
from fecontact.map.cells import ApplicabilityMap
from fecontact.outputs.maps.cheapest import law_view, theory_view
from fecontact.outputs.maps.figure import map_figure
from fecontact.outputs.maps.verdicts import force_view, verdict_view
from fecontact.outputs.records.contact_table import judged_row, ordered
from fecontact.outputs.records.map import law_row, map_record, stiffness_rows
from fecontact.outputs.records.results import cell_row
from fecontact.outputs.records.told import Record
from fecontact.outputs.tables.csv_file import write_csv


def write_map(
    made: ApplicabilityMap,
    out: Path,
    name: str = "map",
    *,
    theory: str = HERTZ,
    provenance: Record | None = None,
    drawn: bool = True,
) -> None:
    """Write a map's tables and pictures into a folder.

    NAME.csv, NAME.json, NAME.png (Hertz) and NAME_theory.png (the cheapest theory of the pressure that holds); of
    another `theory` NAME_THEORY.png; with friction NAME_force.png, and where laws of forces were judged NAME_law.csv
    and NAME_law.png. For the whole map contacts.csv, lines of a contact table with the theory to use, and
    stiffness.csv, if it has any.
    """
    rows = [cell_row(cell, position.placement) for position in made.positions for cell in position.cells]
    write_csv(rows, out / f"{name}.csv")
    if name == "map":
        lines = [judged_row(cell, position.placement) for position in made.positions for cell in position.cells]
        write_csv(ordered(lines), out / "contacts.csv")
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
    map_figure(theory_view(made), out / f"{name}_theory.png")
    # those of another friction, or of theories before, would not belong to this map
    (out / f"{name}_law.csv").unlink(missing_ok=True)
    for old in ("force", "law", *THEORIES):
        for ending in ("png", "svg"):
            (out / f"{name}_{old}.{ending}").unlink(missing_ok=True)
    if theory != HERTZ:
        map_figure(verdict_view(made, theory), out / f"{name}_{theory}.png")
    if made.case.creep.asked:
        map_figure(force_view(made), out / f"{name}_force.png")
    if made.laws_judged:
        write_laws(made, out, name)


def write_laws(made: ApplicabilityMap, out: Path, name: str = "map") -> None:
    """Write NAME_law.csv and NAME_law.png into a folder: the laws of creep forces, and the cheapest."""
    write_csv([law_row(cell) for cell in made.cells], out / f"{name}_law.csv")
    map_figure(law_view(made), out / f"{name}_law.png")
