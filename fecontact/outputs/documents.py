"""A case, a study and a map told part by part, for a terminal and for `report.html`; the files of a study."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from fecontact.contact_theories.registry import EITHER_SIDE, HERTZ, HERTZ_GAUGE, THEORIES
from fecontact.criteria import Criteria
from fecontact.errors import InputError, usable
from fecontact.feature_registry import offered
from fecontact.files import read_json, write_sealed, write_text
from fecontact.outputs.case_words import roll_words_of_rows
from fecontact.outputs.cases import (
    ReportedCase,
    deviation_table,
    effort_table,
    elements_table,
    ladder_table,
    lobes_table,
    measures_table,
    numbers_table,
    peaks_table,
    plastic_tables,
    solver_table,
    theories_table,
    touch_point_table,
    verdict_of,
    verdict_table,
)
from fecontact.outputs.figures.case import ladder_figure
from fecontact.outputs.figures.position import pair_figure
from fecontact.outputs.own_profiles import geometry_line
from fecontact.outputs.pair_names import Row, pair_of_row, position_text
from fecontact.outputs.parts import Details, Heading, Items, Lead, Part, Picture, Terms
from fecontact.outputs.records.results import (
    asked_record,
    asked_row,
    theory_text,
    versions,
)
from fecontact.outputs.report_words import GLOSSARY, answer_words, lead_style, measure_terms, question, theory_terms
from fecontact.outputs.series import series
from fecontact.outputs.style import page, svg_of
from fecontact.outputs.tables import Item, Table, write_csv
from fecontact.outputs.verdict_words import (
    YIELDING,
    band_text,
    cheapest_text,
    decided,
    deciding,
    elastic_words,
    reason_of_record,
    what_would_decide,
)
from fecontact.outputs.words import names_text, unknown_text
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.curve import Profile

# --- One case in parts: the answer, how far Hertz is off, the theories, and all that is behind it.


def case_parts(record: Item, title: str = "", *, elements: bool = True) -> list[Part]:
    """Parts of a report on a case or cell: what a user looks at first, and what is shown on demand.

    The verdict on the elements' own nodes is among the details with `elements` only.
    """
    asked = asked_record(record)
    measures = measures_table(asked, deciding(asked), YIELDING.capitalize() * _yields(record), judged_only=True)
    lobes = [lobes_table(record)] if record["lobes"] else []
    return [
        *geometry_line(record),
        *_answer_lines(record, title),
        measures,
        *lobes,
        *_theories(record),
        Items([*record["verdict"]["warnings"], *record.get("warnings", ())]),
        Details("All measures", list(_details(record, elements))),
        Details("All numbers", [numbers_table(record)]),
    ]


def _answer_lines(record: Item, title: str) -> Iterator[str]:
    """What was asked, the answer, what decided it and why, and what would decide an open one."""
    elastic, record = record, asked_record(record)
    verdict, against = record["verdict"], f" {YIELDING}" * _yields(record)
    yield f"{title}:" if title else ""
    yield f"Hertz {verdict['answer']}{against}; {reason_of_record(record)}"
    others = [name for name in verdict["failing"] if name != verdict["measure"]]
    yield f"it fails by {names_text(others)} as well" if others else ""
    open_ones = [name for name, one in verdict["each"].items() if one == "UNRESOLVED" and name != verdict["measure"]]
    yield f"open are {names_text(open_ones)} as well" if open_ones else ""
    if against:
        yield record["plastic"][HERTZ]["cancelling"]
        yield f"{elastic_words(elastic['verdict']['answer'])}; {reason_of_record(elastic)}"
    yield band_text(elastic["fe"])
    if verdict["unknown"]:
        yield unknown_text(verdict["unknown"])
    elif verdict["answer"] == "UNRESOLVED":
        yield what_would_decide(record)


def _yields(record: Item) -> bool:
    return record.get("plastic") is not None


def _theories(record: Item) -> Iterator[str]:
    """The cheapest theory that holds, and in a line how every other one does."""
    against = "against elastic bodies: " * _yields(record)
    yield f"{against}{text}" if (text := cheapest_text(record)) else ""
    judged = {name: one for name, one in record["theories"].items() if name != HERTZ_GAUGE and "verdict" in one}
    by_answer: dict[str, list[str]] = {}
    for name, one in judged.items():
        answer = record["verdict"]["answer"] if name in EITHER_SIDE else one["verdict"]["answer"]
        range_ = " (out of its range)" if one["status"] == "out of range" and name not in EITHER_SIDE else ""
        by_answer.setdefault(answer, []).append(f"{THEORIES[name].words}{range_}")
    yield against + "; ".join(f"{answer}: {', '.join(names)}" for answer, names in by_answer.items())


def _details(record: Item, elements: bool) -> Iterator[Part]:
    """Everything else that is known of a case."""
    if "touch_points" in record:
        yield touch_point_table(record)
    for name in (name for name in EITHER_SIDE if name in record["theories"]):
        by = f", with the curvature of the {'gauge' if name == HERTZ_GAUGE else 'field'} side"
        bodies = f"{'elastic ' * _yields(record)}finite elements"
        title = f"Hertz against {bodies}{by if HERTZ_GAUGE in record['theories'] else ''}"
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
    if elements:
        yield elements_table(record)
        yield _by_elements(record)
    yield from _meshes(record)
    for name, telling in offered("TELLINGS").items():
        if name in record:
            yield from telling.parts(record[name])
    if "von_mises" in record:
        yield "largest von Mises stress: " + ", ".join(
            f"{name} {peak['von_mises_MPa']:.0f} MPa {peak['depth_mm']:.2f} mm below its surface"
            for name, peak in record["von_mises"].items()
        )
    if "seconds" in record["solver"]:
        yield effort_table(record["solver"])


def _meshes(record: Item) -> Iterator[str]:
    """On which meshes it was decided, how far the elements' own contact goes with it, and how well it was solved."""
    elements, solver = record["elements"], record["solver"]
    yield f"{_state(record['verdict']['answer'])} on {refinement(solver['elements_a_semi_axis'])}"
    yield (
        f"beside the verdict: L2 difference of the pressures {1e2 * record['pressure_l2']:.1f} %, overlap of the"
        f" patches {record['overlap']:.3f}"
    )
    off = elements["compliance_error"]
    yield (
        f"the elements' own, coarser nodes place {1e2 * elements['misfit']:.1f} % of the load differently; their"
        f" compliance {'is not seen' if off is None else f'differs from a half-space by {1e2 * off:+.1f} %'}"
    )
    yield (
        f"normal force {record['normal_force_N'] / 1e3:.3f} kN, Hertz stiffness"
        f" {record['theories']['hertz']['stiffness_GN_per_m15']:.2f} GN/m^1.5"
    )
    degrees = ", ".join(f"{name} {count}" for name, count in solver["degrees_of_freedom"].items())
    yield (
        f"solver {solver.get('path', '')}: degrees of freedom {degrees}; {solver['iterations']} iterations, residuals"
        f" contact {solver['contact_residual']:.0e}, penetration {solver['penetration_residual']:.0e}; balance of the"
        f" load {solver['load_balance']:.0e}, of the force on both bodies {solver['force_balance']:.0e}, of its moment"
        f" {solver['moment_balance']:.0e}"
    )


def _by_elements(record: Item) -> str:
    """What the elements say by themselves."""
    answer = record["elements"]["hertz"]["verdict"]["answer"]
    asked = record.get("case", {}).get("refine", "evidence") == "evidence"
    more = "; --refine evidence: until they know" * (answer == "UNRESOLVED" and not asked)
    return f"the elements by themselves, on their own nodes: Hertz {answer}{more}"


def _state(answer: str) -> str:
    return "open" if answer == "UNRESOLVED" else "decided"


def refinement(elements_a_semi_axis: Sequence[float]) -> str:
    """Meshes by their elements, the finest first, and how often they were refined."""
    elements, times = [f"{count:.1f}" for count in elements_a_semi_axis], len(elements_a_semi_axis) - 2
    refined = ("not refined", "refined once", "refined twice")[times] if times < 3 else f"refined {times} times"
    meshes = f"{', '.join(elements[:-1])} and {elements[-1]}"
    return f"{len(elements)} meshes of {meshes} elements per semi-axis, {refined}"


# --- A study in parts: a line a case for the terminal, and `report.html` with question, answer and all behind it.

_Row = TypeVar("_Row", bound=Row)

REPORT = "report.html"
MOST_PICTURES = 40
"""More pictures make a page of tens of megabytes."""


@dataclass(frozen=True, kw_only=True)
class ShownPair:
    """The case whose pair is drawn in section."""

    row: Row
    placement: Placement


def reported_case(row: Row, folder: Path) -> ReportedCase:
    """A case as it lies in its folder."""
    try:
        record = read_json(folder / "result.json")
    except InputError:
        record = None
    picture = folder / "case.png"
    return ReportedCase(
        row=row,
        record=record if isinstance(record, Mapping) else {},
        picture=picture if picture.is_file() else None,
    )


def most_used(rows: Iterable[_Row], count: int) -> list[_Row]:
    """So many of the rows, those that use most of a limit first."""
    return sorted(rows, key=lambda row: -float(row.get("verdict_limit_used") or 0.0))[:count]


def write_study_report(
    name: str,
    cases: Sequence[ReportedCase],
    out: Path,
    *,
    shown: ShownPair | None = None,
    criteria: Criteria | None = None,
    conclusion: str | None = None,
    pictures: str = "all are in cases/ID/case.png",
) -> Path:
    """Write `report.html` into the folder of a study, or of a single case.

    Parameters
    ----------
    shown
        The pair to draw, of the case that uses most of a limit.
    criteria
        Those by which all rows were judged, None if there is more than one set.
    conclusion
        What the study itself says.
    pictures
        Where the pictures are that the report leaves out.
    """
    cases = [replace(case, row=asked_row(case.row)) for case in cases]
    rows = [case.row for case in cases]
    verdicts = [verdict_of(row) for row in rows]
    pairs = list(dict.fromkeys(pair_of_row(row, " and ") for row in rows))
    pair = "; ".join(pairs[:4]) + ("; ..." if len(pairs) > 4 else "")
    title = _title(name, rows)
    parts: list[Part] = [
        Heading(title, 1),
        Lead(conclusion or _answer(cases), lead_style(verdicts)),
        f"{name}: {_answer(cases)}." if conclusion else f"Study {name}." if title != name else "",
        question(pair, criteria, roll_words_of_rows(rows)),
        Heading("Verdicts"),
        verdict_table(cases),
        Picture(content=out / "study.svg", words="Peak pressure, how far Hertz is off, and the touch point."),
        *_pair_drawn(shown, rows),
        *_ladder(rows),
        Heading("Cases"),
        *_cases(cases, pictures),
        Heading("Meshes and solver"),
        Details("Of each case", [solver_table(cases)]),
        *closing(
            (name for case in cases for name in case.record.get("theories", ())),
            laws=any(name in case.record for case in cases for name in offered("TELLINGS")),
        ),
    ]
    return write_text(out / REPORT, page(f"{title}: where Hertz holds", parts))


def closing(theories: Iterable[str], *more: tuple[str, str], laws: bool) -> list[Part]:
    """What every report ends with: the terms of all reports, of theories and laws, and `more`; then versions."""
    packages = [f"{package} {version}" for package, version in versions().items() if version]
    told = Terms((*GLOSSARY, *measure_terms(), *theory_terms(theories, laws=laws), *more))
    return [Heading("Terms"), told, Heading("What made it"), Items(packages)]


def _title(name: str, rows: Sequence[Row]) -> str:
    """The pair and its loads, or the name of a study of several pairs, and of a single case."""
    pairs = {pair_of_row(row, " and ") for row in rows}
    if len(rows) == 1 or len(pairs) != 1:
        return name
    loads = sorted({float(row["load_kN"]) for row in rows})
    (pair,) = pairs
    return (
        f"{pair[0].upper()}{pair[1:]}, {' to '.join(f'{load:g}' for load in dict.fromkeys((loads[0], loads[-1])))} kN"
    )


def _answer(cases: Sequence[ReportedCase]) -> str:
    if len(cases) != 1:
        elastic = [case.row["elastic_verdict_answer"] for case in cases if "elastic_verdict_answer" in case.row]
        more = f"; {YIELDING}, and against elastic bodies it holds in {elastic.count('HOLDS')}" if elastic else ""
        return answer_words([verdict_of(case.row) for case in cases], "cases") + more
    (row,) = (case.row for case in cases)
    cause = f"; {row['verdict_cause']}" if row.get("verdict_cause") else ""
    against = more = ""
    if "elastic_verdict_answer" in row:
        against, more = f" {YIELDING}", f"; {elastic_words(row['elastic_verdict_answer'])}"
    return f"Hertz {verdict_of(row)}{against}: {decided(row, cases[0].limits)}{cause}{more}"


def _pair_drawn(shown: ShownPair | None, rows: Sequence[Row]) -> list[Part]:
    """The pair in section, with the words that say which case it is."""
    if shown is None:
        return []
    words = f"Section through the first touch point {_which(shown.row, rows)}."
    return [Heading("The pair"), Picture(content=svg_of(pair_figure(shown.placement)), words=words)]


def _which(row: Row, rows: Sequence[Row]) -> str:
    """Which of the cases is drawn, and why that one."""
    at = f"at {position_text(row)}" + (
        f" of {pair_of_row(row, ' and ')}" if len({pair_of_row(one) for one in rows}) > 1 else ""
    )
    if sum(usable(one) for one in rows) < 2:
        return at
    used = row.get("verdict_limit_used")
    part = "" if used is None else f" ({float(used):.2f} times the limit)"
    return f"{at}, the case that uses most of a limit{part}"


def _ladder(rows: Sequence[Row]) -> list[Part]:
    # a single case is no line over the shift
    figure = ladder_figure(rows) if len(rows) > 1 else None
    words = "The ladder: by how much the shape of the gap, and then the finite bodies, change the peak pressure."
    return [] if figure is None else [Picture(content=svg_of(figure), words=words)]


def _cases(cases: Sequence[ReportedCase], pictures: str) -> list[Part]:
    """Picture and all measures of the drawn cases, and where the other cases are."""
    have = [case.row for case in cases if case.picture is not None]
    drawn = {str(row["id"]) for row in most_used(have, MOST_PICTURES)}
    parts: list[Part] = []
    if len(drawn) < max(sum(usable(case.row) for case in cases), len(have)):
        parts.append(f"{len(drawn)} of {len(cases)} cases, those that use most of a limit; {pictures}.")
    for case in (case for case in cases if str(case.row["id"]) in drawn):
        row, words = case.row, "Dashed: Hertz's ellipse; solid: the patch of the finite elements."
        assert case.picture is not None
        parts += [
            Heading(f"{pair_of_row(row, ' and ')}, {position_text(row)}: {verdict_of(row)}", 3),
            Picture(content=case.picture, words=f"{decided(row, {})}. {words}"),
            *([] if case.relief is None else [case.relief]),
            *(case_parts(case.record) if "theories" in case.record else ()),
        ]
    return parts


_KEY = "dev %: error of Hertz; separ., mispl.: load on separate patches, misplaced load"
# More of them are one table, with the pair in its first column.
_MOST_TABLES = 6
# Characters for the measures by which a case fails, from the most down to the fewest; those beyond are counted.
_FAILING_WIDTHS = (50, 34, 30, 26, 22, 18)


def judged_rows_parts(rows: Sequence[Item]) -> Iterator[Part]:
    """Do as `rows_parts` does, with what features say of the rows."""
    yield from rows_parts(rows)
    for telling in offered("TELLINGS").values():
        yield from telling.of_rows(rows)


def rows_parts(rows: Sequence[Item]) -> Iterator[Table | str]:
    """One line a case, a table for each rail, wheel and inclination, and in full what makes a row unusable."""
    groups: dict[tuple[Any, ...], list[Item]] = {}
    rows = [asked_row(row) for row in rows]
    for row in rows:
        pair = (row["rail"], row["wheel"], float(row.get("inclination_rad") or 0.0))
        groups.setdefault(pair, []).append(row)
    if len(groups) > _MOST_TABLES:
        yield _fitting(rows, "", with_pair=True)
    else:
        for own in groups.values():
            yield _fitting(own, "; ".join(filter(None, (pair_of_row(own[0]), roll_words_of_rows(own)))))
    if any(usable(row) for row in rows):
        yield _KEY
    if any("elastic_verdict_answer" in row for row in rows):
        yield f"verdict, FE, dev %: {YIELDING}"
    for row in rows:
        where = (f"{pair_of_row(row)}, " if len(groups) > 1 else "") + position_text(row)
        if not usable(row):
            yield f"{where}: {row['status']}"
            continue
        if row.get("verdict_cause"):
            yield f"{where}: {row['verdict_answer']}: {row['verdict_cause']}"
        if text := theory_text(row):
            yield f"{where}: {text}"


def _fitting(rows: Sequence[Item], title: str, *, with_pair: bool = False) -> Table:
    """The list of measures shrinks first, then columns go."""
    wide, *shorter = (deviation_table(rows, title, width, with_pair=with_pair) for width in _FAILING_WIDTHS)
    return replace(wide, shorter=shorter)


# --- Files of a whole study: tables, figure, and collections of its cases for ParaView.

STUDY_SCHEMA = "fecontact/study/2"


def write_tables(study: str, cases: int, rows: Sequence[Row], path: Path) -> None:
    """Write the rows of a study of so many cases to `path` with the endings .csv and .json."""
    write_csv(rows, path.with_name(f"{path.name}.csv"))
    record = {
        "schema": STUDY_SCHEMA,
        "study": study,
        "cases": cases,
        "rows": list(rows),
        "versions": versions(),
    }
    write_sealed(path.with_name(f"{path.name}.json"), record, [path.with_name(f"{path.name}.csv")])


def study_figures(
    rows: Sequence[Row], out: Path, rail: Profile | None = None, criteria: Criteria | None = None
) -> tuple[str, ...]:
    """Draw the figure of a study and write its collections; cases are in the folder `cases` below `out`.

    The junctions of `rail` are drawn where it is the only one, and the limits of `criteria` where they are.

    Returns the names of the collections.
    """
    from fecontact.outputs.figures.study import study_figure

    solved = [row for row in rows if row.get("fe_p_max_MPa") is not None]
    if solved:
        study_figure(list(rows), out / "study.png", rail, criteria)
    return _write_collections(solved, out)


def _write_collections(rows: Sequence[Row], out: Path) -> tuple[str, ...]:
    """A .pvd for each series of cases over the lateral shift: ParaView merges equal times, so two cannot share one.

    Left out are single cases beside others, and cases that differ in something else (such as their bodies' sizes).
    """
    from fecontact.outputs.paraview.vtk import write_pvd

    unique = list({row["id"]: row for row in rows}.values())
    found = series(unique)
    written: list[str] = []
    for one in found:
        shifts = {float(row["lateral_shift_mm"]): out / "cases" / str(row["id"]) for row in one.rows}
        if len(shifts) == len(one.rows) and (len(shifts) > 1 or len(found) == 1):
            name = f"study{one.file_suffix}"
            # profile files of the same name in two folders
            same = sum(other.startswith(f"{name}.") for other in written)
            path = out / (f"{name}.{same + 1}.pvd" if same else f"{name}.pvd")
            written.append(write_pvd(path, shifts.items()).name)
    return tuple(written)
