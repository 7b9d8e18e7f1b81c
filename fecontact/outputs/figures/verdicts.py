"""Picture of two sets of verdicts over shift and load, with marked differences."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.outputs.case_words import SHIFT_LABEL
from fecontact.outputs.style import ANSWER_COLOURS, ANSWER_WORDS, add_grid, add_legend_beside, blank_figure, save_figure

if TYPE_CHECKING:
    from fecontact.regression.compare import TableComparison

_MARK_STYLE: dict[str, Any] = {"marker": "s", "ms": 15, "ls": "none"}
_CHANGED_STYLE: dict[str, Any] = {"mec": "k", "mew": 2.4, "zorder": 4}
_UNCHANGED_STYLE: dict[str, Any] = {"mec": "0.7", "mew": 0.6, "zorder": 3}


def verdicts_figure(comparison: TableComparison, path: str | Path) -> Path:
    """Draw a square with both verdicts for each common case.

    The left half has the baseline's verdict, the right half the new verdict.

    Parameters
    ----------
    comparison
        Comparison of two tables.
    path
        File of the picture.

    Returns
    -------
    Path
        The given path.
    """
    verdicts = comparison.verdicts
    figure = blank_figure(9.0, 5.5)
    ax = figure.subplots()
    for cell in verdicts.itertuples():
        style = _MARK_STYLE | (_CHANGED_STYLE if cell.baseline != cell.new else _UNCHANGED_STYLE)
        colours: dict[str, Any] = {"mfc": ANSWER_COLOURS[cell.baseline], "markerfacecoloralt": ANSWER_COLOURS[cell.new]}
        ax.plot([cell.lateral_shift_mm], [cell.load_kN], fillstyle="left", **style, **colours)
    drawn_answers = {*verdicts.baseline, *verdicts.new}
    for answer in (answer for answer in ANSWER_COLOURS if answer in drawn_answers):
        ax.plot(
            [],
            [],
            mfc=ANSWER_COLOURS[answer],
            label=ANSWER_WORDS[answer],
            **_MARK_STYLE | _UNCHANGED_STYLE | {"ms": 10},
        )
    ax.plot(
        [],
        [],
        mfc="w",
        label="changed verdict: left half\nbaseline, right half new",
        **_MARK_STYLE | _CHANGED_STYLE | {"ms": 10},
    )
    ax.margins(x=0.1, y=0.15)
    ax.set(xlabel=SHIFT_LABEL, ylabel="load in kN", title=f"{comparison.baseline.path} and {comparison.new.path}")
    add_legend_beside(ax)
    add_grid(ax)
    return save_figure(figure, path)
