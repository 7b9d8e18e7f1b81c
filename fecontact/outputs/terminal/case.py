"""One solved case on the terminal: touch points, measures, lobes, ladder, verdict, time and memory."""

from __future__ import annotations

from fecontact.comparison.theories import THEORIES
from fecontact.outputs.tables.cases import (
    effort_table,
    elements_table,
    hertz_tables,
    ladder_table,
    lobe_table,
    plastic_tables,
    theories_table,
)
from fecontact.outputs.tables.table import Record
from fecontact.outputs.terminal.console import Lines, notes
from fecontact.outputs.terminal.creep import creep_lines
from fecontact.outputs.terminal.hertz import touch_point_table
from fecontact.outputs.words.measures import names_text, unknown_text
from fecontact.outputs.words.verdicts import plastic_words, reason_of_record, what_would_decide


def case_lines(record: Record) -> Lines:
    """A result record: touch points, all measures of both solutions, verdict, work, warnings."""
    yield from (touch_point_table(record), *hertz_tables(record), lobe_table(record), theories_table(record))
    for name, theory in record["theories"].items():
        if theory.get("notes"):
            yield f"{THEORIES[name].words} is {theory['status']}: {'; '.join(theory['notes'])}"
    yield from (ladder_table(record), *plastic_tables(record), elements_table(record))
    yield from _verdict_lines(record)
    yield (
        f"beside the verdict: L2 difference of the pressures {1e2 * record['pressure_l2']:.1f} %, overlap of the"
        f" patches {record['overlap']:.3f}"
    )
    solver, off = record["solver"], record["solver"]["elements_compliance_error"]
    yield (
        f"the elements' own nodes carry {1e2 * solver['misfit']:.1f} % of the load elsewhere: they are coarser; their"
        f" compliance is {'not seen' if off is None else f'{1e2 * off:+.1f} % off that of a half-space'}"
    )
    yield (
        f"normal force {record['normal_force_N'] / 1e3:.3f} kN,"
        f" Hertz stiffness {record['hertz_stiffness_GN_per_m15']:.2f} GN/m^1.5"
    )
    if record["creep"] is not None:
        yield from creep_lines(record["creep"])
    yield "largest von Mises stress: " + ", ".join(
        f"{name} {peak['von_mises_MPa']:.0f} MPa {peak['depth_mm']:.2f} mm below its surface"
        for name, peak in record["von_mises"].items()
    )
    degrees = ", ".join(f"{name} {count}" for name, count in solver["degrees_of_freedom"].items())
    yield (
        f"solver {solver['path']}: degrees of freedom {degrees}; {solver['iterations']} iterations, residuals contact"
        f" {solver['contact_residual']:.0e}, penetration {solver['penetration_residual']:.0e}, load balance"
        f" {solver['load_balance']:.0e}"
    )
    yield effort_table(solver)
    yield from notes([*record["verdict"]["warnings"], *record["warnings"]])


def _verdict_lines(record: Record) -> Lines:
    """The answer, what decided it and why, on which meshes, and what would decide an open one."""
    verdict = record["verdict"]
    answer, measure = verdict["verdict"], verdict["measure"]
    yield f"verdict: Hertz {answer}; {reason_of_record(record)}"
    for kind, head in (("FAILS", "it fails by"), ("UNRESOLVED", "open are")):
        found = [name for name, one in verdict["each"].items() if one == kind]
        # the measure that is open is named already
        if found and found != [measure] * (kind == "UNRESOLVED"):
            yield f"{head}: {names_text(found)}"
    elements = [f"{count:.1f}" for count in record["solver"]["elements_a_semi_axis"]]
    times = len(elements) - 2
    refined = ("not refined", "refined once", "refined twice")[times] if times < 3 else f"refined {times} times"
    state = "open" if answer == "UNRESOLVED" else "decided"
    meshes = f"{', '.join(elements[:-1])} and {elements[-1]}"
    yield f"{state} on {len(elements)} meshes of {meshes} elements a semi-axis, {refined}"
    by_elements = record["verdict_elements"]["verdict"]
    more = "; --evidence refines until they know" * (by_elements == "UNRESOLVED" and not record["case"]["evidence"])
    yield f"the elements by themselves, on their own nodes: Hertz {by_elements}{more}"
    if plastic := plastic_words(record):
        yield plastic
    if verdict["unknown"]:
        yield unknown_text(verdict["unknown"])
    elif answer == "UNRESOLVED":
        yield what_would_decide(record)
