"""Pictures of a vehicle in curves: over the curvature, and on a map."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.features.curves.curve import CurveRun
from fecontact.features.curves.visits import Curves, MapColumn, Visit
from fecontact.outputs.pair_names import pair_words
from fecontact.outputs.style import (
    ANSWER_WORDS,
    ANSWERS,
    BETWEEN,
    MARKS,
    blank_figure,
    finish,
    save_figure,
    series_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray
from fecontact.features.curves.sentences import difference_words, path_words


def curves_figure(found: Curves, path: str | Path) -> Path:
    """Draw shift, angle of attack, Y/Q of the leading outer wheel and resistance by theory, over the curvature.

    In a single curve they are bars with their values, wheelset beside wheelset.
    """
    figure = blank_figure(12.0, 8.0)
    axes = figure.subplots(2, 2)
    curvatures = {1.0 / run.radius_m for runs in found.runs.values() for run in runs}
    (_draw_one_curve if len(curvatures) == 1 else _draw_curves)(axes, found.runs)
    labels = ("lateral shift, mm", "yaw (angle of attack), mrad", "Y/Q, leading outer wheel", "curve resistance, N/kN")
    for ax, label in zip(axes.flat, labels, strict=True):
        ax.set(ylabel=label)
    finish(*axes.flat)
    for ax in axes.flat:
        if ax.get_legend_handles_labels()[0]:
            ax.legend(fontsize=8)
    headline = [*map(difference_words, found.differences), *path_words(found)]
    radius = f", R {1.0 / curvatures.pop():g} m" if len(curvatures) == 1 else ""
    told = f"{_title(found)}{radius}, friction {found.conditions.friction:g}"
    figure.suptitle("\n".join([*headline, told]), fontsize=10)
    return save_figure(figure, Path(path))


def _outer_y_over_q(run: CurveRun) -> float:
    return run.wheelsets[0].wheels[0 if run.radius_m > 0.0 else 1].y_over_q


def _draw_one_curve(axes: NDArray[Any], runs: Mapping[str, Sequence[CurveRun]]) -> None:
    good = {theory: run for theory, (run,) in runs.items() if run.is_balanced}
    width = 0.5 / max(len(good), 1)
    for index, (theory, run) in enumerate(good.items()):
        places = ("leading", "trailing") if len(run.wheelsets) > 1 else ("wheelset",)
        panels = (
            {place: one.lateral_shift_mm for place, one in zip(places, run.wheelsets, strict=False)},
            {place: one.yaw_mrad for place, one in zip(places, run.wheelsets, strict=False)},
            {places[0]: _outer_y_over_q(run)},
            {"vehicle": run.resistance_N_per_kN},
        )
        for ax, values in zip(axes.flat, panels, strict=True):
            at = [place + (index - (len(good) - 1) / 2.0) * width for place in range(len(values))]
            bars = ax.bar(at, list(values.values()), width, color=series_style(index)["color"], label=theory)
            ax.bar_label(bars, fmt="%.3g", padding=2, fontsize=8)
            ax.set_xticks(range(len(values)), list(values))
            ax.set_xlim(-0.6, len(values) - 0.4)
            ax.margins(y=0.15)


def _draw_curves(axes: NDArray[Any], runs_of: Mapping[str, Sequence[CurveRun]]) -> None:
    for index, (theory, runs) in enumerate(runs_of.items()):
        good = sorted((run for run in runs if run.is_balanced), key=lambda run: 1.0 / run.radius_m)
        # a line does not go on beyond the end of its path
        paths = [list(one) for _, one in itertools.groupby(good, key=lambda run: run.path_ends_m)]
        for place, one in enumerate(paths):
            _draw_path(axes, one, "" if place else theory, series_style(index))
    for ax in axes.flat:
        ax.set(xlabel="curvature 1/R in 1/km (> 0: to the right)")


def _draw_path(axes: NDArray[Any], runs: Sequence[CurveRun], theory: str, style: dict[str, Any]) -> None:
    """Runs of one path by the curvature; without a name of their theory they have no label."""
    x, wheelsets = [1e3 / run.radius_m for run in runs], len(runs[0].wheelsets)
    for place, dash in zip(range(wheelsets), ("-", "--"), strict=False):
        of_place = style | {"mfc": "white" if place else style["color"]}
        label = f"{theory}, {'leading' if place == 0 else 'trailing'}" if theory and wheelsets > 1 else theory
        axes[0, 0].plot(x, [r.wheelsets[place].lateral_shift_mm for r in runs], dash, label=label, **of_place)
        axes[0, 1].plot(x, [r.wheelsets[place].yaw_mrad for r in runs], dash, label=label, **of_place)
    axes[1, 0].plot(x, [_outer_y_over_q(run) for run in runs], label=theory, **style)
    axes[1, 1].plot(x, [run.resistance_N_per_kN for run in runs], label=theory, **style)


def _title(found: Curves) -> str:
    return f"{found.vehicle.name}, {pair_words(found.case)}"


def visits_figure(found: Curves, path: str | Path) -> Path:
    """Draw the paths of all wheels over the map of the left wheel, on the verdicts of its cells."""
    figure = blank_figure(10.0, 6.0)
    axes = figure.subplots()
    _draw_columns(axes, found.columns)
    for index, theory in enumerate(found.runs):
        _draw_paths(axes, [visit for visit in found.visits if visit.theory == theory], MARKS[index % len(MARKS)])
    axes.set(xlabel="lateral shift towards the wheel's own rail, mm", ylabel="vertical force, kN")
    finish(axes)
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.01, 1.0))
    axes.set_title(f"{_title(found)}:\nall wheels on the map; numbers are radii in m", fontsize=10)
    return save_figure(figure, Path(path))


def _draw_columns(axes: Axes, columns: Sequence[MapColumn]) -> None:
    """Solved shifts as columns, in the colours of their verdicts over the loads that were solved; all else is white."""
    shown = set()
    for column in columns:
        for low, high, answer in column.bands:
            words = ANSWER_WORDS.get(answer, answer)
            axes.bar(
                *(column.lateral_shift_mm, high - low, 2.0 * column.reach_mm, low),
                color=ANSWERS.get(answer, "white"),
                # a single load is a line
                edgecolor=ANSWERS.get(answer, "white") if answer != BETWEEN else "0.7",
                hatch="////" if answer == BETWEEN else None,
                label=None if words in shown else words,
            )
            shown.add(words)


def _draw_paths(axes: Axes, visits: Sequence[Visit], mark: str) -> None:
    """A line a wheel from the widest curve to the tightest."""
    for wheelset, side in sorted({(visit.wheelset, visit.side) for visit in visits}):
        own = [visit for visit in visits if (visit.wheelset, visit.side) == (wheelset, side)]
        own.sort(key=lambda visit: 1.0 / visit.radius_m)
        axes.plot(
            [visit.lateral_shift_mm for visit in own],
            [1e-3 * visit.vertical_force_N for visit in own],
            *("-", "--")[wheelset - 1 : wheelset],
            color="black" if side == "left" else "#7a3b9a",
            marker=mark,
            ms=5,
            label=f"{own[0].theory}: {side} wheel of wheelset {wheelset}",
        )
        for visit in own:
            place = (visit.lateral_shift_mm, 1e-3 * visit.vertical_force_N)
            axes.annotate(f"{abs(visit.radius_m):g}", place, xytext=(3, 3), textcoords="offset points", fontsize=6)
