"""Theories on the terminal: the list of those that are judged, and one of them at a position."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fecontact.outputs.tables.table import Table, number, table_of, text
from fecontact.outputs.terminal.console import print_notes, print_table, say, standard_console

if TYPE_CHECKING:
    from rich.console import Console

Record = Mapping[str, Any]

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


def print_theories(listed: Record, *, console: Console | None = None) -> None:
    """Print what each theory is, where it is from, what it takes for granted, and what differs from its source."""
    console = console or standard_console()
    for kind, theories in listed.items():
        say(console, f"{_TITLES[kind]}:")
        for name, theory in theories.items():
            say(console, f"  {name}: {theory['words']}; {theory['cost']}")
            say(console, f"      source: {theory['source']}")
            say(console, f"      range: {theory['range']}")
            if theory.get("differs"):
                say(console, f"      differs: {theory['differs']}")


def print_alone(record: Record, *, console: Console | None = None) -> None:
    """Print what a theory says at a position, and each of its patches."""
    console = console or standard_console()
    if record["problem"] is None:
        print_table(console, _contact_table(record))
    say(console, f"status: {record['status']}")
    for note in filter(None, (record["problem"], *record["notes"])):
        say(console, f"{note}")
    if record["solutions"] > 1:
        say(console, f"approaches that carry the force: {record['solutions']}")
    print_notes(record["warnings"], console)


def _contact_table(record: Record) -> Table:
    """All of the contact, and, where there are several, each patch."""
    patches = record["patches"] if len(record["patches"]) > 1 else []
    numbered = ({**patch, "patch": place, "approach_mm": None} for place, patch in enumerate(patches, 1))
    return table_of(record["words"], _PATCH, [{**record, "patch": "all"}, *numbered])
