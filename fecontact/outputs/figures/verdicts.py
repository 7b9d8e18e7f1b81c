"""The picture of two sets of verdicts over shift and load: which cells have another one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.outputs.case_words import SHIFT
from fecontact.outputs.style import ANSWER_WORDS, ANSWERS, blank_figure, finish, legend_beside, save_figure

if TYPE_CHECKING:
    from fecontact.regression.compare import TableComparison

_MARK: dict[str, Any] = {"marker": "s", "ms": 15, "ls": "none"}
_CHANGED: dict[str, Any] = {"mec": "k", "mew": 2.4, "zorder": 4}
_SAME: dict[str, Any] = {"mec": "0.7", "mew": 0.6, "zorder": 3}


def verdicts_figure(comparison: TableComparison, path: str | Path) -> Path:
    """Draw a square for each case in common: its left half has the baseline's verdict, its right half the new one."""
    verdicts = comparison.verdicts
    figure = blank_figure(9.0, 5.5)
    ax = figure.subplots()
    for one in verdicts.itertuples():
        style = _MARK | (_CHANGED if one.baseline != one.new else _SAME)
        colours: dict[str, Any] = {"mfc": ANSWERS[one.baseline], "markerfacecoloralt": ANSWERS[one.new]}
        ax.plot([one.lateral_shift_mm], [one.load_kN], fillstyle="left", **style, **colours)
    found = {*verdicts.baseline, *verdicts.new}
    for answer in (answer for answer in ANSWERS if answer in found):
        ax.plot([], [], mfc=ANSWERS[answer], label=ANSWER_WORDS[answer], **_MARK | _SAME | {"ms": 10})
    ax.plot(
        [], [], mfc="w", label="another verdict: left half\nbaseline, right half new", **_MARK | _CHANGED | {"ms": 10}
    )
    ax.margins(x=0.1, y=0.15)
    ax.set(xlabel=SHIFT, ylabel="load in kN", title=f"{comparison.baseline.path} and {comparison.new.path}")
    legend_beside(ax)
    finish(ax)
    return save_figure(figure, path)
