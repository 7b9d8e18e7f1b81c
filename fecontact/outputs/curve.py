"""A vehicle in curves as a record, rows of a table, text on the terminal, and a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.outputs.style import ANSWERS, MARKS, SERIES, blank_figure, finish, save_figure
from fecontact.outputs.terminal import number_text, print_notes, say, standard_console, titled_table
from fecontact.vehicle.curve import CurveRun, WheelRun, WheelsetRun
from fecontact.vehicle.model import Vehicle
from fecontact.vehicle.visits import Curves, Visit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Console

Record = dict[str, Any]
CURVE_SCHEMA = "fecontact/curve/1"
_ZONES = ("HOLDS", "UNRESOLVED", "FAILS", "failed", "not on the map")


def curves_record(found: Curves) -> Record:
    """All runs, with units in the keys; the frame of each wheelset is that of its place on the track."""
    record: Record = {
        "schema": CURVE_SCHEMA,
        "vehicle": asdict(found.vehicle),
        "conditions": asdict(found.conditions),
        "curves": [_run_record(run) for runs in found.runs.values() for run in runs],
    }
    if found.visits:
        record["visits"] = [asdict(visit) for visit in found.visits]
        record["visited_percent"] = {
            theory: {zone: 1e2 * part for zone, part in found.visited(theory).items()} for theory in found.runs
        }
    return record


def _run_record(run: CurveRun) -> Record:
    return {
        "theory": run.theory,
        "radius_m": run.radius_m,
        "status": run.status,
        "notes": list(run.notes),
        "speed_km_h": run.speed_km_h,
        "unbalanced_m_s2": run.unbalanced_m_s2,
        "pull_N": run.pull_N,
        "power_per_speed_N": run.power_per_speed_N,
        "resistance_N_per_kN": run.resistance_N_per_kN,
        "left_over_N": run.left_over_N,
        "wheelsets": [
            {
                "lateral_shift_mm": wheelset.lateral_shift_mm,
                "yaw_mrad": wheelset.yaw_mrad,
                "roll_mrad": wheelset.roll_mrad,
                "wheels": [_wheel_record(wheel) for wheel in wheelset.wheels],
            }
            for wheelset in run.wheelsets
        ],
    }


def _wheel_record(wheel: WheelRun) -> Record:
    return {
        "side": wheel.side,
        "normal_force_N": wheel.normal_force_N,
        "lateral_force_N": wheel.lateral_force_N,
        "vertical_force_N": wheel.vertical_force_N,
        "y_over_q": wheel.y_over_q,
        "patches": [asdict(patch) for patch in wheel.patches],
    }


def curve_rows(found: Curves) -> list[Record]:
    """One row a theory, radius, wheelset and wheel."""
    return [
        {
            "theory": run.theory,
            "radius_m": run.radius_m,
            "status": run.status,
            "speed_km_h": run.speed_km_h,
            "unbalanced_m_s2": run.unbalanced_m_s2,
            "wheelset": number,
            "lateral_shift_mm": wheelset.lateral_shift_mm,
            "yaw_mrad": wheelset.yaw_mrad,
            "roll_mrad": wheelset.roll_mrad,
            "side": wheel.side,
            "normal_force_N": wheel.normal_force_N,
            "lateral_force_N": wheel.lateral_force_N,
            "vertical_force_N": wheel.vertical_force_N,
            "y_over_q": wheel.y_over_q,
            "patches": len(wheel.patches),
            "patch_forces_N": " ".join(f"{patch.normal_force_N:.0f}" for patch in wheel.patches),
            "resistance_N_per_kN": run.resistance_N_per_kN,
            "left_over_N": run.left_over_N,
            "notes": "; ".join(run.notes),
        }
        for runs in found.runs.values()
        for run in runs
        for number, wheelset in enumerate(run.wheelsets, start=1)
        for wheel in wheelset.wheels
    ]


def print_curves(found: Curves, console: Console | None = None) -> None:
    """Print a table a theory, what theories change, and where the wheels are on the map."""
    console = console or standard_console()
    for theory, runs in found.runs.items():
        _print_theory(found.vehicle, theory, runs, console)
    _print_differences(found.runs, console)
    for theory in found.runs if found.visits else ():
        parts = found.visited(theory)
        told = ", ".join(f"{zone} {1e2 * parts[zone]:.0f} %" for zone in _ZONES if parts.get(zone))
        say(console, f"{theory}: of the way of all wheels {told}")


def _print_theory(vehicle: Vehicle, theory: str, runs: Sequence[CurveRun], console: Console) -> None:
    table = titled_table(console, title=f"{vehicle.name}, normal forces by {theory}; shift > 0 and yaw > 0 to the left")
    for heading in ("radius\nm", "speed\nkm/h", "wheelset", "shift\nmm", "yaw\nmrad", "Y/Q\nleft", "Y/Q\nright"):
        table.add_column(heading, justify="right")
    for heading in ("patches left\nkN", "patches right\nkN", "resistance\nN/kN"):
        table.add_column(heading, justify="right")
    for run in runs:
        for number, wheelset in enumerate(run.wheelsets, start=1):
            first = number == 1
            table.add_row(
                f"{run.radius_m:g}" if first else "",
                f"{run.speed_km_h:.0f}" if first else "",
                str(number),
                *_cells(run, wheelset),
                number_text(run.resistance_N_per_kN, "{:.2f}") if first and run.status != "no equilibrium" else "",
            )
    console.print(table)
    print_notes((f"R {run.radius_m:g} m: {run.status}: {'; '.join(run.notes)}" for run in runs if run.notes), console)


def _cells(run: CurveRun, wheelset: WheelsetRun) -> list[str]:
    if run.status == "no equilibrium":
        return ["none", *[""] * 5]
    left, right = wheelset.wheels
    return [
        f"{wheelset.lateral_shift_mm:+z.2f}",
        f"{wheelset.yaw_mrad:+z.2f}",
        *(number_text(wheel.y_over_q, "{:+z.2f}") for wheel in (left, right)),
        *(" + ".join(f"{1e-3 * patch.normal_force_N:.1f}" for patch in wheel.patches) for wheel in (left, right)),
    ]


def _print_differences(runs: Mapping[str, tuple[CurveRun, ...]], console: Console) -> None:
    """What each theory changes against the last one, wheelset by wheelset, where both have an equilibrium."""
    *others, reference = runs
    for theory in others:
        pairs = [(one, other) for one, other in zip(runs[theory], runs[reference], strict=True) if _both(one, other)]
        missing = [f"{one.radius_m:g}" for one in runs[theory] if one.status == "no equilibrium"]
        if missing:
            say(console, f"{theory} has no equilibrium at R {', '.join(missing)} m")
        if not pairs:
            continue
        shift, at = max(
            (abs(a.lateral_shift_mm - b.lateral_shift_mm), one.radius_m)
            for one, other in pairs
            for a, b in zip(one.wheelsets, other.wheelsets, strict=True)
        )
        guiding, where = max(
            (abs(a.wheels[k].y_over_q - b.wheels[k].y_over_q), one.radius_m)
            for one, other in pairs
            for a, b in zip(one.wheelsets, other.wheelsets, strict=True)
            for k in (0, 1)
        )
        say(
            console,
            f"{theory} against {reference}: shift differs by up to {shift:.2f} mm (R {at:g} m), Y/Q by up to"
            f" {guiding:.3f} (R {where:g} m)",
        )


def _both(one: CurveRun, other: CurveRun) -> bool:
    return "no equilibrium" not in (one.status, other.status)


def curves_figure(found: Curves, path: str | Path) -> Path:
    """Draw shift, angle of attack, Y/Q of the leading outer wheel and resistance over the curvature, by theory."""
    figure = blank_figure(12.0, 8.0)
    axes = figure.subplots(2, 2)
    for number, (theory, runs) in enumerate(found.runs.items()):
        good = sorted((run for run in runs if run.status != "no equilibrium"), key=lambda run: 1.0 / run.radius_m)
        style = {"color": SERIES[number % len(SERIES)], "marker": MARKS[number % len(MARKS)]}
        x = [1e3 / run.radius_m for run in good]
        for place, dash in zip(range(len(good[0].wheelsets) if good else 0), ("-", "--"), strict=False):
            label = f"{theory}, {'leading' if place == 0 else 'trailing'}" if len(good[0].wheelsets) > 1 else theory
            axes[0, 0].plot(x, [r.wheelsets[place].lateral_shift_mm for r in good], dash, label=label, **style)
            axes[0, 1].plot(x, [r.wheelsets[place].yaw_mrad for r in good], dash, label=label, **style)
        outer = [run.wheelsets[0].wheels[0 if run.radius_m > 0.0 else 1].y_over_q for run in good]
        axes[1, 0].plot(x, outer, label=theory, **style)
        axes[1, 1].plot(x, [run.resistance_N_per_kN for run in good], label=theory, **style)
    labels = ("lateral shift, mm", "yaw (angle of attack), mrad", "Y/Q, leading outer wheel", "curve resistance, N/kN")
    for ax, label in zip(axes.flat, labels, strict=True):
        ax.set(xlabel="curvature 1000/R, 1/m (> 0: to the right)", ylabel=label)
    finish(*axes.flat)
    for ax in axes.flat:
        if ax.lines:
            ax.legend(fontsize=8)
    figure.suptitle(f"{found.vehicle.name}, friction {found.conditions.friction:g}")
    return save_figure(figure, Path(path))


def visits_figure(found: Curves, path: str | Path) -> Path:
    """Draw where all wheels are on the map of the left wheel: shift and load, coloured by what the map says there."""
    figure = blank_figure(9.0, 5.5)
    axes = figure.subplots()
    draw_visits(axes, found.visits)
    axes.legend(fontsize=8)
    finish(axes)
    axes.set_title(f"{found.vehicle.name}: wheels on the map; numbers are radii in m", fontsize=10)
    return save_figure(figure, Path(path))


def draw_visits(axes: Axes, visits: Sequence[Visit]) -> None:
    """Wheels as points over shift and load, with their radii."""
    theories = list(dict.fromkeys(visit.theory for visit in visits))
    for zone in _ZONES:
        for number, theory in enumerate(theories):
            own = [visit for visit in visits if visit.verdict == zone and visit.theory == theory]
            if own:
                axes.plot(
                    [visit.lateral_shift_mm for visit in own],
                    [1e-3 * visit.vertical_force_N for visit in own],
                    MARKS[number % len(MARKS)],
                    color=ANSWERS.get(zone, "white"),
                    markeredgecolor="black",
                    label=f"{theory}: {zone}",
                )
    for visit in visits:
        axes.annotate(f"{abs(visit.radius_m):g}", (visit.lateral_shift_mm, 1e-3 * visit.vertical_force_N), fontsize=6)
    axes.set(xlabel="lateral shift towards the wheel's own rail, mm", ylabel="vertical force, kN")
