"""Checks of a study's results against references, and the pages of all checks."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from fecontact.inputs.texts import count_text, escape_invisible

ReferenceKind = Literal["analytic", "other code", "invariant"]


@dataclass(frozen=True, kw_only=True)
class Check:
    """A number of a study, checked against a number from another source.

    Attributes
    ----------
    quantity, case
        The checked quantity with its unit, and its case.
    reference, kind
        Source of the expected value.
    value, expected
        Numbers in the quantity's unit. `expected` is None if the value is itself an error in percent.
    limit_percent
        Largest deviation. The study gives the reason for it.
    uncertainty_percent
        Stated numerical uncertainty of the value, or None.

    Examples
    --------
    >>> check = Check(
    ...     quantity="p_max, MPa", case="sphere", reference="Hertz", kind="analytic",
    ...     value=1004.0, expected=1000.0, limit_percent=0.5,
    ... )
    >>> round(check.deviation_percent, 3), check.passed
    (0.4, True)
    """

    quantity: str
    case: str
    reference: str
    kind: ReferenceKind
    value: float
    expected: float | None
    limit_percent: float
    uncertainty_percent: float | None = None

    @property
    def deviation_percent(self) -> float:
        """Deviation of the value from the expected value, in percent."""
        return self.value if self.expected is None else 100.0 * (self.value / self.expected - 1.0)

    @property
    def deviation_per_uncertainty(self) -> float | None:
        """Absolute deviation divided by the stated uncertainty; None without a stated uncertainty."""
        return abs(self.deviation_percent) / self.uncertainty_percent if self.uncertainty_percent else None

    @property
    def passed(self) -> bool:
        """Whether the deviation is within its limit; NaN is not."""
        return math.isfinite(self.deviation_percent) and abs(self.deviation_percent) <= self.limit_percent


def compare_with_hertz(row: Mapping[str, Any], measure: str, case: str, limit_percent: float) -> Check:
    """Check of a measure against Hertz, in a case for which Hertz's theory is exact.

    Parameters
    ----------
    row
        Row of a result.
    measure
        Column of the measure without its prefix, such as `p_max_MPa`.
    case
        Name of the case.
    limit_percent
        Largest deviation.

    Returns
    -------
    Check
        Finite elements against Hertz, with the stated uncertainty.
    """
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


def compare_discretisation(rows: Sequence[Mapping[str, Any]], limit_percent: float) -> list[Check]:
    """Check of the largest deviation of the discrete half-space from Hertz, under Hertz's gap.

    Both have equal normal force: they differ only by the resolution of the pressure and the contact solver.

    Parameters
    ----------
    rows
        Rows of results.
    limit_percent
        Largest deviation.

    Returns
    -------
    checks
        The check of the worst row; empty without rows.
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


PAGES_FOLDER = "validation"
"""Folder of the pages, next to the table that links to them."""
_ERROR_EXPLANATION = """\
The error E is (result - reference) / reference. A result that is an error itself has the reference 0. u_val (ASME V&V
20) is the uncertainty of E for 95 %. It includes the uncertainty of the result and the uncertainty of the reference.
Both sides have equal inputs, which add no uncertainty. A closed form has no uncertainty. Other references do not state
their uncertainty: u_val has only the uncertainty of the result there, and the limit allows for the rest."""


def render_reports(
    checks: Mapping[str, Sequence[Check]],
    questions: Mapping[str, str],
    versions: Mapping[str, str | None],
    unusable: Sequence[str],
    old_table: str = "",
) -> dict[str, str]:
    """Files of a validation by their paths: VALIDATION.md and a page for each study.

    VALIDATION.md has a row for each study.

    Parameters
    ----------
    checks
        Checks of each study.
    questions
        Question of each study.
    versions
        Versions of the programs that the table names; None leaves a program out.
    unusable
        Studies without a usable result, each with the reason.
    old_table
        The old table. Rows of studies that were not run now are kept, and the table lists the studies that were run.

    Returns
    -------
    files
        Text of each file.
    """
    version_text = ", ".join(f"{name} {version}" for name, version in versions.items() if version is not None)
    kept_lines = [text for text in old_table.splitlines() if (study := _find_study(text)) and study not in questions]
    study_rows = sorted(
        [text for text in kept_lines if text.startswith("|")]
        + [_summary_row(questions, *named_checks) for named_checks in checks.items()]
    )
    numbers = [[int(cell) for cell in text.split(" | ")[2:4]] for text in study_rows]
    document = [
        "# Validation",
        "",
        f"{count_text(sum(number for number, _ in numbers), 'check')},"
        f" {sum(failed for _, failed in numbers)} failed. Written by"
        " `make validate`; do not edit it.",
        "",
        version_text + (f". The last run had only {', '.join(questions)}." if kept_lines else ""),
        *(f"\n{text}" for text in kept_lines if not text.startswith("|")),
        *(f"\n**No usable result: {_escape_cell(text)}**" for text in unusable),
        "",
        _ERROR_EXPLANATION,
        "",
        "| study | question | checks | failed | largest error / limit | largest error / u_val, closed forms |",
        "|---|---|---|---|---|---|",
    ]
    document += study_rows
    pages = {
        f"{PAGES_FOLDER}/{study}.md": _render_page(study, questions.get(study, ""), study_checks)
        for study, study_checks in checks.items()
    }
    return {"VALIDATION.md": "\n".join(document) + "\n", **pages}


def _find_study(line: str) -> str | None:
    """Study of a row of the table, or of a line about an unusable result; None for other lines."""
    match = re.match(r"\| \[(\w+)\]|\*\*No usable result: (\w+):", line)
    return match and (match[1] or match[2])


def _summary_row(questions: Mapping[str, str], study: str, checks: Sequence[Check]) -> str:
    """Row of a study in the table."""
    largest_utilisation = _format_largest(
        abs(check.deviation_percent) / check.limit_percent for check in checks if check.limit_percent
    )
    largest_ratio = _format_largest(check.deviation_per_uncertainty for check in checks if check.kind == "analytic")
    numbers = f"{len(checks)} | {_count_failed(checks)} | {largest_utilisation} | {largest_ratio}"
    return f"| [{study}]({PAGES_FOLDER}/{study}.md) | {_escape_cell(questions.get(study, ''))} | {numbers} |"


def _escape_cell(text: str) -> str:
    """Escape a text for a cell of a table in Markdown.

    A bar would end the cell, a newline the row, and `<` would begin HTML.
    """
    return escape_invisible(" ".join(text.split())).replace("|", r"\|").replace("<", "&lt;")


def _count_failed(checks: Sequence[Check]) -> int:
    """Number of checks beyond their limit."""
    return sum(not check.passed for check in checks)


def _format_largest(values: Iterable[float | None]) -> str:
    """Text of the largest value, NaN first; empty without values."""
    stated_values = [value for value in values if value is not None]
    return f"{max(stated_values, key=lambda value: (math.isnan(value), value)):.2g}" if stated_values else ""


def _render_page(study: str, question: str, checks: Sequence[Check]) -> str:
    """Page of a study: a table for each reference."""
    lines = [
        f"# Validation: {study}",
        "",
        _escape_cell(question),
        "",
        f"{count_text(len(checks), 'check')}, {_count_failed(checks)} failed.",
    ]
    for reference, kind in dict.fromkeys((check.reference, check.kind) for check in checks):
        uncertainty_text = "no uncertainty" if kind == "analytic" else "uncertainty not stated"
        lines += [
            f"\n## Against {_escape_cell(reference)} ({kind}; {uncertainty_text})\n",
            "| quantity | case | reference | result | ± | error E | E / u_val | limit of E | |",
            "|---|---|---|---|---|---|---|---|---|",
            *(_check_row(check) for check in checks if (check.reference, check.kind) == (reference, kind)),
        ]
    return "\n".join(lines) + "\n"


def _check_row(check: Check) -> str:
    """Row of a check on the page of its study."""
    expected = "0" if check.expected is None else f"{check.expected:.5g}"
    uncertainty_text = "" if check.uncertainty_percent is None else f"{check.uncertainty_percent:.2g} %"
    ratio = "" if check.deviation_per_uncertainty is None else f"{check.deviation_per_uncertainty:.2g}"
    cells = (
        *(check.quantity, check.case, expected, f"{check.value:.5g}", uncertainty_text),
        *(f"{check.deviation_percent:+.2f} %", ratio, f"{check.limit_percent:g} %"),
        "pass" if check.passed else "**FAIL**",
    )
    return f"| {' | '.join(map(_escape_cell, cells))} |"
