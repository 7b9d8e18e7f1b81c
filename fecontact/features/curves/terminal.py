"""Results of a vehicle in curves on the terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fecontact.features.curves.curve import CurveRun
from fecontact.features.curves.records import MAP_NOTE, SHARE_ANSWERS, STABILITY_NOTE
from fecontact.features.curves.sentences import (
    ZONE_ORDER,
    describe_difference,
    describe_paths,
    describe_shares,
    describe_straight_track,
)
from fecontact.features.curves.visits import CurveResults
from fecontact.inputs.texts import count_text, escape_line
from fecontact.outputs.feature_report import write_feature_report
from fecontact.outputs.flat_records import select_attributes
from fecontact.outputs.pair_names import pair_words
from fecontact.outputs.parts import Lead, Picture
from fecontact.outputs.report_words import answer_words, lead_style
from fecontact.outputs.tables import Table, make_table, number_column, number_text, text_column
from fecontact.outputs.terminal import OutputLines, note_lines

_WHEELSET_COLUMNS = (
    number_column("radius\nm", "radius_m", none=""),
    number_column("speed\nkm/h", "speed_km_h", "{:.0f}", none=""),
    number_column("wheelset", "wheelset", "{:.0f}"),
    number_column("shift\nmm", "lateral_shift_mm", "{:+z.2f}", none="none"),
    number_column("yaw\nmrad", "yaw_mrad", "{:+z.2f}", none=""),
    *(text_column(f"Y/Q\n{side}", f"y_over_q {side}", "number") for side in ("left", "right")),
    *(text_column(f"patches {side}\nkN", f"patches {side}", "number") for side in ("left", "right")),
    text_column("T-gamma\nN", "t_gamma", "number"),
    text_column("resistance\nN/kN", "resistance", "number"),
)
_FORCE_SIGNS = "x forward, y to the field side"
_FORCE_COLUMNS = (
    number_column("radius\nm", "radius_m", none=""),
    number_column("wheelset", "wheelset", "{:.0f}", none=""),
    text_column("wheel", "side"),
    number_column("T-gamma\nN", "t_gamma_N", "{:.2f}", none=""),
    number_column("N\nkN", "normal_force_N", "{:.1f}", 1e-3, none="none"),
    number_column("Fx\nkN", "fx_N", "{:+z.3f}", 1e-3, none=""),
    number_column("Fy\nkN", "fy_N", "{:+z.3f}", 1e-3, none=""),
    number_column("Mz\nN m", "spin_moment_Nmm", "{:+z.2f}", 1e-3, none=""),
    number_column("|F|\n% of mu N", "force_of_limit", "{:.0f}", 1e2, none=""),
)


def format_curves(results: CurveResults) -> OutputLines:
    """Format the results of a vehicle in curves for the terminal.

    Parameters
    ----------
    results
        Results of a vehicle in curves.

    Yields
    ------
    str or Table
        Differences between theories, a table for each theory, straight track, and with a map the shares of the way.
    """
    yield from map(describe_difference, results.differences)
    bogie = results.vehicle.bogie
    name = escape_line(results.vehicle.name)
    bogie_words = "" if bogie is None else ", leading bogie" if bogie.leads else ", trailing bogie"
    for theory, runs in results.runs.items():
        title = f"{name}{bogie_words}, normal forces by {theory}; shift > 0 and yaw > 0 to the left"
        yield _make_wheelset_table(title, runs)
        yield _make_force_table(
            f"{theory}: creep forces on the wheels; {_FORCE_SIGNS}", runs, results.conditions.friction
        )
        yield from note_lines(
            f"R {run.radius_m:g} m: {run.status}: {'; '.join(run.notes)}" for run in runs if run.notes
        )
    yield from note_lines(describe_paths(results))
    yield from map(describe_straight_track, results.straight)
    yield from note_lines([STABILITY_NOTE])
    if results.columns:
        for theory in results.runs:
            verdict_shares, theory_shares = (
                results.shares(theory, answer_kind) for answer_kind in SHARE_ANSWERS.values()
            )
            yield f"{theory}: verdicts over the distance of all wheels: {describe_shares(verdict_shares, ZONE_ORDER)}"
            yield f"{theory}: cheapest theory that holds, over the same distance: {describe_shares(theory_shares)}"
        yaw = max((abs(visit.yaw_mrad) for visit in results.visits), default=0.0)
        yield from note_lines([f"{MAP_NOTE}; in these curves their yaw is up to {yaw:.1f} mrad"])


def write_curve_report(results: CurveResults, verdicts: Sequence[str], parts: Sequence[Table | str], out: Path) -> Path:
    """Write `report.html` of a vehicle in curves.

    Parameters
    ----------
    results
        Results of a vehicle in curves.
    verdicts
        Verdict on Hertz for each solved wheel; empty if no wheel was solved.
    parts
        Parts that the command prints.
    out
        Folder of the results, with the pictures.

    Returns
    -------
    Path
        The written page.
    """
    runs = [run for runs_by_theory in results.runs.values() for run in runs_by_theory]
    balanced_count = sum(run.is_balanced for run in runs)
    if verdicts:
        answer = answer_words(verdicts, "wheels")
    elif results.columns:
        shares = (
            f"{describe_shares(results.shares(theory, SHARE_ANSWERS['visited_percent']), ZONE_ORDER)} ({theory})"
            for theory in results.runs
        )
        answer = f"Verdicts on Hertz over the distance of all wheels: {'; '.join(shares)}"
    else:
        balanced_text = f"Equilibrium in {balanced_count} of {count_text(len(runs), 'curve')}"
        answer = f"{balanced_text}; verdicts on Hertz need --solve or --map"
    radii = ", ".join(f"{radius:g}" for radius in results.radii_m)
    name = escape_line(results.vehicle.name)
    pictures = [
        Picture(
            content=out / "curve.svg",
            words="Lateral shift and yaw of the wheelsets, Y/Q of the leading outer wheel, and curve resistance.",
        ),
        *[Picture(content=out / "curve_map.svg", words="The wheels on the map of the verdicts.")]
        * bool(results.columns),
    ]
    return write_feature_report(
        f"{name} in curves",
        Lead(answer, lead_style(verdicts), f"{name}; {pair_words(results.case, ' and ')}; curves of {radii} m"),
        parts,
        pictures,
        out,
    )


def _make_wheelset_table(title: str, runs: Sequence[CurveRun]) -> Table:
    """Make a table with a line for each wheelset.

    Values common to all wheelsets of a curve are in its first line.
    """
    rows: list[dict[str, Any]] = []
    for run in runs:
        row: dict[str, Any] = {"radius_m": run.radius_m, "speed_km_h": run.speed_km_h}
        if run.is_balanced:
            row["t_gamma"] = number_text(run.power_per_speed_N, "{:.1f}")
            row["resistance"] = number_text(run.resistance_N_per_kN, "{:.2f}")
        for wheelset_number, wheelset in enumerate(run.wheelsets, start=1):
            row["wheelset"] = wheelset_number
            if run.is_balanced:
                row |= {"lateral_shift_mm": wheelset.lateral_shift_mm, "yaw_mrad": wheelset.yaw_mrad}
            for wheel in wheelset.wheels if run.is_balanced else ():
                row[f"y_over_q {wheel.side}"] = number_text(wheel.y_over_q, "{:+z.2f}")
                row[f"patches {wheel.side}"] = " + ".join(
                    f"{1e-3 * patch.normal_force_N:.1f}" for patch in wheel.patches
                )
            rows.append(row)
            row = {}
        if not run.wheelsets:
            rows.append(row)
    return make_table(title, _WHEELSET_COLUMNS, rows)


def _make_force_table(title: str, runs: Sequence[CurveRun], friction: float) -> Table:
    """Make a table of creep forces with a line for each patch.

    T-gamma is the sum over the patches of a wheel, in the line of its largest patch.
    """
    rows: list[dict[str, Any]] = []
    for run in runs:
        curve_columns: dict[str, Any] = {"radius_m": run.radius_m}
        for number, wheelset in enumerate(run.wheelsets if run.is_balanced else (), start=1):
            curve_columns["wheelset"] = number
            for wheel in wheelset.wheels:
                patch_rows = [
                    select_attributes(patch, "normal_force_N fx_N fy_N spin_moment_Nmm")
                    | {"force_of_limit": math.hypot(patch.fx_N, patch.fy_N) / (friction * patch.normal_force_N)}
                    for patch in wheel.sorted_patches
                ] or [{}]
                patch_rows[0] |= {**curve_columns, "side": wheel.side, "t_gamma_N": wheel.t_gamma_N}
                rows += patch_rows
                curve_columns = {}
    return make_table(title, _FORCE_COLUMNS, rows)
