"""Pages of a validation: the table of all studies, and a page of checks for each study."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from fecontact.inputs.texts import count_text, escape_invisible
from fecontact.regression.checks import Check

PAGES_FOLDER = "validation"
"""Folder of the pages, next to the table that links to them."""
_ERROR_EXPLANATION = """\
The error E is (result - reference) / reference. A result that is an error itself has the reference 0. u_val (ASME V&V
20) is the uncertainty of E for 95 %. It includes the uncertainty of the result and the uncertainty of the reference.
Both sides have equal inputs, which add no uncertainty. A closed form has no uncertainty. Other references do not state
their uncertainty: u_val has only the uncertainty of the result there, and the limit allows for the rest.

A check fails if E exceeds its limit. If E is within the limit and exceeds u_val, it is a model difference: the result
and the reference differ by more than the uncertainty of the numbers. Its reason stands in the row."""
_STUDY_COLUMNS = (
    *("study", "question", "checks", "failed", "model differences", "largest error / limit"),
    "largest error / u_val, closed forms",
)
_CHECK_COLUMNS = ("quantity", "case", "reference", "result", "±", "error E", "E / u_val", "limit", "answer", "reason")


@dataclass(frozen=True, kw_only=True)
class UnsolvedCases:
    """Cases or checks of a study without a result.

    Attributes
    ----------
    study
        Name of the study.
    reason
        Cases that were not solved, or the error in the checks.
    """

    study: str
    reason: str


def render_reports(
    checks: Mapping[str, Sequence[Check]],
    questions: Mapping[str, str],
    versions: Mapping[str, str | None],
    unsolved: Sequence[UnsolvedCases],
    old_table: str = "",
) -> dict[str, str]:
    """Files of a validation by their paths: VALIDATION.md and a page for each study.

    VALIDATION.md begins with what failed and what that means. It has a row for each study.

    Parameters
    ----------
    checks
        Checks of each study.
    questions
        Question of each study.
    versions
        Versions of the programs that the table names; None leaves a program out.
    unsolved
        Cases without a result.
    old_table
        The old table. Its rows and failures of studies that were not run now are kept, and the table lists the studies
        that were run.

    Returns
    -------
    files
        Text of each file.
    """
    version_text = ", ".join(f"{name} {version}" for name, version in versions.items() if version is not None)
    kept_lines = [text for text in old_table.splitlines() if (study := _find_study(text)) and study not in questions]
    study_rows = sorted(
        [text for text in kept_lines if text.startswith("|")]
        + [_summarise_study(questions, *named_checks) for named_checks in checks.items()]
    )
    failures = sorted(
        [text for text in kept_lines if not text.startswith("|")]
        + [line for study, study_checks in checks.items() for line in _describe_failures(study, study_checks)]
        + [f"- {cases.study}, not solved: {_escape_cell(cases.reason)}" for cases in unsolved]
    )
    numbers = [[int(cell) for cell in text.split(" | ")[2:5]] for text in study_rows]
    totals = [sum(column) for column in zip(*numbers, strict=True)] or [0, 0, 0]
    document = [
        "# Validation",
        "",
        _count_answers(*totals),
        *(["", *failures] if failures else []),
        "",
        "Written by `make validate`; do not edit it. "
        + version_text
        + (f". The last run had only {', '.join(questions)}." if kept_lines else ""),
        "",
        _ERROR_EXPLANATION,
        "",
        *_table_head(_STUDY_COLUMNS),
        *study_rows,
    ]
    pages = {
        f"{PAGES_FOLDER}/{study}.md": _render_page(study, questions.get(study, ""), study_checks)
        for study, study_checks in checks.items()
    }
    return {"VALIDATION.md": "\n".join(document) + "\n", **pages}


def _find_study(line: str) -> str | None:
    """Study of a row of the table, or of a line about a failure; None for other lines."""
    match = re.match(r"\| \[(\w+)\]|- (\w+), (?:failed|not solved):", line)
    return match and (match[1] or match[2])


def _table_head(columns: Sequence[str]) -> tuple[str, str]:
    """First two lines of a table."""
    return f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"


def _count_answers(checks: int, failed: int, differences: int) -> str:
    """Sentence with the number of checks, failures and model differences."""
    return f"{count_text(checks, 'check')}: {failed} failed, {count_text(differences, 'model difference')}."


def _count_study(checks: Sequence[Check]) -> tuple[int, int, int]:
    """Number of checks, failures and model differences."""
    return (
        len(checks),
        sum(not check.passed for check in checks),
        sum(check.is_model_difference for check in checks),
    )


def _describe_failures(study: str, checks: Sequence[Check]) -> list[str]:
    """Line for each failed quantity: values, limit, cases, and consequence."""
    failed = sorted((check for check in checks if not check.passed), key=lambda check: (check.quantity, check.case))
    lines = []
    for quantity, group in groupby(failed, key=lambda check: check.quantity):
        cases = [f"{_format_deviation(check)} (limit {check.limit_percent:g} %) in {check.case}" for check in group]
        reasons = dict.fromkeys(check.explanation for check in failed if check.quantity == quantity)
        text = f"{quantity}: {'; '.join(cases)}. {' '.join(reasons).strip() or 'The reason is not known.'}"
        lines.append(f"- {study}, failed: {_escape_cell(text)}")
    return lines


def _summarise_study(questions: Mapping[str, str], study: str, checks: Sequence[Check]) -> str:
    """Row of a study in the table."""
    largest_utilisation = _format_largest(
        abs(check.deviation_percent) / check.limit_percent for check in checks if check.limit_percent
    )
    largest_ratio = _format_largest(check.deviation_per_uncertainty for check in checks if check.kind == "analytic")
    numbers = " | ".join(map(str, _count_study(checks)))
    return (
        f"| [{study}]({PAGES_FOLDER}/{study}.md) | {_escape_cell(questions.get(study, ''))} | {numbers}"
        f" | {largest_utilisation} | {largest_ratio} |"
    )


def _escape_cell(text: str) -> str:
    """Escape a text for a cell of a table in Markdown.

    A bar would end the cell, a newline the row, and `<` would begin HTML.
    """
    return escape_invisible(" ".join(text.split())).replace("|", r"\|").replace("<", "&lt;")


def _format_largest(values: Iterable[float | None]) -> str:
    """Text of the largest value, NaN first; empty without values."""
    stated_values = [value for value in values if value is not None]
    return f"{max(stated_values, key=lambda value: (math.isnan(value), value)):.2g}" if stated_values else ""


def _render_page(study: str, question: str, checks: Sequence[Check]) -> str:
    """Page of a study: failures, and a table for each reference."""
    failures = _describe_failures(study, checks)
    lines = [
        f"# Validation: {study}",
        "",
        _escape_cell(question),
        "",
        _count_answers(*_count_study(checks)),
        *(["", *failures] if failures else []),
    ]
    for reference, kind in dict.fromkeys((check.reference, check.kind) for check in checks):
        uncertainty_text = "no uncertainty" if kind == "analytic" else "uncertainty not stated"
        lines += [
            f"\n## Against {_escape_cell(reference)} ({kind}; {uncertainty_text})\n",
            *_table_head(_CHECK_COLUMNS),
            *(_render_check(check) for check in checks if (check.reference, check.kind) == (reference, kind)),
        ]
    return "\n".join(lines) + "\n"


def _format_deviation(check: Check) -> str:
    """Deviation in percent; with a sign if it is an error."""
    return f"{check.deviation_percent:+.2f} %" if check.is_error else f"{check.deviation_percent:.4g} %"


def _render_check(check: Check) -> str:
    """Row of a check on the page of its study."""
    answer = "model difference" if check.is_model_difference else "pass" if check.passed else "**FAIL**"
    is_shown = check.explanation and answer != "pass"
    ratio = check.deviation_per_uncertainty
    cells = (
        *(check.quantity, check.case),
        "" if not check.is_error else "0" if check.expected is None else f"{check.expected:.5g}",
        f"{check.value:.5g}",
        "" if check.uncertainty_percent is None else f"{check.uncertainty_percent:.2g} %",
        _format_deviation(check) if check.is_error else "",
        *("" if ratio is None else f"{ratio:.2g}", f"{check.limit_percent:g} %", answer),
        check.explanation if is_shown else "",
    )
    return f"| {' | '.join(map(_escape_cell, cells))} |"
