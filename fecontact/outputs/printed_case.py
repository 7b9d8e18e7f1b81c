"""One solved case on the terminal: touch points, measures, lobes, ladder, verdict, time and memory."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fecontact.case import RESOLUTIONS
from fecontact.comparison.theories import THEORIES
from fecontact.outputs.creep import print_creep
from fecontact.outputs.measure_words import WORDS, names_text, unknown_text
from fecontact.outputs.printed_hertz import print_touch_points
from fecontact.outputs.terminal import number_text, print_notes, say, standard_console, titled_table

if TYPE_CHECKING:
    from rich.console import Console

Record = Mapping[str, Any]


def print_case(record: Record, *, console: Console | None = None) -> None:
    """Print a result record: touch points, all measures of both solutions, warnings."""
    console = console or standard_console()
    print_touch_points(record, console)
    for side in record["verdict"]["sides"]:
        _print_measures(record, side, console)
    _print_lobes(record, console)
    _print_theories(record, console)
    _print_ladder(record, console)
    _print_verdict(record, console)
    say(
        console,
        f"beside the verdict: L2 difference of the pressures {1e2 * record['pressure_l2']:.1f} %, overlap of the"
        f" patches {record['overlap']:.3f}",
    )
    solver, off = record["solver"], record["solver"]["elements_compliance_error"]
    say(
        console,
        f"the elements' own nodes carry {1e2 * solver['misfit']:.1f} % of the load elsewhere: they are coarser; their"
        f" compliance is {'not seen' if off is None else f'{1e2 * off:+.1f} % off that of a half-space'}",
    )
    say(
        console,
        f"normal force {record['normal_force_N'] / 1e3:.3f} kN,"
        f" Hertz stiffness {record['hertz_stiffness_GN_per_m15']:.2f} GN/m^1.5",
    )
    if record["creep"] is not None:
        print_creep(record["creep"], console)
    peaks = record["von_mises"].items()
    say(
        console,
        "largest von Mises stress: "
        + ", ".join(
            f"{name} {p['von_mises_MPa']:.0f} MPa {p['depth_mm']:.2f} mm below its surface" for name, p in peaks
        ),
    )
    _print_work(record["solver"], console)
    print_notes([*record["verdict"]["warnings"], *record["warnings"]], console)


def _print_measures(record: Record, side: Record, console: Console) -> None:
    """Print all measures beside Hertz with the curvature on one side of the touch point, those that decide first."""
    limits, each = record["verdict"]["limits"], side["each"]
    by = "" if side["side"] == "both" else f", with the curvature of the {side['side']} side"
    table = titled_table(console, title=f"Hertz against finite elements{by}")
    for heading in ("measure", "FE", "Hertz", "deviation", "±", "limit", "answer"):
        # where there is no room, the names take two lines
        table.add_column(
            heading, justify="left" if heading in ("measure", "answer") else "right", no_wrap=heading != "measure"
        )
    for name in (*limits, *(name for name in WORDS if name not in limits)):
        words, deviation = WORDS[name], side["deviation"].get(name)
        if name in side["hertz"]:
            values = (number_text(record["fe"][name]), number_text(side["hertz"][name]))
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
    table = titled_table(console, title=counts)
    for heading in ("lobe", "place across\nmm", "peak\nMPa", "of the force\n%"):
        table.add_column(heading, justify="right")
    for number, lobe in enumerate(lobes, start=1):
        part = 1e2 * lobe["force_share"]
        table.add_row(str(number), f"{lobe['y_mm']:+z.1f}", f"{lobe['p_max_MPa']:.0f}", f"{part:.1f}")
    console.print(table)


def _print_theories(record: Record, console: Console) -> None:
    """Print the verdict on every theory of the pressure, and why one has no contact."""
    table = titled_table(console, title="Theories of the contact, the cheapest first")
    for heading in ("theory", "p_max\ndev %", "area\ndev %", "part of\na limit", "decided by", "verdict"):
        table.add_column(heading, justify="right" if "\n" in heading else "left")
    for name, theory in record["theories"].items():
        if "problem" in theory:
            table.add_row(THEORIES[name].words, "", "", "", theory["problem"], "none", style="dim")
            continue
        verdict, off = theory["verdict"], theory["deviation"]
        table.add_row(
            THEORIES[name].words,
            *(f"{1e2 * off[measure]:+z.1f}" for measure in ("p_max_MPa", "area_mm2")),
            f"{theory['limit_used']:.2f}",
            WORDS[verdict["measure"]].name,
            verdict["verdict"],
            style=_ANSWER_STYLES.get(verdict["verdict"], ""),
        )
    console.print(table)
    for name, theory in record["theories"].items():
        if theory.get("notes"):
            say(console, f"{THEORIES[name].words} is {theory['status']}: {'; '.join(theory['notes'])}")


def _print_verdict(record: Record, console: Console) -> None:
    """Print the answer, what decided it and why, on which meshes, and what would decide an open one."""
    verdict = record["verdict"]
    answer, measure, each = verdict["verdict"], verdict["measure"], verdict["each"]
    side = _deciding_side(verdict)
    words = WORDS[measure]
    said = f"{words.off(side['deviation'].get(measure))} ± {words.off(side['uncertainty'].get(measure), size=True)}"
    at = "" if side["side"] == "both" else f" with the curvature of the {side['side']} side"
    by = {"HOLDS": "nearest to its limit", "FAILS": "furthest beyond its limit"}.get(each[measure], "open")
    because = f"; because: {verdict['cause']}" if verdict["cause"] else ""
    say(
        console,
        f"verdict: Hertz {answer}{at}; {by}: {words.name} ({said}, limit {words.limit(verdict['limits'][measure])})"
        f"{because}",
    )
    for kind, head in (("FAILS", "he fails by"), ("UNRESOLVED", "open are")):
        found = [name for name, one in each.items() if one == kind]
        # the measure that is open is named already
        if found and found != [measure] * (kind == "UNRESOLVED"):
            say(console, f"{head}: {names_text(found)}")
    elements = [f"{count:.1f}" for count in record["solver"]["elements_a_semi_axis"]]
    refined = {2: "not refined", 3: "refined once"}.get(len(elements), "refined twice")
    state = "open" if answer == "UNRESOLVED" else "decided"
    meshes = f"{', '.join(elements[:-1])} and {elements[-1]}"
    say(console, f"{state} on {len(elements)} meshes of {meshes} elements a semi-axis, {refined}")
    if verdict["unknown"]:
        say(console, unknown_text(verdict["unknown"]))
    elif answer == "UNRESOLVED":
        say(console, what_would_decide(record))


def _deciding_side(verdict: Record) -> Record:
    """The side whose verdict it is, that of the field side where both are the same."""
    decided = (verdict["each"], verdict["measure"])
    side: Record = next(s for s in reversed(verdict["sides"]) if (s["each"], s["measure"]) == decided)
    return side


def what_would_decide(record: Record) -> str:
    """What decides an open verdict: finer meshes, or better profiles."""
    side, measure = _deciding_side(record["verdict"]), record["verdict"]["measure"]
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
    table = titled_table(console, title="Ladder")
    for heading in ("rung", "p_max\nMPa", "area\nmm²", "approach\nmm"):
        table.add_column(heading, justify="left" if heading == "rung" else "right")
    for name, rung in record["rungs"].items():
        # the other rungs of the same nodes are no better known than what is judged
        unsure = record["elements_uncertainty"] if name == "elements" else {}
        table.add_row(
            name.replace("_", " "),
            *(
                number_text(rung[m]) + (f" ± {1e2 * unsure[m]:.1f} %" if m in unsure else "")
                for m in ("p_max_MPa", "area_mm2", "approach_mm")
            ),
        )
    console.print(table)


def _print_work(solver: Record, console: Console) -> None:
    degrees = ", ".join(f"{name} {count}" for name, count in solver["degrees_of_freedom"].items())
    say(
        console,
        f"solver {solver['path']}: degrees of freedom {degrees}; {solver['iterations']} iterations, residuals contact"
        f" {solver['contact_residual']:.0e}, penetration {solver['penetration_residual']:.0e}, load balance"
        f" {solver['load_balance']:.0e}",
    )
    table = titled_table(console, title="Time and memory")
    for heading in ("step", "time\ns", "memory after\nMB"):
        table.add_column(heading, justify="left" if heading == "step" else "right")
    for step, seconds in solver["seconds"].items():
        table.add_row(step, f"{seconds:.2f}", f"{solver['memory_MB'][step]:.0f}")
    table.add_row("all (memory: peak)", f"{sum(solver['seconds'].values()):.2f}", f"{solver['peak_memory_MB']:.0f}")
    console.print(table)
