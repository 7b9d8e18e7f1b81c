"""Tables: CSV for other programs, and texts for the terminal."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.case import RESOLUTIONS
from fecontact.files import write_text
from fecontact.outputs.creep import print_creep
from fecontact.outputs.measure_words import WORDS, names_text, unknown_text
from fecontact.outputs.multi_hertz import springs_text
from fecontact.outputs.roll_words import roll_words_of_rows
from fecontact.profiles.curve import Arc, Line, Profile, Segment

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

Record = Mapping[str, Any]

# Width of a table that goes to a file or a pipe.
_PLAIN_WIDTH = 120
# Terminals that are narrower have columns closer together.
_ROOMY_WIDTH = 100


@dataclass(frozen=True, kw_only=True)
class _Column:
    """A column of the table of cases: heading, key of its values and their format.

    Where there is no room, columns with a `name` are left out, those of the lowest `rank` first, and named.
    """

    heading: str
    key: str
    form: str
    rank: int = 0
    name: str = ""

    @property
    def left(self) -> bool:
        return self.key.startswith(("verdict", _SPRINGS))


# The verdict of ellipses at several touch points: a column where a row has one.
_SPRINGS = "multi_hertz_verdict"
# Deviations are Hertz minus finite elements.
_COLUMNS = (
    _Column(heading="shift\nmm", key="lateral_shift_mm", form="{:+z.2f}"),
    _Column(heading="load\nkN", key="load_kN", form="{:g}"),
    _Column(heading="p_max\nFE MPa", key="p_max_fe_MPa", form="{:.0f}", rank=5, name="p_max in MPa"),
    _Column(heading="p_max\ndev %", key="p_max_deviation_percent", form="{:+z.1f}"),
    _Column(heading="\n± %", key="p_max_uncertainty_percent", form="{:.1f}", rank=3, name="± of p_max"),
    _Column(heading="area\ndev %", key="area_deviation_percent", form="{:+z.1f}", rank=9, name="area"),
    _Column(heading="a\ndev %", key="a_deviation_percent", form="{:+z.1f}", rank=4, name="a"),
    _Column(heading="b\ndev %", key="b_deviation_percent", form="{:+z.1f}", rank=8, name="b"),
    _Column(heading="centre\nin b", key="centre_over_b", form="{:+z.2f}", rank=7, name="centre"),
    _Column(heading="valley\n%", key="valley_percent", form="{:z.1f}", rank=6, name="valley"),
    _Column(heading="mispl.\n%", key="misplaced_load_percent", form="{:z.1f}", rank=10, name="misplaced"),
    _Column(heading="verdict", key="verdict", form="{}"),
    _Column(heading="fails by", key="verdict_failing", form="{}"),
    _Column(heading="springs", key=_SPRINGS, form="{}", name="springs"),
    _Column(heading="meshes", key="meshes", form="{}", rank=2, name="meshes"),
    _Column(heading="time\ns", key="seconds", form="{:.0f}", rank=1, name="time"),
)
# Characters for the measures by which a case fails, from the most down to the fewest; those beyond are counted.
_FAILING_WIDTHS = (50, 34, 30, 26, 22, 18)


def write_csv(rows: Iterable[Record], path: str | Path) -> Path:
    """Write rows as CSV: the columns in the order in which they first occur, missing values and NaN empty."""
    rows = list(rows)
    columns = list(dict.fromkeys(key for row in rows for key in row))
    text = io.StringIO()
    table = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    table.writeheader()
    table.writerows({key: None if _missing(value) else value for key, value in row.items()} for row in rows)
    return write_text(path, text.getvalue())


def _missing(value: object) -> bool:
    return value is None or (isinstance(value, float) and not math.isfinite(value))


def print_table(rows: Sequence[Record], *, console: Console | None = None) -> None:
    """Print one line a case, a table for each rail, wheel and inclination, and in full what makes a row unusable."""
    console = console or _console()
    groups: dict[str, list[Record]] = {}
    for row in rows:
        groups.setdefault(_pair_text(row), []).append(row)
    if len(groups) > _MOST_TABLES:
        _print_rows(rows, "", console, with_pair=True)
    else:
        for pair, own in groups.items():
            _print_rows(own, "; ".join(filter(None, (pair, roll_words_of_rows(own)))), console)
    for row in rows:
        pair = f"{_pair_text(row)}, " if len(groups) > 1 else ""
        where = f"{pair}{row['lateral_shift_mm']:+z.2f} mm, {row['load_kN']:g} kN"
        if row["status"] != "converged":
            console.print(f"{where}: {row['status']}", markup=False, highlight=False)
            continue
        if row.get("verdict_cause"):
            console.print(f"{where}: {row['verdict']}: {row['verdict_cause']}", markup=False, highlight=False)
        if springs := springs_text(row):
            console.print(f"{where}: {springs}", markup=False, highlight=False)


# More of them are one table, with the pair in its first column.
_MOST_TABLES = 6


def _print_rows(rows: Sequence[Record], title: str, console: Console, *, with_pair: bool = False) -> None:
    """Print a table with the columns that find room, and name those that do not."""
    from rich.measure import Measurement

    unbounded = console.options.update(max_width=10_000)
    every = [column for column in _COLUMNS if column.key != _SPRINGS or any(row.get(_SPRINGS) for row in rows)]
    by_rank = sorted((column for column in every if column.name), key=lambda column: column.rank)
    # the list of measures shrinks first, then columns go
    attempts = [(0, width) for width in _FAILING_WIDTHS]
    attempts += [(count, _FAILING_WIDTHS[-1]) for count in range(1, len(by_rank) + 1)]
    for count, failing_width in attempts:
        left_out = [column.name for column in by_rank[:count]]
        columns = [column for column in every if not column.name or column.name not in left_out]
        table = _rows_table(rows, columns, failing_width, title, console, with_pair=with_pair)
        if Measurement.get(console, unbounded, table).maximum <= console.width:
            break
    console.print(table)
    if left_out:
        _say(console, f"no room for: {', '.join(left_out)}")


def _rows_table(
    rows: Sequence[Record],
    columns: Sequence[_Column],
    failing_width: int,
    title: str,
    console: Console,
    *,
    with_pair: bool,
) -> Table:
    table = _table(console, title=title)
    if with_pair:
        table.add_column("rail, wheel", no_wrap=True)
    for column in columns:
        table.add_column(column.heading, justify="left" if column.left else "right", no_wrap=True)
    for row in rows:
        pair = [_pair_text(row)] if with_pair else []
        table.add_row(*pair, *(_cell(row, column, failing_width) for column in columns), style=_row_style(row))
    return table


def _pair_text(row: Record) -> str:
    inclination = float(row.get("inclination_rad") or 0.0)
    inclined = f" 1:{1.0 / math.tan(inclination):.3g}" if inclination else ""
    return f"rail {row['rail']}{inclined}, wheel {row['wheel']}"


def _cell(row: Record, column: _Column, failing_width: int) -> str:
    value = row.get(column.key)
    if column.key == "verdict" and row["status"] != "converged":
        # what must not be used has no verdict
        status = str(row["status"])
        return "failed" if status.startswith("failed") else _SHORT_STATUS.get(status, status)
    if column.key == "verdict_failing":
        return _failing(str(value or "").split(), row.get("verdict_measure"), failing_width)
    return "-" if _missing(value) else column.form.format(value)


_SHORT_STATUS = {"patch at the edge of the fine mesh": "at edge", "not converged": "not conv."}


def _failing(measures: Sequence[str], decided: str | None, width: int) -> str:
    """Short names of the measures that fail, the one that decided first; those that find no room are counted."""
    names = [WORDS[measure].short for measure in sorted(measures, key=lambda measure: measure != decided)]
    for shown in range(len(names), 0, -1):
        more = [f"+{len(names) - shown}"] if shown < len(names) else []
        text = " ".join((*names[:shown], *more))
        if len(text) <= width:
            return text
    return ""


def _row_style(row: Record) -> str:
    return "" if row["status"] == "converged" else "red"


def print_case(record: Record, *, console: Console | None = None) -> None:
    """Print a result record: touch points, all measures of both solutions, warnings."""
    console = console or _console()
    _print_touch_points(record, console)
    for side in record["verdict"]["sides"]:
        _print_measures(record, side, console)
    _print_lobes(record, console)
    _print_multi_hertz(record["theories"]["multi_hertz"], console)
    _print_ladder(record, console)
    _print_verdict(record, console)
    _say(
        console,
        f"beside the verdict: L2 difference of the pressures {1e2 * record['pressure_l2']:.1f} %, overlap of the"
        f" patches {record['overlap']:.3f}",
    )
    misfit = record["solver"]["misfit"]
    _say(console, f"the elements' own nodes carry {1e2 * misfit:.1f} % of the load elsewhere: they are coarser")
    _say(
        console,
        f"normal force {record['normal_force_N'] / 1e3:.3f} kN,"
        f" Hertz stiffness {record['hertz_stiffness_GN_per_m15']:.2f} GN/m^1.5",
    )
    if record["creep"] is not None:
        print_creep(record["creep"], console)
    peaks = record["von_mises"].items()
    _say(
        console,
        "largest von Mises stress: "
        + ", ".join(
            f"{name} {p['von_mises_MPa']:.0f} MPa {p['depth_mm']:.2f} mm below its surface" for name, p in peaks
        ),
    )
    _print_work(record["solver"], console)
    _print_warnings({"warnings": [*record["verdict"]["warnings"], *record["warnings"]]}, console)


def _print_measures(record: Record, side: Record, console: Console) -> None:
    """Print all measures beside Hertz with the curvature on one side of the touch point, those that decide first."""
    limits, each = record["verdict"]["limits"], side["each"]
    by = "" if side["side"] == "both" else f", with the curvature of the {side['side']} side"
    table = _table(console, title=f"Hertz against finite elements{by}")
    for heading in ("measure", "FE", "Hertz", "deviation", "±", "limit", "answer"):
        # where there is no room, the names take two lines
        table.add_column(
            heading, justify="left" if heading in ("measure", "answer") else "right", no_wrap=heading != "measure"
        )
    for name in (*limits, *(name for name in WORDS if name not in limits)):
        words, deviation = WORDS[name], side["deviation"].get(name)
        if name in side["hertz"]:
            values = (_number(record["fe"][name]), _number(side["hertz"][name]))
        else:
            # there is nothing of it in Hertz's ellipse
            values = (words.off(deviation).removesuffix(words.off_unit).strip(), "0")
        table.add_row(
            words.title,
            *values,
            words.off(deviation),
            words.off(side["uncertainty"].get(name), size=True),
            words.limit(limits[name]) if name in limits else "",
            each.get(name, "not judged"),
            style=_ANSWER_STYLES.get(each.get(name, ""), "dim"),
        )
    console.print(table)


_ANSWER_STYLES = {"HOLDS": "", "UNRESOLVED": "yellow", "FAILS": "red"}


def _print_lobes(record: Record, console: Console) -> None:
    lobes, pieces = record["lobes"], record["pieces"]
    counts = f"{len(lobes)} {'lobe' if len(lobes) == 1 else 'lobes'}, {pieces} {'patch' if pieces == 1 else 'patches'}"
    table = _table(console, title=counts)
    for heading in ("lobe", "place across\nmm", "peak\nMPa", "of the force\n%"):
        table.add_column(heading, justify="right")
    for number, lobe in enumerate(lobes, start=1):
        part = 1e2 * lobe["force_share"]
        table.add_row(str(number), f"{lobe['y_mm']:+z.1f}", f"{lobe['p_max_MPa']:.0f}", f"{part:.1f}")
    console.print(table)


def _print_multi_hertz(theory: Record, console: Console) -> None:
    """Say what ellipses at several touch points come to; with a single one it is Hertz."""
    if "problem" in theory:
        _say(console, f"no ellipses that share the load: {theory['problem']}")
        return
    if len(theory["patches"]) < 2:
        return
    parts = ", ".join(
        f"{one['normal_force_N'] / 1e3:.1f} kN at y = {one['touch_rail_y_mm']:+z.1f} mm" for one in theory["patches"]
    )
    verdict = theory["verdict"]
    off = ", ".join(f"{WORDS[name].name} {WORDS[name].off(theory['deviation'].get(name))}" for name in verdict["each"])
    overlap = "; the ellipses overlap" if theory["overlapping"] else ""
    _say(
        console, f"Hertz at every touch point, as springs side by side ({parts}): {verdict['verdict']}; {off}{overlap}"
    )


def _print_verdict(record: Record, console: Console) -> None:
    """Print the answer, what decided it and why, on which meshes, and what would decide an open one."""
    verdict = record["verdict"]
    answer, measure, each = verdict["verdict"], verdict["measure"], verdict["each"]
    # the side whose verdict it is, that of the field side where both are the same
    side = next(s for s in reversed(verdict["sides"]) if (s["each"], s["measure"]) == (each, measure))
    words = WORDS[measure]
    said = f"{words.off(side['deviation'].get(measure))} ± {words.off(side['uncertainty'].get(measure), size=True)}"
    at = "" if side["side"] == "both" else f" with the curvature of the {side['side']} side"
    by = {"HOLDS": "nearest to its limit", "FAILS": "furthest beyond its limit"}.get(each[measure], "open")
    because = f"; because: {verdict['cause']}" if verdict["cause"] else ""
    _say(
        console,
        f"verdict: Hertz {answer}{at}; {by}: {words.name} ({said}, limit {words.limit(verdict['limits'][measure])})"
        f"{because}",
    )
    for kind, head in (("FAILS", "he fails by"), ("UNRESOLVED", "open are")):
        found = [name for name, one in each.items() if one == kind]
        # the measure that is open is named already
        if found and found != [measure] * (kind == "UNRESOLVED"):
            _say(console, f"{head}: {names_text(found)}")
    elements = [f"{count:.1f}" for count in record["solver"]["elements_a_semi_axis"]]
    refined = {2: "not refined", 3: "refined once"}.get(len(elements), "refined twice")
    state = "open" if answer == "UNRESOLVED" else "decided"
    meshes = f"{', '.join(elements[:-1])} and {elements[-1]}"
    _say(console, f"{state} on {len(elements)} meshes of {meshes} elements a semi-axis, {refined}")
    if verdict["unknown"]:
        _say(console, unknown_text(verdict["unknown"]))
    elif answer == "UNRESOLVED":
        _say(console, _what_would_decide(record, side, measure))


def _what_would_decide(record: Record, side: Record, measure: str) -> str:
    if record["status"] != "converged":
        return f"the result must not be used: {record['status']}"
    of_points = (record["uncertainty_of_profile"] or {}).get(measure, 0.0)
    # a NaN is not less
    if not of_points < 0.5 * side["uncertainty"][measure]:
        left = WORDS[measure].off(of_points, size=True)
        return (
            f"finer meshes would hardly decide it: points of the profiles leave {left} open; give profiles with less"
            " noise, or closer points"
        )
    case, solver, names = record["case"], record["solver"], list(RESOLUTIONS)
    if case["resolution"] in names[:-1]:
        finer = f"--resolution {' or '.join(names[names.index(case['resolution']) + 1 :])}"
    else:
        finer = f"--resolution with sizes below {','.join(f'{size:.3g}' for size in solver['element_size_mm'])}"
    more = solver["finer_degrees_of_freedom"]
    limit = f", or --refine-degrees-of-freedom {more}" if more > case["refine_degrees_of_freedom"] else ""
    return f"to decide it: {finer}{limit}"


def _print_ladder(record: Record, console: Console) -> None:
    table = _table(console, title="Ladder")
    for heading in ("rung", "p_max\nMPa", "area\nmm²", "approach\nmm"):
        table.add_column(heading, justify="left" if heading == "rung" else "right")
    for name, rung in record["rungs"].items():
        table.add_row(name.replace("_", " "), *(_number(rung[m]) for m in ("p_max_MPa", "area_mm2", "approach_mm")))
    console.print(table)


def _print_work(solver: Record, console: Console) -> None:
    degrees = ", ".join(f"{name} {count}" for name, count in solver["degrees_of_freedom"].items())
    _say(
        console,
        f"solver {solver['path']}: degrees of freedom {degrees}; {solver['iterations']} iterations, residuals contact"
        f" {solver['contact_residual']:.0e}, penetration {solver['penetration_residual']:.0e}, load balance"
        f" {solver['load_balance']:.0e}",
    )
    table = _table(console, title="Time and memory")
    for heading in ("step", "time\ns", "memory after\nMB"):
        table.add_column(heading, justify="left" if heading == "step" else "right")
    for step, seconds in solver["seconds"].items():
        table.add_row(step, f"{seconds:.2f}", f"{solver['memory_MB'][step]:.0f}")
    table.add_row("all (memory: peak)", f"{sum(solver['seconds'].values()):.2f}", f"{solver['peak_memory_MB']:.0f}")
    console.print(table)


def print_hertz(record: Record, *, console: Console | None = None) -> None:
    """Print a Hertz record: touch points and the ellipse of each, and of each side of a junction."""
    console = console or _console()
    _print_touch_points(record, console)
    table = _table(console, title="Hertz's ellipse, each with the whole load")
    for heading in (
        "point",
        "side",
        "F_n\nkN",
        "p0\nMPa",
        "a\nmm",
        "b\nmm",
        "turned\nmrad",
        "area\nmm²",
        "approach\nmm",
    ):
        table.add_column(heading, justify="left" if heading == "side" else "right")
    keys = ("p_max_MPa", "a_mm", "b_mm", "orientation_rad", "area_mm2", "approach_mm")
    forms = ("{:.1f}", "{:.3f}", "{:.3f}", "{:+z.1f}", "{:.2f}", "{:.5f}")
    for ellipse in record["ellipses"]:
        point = str(ellipse["touch_point"] + 1)
        if "problem" in ellipse:
            table.add_row(point, ellipse["side"], *["-"] * (len(keys) + 1))
            continue
        values = [1e3 * ellipse[key] if key == "orientation_rad" else ellipse[key] for key in keys]
        cells = (form.format(value) for form, value in zip(forms, values, strict=True))
        table.add_row(point, ellipse["side"], f"{ellipse['normal_force_N'] / 1e3:.3f}", *cells)
    console.print(table)
    _print_shared(record["shared"], console)
    for ellipse in record["ellipses"]:
        if "problem" in ellipse:
            _say(console, f"point {ellipse['touch_point'] + 1}, {ellipse['side']} side: {ellipse['problem']}")
    _print_warnings(record, console)


def _print_shared(shared: Record, console: Console) -> None:
    if len(shared["ellipses"]) < 2:
        return
    parts = (
        f"point {e['touch_point'] + 1} {e['normal_force_N'] / 1e3:.1f} kN, p0 {e['p_max_MPa']:.0f} MPa"
        for e in shared["ellipses"]
    )
    overlap = "; but their ellipses overlap: they are one patch" if shared["overlapping"] else ""
    _say(console, f"As springs side by side they share the load: {'; '.join(parts)}{overlap}.")


def _print_touch_points(record: Record, console: Console) -> None:
    table = _table(console, title="Touch points (radii positive where convex)")
    headings: tuple[str, ...] = ("point", "y rail\nmm", "y wheel\nmm", "angle\nmrad", "gap\nmm", "side")
    headings += ("R rail\nmm", "R wheel\nacross mm", "R wheel\nrolling mm")
    for heading in headings:
        table.add_column(heading, justify="left" if heading == "side" else "right")
    for number, touch in enumerate(record["touch_points"], start=1):
        position: tuple[str, ...] = (
            str(number),
            f"{touch['rail_y_mm']:+z.3f}",
            f"{touch['wheel_y_mm']:+z.3f}",
            f"{1e3 * touch['contact_angle_rad']:+z.2f}",
            f"{touch['vertical_gap_mm']:.4f}",
        )
        for curvature in touch["curvatures"]:
            radii = (curvature[f"{name}_radius_mm"] for name in ("rail", "wheel_lateral", "wheel_rolling"))
            table.add_row(*position, curvature["side"], *("straight" if r is None else f"{r:.1f}" for r in radii))
            position = ("",) * len(position)
    console.print(table)


def _print_warnings(record: Record, console: Console) -> None:
    for warning in record["warnings"]:
        _say(console, f"note: {warning}")


def print_library(*, folder: Path | None = None, console: Console | None = None) -> None:
    """Print the profiles of the library and files of a folder, and what else may be given in place of a name."""
    from rich.text import Text

    from fecontact.profiles.library import load, names

    console = console or _console()
    table = _table(console, title="Profile library")
    for heading in ("name", "kind", "y from\nmm", "y to\nmm", "junctions", "certainty", "source"):
        table.add_column(heading, justify="left" if heading in ("name", "kind", "certainty", "source") else "right")
    for name in names():
        profile = load(name)
        low, high = profile.y_range_mm
        source = Text(profile.source)  # not as markup: sources may have brackets
        table.add_row(
            name, profile.kind, f"{low:.1f}", f"{high:.1f}", str(len(profile.junctions)), profile.certainty, source
        )
    for path in sorted(folder.iterdir()) if folder is not None and folder.is_dir() else ():
        if path.is_file():
            table.add_row(path.stem, "", "", "", "", "", Text(f"file {path.name} of {folder}"))
    console.print(table)
    _say(
        console, "Also: circle:R and arcs:R/R@D (rails), cylinder:R (wheel), all in mm, or the path of a profile file."
    )


def print_profile(profile: Profile, *, console: Console | None = None) -> None:
    """Print the segments and the junctions of a profile."""
    console = console or _console()
    low, high = profile.y_range_mm
    _say(console, f"{profile.kind} {profile.name}: y from {low:.3f} to {high:.3f} mm, {profile.length_mm:.2f} mm long")
    if profile.source:
        _say(console, f"source: {profile.source}")
    for note in profile.notes:
        _say(console, f"note: {note}")
    console.print(_segment_table(profile, console))
    table = _table(console, title="Junctions (radii positive where convex)")
    for heading in ("y mm", "z mm", "R before mm", "R after mm", "kink mrad"):
        table.add_column(heading, justify="right")
    for junction in profile.junctions:
        kink = math.remainder(junction.angle_right_rad - junction.angle_left_rad, math.tau)
        radii = (_radius(junction.curvature_left_per_mm), _radius(junction.curvature_right_per_mm))
        table.add_row(f"{junction.y_mm:.4f}", f"{junction.z_mm:.4f}", *radii, f"{1e3 * kink:z.3f}")
    console.print(table)


def _segment_table(profile: Profile, console: Console) -> Table:
    import numpy as np

    table = _table(console, title="Running surface, from the gauge side to the field side")
    for heading in ("segment", "kind", "y from mm", "y to mm", "z from mm", "z to mm", "R mm"):
        table.add_column(heading, justify="left" if heading == "kind" else "right")
    for number, segment in enumerate(profile.segments, start=1):
        ends = segment.evaluate(np.array([0.0, 1.0]))
        positions = (f"{float(value):.4f}" for value in (*ends.y, *ends.z))
        table.add_row(str(number), type(segment).__name__.lower(), *positions, _segment_radius(segment))
    return table


def _segment_radius(segment: Segment) -> str:
    if isinstance(segment, Line):
        return "straight"
    return f"{segment.radius:.4g}" if isinstance(segment, Arc) else "varies"


def _radius(curvature_per_mm: float) -> str:
    return "straight" if abs(curvature_per_mm) < 1e-9 else f"{1.0 / curvature_per_mm:.2f}"


def _number(value: float | None, form: str = "{:.5g}") -> str:
    return "-" if value is None or _missing(value) else form.format(value)


def _console() -> Console:
    """Standard output: as wide as the terminal, or `_PLAIN_WIDTH` and without any colour where there is none."""
    from rich.console import Console

    console = Console(highlight=False)
    return console if console.is_terminal else Console(width=_PLAIN_WIDTH, no_color=True, highlight=False)


def _table(console: Console, *, title: str) -> Table:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    return Table(
        title=Text(title),
        title_justify="left",
        title_style="bold",
        box=box.SIMPLE_HEAD if console.is_terminal else None,
        # the box has a space between columns as well
        padding=(0, 1) if not console.is_terminal or console.width >= _ROOMY_WIDTH else (0, 1, 0, 0),
        pad_edge=False,
    )


def _say(console: Console, text: str) -> None:
    # not as markup: profile names and notes may have brackets
    console.print(text, markup=False, soft_wrap=not console.is_terminal)
