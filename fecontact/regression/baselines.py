"""Baselines of studies: results for the comparison with later results."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import pandas

from fecontact.errors import InputError, is_usable_status
from fecontact.files import write_json, write_text
from fecontact.inputs.texts import count_text
from fecontact.regression.compare import TableComparison, compare_tables
from fecontact.regression.tables import (
    EFFORT_KIND,
    TEXT_KIND,
    ResultTable,
    Tolerances,
    find_kind,
    load_table,
    parse_number,
)

# Enough for every tolerance. Further digits would differ between machines and fill the version history.
_SIGNIFICANT_DIGITS = 10
# Fraction of the absolute tolerance below which a value is rounding about zero, such as a centre of 4e-19 mm.
_NOISE_PER_TOLERANCE = 1e-6


@dataclass(frozen=True, kw_only=True)
class BaselineUpdate:
    """A baseline that was written.

    Attributes
    ----------
    path
        CSV of the baseline. Study, reason and versions are in the .json of the same name.
    comparison
        Comparison with the old baseline; None without an old baseline, or without a case in common.
    text
        The changes, in one line.
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
        Reason why the new results are right.
    allow_failed
        Whether to accept cases that failed or did not converge.

    Returns
    -------
    BaselineUpdate
        The written file and the comparison with the old baseline.

    Raises
    ------
    InputError
        If there is no reason, a case failed, or the results do not name their study.
    """
    reason = reason.strip()
    if not reason:
        raise InputError("reason is ''; allowed: any text; state why the new results are right")
    table = load_table(result)
    name = _study_name(table)
    _check_status(table, allow_failed)
    path = Path(folder) / f"{name}.csv"
    comparison, text = _compare_with_old(path, table)
    # The platform names the release of the kernel, which changes often and affects no number.
    versions = {name: version for name, version in table.versions.items() if name != "platform"}
    document = {"schema": "fecontact/baseline/1", "study": name, "reason": reason, "versions": versions}
    # The CSV is written last: it marks the baseline as complete.
    write_json(path.with_suffix(".json"), document)
    write_text(path, _csv_text(table))
    return BaselineUpdate(path=path, comparison=comparison, text=text)


def _study_name(table: ResultTable) -> str:
    """Name of the study that made a table.

    Raises
    ------
    InputError
        If the table has no name that can be the name of a file.
    """
    name = table.settings.get("study", "")
    # The name of the study becomes the name of a file.
    if table.key != ("id",) or not name:
        raise InputError(
            f"results {table.path}: there is no name of a study; give the folder that `fecontact run` wrote, with its"
            " study.json"
        )
    if not re.fullmatch(r"\w[\w.-]*", name):
        raise InputError(
            f"results {table.path}: the name of the study is {name!r}; allowed in the names of the files of a baseline:"
            " letters, digits, _, . and -, with a letter or a digit first; rename the study file and run it again"
        )
    return name


def _check_status(table: ResultTable, allow_failed: bool) -> None:
    """Refuse a table with failed or unconverged cases, unless they are allowed."""
    if "status" not in table.columns:
        raise InputError(f"results {table.path}: no column status; give a folder that `fecontact run` wrote")
    rows = table.rows.to_dict("index")
    unusable = [f"{case}: {row['status']}" for case, row in rows.items() if not is_usable_status(row)]
    if unusable and not allow_failed:
        raise InputError(
            f"results {table.path}: not converged: {len(unusable)} of {count_text(len(table.rows), 'case')}"
            f" ({unusable[0]}); correct the study, or accept these cases with --allow-failed"
        )


def _compare_with_old(path: Path, table: ResultTable) -> tuple[TableComparison | None, str]:
    """Comparison with an old baseline, and a text of the changes."""
    if not path.is_file():
        return None, f"new baseline of {count_text(len(table.rows), 'case')}"
    old = load_table(path)
    if not old.rows.index.isin(table.rows.index).any():
        return None, f"{count_text(len(old.rows), 'case')} replaced by {count_text(len(table.rows), 'new case')}"
    comparison = compare_tables(old, table)
    return comparison, comparison.verdict


def _csv_text(table: ResultTable) -> str:
    """Text of the CSV of a baseline, without the columns of the kind `effort`."""
    columns = [name for name in table.columns if find_kind(name) != EFFORT_KIND]
    rounded = {name: [_round_text(name, text) for text in table.rows[name]] for name in ("id", *columns)}
    return str(pandas.DataFrame(rounded).to_csv(index=False, lineterminator="\n"))


def _round_text(column: str, text: str) -> str:
    """Text of a cell with rounded numbers, for a baseline.

    Numbers have `_SIGNIFICANT_DIGITS` digits. Numbers far below the absolute tolerance of the column become 0; other
    texts stay unchanged.
    """
    value = math.nan if find_kind(column) == TEXT_KIND else parse_number(text)
    if math.isnan(value):
        return text
    tolerance = Tolerances().of(column)
    small = tolerance is not None and abs(value) < _NOISE_PER_TOLERANCE * tolerance.absolute
    return "0" if small else f"{value:.{_SIGNIFICANT_DIGITS}g}"
