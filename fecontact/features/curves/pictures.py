"""Pictures of a vehicle in curves: results over the curvature, and wheels on a map."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.features.curves.curve import CurveRun
from fecontact.features.curves.visits import CurveResults, MapColumn, Visit
from fecontact.inputs.texts import escape_line
from fecontact.outputs.pair_names import pair_words
from fecontact.outputs.style import (
    ANSWER_COLOURS,
    ANSWER_WORDS,
    BETWEEN_VERDICTS,
    SERIES_MARKS,
    add_grid,
    blank_figure,
    save_figure,
    series_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray
from fecontact.features.curves.sentences import describe_difference, describe_paths

# Characters of a title that fit across the picture: 12 inches at a font size of 10.
_TITLE_CHARACTERS = 150


def draw_curves(results: CurveResults, path: str | Path) -> Path:
    """Draw the results of all theories over the curvature.

    The panels are shift, angle of attack, Y/Q of the leading outer wheel, and resistance. For a single curve they have
    bars with their values, with the wheelsets side by side.

    Parameters
    ----------
    results
        Results of a vehicle in curves.
    path
        File of the picture.

    Returns
    -------
    Path
        The written file.
    """
    figure = blank_figure(12.0, 8.0)
    axes = figure.subplots(2, 2)
    curvatures = {1.0 / run.radius_m for runs in results.runs.values() for run in runs}
    (_draw_single_curve if len(curvatures) == 1 else _draw_over_curvature)(axes, results.runs)
    labels = ("lateral shift, mm", "yaw (angle of attack), mrad", "Y/Q, leading outer wheel", "curve resistance, N/kN")
    for ax, label in zip(axes.flat, labels, strict=True):
        ax.set(ylabel=label)
    add_grid(*axes.flat)
    for ax in axes.flat:
        if ax.get_legend_handles_labels()[0]:
            ax.legend(fontsize=8)
    headline = [*map(describe_difference, results.differences), *describe_paths(results)]
    radius = f", R {1.0 / curvatures.pop():g} m" if len(curvatures) == 1 else ""
    settings = f"{_make_title(results)}{radius}, friction {results.conditions.friction:g}"
    title_lines = [line for text in (*headline, settings) for line in textwrap.wrap(text, _TITLE_CHARACTERS)]
    figure.suptitle("\n".join(title_lines), fontsize=10)
    return save_figure(figure, Path(path))


def _outer_y_over_q(run: CurveRun) -> float:
    """Y/Q of the outer wheel of the leading wheelset."""
    return run.wheelsets[0].wheels[0 if run.radius_m > 0.0 else 1].y_over_q


def _draw_single_curve(axes: NDArray[Any], runs: Mapping[str, Sequence[CurveRun]]) -> None:
    """Draw bars with values for a single curve, side by side for all theories.

    The four panels are lateral shift (mm), yaw (mrad), Y/Q of the outer wheel, and resistance (N/kN). Theories without
    a balanced run have no bars.
    """
    balanced_runs = {theory: run for theory, (run,) in runs.items() if run.is_balanced}
    width = 0.5 / max(len(balanced_runs), 1)
    for index, (theory, run) in enumerate(balanced_runs.items()):
        wheelset_names = ("leading", "trailing") if len(run.wheelsets) > 1 else ("wheelset",)
        panels = (
            {name: wheelset.lateral_shift_mm for name, wheelset in zip(wheelset_names, run.wheelsets, strict=False)},
            {name: wheelset.yaw_mrad for name, wheelset in zip(wheelset_names, run.wheelsets, strict=False)},
            {wheelset_names[0]: _outer_y_over_q(run)},
            {"vehicle": run.resistance_N_per_kN},
        )
        for ax, values in zip(axes.flat, panels, strict=True):
            positions = [
                value_index + (index - (len(balanced_runs) - 1) / 2.0) * width for value_index in range(len(values))
            ]
            bars = ax.bar(positions, list(values.values()), width, color=series_style(index)["color"], label=theory)
            ax.bar_label(bars, fmt="%.3g", padding=2, fontsize=8)
            ax.set_xticks(range(len(values)), list(values))
            ax.set_xlim(-0.6, len(values) - 0.4)
            ax.margins(y=0.15)


def _draw_over_curvature(axes: NDArray[Any], runs_by_theory: Mapping[str, Sequence[CurveRun]]) -> None:
    """Draw the results over the curvature, a curve for each path and theory.

    The four panels are lateral shift (mm), yaw (mrad), Y/Q of the outer wheel, and resistance (N/kN). The curvature is
    in 1/km, positive to the right. Runs without a balance are left out.
    """
    for index, (theory, runs) in enumerate(runs_by_theory.items()):
        balanced_runs = sorted((run for run in runs if run.is_balanced), key=lambda run: 1.0 / run.radius_m)
        # a curve of the picture ends at the end of its path
        paths = [list(path_runs) for _, path_runs in itertools.groupby(balanced_runs, key=lambda run: run.path_ends_m)]
        for index_on_path, path_runs in enumerate(paths):
            _draw_path(axes, path_runs, "" if index_on_path else theory, series_style(index))
    for ax in axes.flat:
        ax.set(xlabel="curvature 1/R in 1/km (> 0: to the right)")


def _draw_path(axes: NDArray[Any], runs: Sequence[CurveRun], theory: str, style: dict[str, Any]) -> None:
    """Draw the results of a path over the curvature.

    If the name of the theory is empty, then the curves have no label.
    """
    curvatures, wheelsets = [1e3 / run.radius_m for run in runs], len(runs[0].wheelsets)
    for number, dash in zip(range(wheelsets), ("-", "--"), strict=False):
        wheelset_style = style | {"mfc": "white" if number else style["color"]}
        label = f"{theory}, {'leading' if number == 0 else 'trailing'}" if theory and wheelsets > 1 else theory
        axes[0, 0].plot(
            curvatures, [run.wheelsets[number].lateral_shift_mm for run in runs], dash, label=label, **wheelset_style
        )
        axes[0, 1].plot(
            curvatures, [run.wheelsets[number].yaw_mrad for run in runs], dash, label=label, **wheelset_style
        )
    axes[1, 0].plot(curvatures, [_outer_y_over_q(run) for run in runs], label=theory, **style)
    axes[1, 1].plot(curvatures, [run.resistance_N_per_kN for run in runs], label=theory, **style)


def _make_title(results: CurveResults) -> str:
    """Vehicle and pair in a title."""
    return f"{escape_line(results.vehicle.name)}, {pair_words(results.case)}"


def draw_visits(results: CurveResults, path: str | Path) -> Path:
    """Draw the paths of all wheels on the map of the left wheel.

    The map shows the verdicts of its cells.

    Parameters
    ----------
    results
        Results of a vehicle in curves, with a map.
    path
        File of the picture.

    Returns
    -------
    Path
        The written file.
    """
    figure = blank_figure(10.0, 6.0)
    axes = figure.subplots()
    _draw_columns(axes, results.columns)
    for index, theory in enumerate(results.runs):
        _draw_paths(
            axes, [visit for visit in results.visits if visit.theory == theory], SERIES_MARKS[index % len(SERIES_MARKS)]
        )
    axes.set(xlabel="lateral shift towards the wheel's own rail, mm", ylabel="vertical force, kN")
    add_grid(axes)
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.01, 1.0))
    axes.set_title(f"{_make_title(results)}:\nall wheels on the map; numbers are radii in m", fontsize=10)
    return save_figure(figure, Path(path))


def _draw_columns(axes: Axes, columns: Sequence[MapColumn]) -> None:
    """Draw the solved shifts as columns in the colours of their verdicts.

    The columns reach over the solved loads; the rest of the map is white.
    """
    labelled = set()
    for column in columns:
        for low, high, answer in column.bands:
            label = ANSWER_WORDS.get(answer, answer)
            axes.bar(
                *(column.lateral_shift_mm, high - low, 2.0 * column.reach_mm, low),
                color=ANSWER_COLOURS.get(answer, "white"),
                # a single load is a line, which only its edge shows
                edgecolor=ANSWER_COLOURS.get(answer, "white") if answer != BETWEEN_VERDICTS else "0.7",
                hatch="////" if answer == BETWEEN_VERDICTS else None,
                label=None if label in labelled else label,
            )
            labelled.add(label)


def _draw_paths(axes: Axes, visits: Sequence[Visit], mark: str) -> None:
    """Draw a curve for each wheel, from the widest curve to the tightest.

    The vertical force in kN is over the lateral shift in mm; each point has its radius in m without a sign.
    """
    for wheelset, side in sorted({(visit.wheelset, visit.side) for visit in visits}):
        path_visits = [visit for visit in visits if (visit.wheelset, visit.side) == (wheelset, side)]
        path_visits.sort(key=lambda visit: 1.0 / visit.radius_m)
        axes.plot(
            [visit.lateral_shift_mm for visit in path_visits],
            [1e-3 * visit.vertical_force_N for visit in path_visits],
            *("-", "--")[wheelset - 1 : wheelset],
            color="black" if side == "left" else "#7a3b9a",
            marker=mark,
            ms=5,
            label=f"{path_visits[0].theory}: {side} wheel of wheelset {wheelset}",
        )
        for visit in path_visits:
            position = (visit.lateral_shift_mm, 1e-3 * visit.vertical_force_N)
            axes.annotate(f"{abs(visit.radius_m):g}", position, xytext=(3, 3), textcoords="offset points", fontsize=6)
