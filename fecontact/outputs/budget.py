"""Table of the contributions to the uncertainties of a verdict."""

from __future__ import annotations

from fecontact.outputs.tables import Column, Table, TableRecord, TableRow
from fecontact.outputs.words import CONTRIBUTION_WORDS, MEASURE_WORDS

_TOTAL = "sum"


def budget_table(record: TableRecord) -> Table:
    """Table of the contributions to the uncertainty of each judged measure.

    Parameters
    ----------
    record
        Record of a load, with `uncertainty_budget`.

    Returns
    -------
    Table
        A row for each contribution that is not zero everywhere, and their sum; a column for each judged measure.
    """
    # a criterion of a user without its function has no contributions
    budgets = {
        name: record["uncertainty_budget"][name]
        for name in record["verdict"]["each"]
        if name in record["uncertainty_budget"]
    }
    contributions = [name for name in CONTRIBUTION_WORDS if any(budget[name] for budget in budgets.values())]
    rows = [
        TableRow(
            cells=[
                CONTRIBUTION_WORDS[name],
                *(_cell(measure, budget[name]) for measure, budget in budgets.items()),
            ]
        )
        for name in contributions
    ]
    totals = [_cell(measure, sum(budget.values())) for measure, budget in budgets.items()]
    return Table(
        title="Contributions to the uncertainty",
        columns=[
            Column(heading="contribution", kind="text"),
            *(
                Column(heading=f"{MEASURE_WORDS[measure].short}\n{MEASURE_WORDS[measure].off_unit}")
                for measure in budgets
            ),
        ],
        rows=[*rows, TableRow(cells=[_TOTAL, *totals])],
    )


def _cell(measure: str, value: float) -> str:
    """Number of a contribution in the unit of the deviation; empty for zero."""
    words = MEASURE_WORDS[measure]
    return words.number_text(value, more_digits=1) if value else ""
