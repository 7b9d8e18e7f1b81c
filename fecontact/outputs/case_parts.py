"""Parts of the report on a case: answer, deviations of Hertz, theories and details."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fecontact.contact_theories.registry import HERTZ, HERTZ_GAUGE, HERTZ_OF_EACH_SIDE, THEORIES
from fecontact.feature_registry import load_offers
from fecontact.inputs.texts import count_text
from fecontact.outputs.budget import budget_table
from fecontact.outputs.cases import (
    effort_table,
    elements_table,
    ladder_table,
    lobes_table,
    measures_table,
    numbers_table,
    peaks_table,
    plastic_tables,
    theories_table,
)
from fecontact.outputs.hertz_terminal import contact_point_table
from fecontact.outputs.pair_geometry import pair_geometry_lines
from fecontact.outputs.parts import Details, Items, Part
from fecontact.outputs.records.asked import elastic_record, requested_record
from fecontact.outputs.tables import TableRecord
from fecontact.outputs.theory_records import deciding_hertz, judged_theories
from fecontact.outputs.verdict_words import (
    AGAINST_YIELDING_BODIES,
    answer_sentence,
    cheapest_text,
    deciding_text,
    elastic_words,
    peak_range_text,
    remedy_text,
)
from fecontact.outputs.words import names_text, unknown_text


def case_parts(record: TableRecord, title: str = "", *, elements: bool = True) -> list[Part]:
    """Parts of a report on a case or cell: main results first, then details on demand.

    Parameters
    ----------
    record
        Record of a load.
    title
        Title of the answer; empty for no title.
    elements
        Whether the details include the verdict on the elements' own nodes.

    Returns
    -------
    list of Part
        Parts in order.
    """
    converted_record = requested_record(record)
    measures = measures_table(
        converted_record,
        deciding_hertz(converted_record),
        AGAINST_YIELDING_BODIES.capitalize() * _has_plastic_step(record),
        judged_only=True,
    )
    lobes = [lobes_table(record)] if record["lobes"] else []
    return [
        *pair_geometry_lines(record),
        *_answer_lines(record, title),
        measures,
        *lobes,
        *_theory_lines(record),
        *iterate_feature_answers(record),
        Items(
            [
                *record["verdict"]["warnings"],
                *(note for note in record.get("warnings", ()) if note not in profile_notes(record)),
            ]
        ),
        Details("Notes on the profiles", [Items(profile_notes(record))]),
        Details("All measures", list(_detail_parts(record, elements))),
        Details("All numbers", [numbers_table(record)]),
    ]


def profile_notes(record: TableRecord) -> list[str]:
    """Notes of a result on the files of rail and wheel.

    A line above the verdict has the geometry that a wrong reading would change, so the notes are details.
    """
    return [note for note in record.get("warnings", ()) if note.startswith(("rail: ", "wheel: "))]


def _answer_lines(record: TableRecord, title: str) -> Iterator[str]:
    """Iterate over the lines of the answer: verdict, reason and cause.

    If the verdict is unresolved, a line has the remedy.
    """
    yield f"{title}:" if title else ""
    yield answer_sentence(record)
    elastic, record = elastic_record(record), requested_record(record)
    verdict = record["verdict"]
    other_measures = [name for name in verdict["failing"] if name != verdict["measure"]]
    yield f"also failing: {names_text(other_measures)}" if other_measures else ""
    unresolved_measures = [
        name for name, answer in verdict["each"].items() if answer == "UNRESOLVED" and name != verdict["measure"]
    ]
    yield f"also unresolved: {names_text(unresolved_measures)}" if unresolved_measures else ""
    if _has_plastic_step(record):
        yield record["plastic"][HERTZ]["cancelling"]
        yield f"{elastic_words(elastic['verdict']['answer'])}; {deciding_text(elastic)}"
    yield peak_range_text(elastic["fe"])
    if verdict["unknown"]:
        yield unknown_text(verdict["unknown"])
    elif verdict["answer"] == "UNRESOLVED":
        yield remedy_text(record)


def _has_plastic_step(record: TableRecord) -> bool:
    return record["plastic"] is not None


def _theory_lines(record: TableRecord) -> Iterator[str]:
    """Iterate over two lines: the cheapest theory that holds, and the answers for all theories."""
    reference = "against elastic bodies: " * _has_plastic_step(record)
    yield f"{reference}{text}" if (text := cheapest_text(record)) else ""
    theories = {name: theory for name, theory in judged_theories(record).items() if name != HERTZ_GAUGE}
    elastic = elastic_record(record)
    by_answer: dict[str, list[str]] = {}
    for name, theory in theories.items():
        answer = elastic["verdict"]["answer"] if name in HERTZ_OF_EACH_SIDE else theory["verdict"]["answer"]
        range_part = " (out of range)" if theory["status"] == "out of range" and name not in HERTZ_OF_EACH_SIDE else ""
        by_answer.setdefault(answer, []).append(f"{THEORIES[name].words}{range_part}")
    yield reference + "; ".join(f"{answer}: {', '.join(names)}" for answer, names in by_answer.items())


def iterate_feature_answers(record: TableRecord) -> Iterator[str]:
    """Iterate over the sentences of features on the main results, such as creep forces.

    Parameters
    ----------
    record
        Record of a result.

    Yields
    ------
    str
        Sentences.
    """
    for name, telling in load_offers("TELLINGS").items():
        if record[name] is not None:
            yield from telling.answer(record[name])


def _detail_parts(record: TableRecord, elements: bool) -> Iterator[Part]:
    """Iterate over all further parts on a case."""
    if "contact_points" in record:
        yield contact_point_table(record)
    theories = judged_theories(record)
    for name in (name for name in HERTZ_OF_EACH_SIDE if name in theories):
        side_part = f", with the curvature of the {'gauge' if name == HERTZ_GAUGE else 'field'} side"
        bodies = f"{'elastic ' * _has_plastic_step(record)}finite elements"
        title = f"Hertz and {bodies}{side_part if HERTZ_GAUGE in theories else ''}"
        yield measures_table(record, record["theories"][name], title)
    for name, theory in theories.items():
        if name not in HERTZ_OF_EACH_SIDE:
            yield measures_table(record, theory, THEORIES[name].words, "theory")
    yield budget_table(record)
    yield peaks_table(record)
    yield theories_table(record)
    yield Items(
        [
            f"{THEORIES[name].words} is {theory['status']}: {'; '.join(theory['notes'])}"
            for name, theory in theories.items()
            if theory["notes"]
        ]
    )
    yield ladder_table(record)
    yield from plastic_tables(record)
    if elements:
        yield elements_table(elastic_record(record))
        yield _elements_verdict_text(record)
    yield from _mesh_lines(record)
    for name, telling in load_offers("TELLINGS").items():
        if record[name] is not None:
            yield from telling.parts(record[name])
    if "von_mises" in record:
        yield "highest von Mises stress: " + ", ".join(
            f"{name} {peak['von_mises_MPa']:.0f} MPa at a depth of {peak['depth_mm']:.2f} mm"
            for name, peak in record["von_mises"].items()
        )
    if "seconds" in record["solver"]:
        yield effort_table(record["solver"])


def _mesh_lines(record: TableRecord) -> Iterator[str]:
    """Iterate over sentences on mesh refinement, agreement of both contacts, and solver residuals.

    Texts have percentages, kN and GN/m^1.5; `record` is the record of a load with finite elements.
    """
    elements, solver = record["elements"], record["solver"]
    yield f"{_status_word(record['verdict']['answer'])} on {refinement(solver['elements_per_semi_axis'])}"
    yield (
        f"not judged: L2 difference of the pressures {1e2 * record['pressure_l2']:.1f} %, overlap of the"
        f" patches {record['overlap']:.3f}"
    )
    error = elements["compliance_error"]
    yield (
        f"on the nodes of the elements {1e2 * elements['misfit']:.1f} % of the load is at a different place; their"
        f" compliance {'is not checked' if error is None else f'differs from a half-space by {1e2 * error:+.1f} %'}"
    )
    yield (
        f"normal force {record['normal_force_N'] / 1e3:.3f} kN, Hertz stiffness"
        f" {record['theories']['hertz']['stiffness_GN_per_m15']:.2f} GN/m^1.5"
    )
    degrees = ", ".join(f"{name} {count}" for name, count in solver["degrees_of_freedom"].items())
    yield (
        f"solver {solver.get('path', '')}: degrees of freedom {degrees};"
        f" {count_text(solver['iterations'], 'iteration')}, residuals"
        f" contact {solver['contact_residual']:.0e}, penetration {solver['penetration_residual']:.0e}; balance of the"
        f" load {solver['load_balance']:.0e}, of the forces on both bodies {solver['force_balance']:.0e}, of their"
        f" moments {solver['moment_balance']:.0e}"
    )


def _elements_verdict_text(record: TableRecord) -> str:
    """Sentence on the verdict of the elements alone.

    It belongs to the contact on the elements' own nodes.
    """
    answer = record["elements"]["hertz"]["verdict"]["answer"]
    is_refined_for_evidence = record.get("case", {}).get("refine", "evidence") == "evidence"
    remedy = "; to decide, use --refine evidence" * (answer == "UNRESOLVED" and not is_refined_for_evidence)
    return f"verdict on the nodes of the elements: Hertz {answer}{remedy}"


def _status_word(answer: str) -> str:
    return "unresolved" if answer == "UNRESOLVED" else "decided"


def refinement(elements_per_semi_axis: Sequence[float]) -> str:
    """Text on the meshes by their elements per semi-axis, and on the refinements.

    Parameters
    ----------
    elements_per_semi_axis
        Elements per semi-axis of each mesh, the finest first, at least two.

    Returns
    -------
    str
        Text such as "2 meshes of 8.0 and 4.0 elements per semi-axis, not refined".

    Examples
    --------
    >>> from fecontact.outputs.case_parts import refinement
    >>> refinement([8.0, 4.0])
    '2 meshes of 8.0 and 4.0 elements per semi-axis, not refined'
    """
    elements, refinements = [f"{count:.1f}" for count in elements_per_semi_axis], len(elements_per_semi_axis) - 2
    refined = (
        ("not refined", "refined once", "refined twice")[refinements]
        if refinements < 3
        else f"refined {refinements} times"
    )
    meshes = f"{', '.join(elements[:-1])} and {elements[-1]}"
    return f"{len(elements)} meshes of {meshes} elements per semi-axis, {refined}"
