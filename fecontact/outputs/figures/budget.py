"""Bar chart of the contributions to an uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from fecontact.outputs.style import SERIES_COLOURS
from fecontact.outputs.words import CONTRIBUTION_WORDS, MEASURE_WORDS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Smaller contributions, as a fraction of the uncertainty, are drawn as a single segment.
_SMALL_FRACTION = 0.04
_OTHER = "other"


def draw_budget(ax: Axes, measure: str, budget: Mapping[str, float]) -> None:
    """Draw the contributions to the uncertainty of a deviation as a stacked bar.

    Parameters
    ----------
    ax
        Axes of the bar, without decorations afterwards.
    measure
        Name of the measure.
    budget
        Contributions to the uncertainty (-), by name.
    """
    words = MEASURE_WORDS[measure]
    left = 0.0
    for number, (name, value) in enumerate(group_contributions(budget).items()):
        colour = "0.75" if name == _OTHER else SERIES_COLOURS[number % len(SERIES_COLOURS)]
        label = f"{CONTRIBUTION_WORDS.get(name, name)} {words.deviation_text(value, size=True)}"
        ax.barh(0.0, value, left=left, height=1.0, color=colour, edgecolor="white", label=label)
        left += value
    # matplotlib makes ticks of invisible axes too
    ax.set(xlim=(0.0, left or 1.0), xticks=[], yticks=[])
    ax.set_axis_off()
    total = words.deviation_text(sum(budget.values()), size=True)
    ax.set_title(f"contributions to the uncertainty of {words.name}, ± {total}", fontsize=9, loc="left", pad=3)
    ax.legend(
        loc="upper left", bbox_to_anchor=(0.0, -0.05), ncols=5, fontsize=8, frameon=False, borderpad=0, handlelength=1.0
    )


def group_contributions(budget: Mapping[str, float]) -> dict[str, float]:
    """Contributions that are worth a segment, the largest first, and the sum of all others.

    Parameters
    ----------
    budget
        Contributions to an uncertainty (-), by name.

    Returns
    -------
    dict of str to float
        Contributions of at least 4 % of the uncertainty by name, then `other` if it is not zero (-).

    Examples
    --------
    >>> from fecontact.outputs.figures.budget import group_contributions
    >>> group_contributions({"reading": 0.001, "cut_planes": 0.003, "residual": 0.00001})
    {'cut_planes': 0.003, 'reading': 0.001, 'other': 1e-05}
    """
    total = sum(budget.values())
    contributions = sorted(budget.items(), key=lambda contribution: -contribution[1])
    large = {name: value for name, value in contributions if value >= _SMALL_FRACTION * total and value > 0.0}
    rest = sum(value for name, value in contributions if name not in large)
    return large | ({_OTHER: rest} if rest > 0.0 else {})
