"""Models of a wheel on an irregularity on the terminal: the limits of a map, or the forces along a line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fecontact.outputs.tables.table import Column, Table, TableRow, columns_of, number_text
from fecontact.outputs.terminal.console import print_notes, print_table, say, standard_console

if TYPE_CHECKING:
    from rich.console import Console

Record = Mapping[str, Any]


def print_irregular(record: Record, *, console: Console | None = None) -> None:
    """Print the smooth pair, what each model is worth, notes, and the conclusion of a map."""
    console = console or standard_console()
    pair = record["pair"]
    say(
        console,
        f"Hertz without it: a {pair['a_mm']:.3f}, b {pair['b_mm']:.3f} mm, {pair['p_max_MPa']:.1f} MPa, approach"
        f" {1e3 * pair['approach_mm']:.2f} um under {1e-3 * pair['normal_force_N']:.2f} kN;"
        f" A {pair['A_per_mm']:.4g}, B {pair['B_per_mm']:.4g} 1/mm",
    )
    if "cells" in record:
        print_table(console, limits_table(record))
    else:
        print_table(console, places_table(record))
        print_table(console, worst_table(record))
    own = record["half_space"]
    say(
        console,
        f"the half-space on its nodes is {100 * own['approach_error']:+.2f} % (approach) and"
        f" {100 * own['peak_error']:+.2f} % (peak) from Hertz without the irregularity",
    )
    print_notes(record["notes"], console)
    kind = "cells" if "cells" in record else "places"
    found = [one["problem"] for one in record[kind] if one["problem"]]
    problems = [f"{len(found)} of {len(record[kind])} {kind} have no solution; the first: {found[0]}"] if found else []
    print_notes(problems, console)
    if "conclusion" in record:
        say(console, record["conclusion"])


def limits_table(record: Record) -> Table:
    """Amplitude up to which each model holds, a line for each wavelength."""
    names = list(record["models"])
    rows = []
    for one in record["limits"]:
        column = [cell for cell in record["cells"] if cell["wavelength_mm"] == one["wavelength_mm"]]
        closed = one["closed_form_mm"]["eq6_mm"]
        rows.append(
            TableRow(
                cells=[
                    f"{one['wavelength_mm']:g}",
                    f"{column[0]['patch_lengths']:.2f}",
                    *(_amplitude(one["amplitude_mm"][name], column, name) for name in names),
                    f"{1e3 * closed:.3g}",
                ]
            )
        )
    headings = ("wavelength\nmm", "lengths of\nthe patch", *(f"{name}\num" for name in names), "eq6, closed\nform um")
    title = f"Amplitude up to which a model is within {100 * record['limit']:g} % of force and peak"
    return Table(title=title, columns=columns_of(*headings), rows=rows)


def _amplitude(found: float | None, column: list[Record], name: str) -> str:
    """The largest amplitude, or beyond which of those that were solved it lies."""
    if found is not None:
        return f"{1e3 * found:.3g}"
    holds = bool(column[0]["models"]) and column[0]["models"][name]["holds"]
    end = column[-1 if holds else 0]
    return f"{'>' if holds else '<'}{1e3 * end['amplitude_mm']:.3g}"


def places_table(record: Record) -> Table:
    """Approach and peak of the half-space, and the force of each model at that approach, a line for each place."""
    names = list(record["models"])
    rows = [
        TableRow(
            cells=[
                f"{one['s_mm']:g}",
                f"{1e3 * one['opening_mm']:.1f}",
                number_text(one.get("approach_mm"), "{:.5f}"),
                number_text(one.get("p_max_MPa"), "{:.0f}"),
                *(_force(one, name) for name in names),
            ],
            tone="open" if one["problem"] else "plain",
        )
        for one in record["places"]
    ]
    headings = ("s\nmm", "e\num", "approach\nmm", "p_max\nMPa", *(f"{name}\nkN" for name in names))
    columns = [Column(heading=heading) for heading in headings]
    return Table(
        title="Half-space under the load, and forces of the models at its approach", columns=columns, rows=rows
    )


def _force(place: Record, name: str) -> str:
    model = place["models"].get(name)
    return "-" if model is None or model["force_N"] is None else f"{1e-3 * model['force_N']:.2f}"


def worst_table(record: Record) -> Table:
    """Where each model is worst."""
    rows = [
        TableRow(
            cells=[
                name,
                *(
                    text
                    for error in ("force_error", "peak_error")
                    for text in (_percent(one[error]), number_text(one[f"{error}_at_mm"], "{:g}"))
                ),
                str(one["silent"]),
                f"{100 * one['share_within_limit']:.0f}",
            ]
        )
        for name, one in record["worst"].items()
    ]
    headings = ("model", "force\n%", "at\nmm", "peak\n%", "at \nmm", "says\nnothing", "holds\n% of places")
    return Table(title="Worst places", columns=columns_of(*headings, texts=("model",)), rows=rows)


def _percent(value: float | None) -> str:
    return number_text(None if value is None else 100 * value, "{:+.1f}")
