"""Checks of a study's results against references, and the table of all checks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
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


def report(checks: Mapping[str, Sequence[Check]], versions: Mapping[str, str | None], unusable: Sequence[str]) -> str:
    """All checks by study as Markdown, with the versions of the programs and the studies without a usable result."""
    every = [check for of_study in checks.values() for check in of_study]
    failed = sum(not check.passed for check in every)
    lines = [
        "# Validation",
        "",
        f"{len(every)} checks, {failed} failed. Written by `make validate`; not to be edited.",
        "",
        ", ".join(f"{name} {version}" for name, version in versions.items() if version is not None),
    ]
    lines += [f"\n**No usable result: {text}**" for text in unusable]
    for study, of_study in checks.items():
        lines += [
            f"\n## {study}\n",
            "| quantity | case | reference | kind | value | expected | deviation | limit | uncertainty | |",
            "|---|---|---|---|---|---|---|---|---|---|",
            *(_line(check) for check in of_study),
        ]
    return "\n".join(lines) + "\n"


def _line(check: Check) -> str:
    expected = "0" if check.expected is None else f"{check.expected:.5g}"
    unsure = "" if check.uncertainty_percent is None else f"{check.uncertainty_percent:.2g} %"
    cells = (
        *(check.quantity, check.case, check.reference, check.kind, f"{check.value:.5g}", expected),
        *(f"{check.deviation_percent:+.2f} %", f"{check.limit_percent:g} %", unsure),
        "pass" if check.passed else "**FAIL**",
    )
    return f"| {' | '.join(cells)} |"
