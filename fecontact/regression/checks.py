"""Checks of a study's results against references."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

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
    explanation
        Reason of a deviation beyond the uncertainty, or consequence of a deviation beyond the limit.
    is_error
        Whether the value is an error. If not, it is a number in percent that must not exceed its limit.

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
    explanation: str = ""
    is_error: bool = True

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

    @property
    def is_model_difference(self) -> bool:
        """Whether the deviation is within its limit and exceeds the stated uncertainty.

        Such a deviation is a difference of the models (ASME V&V 20, 2009).
        """
        ratio = self.deviation_per_uncertainty
        return self.passed and ratio is not None and ratio > 1.0


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
