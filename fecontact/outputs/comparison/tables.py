"""Tables of a comparison of two tables of results, and names of its cases."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from fecontact.outputs.pair_names import short_name
from fecontact.outputs.tables import Column, Table, TableRecord, make_table, number_column, text_column

if TYPE_CHECKING:
    import pandas

    from fecontact.regression.compare import TableComparison


# On narrower terminals the columns are closer together.
_ROOMY_WIDTH = 110


def value_text(row: TableRecord, side: str) -> str:
    """Text for a value, with eight digits if both sides are numbers."""
    return str(row[side]) or "(none)" if math.isnan(row["difference"]) else f"{float(row[side]):.8g}"


def _number_or_entry(key: str, form: str, fallback_key: str) -> Callable[[TableRecord], str]:
    """Function that formats a number of a row, or a second column if there is no number."""
    return lambda row: str(row.get(fallback_key, "-")) if math.isnan(row[key]) else form.format(row[key])


VALUE_TABLE_COLUMNS = (
    text_column("column", "column"),
    text_column("case", "called", wraps=True),
    text_column("baseline", lambda row: value_text(row, "baseline"), "number"),
    text_column("new", lambda row: value_text(row, "new"), "number"),
    text_column("difference", _number_or_entry("difference", "{:+.3g}", "-"), "number"),
    text_column("tolerance", _number_or_entry("tolerance", "{:.3g}", "kind"), "number", rank=2, name="tolerance"),
    number_column("times", "times_tolerance", "{:.3g}"),
)
"""Single values."""
_DIFFERING_COLUMN = text_column(
    "differ", lambda row: f"{row['differing']}/{row['cases']}", "number", rank=1, name="differing cases"
)
COLUMN_TABLE_COLUMNS = (
    VALUE_TABLE_COLUMNS[0],
    _DIFFERING_COLUMN,
    replace(VALUE_TABLE_COLUMNS[1], heading="worst case"),
    *VALUE_TABLE_COLUMNS[2:],
)
"""Columns of tables, each with the case of the largest difference."""


def value_table(title: str, columns: Sequence[Column], values: pandas.DataFrame, comparison: TableComparison) -> Table:
    """Table of values, or of the worst value of each column.

    Parameters
    ----------
    title
        Title of the table.
    columns
        Columns of the table.
    values
        Values of the comparison. Values beyond their tolerance are marked.
    comparison
        Comparison of two tables.

    Returns
    -------
    Table
        The table.
    """
    case_labels = values.case.map(case_names(comparison))
    rows = values.assign(called=case_labels, cases=len(comparison.cases)).to_dict("records")
    table = make_table(title, columns, rows, lambda row: "fails" if row["times_tolerance"] > 1.0 else "plain")
    return replace(table, roomy_width=_ROOMY_WIDTH)


def head_lines(comparison: TableComparison) -> list[str]:
    """Lines above the tables: the two tables, versions, settings and one-sided columns.

    Parameters
    ----------
    comparison
        Comparison of two tables.

    Returns
    -------
    list of str
        The lines.
    """
    tables = comparison.baseline, comparison.new
    lines = [f"baseline {comparison.baseline.path}", f"new      {comparison.new.path}"]
    if comparison.baseline.key != ("id",):
        lines.append(f"cases are matched by {', '.join(comparison.baseline.key)}")
    for topic, pairs in (("version", comparison.versions), ("setting", comparison.settings)):
        lines += [
            f"{topic} {name}: {baseline_value} -> {new_value}" for name, (baseline_value, new_value) in pairs.items()
        ]
    lines += [f"{table.path} does not state its versions" for table in tables if not table.versions]
    default_columns = comparison.columns.column[comparison.columns.kind == "default"]
    names_by_topic = {
        **comparison.one_sided,
        "not compared, because the baseline has no column of this kind": comparison.later_columns,
        "unknown unit, compared as the kind 'default'": list(default_columns),
    }
    return lines + [f"{topic}: {', '.join(names)}" for topic, names in names_by_topic.items() if names]


def case_names(comparison: TableComparison) -> dict[str, str]:
    """Readable names of the compared cases, by case id.

    A name has the pair, the shift and the load. If several cases would have equal names, the end of the id is added.

    Parameters
    ----------
    comparison
        Comparison of two tables.

    Returns
    -------
    dict
        Name by case id.
    """
    rows = comparison.baseline.rows
    if not {*comparison.baseline.key} <= {*rows}:
        # the cases are matched by columns, and these name the cases
        return {case: case for case in comparison.cases}
    # the yaw is part of the name in maps of several yaws, where it names the cases
    yaw_columns = [name for name in comparison.baseline.key if name == "yaw_mrad"]
    rows_by_case = (
        rows.filter(("lateral_shift_mm", "load_kN", "wheel", "rail", *yaw_columns))
        .loc[comparison.cases]
        .to_dict("index")
    )
    pairs = {
        case: " on ".join(short_name(row[body]) for body in ("wheel", "rail") if row.get(body))
        for case, row in rows_by_case.items()
    }
    # a pair that all cases have in common does not distinguish them
    has_several_pairs = len({*pairs.values()}) > 1
    names_by_case = {
        case: _case_name(row, pairs[case] if has_several_pairs else "") or case for case, row in rows_by_case.items()
    }
    count = Counter(names_by_case.values())
    return {case: f"{name} ({case[-8:]})" if count[name] > 1 else name for case, name in names_by_case.items()}


def _case_name(row: Mapping[str, str], pair: str) -> str:
    shift, load, yaw = row.get("lateral_shift_mm"), row.get("load_kN"), row.get("yaw_mrad")
    if not shift or not load:
        return ""
    yaw_text = f"yaw {float(yaw):g} mrad" if yaw else ""
    return ", ".join(filter(None, (pair, f"{float(shift):+g} mm", yaw_text, f"{float(load):g} kN")))


def tolerance_table(comparison: TableComparison) -> Table:
    """Table of the tolerance of each column, with its reason.

    Parameters
    ----------
    comparison
        Comparison of two tables.

    Returns
    -------
    Table
        The table.
    """
    columns = comparison.columns.sort_index()
    tolerance_columns = (number_column("relative", "relative"), number_column("absolute", "absolute"))
    reason_column = text_column("reason", "reason", none="equal text")
    return make_table(
        "",
        (VALUE_TABLE_COLUMNS[0], text_column("kind", "kind"), *tolerance_columns, reason_column),
        columns.to_dict("records"),
    )


def version_table(comparison: TableComparison) -> Table:
    """Table of the versions on both sides.

    Parameters
    ----------
    comparison
        Compared tables.

    Returns
    -------
    Table
        Table with a row for each package.
    """
    baseline_versions, new_versions = comparison.baseline.versions, comparison.new.versions
    rows = (
        {"package": name, "baseline": baseline_versions.get(name), "new": new_versions.get(name)}
        for name in {**baseline_versions, **new_versions}
    )
    return make_table("", [text_column(heading, heading, none="-") for heading in ("package", "baseline", "new")], rows)
