"""Theories on the terminal: the list of those that are judged, and one of them at a position."""

from __future__ import annotations

from fecontact.outputs.tables.table import Record, number, table_of, text
from fecontact.outputs.terminal.console import Lines, notes

_TITLES = {
    "pressure": "Theories of the pressure, from the cheapest",
    "forces": "Laws of creep forces, from the cheapest",
}
_PATCH = (
    text("patch", "patch"),
    number("F_n\nkN", "normal_force_N", "{:.3f}", 1e-3),
    number("p_max\nMPa", "p_max_MPa", "{:.1f}"),
    number("area\nmm²", "area_mm2", "{:.2f}"),
    number("a\nmm", "a_mm", "{:.3f}"),
    number("b\nmm", "b_mm", "{:.3f}"),
    number("approach\nmm", "approach_mm", "{:.5f}", none=""),
    number("centre s\nmm", lambda patch: patch["centre_mm"][1], "{:+z.3f}"),
)


def theories_lines(listed: Record) -> Lines:
    """What each theory is, where it is from, what it takes for granted, and what differs from its source."""
    for kind, theories in listed.items():
        yield f"{_TITLES[kind]}:"
        for name, theory in theories.items():
            yield f"  {name}: {theory['words']}; {theory['cost']}"
            yield from (f"      {key}: {theory[key]}" for key in ("source", "range", "differs") if theory.get(key))


def alone_lines(record: Record) -> Lines:
    """What a theory says at a position, and each of its patches where there are several."""
    if record["problem"] is None:
        patches = record["patches"] if len(record["patches"]) > 1 else []
        numbered = ({**patch, "patch": place, "approach_mm": None} for place, patch in enumerate(patches, 1))
        yield table_of(record["words"], _PATCH, [{**record, "patch": "all"}, *numbered])
    yield f"status: {record['status']}"
    yield from filter(None, (record["problem"], *record["notes"]))
    if record["solutions"] > 1:
        yield f"approaches that carry the force: {record['solutions']}"
    yield from notes(record["warnings"])
