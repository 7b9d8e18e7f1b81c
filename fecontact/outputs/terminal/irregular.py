"""Models of a wheel on an irregularity on the terminal: the limits of a map, or the forces along a line."""

from __future__ import annotations

from functools import partial

from fecontact.outputs.tables.table import Record, Table, number, table_of, text
from fecontact.outputs.terminal.console import Lines, notes

_WORST = (
    text("model", "name"),
    number("force\n%", "force_error", "{:+.1f}", 1e2),
    number("at\nmm", "force_error_at_mm"),
    number("peak\n%", "peak_error", "{:+.1f}", 1e2),
    number("at \nmm", "peak_error_at_mm"),
    number("says\nnothing", "silent", "{:.0f}"),
    number("holds\n% of places", "share_within_limit", "{:.0f}", 1e2),
)


def irregular_lines(record: Record) -> Lines:
    """The smooth pair, what each model is worth, and notes."""
    pair = record["pair"]
    yield (
        f"Hertz without it: a {pair['a_mm']:.3f}, b {pair['b_mm']:.3f} mm, {pair['p_max_MPa']:.1f} MPa, approach"
        f" {1e3 * pair['approach_mm']:.2f} um under {1e-3 * pair['normal_force_N']:.2f} kN;"
        f" A {pair['A_per_mm']:.4g}, B {pair['B_per_mm']:.4g} 1/mm"
    )
    kind = "cells" if "cells" in record else "places"
    if kind == "cells":
        yield _limits_table(record)
    else:
        yield _places_table(record)
        yield table_of("Worst places", _WORST, ({**one, "name": name} for name, one in record["worst"].items()))
    own = record["half_space"]
    yield (
        f"the half-space on its nodes is {100 * own['approach_error']:+.2f} % (approach) and"
        f" {100 * own['peak_error']:+.2f} % (peak) from Hertz without the irregularity"
    )
    yield from notes(record["notes"])
    if found := [one["problem"] for one in record[kind] if one["problem"]]:
        yield from notes([f"{len(found)} of {len(record[kind])} {kind} have no solution; the first: {found[0]}"])


def _limits_table(record: Record) -> Table:
    """Amplitude up to which each model holds, a line for each wavelength."""
    columns = [
        number("wavelength\nmm", "wavelength_mm"),
        number("lengths of\nthe patch", lambda one: one["cells"][0]["patch_lengths"], "{:.2f}"),
        *(text(f"{name}\num", partial(_amplitude, name), "number") for name in record["models"]),
        text("eq6, closed\nform um", lambda one: f"{1e3 * one['closed_form_mm']['eq6_mm']:.3g}", "number"),
    ]
    items = [
        {**one, "cells": [cell for cell in record["cells"] if cell["wavelength_mm"] == one["wavelength_mm"]]}
        for one in record["limits"]
    ]
    title = f"Amplitude up to which a model is within {100 * record['limit']:g} % of force and peak"
    return table_of(title, columns, items)


def _amplitude(name: str, limits: Record) -> str:
    """The largest amplitude, or beyond which of those that were solved it lies."""
    found, cells = limits["amplitude_mm"][name], limits["cells"]
    if found is not None:
        return f"{1e3 * found:.3g}"
    holds = bool(cells[0]["models"]) and cells[0]["models"][name]["holds"]
    return f"{'>' if holds else '<'}{1e3 * cells[-1 if holds else 0]['amplitude_mm']:.3g}"


def _places_table(record: Record) -> Table:
    """Approach and peak of the half-space, and the force of each model at that approach, a line for each place."""
    columns = [
        number("s\nmm", "s_mm"),
        number("e\num", "opening_mm", "{:.1f}", 1e3),
        number("approach\nmm", "approach_mm", "{:.5f}"),
        number("p_max\nMPa", "p_max_MPa", "{:.0f}"),
        *(number(f"{name}\nkN", partial(_force, name), "{:.2f}", 1e-3) for name in record["models"]),
    ]
    title = "Half-space under the load, and forces of the models at its approach"
    return table_of(title, columns, record["places"], lambda one: "open" if one["problem"] else "plain")


def _force(name: str, place: Record) -> float | None:
    force_N: float | None = place["models"].get(name, {}).get("force_N")
    return force_N
