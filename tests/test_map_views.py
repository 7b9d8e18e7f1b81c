"""Maps as values: what one table and one picture draw, for each theory by its name and for the cheapest that holds.

The contacts are those of the true gap on a half-space, which take the place of the finite elements.
"""

import io
import json
from dataclasses import replace

import pytest
from rich.console import Console

from fecontact.case import Case
from fecontact.comparison.judging import judge_load
from fecontact.comparison.solved_load import Level, SolvedLoad
from fecontact.comparison.theories import HERTZ, MULTI_HERTZ, THEORIES
from fecontact.comparison.verdict import Verdict
from fecontact.errors import InputError
from fecontact.files import json_text
from fecontact.map.cells import ApplicabilityMap, MapCell, MapPosition
from fecontact.map.load_limit import load_limit
from fecontact.map.position import solved_cell
from fecontact.outputs.figures.style import ANSWERS
from fecontact.outputs.maps.cheapest import theory_view
from fecontact.outputs.maps.figure import map_figure
from fecontact.outputs.maps.files import write_map
from fecontact.outputs.maps.measures import map_view, measure_table, refuse_measure
from fecontact.outputs.maps.verdicts import verdict_view
from fecontact.outputs.maps.view import CellView
from fecontact.outputs.records.theories import share_records
from fecontact.outputs.tables.theories import shares_table
from fecontact.outputs.terminal.maps import print_map
from fecontact.outputs.words.measures import WORDS
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

LOAD_N = 50e3


def position(shift_mm):
    """One load of a wheelset at a shift, solved on a half-space."""
    case = Case(lateral_shift_mm=shift_mm, roll="touching", load_N=LOAD_N)
    placement = place_case(case)
    rung = expect_on_half_space(case, placement)[1].half_space
    levels = tuple(
        Level(
            **dict.fromkeys(("nodal", "fe", "otherwise"), rung),
            degrees_of_freedom={"both": n},
            elements={},
            enlarged=0,
            at_edge=False,
            compliance_error=0.0,
        )
        for n in (200, 100)
    )
    solved = SolvedLoad(case=case, levels=levels, half_space=rung, quadratic=rung, point_noise=None)
    cells = (solved_cell(shift_mm, judge_load(solved, placement)),)
    return MapPosition(lateral_shift_mm=shift_mm, cells=cells, limit=load_limit(cells), placement=placement)


@pytest.fixture(scope="module")
def made():
    """One touch point, where Hertz holds; two, where springs alone do; and a position without a result."""
    lost = MapCell(lateral_shift_mm=6.0, load_N=LOAD_N, status="failed: no memory")
    positions = (
        *(position(shift) for shift in (-4.0, 5.0)),
        MapPosition(lateral_shift_mm=6.0, cells=(lost,), limit=load_limit([lost])),
    )
    return ApplicabilityMap(case=Case(roll="touching"), loads_N=(LOAD_N,), positions=positions)


def failing(made):
    """The same map with theories that all fail at the second position."""
    second = made.positions[1]
    (cell,) = second.cells
    verdict = Verdict(answer="FAILS", measure="area_mm2", each={"area_mm2": "FAILS"})
    fails = {name: replace(one, verdict=verdict) for name, one in cell.judged.judgements.items()}
    other = replace(second, cells=(replace(cell, judged=replace(cell.judged, judgements=fails)),))
    return replace(made, positions=(made.positions[0], other, made.positions[2]))


def cells_of(view) -> list[CellView]:
    return [cell for column in view.columns for cell in column.cells]


def test_every_measure_has_a_letter_of_its_own_that_is_no_sign():
    letters = [words.letter for words in WORDS.values()]
    assert len(set(letters)) == len(letters)
    assert {len(letter) for letter in letters} == {1}
    assert not set(letters) & set("+x?!*")


def test_a_map_of_any_theory(made):
    hertz, springs = verdict_view(made), verdict_view(made, MULTI_HERTZ)
    assert [cell.answer for cell in cells_of(hertz)] == ["HOLDS", "FAILS", "failed"]
    # at one touch point springs are Hertz
    assert [cell.answer for cell in cells_of(springs)] == ["HOLDS", "HOLDS", "failed"]
    assert [cell.diamond for cell in cells_of(hertz)] == [False, True, False]
    assert not any(cell.diamond for cell in cells_of(springs))
    judged = made.cells[1].judged.judgements[MULTI_HERTZ]
    assert cells_of(springs)[1].text == f"{judged.limit_used:.2f}"
    assert cells_of(springs)[1].printed.split() == ["+", f"{1e2 * judged.deviation['p_max_MPa']:+.1f}"]
    assert [column.limit for column in springs.columns] == ["holds 50 kN", "holds 50 kN", "failed: no memory"]
    assert "where it says nothing of its own it is Hertz" in springs.notes
    assert springs.title == f"where {THEORIES[MULTI_HERTZ].words} holds"


def test_a_theory_without_a_contact_has_no_answer(made):
    cell = made.cells[1]
    load = replace(cell.judged, judgements={HERTZ: cell.judged.judgements[HERTZ]}, without={MULTI_HERTZ: "conforms"})
    one = replace(made.positions[1], cells=(replace(cell, judged=load),))
    view = verdict_view(replace(made, positions=(one,)), MULTI_HERTZ)
    assert [(cell.answer, cell.text) for cell in cells_of(view)] == [("failed", "!")]
    assert view.columns[0].bands == ()


def test_the_cheapest_theory_that_holds(made):
    view = theory_view(made)
    assert [cell.answer for cell in cells_of(view)] == [HERTZ, MULTI_HERTZ, "failed"]
    assert [cell.letter for cell in cells_of(view)] == ["A", "B", "!"]
    assert [answer for answer, _ in view.answers] == [HERTZ, MULTI_HERTZ, "failed", "UNRESOLVED"]
    none = theory_view(failing(made))
    assert [cell.text[0] for cell in cells_of(none)] == ["A", "x", "!"]
    assert ("FAILS", "none holds") in none.answers


def test_one_picture_draws_them_in_a_png(made, monkeypatch):
    from matplotlib.colors import to_hex

    kept = []
    monkeypatch.setattr("fecontact.outputs.maps.figure.save_figure", lambda figure, path: kept.append(figure))
    views = [verdict_view(made), verdict_view(made, MULTI_HERTZ), theory_view(made), theory_view(failing(made))]
    for view in views:
        map_figure(view, "unused.png")
    for view, figure in zip(views, kept, strict=True):
        (ax,) = figure.axes
        assert [to_hex(bar.get_facecolor()) for bar in ax.patches if bar.get_fill()] == [
            view.colours[column.bands[0][2]] if column.bands else ANSWERS["failed"] for column in view.columns
        ]
        assert [text.get_text() for text in ax.texts] == [cell.text for cell in cells_of(view)]
        told = [text.get_text() for text in ax.get_legend().get_texts()]
        assert [words for _, words in view.answers] == told[: len(view.answers)]
        assert view.title in ax.get_title()


def test_a_map_is_asked_for_by_names(made):
    assert map_view(made, "pressure", MULTI_HERTZ) == verdict_view(made, MULTI_HERTZ)
    assert map_view(made, "theory") == theory_view(made)
    assert "the cheapest theory that holds" in measure_table(made, "theory")
    for theory in THEORIES:
        refuse_measure(made.case, "pressure", theory)
    # it needs no friction
    refuse_measure(made.case, "theory")
    with pytest.raises(InputError, match="allowed: hertz"):
        refuse_measure(made.case, "pressure", "spring")
    with pytest.raises(InputError, match="of the measure pressure"):
        refuse_measure(Case(creep=replace(made.case.creep, friction=0.3)), "force", MULTI_HERTZ)
    with pytest.raises(InputError, match="the measure theory has all of them"):
        refuse_measure(made.case, "theory", MULTI_HERTZ)


def test_the_shares_of_theories(made):
    """Counted by hand: one cell each where Hertz and springs hold first, and one without a result."""
    shares = {one["theory"]: one for one in share_records(made)}
    assert list(shares)[-3:] == ["UNRESOLVED", "none", "failed"]
    assert {name: one["cheapest_cells"] for name, one in shares.items() if one["cheapest_cells"]} == {
        HERTZ: 1,
        MULTI_HERTZ: 1,
        "failed": 1,
    }
    assert sum(one["cheapest_percent"] for one in shares.values()) == pytest.approx(100.0)
    used = made.cells[1].judged.judgements[MULTI_HERTZ].limit_used
    assert shares[MULTI_HERTZ]["largest_limit_used"] == used < 1.0
    # springs say nothing of their own at the first position; the half-space, which stands for the elements, holds twice
    assert (shares[HERTZ]["holds_cells"], shares[MULTI_HERTZ]["holds_cells"], shares["half_space"]["holds_cells"]) == (
        *(1, 1),
        2,
    )
    assert shares["half_space"]["cheapest_cells"] == 0
    none = {one["theory"]: one["cheapest_cells"] for one in share_records(failing(made))}
    assert (none["none"], none["UNRESOLVED"], none["failed"]) == (1, 0, 1)
    table = shares_table(share_records(made))
    assert [row.cells[0] for row in table.rows][-1] == "could not be solved"
    assert "none holds" not in [row.cells[0] for row in table.rows]


def test_the_cheapest_theory_is_printed_with_its_shares_and_drawn(made, tmp_path, monkeypatch):
    text = io.StringIO()
    print_map(made, "theory", HERTZ, width=100, console=Console(file=text, width=100))
    shown = text.getvalue()
    assert "the cheapest theory that holds, and the largest part of a limit that it uses" in shown
    assert "The cheapest theory that holds, and where each holds" in shown
    alone = io.StringIO()
    print_map(made, "pressure", MULTI_HERTZ, width=100, console=Console(file=alone, width=100))
    assert "where each holds" not in alone.getvalue()
    titles = {}
    monkeypatch.setattr(
        "fecontact.outputs.maps.files.map_figure", lambda view, path: titles.update({path.name: view.title})
    )
    for old in ("map_force.png", "map_law.csv", "map_law.png", "map_strip.svg"):
        (tmp_path / old).write_text("of another map", "utf-8")
    write_map(made, tmp_path, theory=MULTI_HERTZ)
    assert titles == {
        "map.png": "where Hertz holds",
        "map_theory.png": "the cheapest theory that holds",
        "map_multi_hertz.png": f"where {THEORIES[MULTI_HERTZ].words} holds",
    }
    assert sorted(path.name for path in tmp_path.iterdir()) == ["map.csv", "map.json"]
    assert json.loads((tmp_path / "map.json").read_text("utf-8"))["theory_shares"] == json.loads(
        json_text(share_records(made))
    )
