"""Baselines of studies, and checks of their numbers against references."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import pandas

from fecontact.errors import InputError, usable
from fecontact.files import write_json, write_text
from fecontact.regression.compare import TableComparison, compare_tables, counted
from fecontact.regression.tables import EFFORT, TEXT, ResultTable, Tolerances, kind_of, load_table, number

# Enough for every tolerance; the digits beyond would differ between machines and fill the version history.
_DIGITS = 10
# Part of an absolute tolerance below which a value about zero is rounding, such as a centre of 4e-19 mm.
_NOISE = 1e-6


@dataclass(frozen=True, kw_only=True)
class BaselineUpdate:
    """A baseline that was written.

    Attributes
    ----------
    path
        Its CSV; study, reason and versions are in the .json of the same name.
    comparison
        With the old baseline; None where there was none, or one without a case in common.
    text
        What changed, in one line.
    """

    path: Path
    comparison: TableComparison | None
    text: str


def update_baseline(
    result: str | Path, folder: str | Path, *, reason: str, allow_failed: bool = False
) -> BaselineUpdate:
    """Make the results of a study its baseline.

    Parameters
    ----------
    result
        Result folder of a study, or its study.json.
    folder
        Folder of the baselines.
    reason
        Why the results are right as they are now.
    allow_failed
        Take cases that failed or did not converge as well.

    Raises
    ------
    InputError
        If there is no reason, a case failed, or the results do not say which study they are of.
    """
    reason = reason.strip()
    if not reason:
        raise InputError("reason is ''; allowed is any text; say why the new results are right")
    table = load_table(result)
    name = _study_name(table)
    _check_status(table, allow_failed)
    path = Path(folder) / f"{name}.csv"
    comparison, text = _against_old(path, table)
    # the platform has the release of the kernel in it, which decides about no number and changes often
    versions = {name: version for name, version in table.versions.items() if name != "platform"}
    document = {"schema": "fecontact/baseline/1", "study": name, "reason": reason, "versions": versions}
    # the CSV last: it is the mark that a baseline is there
    write_json(path.with_suffix(".json"), document)
    write_text(path, _csv_text(table))
    return BaselineUpdate(path=path, comparison=comparison, text=text)


def _study_name(table: ResultTable) -> str:
    name = table.settings.get("study", "")
    # it becomes the name of a file
    if table.key != ("id",) or not re.fullmatch(r"\w[\w.-]*", name):
        raise InputError(
            f"results {table.path}: study {name!r}; allowed is the name of a study; give the folder that"
            " `fecontact run` wrote, with its study.json"
        )
    return name


def _check_status(table: ResultTable, allow_failed: bool) -> None:
    if "status" not in table.columns:
        raise InputError(f"results {table.path}: there is no column status; give a folder that `fecontact run` wrote")
    rows = table.rows.to_dict("index")
    unusable = [f"{case}: {row['status']}" for case, row in rows.items() if not usable(row)]
    if unusable and not allow_failed:
        raise InputError(
            f"results {table.path}: not converged: {len(unusable)} of {counted(len(table.rows), 'case')}"
            f" ({unusable[0]}); correct the study, or take them as they are with --allow-failed"
        )


def _against_old(path: Path, table: ResultTable) -> tuple[TableComparison | None, str]:
    if not path.is_file():
        return None, f"new baseline of {counted(len(table.rows), 'case')}"
    old = load_table(path)
    if not old.rows.index.isin(table.rows.index).any():
        return None, f"{counted(len(old.rows), 'case')} replaced by {counted(len(table.rows), 'other case')}"
    comparison = compare_tables(old, table)
    return comparison, comparison.verdict


def _csv_text(table: ResultTable) -> str:
    columns = [name for name in table.columns if kind_of(name) != EFFORT]
    rounded = {name: [_rounded(name, text) for text in table.rows[name]] for name in ("id", *columns)}
    return str(pandas.DataFrame(rounded).to_csv(index=False, lineterminator="\n"))


def _rounded(column: str, text: str) -> str:
    value = math.nan if kind_of(column) == TEXT else number(text)
    if math.isnan(value):
        return text
    tolerance = Tolerances().of(column)
    small = tolerance is not None and abs(value) < _NOISE * tolerance.absolute
    return "0" if small else f"{value:.{_DIGITS}g}"


# --- What a study's results are checked against, and the table of all checks: value, reference, deviation, limit.

Kind = Literal["analytic", "other code", "invariant"]


@dataclass(frozen=True, kw_only=True)
class Check:
    """One number of a study against one that does not come from it.

    Attributes
    ----------
    quantity, case
        What is checked, with its unit, and where.
    reference, kind
        Where the expected value comes from.
    value, expected
        In the quantity's unit; None is expected of a value that is an error in percent itself, and should be 0.
    limit_percent
        How far the value may be off, with its reason in the study.
    uncertainty_percent
        Stated numerical uncertainty of the value, None where there is none.
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
        """Value against what is expected."""
        return self.value if self.expected is None else 100.0 * (self.value / self.expected - 1.0)

    @property
    def passed(self) -> bool:
        """Whether the deviation is within its limit; a value that is no number is not."""
        return math.isfinite(self.deviation_percent) and abs(self.deviation_percent) <= self.limit_percent


def hertz_check(row: Mapping[str, Any], measure: str, case: str, limit_percent: float) -> Check:
    """A measure of a row, such as `p_max_MPa`, against Hertz, where its theory is exact."""
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
    """The row whose lowest rung of the ladder, Hertz's own gap on the discrete half-space, is the farthest from Hertz.

    Both have the same normal force: what differs is the resolution of the pressure and the contact solver.
    """
    found = [
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
    return [max(found, key=lambda check: abs(check.deviation_percent))] if found else []


def report(checks: Mapping[str, Sequence[Check]], versions: Mapping[str, str | None], unusable: Sequence[str]) -> str:
    """All checks by study as Markdown, with what made them and which studies gave no usable result."""
    every = [check for own in checks.values() for check in own]
    failed = sum(not check.passed for check in every)
    lines = [
        "# Validation",
        "",
        f"{len(every)} checks, {failed} failed. Written by `make validate`; not to be edited.",
        "",
        ", ".join(f"{name} {version}" for name, version in versions.items() if version is not None),
    ]
    lines += [f"\n**No usable result: {text}**" for text in unusable]
    for study, own in checks.items():
        lines += [
            f"\n## {study}\n",
            "| quantity | case | reference | kind | value | expected | deviation | limit | uncertainty | |",
            "|---|---|---|---|---|---|---|---|---|---|",
            *(_line(check) for check in own),
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
