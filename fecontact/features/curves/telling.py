"""A vehicle in curves: records and rows, words, pictures, terminal."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from fecontact.features.curves.curve import CurveRun
from fecontact.features.curves.stability import StraightTrack
from fecontact.features.curves.visits import NO_CELL, NO_EQUILIBRIUM, Curves, Difference, MapColumn, Visit
from fecontact.outputs.flat_records import Record, flat, picked, told
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
from fecontact.outputs.tables import Table, number, number_text, table_of, text
from fecontact.outputs.terminal import Lines, notes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray


_SHARES: Mapping[str, Literal["verdict", "cheapest_theory"]] = {
    "visited_percent": "verdict",
    "cheapest_theory_percent": "cheapest_theory",
}
_OF_MAPS = "the map's wheels have no yaw"
_OF_STABILITY = "the critical speed is that of straight track; whether the motion in a curve is stable is not looked at"


def curves_record(found: Curves) -> Record:
    """All runs, with units in the keys; each wheelset is told in the frame of its place on the track."""
    record: Record = {
        "schema": "fecontact/curve/1",
        "pair": pair_words(found.case),
        **picked(found, "vehicle conditions differences"),
        "straight_track": told(found.straight),
        "stability_notes": [_OF_STABILITY],
        "path_notes": path_words(found),
        "curves": [told(run) for runs in found.runs.values() for run in runs],
    }
    if found.columns:
        record["visits"] = [
            told(visit) | {"verdict": getattr(visit.cell, "verdict", NO_CELL)} for visit in found.visits
        ]
        for name, of in _SHARES.items():
            record[name] = {
                theory: {one: 1e2 * part for one, part in found.shares(theory, of).items()} for theory in found.runs
            }
        record["map_notes"] = [_OF_MAPS]
    return record


def curve_rows(found: Curves) -> list[Record]:
    """One row per theory, radius, wheelset and wheel; one row for a curve without any numbers."""
    return [
        {
            **picked(run, "theory radius_m status speed_km_h unbalanced_m_s2"),
            **wheel,
            **flat(picked(run, "resistance_N_per_kN left_over_N path_ends_m notes")),
        }
        for runs in found.runs.values()
        for run in runs
        for wheel in _wheel_rows(run) or [{}]
    ]


def _wheel_rows(run: CurveRun) -> list[Record]:
    return [
        {
            "wheelset": number,
            **picked(wheelset, "lateral_shift_mm yaw_mrad roll_mrad"),
            **flat(told(wheel)),
            "patch_forces_N": " ".join(f"{patch.normal_force_N:.0f}" for patch in wheel.patches),
        }
        for number, wheelset in enumerate(run.wheelsets, start=1)
        for wheel in wheelset.wheels
    ]


def position_rows(found: Curves) -> list[Record]:
    """Shift and load of each wheel on a map of the left wheel, by the last theory, with its weight.

    A wheel has its part of the way of its radius; those of radii without an equilibrium are left out.
    """
    way = dict(zip(found.radii_m, found.share, strict=True))
    wheels = [one for one in found.visits if one.theory == list(found.runs)[-1]]
    of_radius = Counter(one.radius_m for one in wheels)
    return [
        {
            "shift_mm": one.lateral_shift_mm,
            "load_kN": 1e-3 * one.vertical_force_N,
            "weight": way[one.radius_m] / of_radius[one.radius_m],
            **picked(one, "radius_m wheelset side yaw_mrad"),
        }
        for one in wheels
    ]


# --- What is said of a vehicle in curves.

# what a map says of the places that a vehicle visits
_ZONES = ("HOLDS", "UNRESOLVED", "FAILS", BETWEEN, NO_CELL, NO_EQUILIBRIUM)


def difference_words(one: Difference) -> str:
    """What a theory changes against the reference, in a sentence."""
    parts = []
    if one.without_m:
        parts.append(f"no equilibrium at R {', '.join(f'{radius:g}' for radius in one.without_m)} m")
    if math.isfinite(one.shift_mm):
        parts.append(f"shift differs by up to {one.shift_mm:.2f} mm (R {one.shift_at_m:g} m)")
        parts.append(f"Y/Q by up to {one.y_over_q:.3f} (R {one.y_over_q_at_m:g} m)")
    if one.critical_speed is not None:
        parts.append(f"the critical speed by {1e2 * one.critical_speed:+.0f} %")
    elif one.without_speed:
        parts.append(f"critical speeds are not compared ({one.without_speed})")
    return f"{one.theory} against {one.reference}: {', '.join(parts) or 'nothing to compare'}"


def straight_words(one: StraightTrack) -> str:
    """What a theory says of straight track, in a sentence."""
    if one.wavelength_m is None or one.slow_wavelength_m is None or one.frequency_Hz is None:
        return f"straight track, {one.theory}: {one.problem}"
    slow = f"wavelength {one.slow_wavelength_m:.1f} m at {one.slow_km_h:g} km/h"
    if one.problem or one.critical_speed_km_h is None:
        return f"straight track, {one.theory}: {one.problem}; {slow}"
    return (
        f"straight track, {one.theory}: critical speed {one.critical_speed_km_h:.0f} km/h, where it hunts with"
        f" {one.frequency_Hz:.1f} Hz and {one.wavelength_m:.1f} m; {slow}"
    )


def path_words(found: Curves) -> list[str]:
    """Where paths from straight track end, and which of the curves lie beyond: a sentence a theory and side."""
    words = []
    for theory, sign in itertools.product(found.runs, (1.0, -1.0)):
        beyond = [run for run in found.runs[theory] if run.path_ends_m and run.radius_m * sign > 0.0]
        if not beyond:
            continue
        first, *others = max((run.path_ends_m for run in beyond), key=len)
        end = f"at R {first:.0f} m" if math.isfinite(first) else "where it begins"
        further = f", another one at R {_radii_words(others)} m" if others else ""
        without, another = ([run.radius_m for run in beyond if run.is_balanced is had] for had in (False, True))
        reached = [f"no equilibrium was found at R {_radii_words(without)} m"] if without else []
        reached += [f"another equilibrium at R {_radii_words(another)} m"] if another else []
        words.append(f"{theory}: the path from straight track ends {end}{further}; beyond it {', '.join(reached)}")
    return words


def _radii_words(radii_m: Sequence[float]) -> str:
    return ", ".join(f"{radius:.4g}" for radius in radii_m)


def share_words(parts: Mapping[str, float], order: tuple[str, ...] = ()) -> str:
    """Shares of the way in percent, those in a given order first, the rest from the largest."""
    rest = sorted((name for name in parts if name not in order), key=lambda name: -parts[name])
    said = {BETWEEN: ANSWER_WORDS[BETWEEN]}
    return ", ".join(f"{said.get(name, name)} {1e2 * parts[name]:.3g} %" for name in (*order, *rest) if parts.get(name))


# --- Pictures of a vehicle in curves: over the curvature, and on a map.


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


# --- A vehicle in curves on the terminal.

_WHEELSET = (
    number("radius\nm", "radius_m", none=""),
    number("speed\nkm/h", "speed_km_h", "{:.0f}", none=""),
    number("wheelset", "wheelset", "{:.0f}"),
    number("shift\nmm", "lateral_shift_mm", "{:+z.2f}", none="none"),
    number("yaw\nmrad", "yaw_mrad", "{:+z.2f}", none=""),
    *(text(f"Y/Q\n{side}", f"y_over_q {side}", "number") for side in ("left", "right")),
    *(text(f"patches {side}\nkN", f"patches {side}", "number") for side in ("left", "right")),
    text("resistance\nN/kN", "resistance", "number"),
)


def curves_lines(found: Curves) -> Lines:
    """What theories change, a table a theory, straight track, and where the wheels are on the map."""
    yield from map(difference_words, found.differences)
    bogie = found.vehicle.bogie
    which = "" if bogie is None else ", leading bogie" if bogie.leads else ", trailing bogie"
    for theory, runs in found.runs.items():
        title = f"{found.vehicle.name}{which}, normal forces by {theory}; shift > 0 and yaw > 0 to the left"
        yield _wheelset_table(title, runs)
        yield from notes(f"R {run.radius_m:g} m: {run.status}: {'; '.join(run.notes)}" for run in runs if run.notes)
    yield from notes(path_words(found))
    yield from map(straight_words, found.straight)
    yield from notes([_OF_STABILITY])
    if found.columns:
        for theory in found.runs:
            way, enough = (found.shares(theory, of) for of in _SHARES.values())
            yield f"{theory}: of the way of all wheels {share_words(way, _ZONES)}"
            yield f"{theory}: the cheapest theory that holds there: {share_words(enough)}"
        yaw = max((abs(visit.yaw_mrad) for visit in found.visits), default=0.0)
        yield from notes([f"{_OF_MAPS}; here up to {yaw:.1f} mrad"])


def _wheelset_table(title: str, runs: Sequence[CurveRun]) -> Table:
    """One line per wheelset; values common to a run stand in its first line."""
    items: list[dict[str, Any]] = []
    for run in runs:
        own: dict[str, Any] = {"radius_m": run.radius_m, "speed_km_h": run.speed_km_h}
        if run.is_balanced:
            own["resistance"] = number_text(run.resistance_N_per_kN, "{:.2f}")
        for place, wheelset in enumerate(run.wheelsets, start=1):
            own["wheelset"] = place
            if run.is_balanced:
                own |= {"lateral_shift_mm": wheelset.lateral_shift_mm, "yaw_mrad": wheelset.yaw_mrad}
            for wheel in wheelset.wheels if run.is_balanced else ():
                own[f"y_over_q {wheel.side}"] = number_text(wheel.y_over_q, "{:+z.2f}")
                own[f"patches {wheel.side}"] = " + ".join(f"{1e-3 * one.normal_force_N:.1f}" for one in wheel.patches)
            items.append(own)
            own = {}
        if not run.wheelsets:
            items.append(own)
    return table_of(title, _WHEELSET, items)
