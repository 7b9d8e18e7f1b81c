"""One case in parts: the answer, how far Hertz is off, the theories, and all that is behind it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fecontact.comparison.theories import EITHER_SIDE, HERTZ_GAUGE, THEORIES
from fecontact.outputs.documents.parts import Details, Items, Part
from fecontact.outputs.tables.cases import (
    effort_table,
    elements_table,
    ladder_table,
    lobes_table,
    measures_table,
    peaks_table,
    plastic_tables,
    theories_table,
)
from fecontact.outputs.tables.table import Record
from fecontact.outputs.terminal.creep import creep_lines
from fecontact.outputs.terminal.hertz import touch_point_table
from fecontact.outputs.words.measures import names_text, unknown_text
from fecontact.outputs.words.verdicts import cheapest_text, deciding, plastic_words, reason_of_record, what_would_decide


def case_parts(record: Record, title: str = "") -> list[Part]:
    """A result record, or that of a cell: what a user looks at first, and what is shown on demand."""
    measures = measures_table(record, deciding(record), judged_only=True)
    lobes = [lobes_table(record)] if record["lobes"] else []
    return [
        *_answer_lines(record, title),
        measures,
        *lobes,
        *_theories(record),
        Items([*record["verdict"]["warnings"], *record.get("warnings", ())]),
        Details("All measures", list(_details(record))),
    ]


def _answer_lines(record: Record, title: str) -> Iterator[str]:
    """What was asked, the answer, what decided it and why, and what would decide an open one."""
    verdict = record["verdict"]
    yield f"{title}:" if title else ""
    yield f"Hertz {verdict['answer']}; {reason_of_record(record)}"
    others = [name for name in verdict["failing"] if name != verdict["measure"]]
    yield f"it fails by {names_text(others)} as well" if others else ""
    open_ones = [name for name, one in verdict["each"].items() if one == "UNRESOLVED" and name != verdict["measure"]]
    yield f"open are {names_text(open_ones)} as well" if open_ones else ""
    yield plastic_words(record)
    if verdict["unknown"]:
        yield unknown_text(verdict["unknown"])
    elif verdict["answer"] == "UNRESOLVED":
        yield what_would_decide(record)


def _theories(record: Record) -> Iterator[str]:
    """The cheapest theory that holds, and in a line how every other one does."""
    yield cheapest_text(record)
    judged = {name: one for name, one in record["theories"].items() if name != HERTZ_GAUGE and "verdict" in one}
    by_answer: dict[str, list[str]] = {}
    for name, one in judged.items():
        answer = record["verdict"]["answer"] if name in EITHER_SIDE else one["verdict"]["answer"]
        range_ = " (out of its range)" if one["status"] == "out of range" and name not in EITHER_SIDE else ""
        by_answer.setdefault(answer, []).append(f"{THEORIES[name].words}{range_}")
    yield "; ".join(f"{answer}: {', '.join(names)}" for answer, names in by_answer.items())


def _details(record: Record) -> Iterator[Part]:
    """Everything else that is known of a case."""
    if "touch_points" in record:
        yield touch_point_table(record)
    for name in (name for name in EITHER_SIDE if name in record["theories"]):
        by = f", with the curvature of the {'gauge' if name == HERTZ_GAUGE else 'field'} side"
        title = f"Hertz against finite elements{by if HERTZ_GAUGE in record['theories'] else ''}"
        yield measures_table(record, record["theories"][name], title)
    for name, theory in record["theories"].items():
        if name not in EITHER_SIDE and "verdict" in theory:
            yield measures_table(record, theory, THEORIES[name].words, "theory")
    yield peaks_table(record)
    yield theories_table(record)
    yield Items(
        [
            f"{THEORIES[name].words} is {theory['status']}: {'; '.join(theory['notes'])}"
            for name, theory in record["theories"].items()
            if theory.get("notes")
        ]
    )
    yield ladder_table(record)
    yield from plastic_tables(record)
    yield elements_table(record)
    yield from _meshes(record)
    if "creep" in record:
        yield from creep_lines(record["creep"])
    if "von_mises" in record:
        yield "largest von Mises stress: " + ", ".join(
            f"{name} {peak['von_mises_MPa']:.0f} MPa {peak['depth_mm']:.2f} mm below its surface"
            for name, peak in record["von_mises"].items()
        )
    if "seconds" in record["solver"]:
        yield effort_table(record["solver"])


def _meshes(record: Record) -> Iterator[str]:
    """On which meshes it was decided, how far the elements' own contact goes with it, and how well it was solved."""
    elements, solver = record["elements"], record["solver"]
    yield f"{_state(record['verdict']['answer'])} on {refinement(solver['elements_a_semi_axis'])}"
    answer = elements["hertz"]["verdict"]["answer"]
    asked = record.get("case", {}).get("evidence", True)
    more = "; --evidence refines until they know" * (answer == "UNRESOLVED" and not asked)
    yield f"the elements by themselves, on their own nodes: Hertz {answer}{more}"
    yield (
        f"beside the verdict: L2 difference of the pressures {1e2 * record['pressure_l2']:.1f} %, overlap of the"
        f" patches {record['overlap']:.3f}"
    )
    off = elements["compliance_error"]
    yield (
        f"the elements' own nodes carry {1e2 * elements['misfit']:.1f} % of the load elsewhere: they are coarser; their"
        f" compliance is {'not seen' if off is None else f'{1e2 * off:+.1f} % off that of a half-space'}"
    )
    yield (
        f"normal force {record['normal_force_N'] / 1e3:.3f} kN, Hertz stiffness"
        f" {record['theories']['hertz']['stiffness_GN_per_m15']:.2f} GN/m^1.5"
    )
    degrees = ", ".join(f"{name} {count}" for name, count in solver["degrees_of_freedom"].items())
    yield (
        f"solver {solver.get('path', '')}: degrees of freedom {degrees}; {solver['iterations']} iterations, residuals"
        f" contact {solver['contact_residual']:.0e}, penetration {solver['penetration_residual']:.0e}, load balance"
        f" {solver['load_balance']:.0e}"
    )


def _state(answer: str) -> str:
    return "open" if answer == "UNRESOLVED" else "decided"


def refinement(elements_a_semi_axis: Sequence[float]) -> str:
    """Meshes by their elements, the finest first, and how often they were refined."""
    elements, times = [f"{count:.1f}" for count in elements_a_semi_axis], len(elements_a_semi_axis) - 2
    refined = ("not refined", "refined once", "refined twice")[times] if times < 3 else f"refined {times} times"
    meshes = f"{', '.join(elements[:-1])} and {elements[-1]}"
    return f"{len(elements)} meshes of {meshes} elements a semi-axis, {refined}"
