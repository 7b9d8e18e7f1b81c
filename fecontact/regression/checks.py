"""Checks of a study's results against references, and the pages of all checks."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

Kind = Literal["analytic", "other code", "invariant"]


@dataclass(frozen=True, kw_only=True)
class Check:
    """A number of a study, checked against a number from another source.

    Attributes
    ----------
    quantity, case
        What is checked, with its unit, and in which case.
    reference, kind
        Where the expected value comes from.
    value, expected
        Numbers in the quantity's unit. `expected` is None if the value is itself an error in percent.
    limit_percent
        Largest deviation; the study gives the reason for it.
    uncertainty_percent
        Stated numerical uncertainty of the value, or None.
    """

    quantity: str
    case: str
    reference: str
    kind: Kind
    value: float
    expected: float | None
    limit_percent: float
    uncertainty_percent: float | None = None

    @property
    def deviation_percent(self) -> float:
        """Deviation of the value from the expected value."""
        return self.value if self.expected is None else 100.0 * (self.value / self.expected - 1.0)

    @property
    def over_uncertainty(self) -> float | None:
        """Size of the deviation over the stated uncertainty; None where none is stated."""
        return abs(self.deviation_percent) / self.uncertainty_percent if self.uncertainty_percent else None

    @property
    def passed(self) -> bool:
        """Whether the deviation is within its limit; NaN is not."""
        return math.isfinite(self.deviation_percent) and abs(self.deviation_percent) <= self.limit_percent


def hertz_check(row: Mapping[str, Any], measure: str, case: str, limit_percent: float) -> Check:
    """Check of a measure of a row, such as `p_max_MPa`, against Hertz in a case for which Hertz's theory is exact."""
    name, _, unit = measure.rpartition("_")
    return Check(
        quantity=f"{name}, {unit}",
        case=case,
        reference="Hertz",
        kind="analytic",
        value=float(row[f"fe_{measure}"]),
        expected=float(row[f"hertz_{measure}"]),
        limit_percent=limit_percent,
        uncertainty_percent=float(row[f"hertz_uncertainty_{name}_percent"]),
    )


def discretisation_check(rows: Sequence[Mapping[str, Any]], limit_percent: float) -> list[Check]:
    """Check of the row in which Hertz's gap on the discrete half-space deviates most from Hertz.

    Both have the same normal force: they differ by the resolution of the pressure and the contact solver only.
    """
    checks = [
        Check(
            quantity="p_max of Hertz's gap on the half-space, MPa",
            case=f"worst of {len(rows)}: {row['id']}",
            reference="Hertz",
            kind="analytic",
            value=float(row["half_space_quadratic_p_max_MPa"]),
            expected=float(row["hertz_p_max_MPa"]),
            limit_percent=limit_percent,
        )
        for row in rows
    ]
    return [max(checks, key=lambda check: abs(check.deviation_percent))] if checks else []


PAGES = "validation"
"""Folder of the pages, beside the table that links to them."""
_HOW = """\
The error E is result over reference, less one; a result that is an error itself has the reference 0. u_val (ASME V&V
20) is the uncertainty of E. It has the uncertainty of the result, which is stated for 95 %, and the uncertainty of the
reference. Inputs are the same on both sides and add nothing. A closed form has no uncertainty. No other reference
states one: u_val has the result's uncertainty alone there, and the limit has room for the rest."""


def reports(
    checks: Mapping[str, Sequence[Check]],
    questions: Mapping[str, str],
    versions: Mapping[str, str | None],
    unusable: Sequence[str],
    before: str = "",
) -> dict[str, str]:
    """Files of a validation by their places: VALIDATION.md with a line for each study, and a page for each.

    Parameters
    ----------
    questions
        What a study asks, by its name.
    versions
        Of the programs, which the table names; one without a version is left out.
    unusable
        Studies without a usable result, with what is wrong.
    before
        The table as it was: lines of studies that were not run now are kept, and it says which were run.
    """
    made = ", ".join(f"{name} {version}" for name, version in versions.items() if version is not None)
    kept = [text for text in before.splitlines() if (study := _study_of(text)) and study not in questions]
    found = sorted(
        [text for text in kept if text.startswith("|")] + [_summary(questions, *of) for of in checks.items()]
    )
    numbers = [[int(cell) for cell in text.split(" | ")[2:4]] for text in found]
    lines = [
        "# Validation",
        "",
        f"{sum(number for number, _ in numbers)} checks, {sum(failed for _, failed in numbers)} failed. Written by"
        " `make validate`; not to be edited.",
        "",
        made + (f" in the last run, of {', '.join(questions)} alone" if kept else ""),
        *(f"\n{text}" for text in kept if not text.startswith("|")),
        *(f"\n**No usable result: {text}**" for text in unusable),
        "",
        _HOW,
        "",
        "| study | question | checks | failed | largest error / limit | largest error / u_val, closed forms |",
        "|---|---|---|---|---|---|",
    ]
    lines += found
    pages = {f"{PAGES}/{study}.md": _page(study, questions.get(study, ""), own) for study, own in checks.items()}
    return {"VALIDATION.md": "\n".join(lines) + "\n", **pages}


def _study_of(line: str) -> str | None:
    """The study of which a line of a table, or one on what is not usable, tells."""
    found = re.match(r"\| \[(\w+)\]|\*\*No usable result: (\w+):", line)
    return found and (found[1] or found[2])


def _summary(questions: Mapping[str, str], study: str, own: Sequence[Check]) -> str:
    """The line of a study in the table."""
    used = _largest(abs(check.deviation_percent) / check.limit_percent for check in own if check.limit_percent)
    of_exact = _largest(check.over_uncertainty for check in own if check.kind == "analytic")
    numbers = f"{len(own)} | {_failed(own)} | {used} | {of_exact}"
    return f"| [{study}]({PAGES}/{study}.md) | {questions.get(study, '')} | {numbers} |"


def _failed(checks: Sequence[Check]) -> int:
    return sum(not check.passed for check in checks)


def _largest(values: Iterable[float | None]) -> str:
    known = [value for value in values if value is not None]
    return f"{max(known, key=lambda value: (math.isnan(value), value)):.2g}" if known else ""


def _page(study: str, question: str, checks: Sequence[Check]) -> str:
    """The page of a study: a table for each reference."""
    lines = [f"# Validation: {study}", "", question, "", f"{len(checks)} checks, {_failed(checks)} failed."]
    for reference, kind in dict.fromkeys((check.reference, check.kind) for check in checks):
        unsure = "no uncertainty" if kind == "analytic" else "its uncertainty is not stated"
        lines += [
            f"\n## Against {reference} ({kind}; {unsure})\n",
            "| quantity | case | reference | result | its ± | error E | E / u_val | limit of E | |",
            "|---|---|---|---|---|---|---|---|---|",
            *(_line(check) for check in checks if (check.reference, check.kind) == (reference, kind)),
        ]
    return "\n".join(lines) + "\n"


def _line(check: Check) -> str:
    expected = "0" if check.expected is None else f"{check.expected:.5g}"
    unsure = "" if check.uncertainty_percent is None else f"{check.uncertainty_percent:.2g} %"
    ratio = "" if check.over_uncertainty is None else f"{check.over_uncertainty:.2g}"
    cells = (
        *(check.quantity, check.case, expected, f"{check.value:.5g}", unsure),
        *(f"{check.deviation_percent:+.2f} %", ratio, f"{check.limit_percent:g} %"),
        "pass" if check.passed else "**FAIL**",
    )
    return f"| {' | '.join(cells)} |"
