"""Tables of a report, and the words for a case in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fecontact.comparison.theories import EITHER_SIDE, THEORIES
from fecontact.outputs.html import table
from fecontact.outputs.measure_words import WORDS
from fecontact.outputs.rows import deviation_column
from fecontact.outputs.series import short_name
from fecontact.outputs.verdict_words import inclination_words

Row = Mapping[str, Any]

_FORCE = "force off by, % of mu N"
_NUMBERS = (
    *("shift mm", "load kN", "peak FE MPa", "peak Hertz MPa", "part of a limit"),
    *("elements a semi-axis", "unknowns", "residual", "load balance", "seconds", "memory MB"),
    *("FE", "Hertz", "theory", "off by", "±", "limit", _FORCE),
)
_SOLVER = (
    *("shift mm", "load kN", "status", "elements a semi-axis", "unknowns", "solver", "residual"),
    *("load balance", "seconds", "memory MB"),
)
_PEAKS = (("p_max_fe_MPa", "{:.0f}"), ("p_max_hertz_MPa", "{:.0f}"), ("limit_used", "{:.2f}"))


@dataclass(frozen=True, kw_only=True)
class ReportedCase:
    """A case as a report shows it.

    Attributes
    ----------
    row
        Its line in the study's table.
    record
        What its `result.json` says; empty where there is none.
    picture
        File of its picture; None where there is none.
    """

    row: Row
    record: Mapping[str, Any] = field(default_factory=dict)
    picture: Path | None = None


def verdict_of(row: Row) -> str:
    """Its verdict; `failed` where the result must not be used."""
    return str(row.get("verdict", "failed")) if row["status"] == "converged" else "failed"


def pair_words(row: Row) -> str:
    """Rail and wheel of a case."""
    rail, wheel = short_name(str(row["rail"])), short_name(str(row["wheel"]))
    return f"rail {rail}{inclination_words(float(row.get('inclination_rad') or 0.0))} and wheel {wheel}"


def decided(row: Row, limits: Mapping[str, float]) -> str:
    """The measure that decided, how far Hertz is off in it, and its limit; the status of what must not be used."""
    if row["status"] != "converged":
        return str(row["status"])
    measure = row.get("verdict_measure")
    if measure not in WORDS:
        return ""
    words = WORDS[measure]
    column, unsure, factor = deviation_column(measure)
    values = (None if row.get(name) is None else float(row[name]) / factor for name in (column, unsure))
    off, error = (words.off(value, size=bool(number)) for number, value in enumerate(values))
    limit = f" (limit {words.limit(limits[measure])})" if measure in limits else ""
    return f"{words.name} {off} ± {error}{limit}"


def limits_of(case: ReportedCase) -> Mapping[str, float]:
    """Limits by which a case was judged, by measure; empty where they are not known."""
    found: Mapping[str, float] = case.record.get("verdict", {}).get("limits", {})
    return found


def verdict_table(cases: Sequence[ReportedCase]) -> str:
    """All cases with their verdicts and what decided; with those of forces where there are any."""
    several = len({pair_words(case.row) for case in cases}) > 1
    headings = ("rail and wheel",) * several + (
        *("shift mm", "load kN", "Hertz", "decided by", "because", "peak FE MPa", "peak Hertz MPa", "part of a limit"),
    )
    theories = any(case.row.get("theory_cheapest") for case in cases)
    forces = any(case.row.get("force_verdict") for case in cases)
    headings += ("cheapest theory that holds",) * theories + ("for forces", _FORCE) * forces
    lines = []
    for case in cases:
        row = case.row
        cells = [pair_words(row)] if several else []
        cells += [f"{row['lateral_shift_mm']:+z.2f}", f"{row['load_kN']:g}", verdict_of(row)]
        cells += [decided(row, limits_of(case)), str(row.get("verdict_cause") or "")]
        cells += [_number(row.get(key), form) for key, form in _PEAKS]
        cells += [cheapest_words(row)] * theories
        cells += _force_cells(row) if forces else ()
        lines.append((cells, verdict_of(row) == "FAILS"))
    return table("", headings, lines, numbers=_NUMBERS, answers=("Hertz", "for forces"))


def cheapest_words(row: Row) -> str:
    """The cheapest theory that holds in words."""
    name = str(row.get("theory_cheapest") or "")
    return THEORIES[name].words if name in THEORIES else name


def _force_cells(row: Row) -> tuple[str, str]:
    """What creep forces say of Hertz, and by how much they are off."""
    if not row.get("force_verdict"):
        return "failed", "-"
    off, unsure = (float(row[f"force_worst{name}_percent"]) for name in ("", "_uncertainty"))
    return str(row["force_verdict"]), f"{off:.1f} ± {unsure:.1f}"


def _number(value: Any, form: str) -> str:
    return "-" if value is None else form.format(float(value))


def measures_tables(record: Mapping[str, Any]) -> str:
    """All measures of a case by each theory; by Hertz with both curvatures where the touch point lies on a junction."""
    parts = []
    for side in record.get("verdict", {}).get("sides", ()):
        by = "" if side["side"] == "both" else f"With the curvature of the {side['side']} side"
        parts.append(_measure_table(record, by, "Hertz", side["hertz"], side))
    for name, theory in record.get("theories", {}).items():
        if name not in EITHER_SIDE and "patches" in theory:
            judged = {**theory, "each": theory["verdict"]["each"]}
            parts.append(_measure_table(record, THEORIES[name].words, "theory", theory, judged))
    return "".join(parts)


def _measure_table(
    record: Mapping[str, Any], by: str, name: str, sizes: Mapping[str, Any], judged: Mapping[str, Any]
) -> str:
    """All measures of the finite elements beside the sizes of a theory, and how it is judged."""
    limits = record["verdict"]["limits"]
    lines = []
    for measure, words in WORDS.items():
        off, unsure, limit = judged["deviation"].get(measure), judged["uncertainty"].get(measure), limits.get(measure)
        both = [f"{of[measure]:.5g}" if measure in of else "" for of in (record["fe"], sizes)]
        cells = [words.title, *both, words.off(off), words.off(unsure, size=True)]
        cells += ["" if limit is None else words.limit(limit), judged["each"].get(measure, "not judged")]
        lines.append((cells, judged["each"].get(measure) == "FAILS"))
    return table(by, ("measure", "FE", name, "off by", "±", "limit", "answer"), lines, numbers=_NUMBERS)


def solver_table(cases: Sequence[ReportedCase]) -> str:
    """Meshes, residuals, time and memory of all cases."""
    lines = []
    for case in cases:
        row, solver = case.row, case.record.get("solver", {})
        elements = [f"{count:.1f}" for count in solver.get("elements_a_semi_axis", ())]
        cells = [f"{row['lateral_shift_mm']:+z.2f}", f"{row['load_kN']:g}", str(row["status"]), ", ".join(elements)]
        cells += [_number(row.get("degrees_of_freedom"), "{:.0f}"), str(solver.get("path", "-"))]
        cells += [_number(solver.get(name), "{:.0e}") for name in ("contact_residual", "load_balance")]
        cells += [_number(row.get("seconds"), "{:.0f}"), _number(row.get("peak_memory_MB"), "{:.0f}")]
        lines.append((cells, False))
    return table("", _SOLVER, lines, numbers=_NUMBERS)
