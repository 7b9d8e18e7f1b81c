"""Maps as values for one table and one picture.

They are drawn for each theory by its name and for the cheapest theory that holds. The contacts come from the true gap
on a half-space, which replaces the finite elements.
"""

import csv
import html
import io
import json
import re
from dataclasses import replace

import pytest
from browser import shown
from marks import slow_but
from matplotlib.figure import Figure
from rich.console import Console
from rungs import on_half_space

import fecontact
from fecontact.case import Case, Criteria
from fecontact.contact_theories.registry import HERTZ, MULTI_HERTZ, THEORIES
from fecontact.errors import InputError
from fecontact.files import format_json
from fecontact.judging.judge import judge_load
from fecontact.judging.verdict import Verdict
from fecontact.maps import report
from fecontact.maps.files import write_map
from fecontact.maps.load_limits import find_load_limit
from fecontact.maps.model import ApplicabilityMap, MapCell, MapPosition
from fecontact.maps.picture import save_map_figure
from fecontact.maps.positions import build_solved_cell
from fecontact.maps.report import build_shares_table, format_map_lines, write_map_report
from fecontact.maps.telling import count_theory_shares
from fecontact.maps.theory_views import build_theory_view
from fecontact.maps.verdict_views import build_verdict_view
from fecontact.maps.view import CellView
from fecontact.maps.views import build_map_view, format_map, refuse_measure, write_map_answer
from fecontact.outputs.cases import theories_table
from fecontact.outputs.parts import Picture
from fecontact.outputs.records.results import load_record
from fecontact.outputs.study_report import parts_of_rows
from fecontact.outputs.style import ANSWER_COLOURS
from fecontact.outputs.terminal import print_parts
from fecontact.outputs.words import MEASURE_WORDS
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

LOAD_N = 50e3


def position(shift_mm, load_N=LOAD_N, **limits):
    """One load of a wheelset at a shift, solved on a half-space."""
    case = Case(lateral_shift_mm=shift_mm, roll="touching", load_N=load_N, criteria=Criteria(**limits))
    placement = place_case(case)
    rung = expect_on_half_space(case, placement)[1].half_space
    solved_load = on_half_space(case, placement, rung, (200, 100))
    cells = (build_solved_cell(shift_mm, judge_load(solved_load, placement)),)
    return MapPosition(lateral_shift_mm=shift_mm, cells=cells, limit=find_load_limit(cells), placement=placement)


@pytest.fixture(scope="module")
def base_map():
    """A map with one contact point, with two contact points, and without a result.

    Hertz holds at one contact point. At two contact points only springs hold.
    """
    lost = MapCell(lateral_shift_mm=6.0, load_N=LOAD_N, status="failed: no memory")
    positions = (
        *(position(shift) for shift in (-4.0, 5.0)),
        MapPosition(lateral_shift_mm=6.0, cells=(lost,), limit=find_load_limit([lost])),
    )
    return ApplicabilityMap(case=Case(roll="touching"), loads_N=(LOAD_N,), positions=positions)


def failing(base_map):
    """The map with theories that all fail at the second position."""
    second = base_map.positions[1]
    (cell,) = second.cells
    verdict = Verdict(answer="FAILS", measure="area_mm2", each={"area_mm2": "FAILS"})
    fails = {name: replace(judgement, verdict=verdict) for name, judgement in cell.judged.judgements.items()}
    failing_position = replace(second, cells=(replace(cell, judged=replace(cell.judged, judgements=fails)),))
    return replace(base_map, positions=(base_map.positions[0], failing_position, base_map.positions[2]))


def cells_of(view) -> list[CellView]:
    return [cell for column in view.columns for cell in column.cells]


def test_every_measure_has_a_letter_of_its_own_that_is_no_sign():
    letters = [words.letter for words in MEASURE_WORDS.values()]
    assert len(set(letters)) == len(letters)
    assert {len(letter) for letter in letters} == {1}
    assert not set(letters) & set("+x?!*")


def test_a_map_of_any_theory(base_map):
    hertz, springs = build_verdict_view(base_map), build_verdict_view(base_map, MULTI_HERTZ)
    assert [cell.answer for cell in cells_of(hertz)] == ["HOLDS", "FAILS", "failed"]
    # at one contact point springs are Hertz
    assert [cell.answer for cell in cells_of(springs)] == ["HOLDS", "HOLDS", "failed"]
    assert [cell.diamond for cell in cells_of(hertz)] == [False, True, False]
    assert not any(cell.diamond for cell in cells_of(springs))
    judgement = base_map.cells[1].judged.judgements[MULTI_HERTZ]
    assert cells_of(springs)[1].text == f"{judgement.limit_utilisation:.2f}"
    assert cells_of(springs)[1].printed.split() == ["+", f"{1e2 * judgement.deviation['p_max_MPa']:+.1f}"]
    assert [column.limit for column in springs.columns] == ["holds 50 kN", "holds 50 kN", "failed: no memory"]
    assert "Hertz is shown where the theory is undefined" in springs.notes
    assert springs.title == f"where {THEORIES[MULTI_HERTZ].words} holds"


def test_a_theory_without_a_contact_has_no_answer(base_map):
    cell = base_map.cells[1]
    load = replace(cell.judged, judgements={HERTZ: cell.judged.judgements[HERTZ]}, without={MULTI_HERTZ: "conforms"})
    lost_theory = replace(base_map.positions[1], cells=(replace(cell, judged=load),))
    view = build_verdict_view(replace(base_map, positions=(lost_theory,)), MULTI_HERTZ)
    assert [(cell.answer, cell.text) for cell in cells_of(view)] == [("failed", "!")]
    assert view.columns[0].bands == ()


def test_the_cheapest_theory_that_holds(base_map):
    view = build_theory_view(base_map)
    assert [cell.answer for cell in cells_of(view)] == [HERTZ, MULTI_HERTZ, "failed"]
    assert [cell.letter for cell in cells_of(view)] == ["H", "MH", "!"]
    assert [answer for answer, _ in view.answers] == [HERTZ, MULTI_HERTZ, "failed"]
    no_theory = build_theory_view(failing(base_map))
    assert [cell.text[0] for cell in cells_of(no_theory)] == ["H", "x", "!"]
    assert ("FAILS", "none holds") in no_theory.answers


def flat_patch(**limits):
    """A map with a single cell and a patch that is partly flat or concave.

    ANALYN holds there by its numbers, out of its range.
    """
    # so that Hertz and STRIPES fail beyond their uncertainties
    limits |= {"area": 0.07}
    case = Case(roll="touching", criteria=Criteria(**limits))
    return ApplicabilityMap(case=case, loads_N=(100e3,), positions=(position(3.0, 100e3, **limits),))


def test_a_theory_out_of_its_range_is_told_so_wherever_it_is_the_answer(tmp_path):
    flat_map = flat_patch(theories_out_of_range=True)
    ((row,), load) = (fecontact.rows(flat_map), flat_map.cells[0].judged)
    reason = row["cheapest_theory_reason"]
    assert (row["cheapest_theory"], row["cheapest_theory_status"]) == ("analyn", "out of range")
    assert reason.startswith("38 % of the patch is flat or concave across")
    text = io.StringIO()
    print_parts(parts_of_rows([row]), Console(file=text, width=300))
    assert f"cheapest theory that holds: ANALYN, out of range: {reason} (p_max" in text.getvalue()
    # one name for one theory
    assert text.getvalue().count("ANALYN, out of range") == 2
    assert "analyn" not in text.getvalue()
    view = build_theory_view(flat_map)
    (cell,) = cells_of(view)
    assert cell.letter.endswith("*")
    assert view.notes[-1].endswith("* out of range")
    assert "out of range" in [words for _, words in view.marks]
    assert write_map_answer(flat_map, "theory") == [
        "The cheapest theory that holds is ANALYN at 3 mm at all loads, out of its range at 3 mm at all loads."
    ]
    (share,) = [share_record for share_record in count_theory_shares(flat_map) if share_record["cheapest_cells"]]
    assert (share["theory"], share["out_of_range_cells"]) == ("analyn", 1)
    write_map(flat_map, tmp_path, drawn=False)
    (line,) = contacts(tmp_path)
    names = ("cheapest_theory", "cheapest_theory_status", "cheapest_theory_reason")
    assert [line[name] for name in names] == ["analyn", "out of range", reason]
    report = write_map_report(flat_map, tmp_path).read_text("utf-8")
    assert f"ANALYN, out of range: {reason}" in html.unescape(report)
    verdicts_told = {row.cells[0]: row.cells[-1] for row in theories_table(load_record(load)).rows}
    assert (verdicts_told["ANALYN"], verdicts_told["KPEC"]) == ("HOLDS, out of range", "HOLDS")


def test_theories_out_of_their_range_are_left_out_by_default():
    flat_map = flat_patch()
    (row,) = fecontact.rows(flat_map)
    assert (row["cheapest_theory"], row["cheapest_theory_status"], row["cheapest_theory_reason"]) == (
        *("kpec", "solved"),
        "",
    )
    # its numbers hold as before
    assert row["analyn_verdict_answer"] == "HOLDS"
    assert write_map_answer(flat_map, "theory") == ["The cheapest theory that holds is KPEC at 3 mm at all loads."]
    assert not cells_of(build_theory_view(flat_map))[0].out_of_range


def test_one_picture_draws_them_in_a_png(base_map, monkeypatch):
    from matplotlib.colors import to_hex

    figures = []
    monkeypatch.setattr("fecontact.maps.picture.save_figure", lambda figure, path: figures.append(figure))
    views = [
        build_verdict_view(base_map),
        build_verdict_view(base_map, MULTI_HERTZ),
        build_theory_view(base_map),
        build_theory_view(failing(base_map)),
    ]
    for view in views:
        save_map_figure(view, "unused.png")
    for view, figure in zip(views, figures, strict=True):
        (ax,) = figure.axes
        assert [to_hex(bar.get_facecolor()) for bar in ax.patches if bar.get_fill()] == [
            view.colours[column.bands[0][2]] if column.bands else ANSWER_COLOURS["failed"] for column in view.columns
        ]
        assert [text.get_text() for text in ax.texts] == [cell.text for cell in cells_of(view)]
        legend = [text.get_text() for text in figure.legends[0].get_texts()]
        assert [words for _, words in view.answers] == legend[: len(view.answers)]
        assert view.title in ax.get_title()


def test_a_map_is_asked_for_by_names(base_map):
    assert build_map_view(base_map, "pressure", MULTI_HERTZ) == build_verdict_view(base_map, MULTI_HERTZ)
    assert build_map_view(base_map, "theory") == build_theory_view(base_map)
    assert "the cheapest theory that holds" in format_map(base_map, "theory")
    for theory in THEORIES:
        refuse_measure(base_map.case, "pressure", theory)
    # it needs no friction
    refuse_measure(base_map.case, "theory")
    with pytest.raises(InputError, match="allowed: hertz"):
        refuse_measure(base_map.case, "pressure", "spring")
    with pytest.raises(InputError, match="the measure theory shows all theories"):
        refuse_measure(base_map.case, "theory", MULTI_HERTZ)


def test_the_shares_of_theories(base_map):
    """Shares counted by hand.

    Hertz holds first in one cell, springs in another, and one cell has no result.
    """
    shares = {share_record["theory"]: share_record for share_record in count_theory_shares(base_map)}
    assert list(shares)[-3:] == ["UNRESOLVED", "none", "failed"]
    assert {
        name: share_record["cheapest_cells"] for name, share_record in shares.items() if share_record["cheapest_cells"]
    } == {
        HERTZ: 1,
        MULTI_HERTZ: 1,
        "failed": 1,
    }
    assert sum(share_record["cheapest_percent"] for share_record in shares.values()) == pytest.approx(100.0)
    utilisation = base_map.cells[1].judged.judgements[MULTI_HERTZ].limit_utilisation
    assert shares[MULTI_HERTZ]["largest_limit_utilisation"] == utilisation < 1.0
    # springs say nothing of their own at the first position; the half-space, which stands for the elements, holds twice
    assert (shares[HERTZ]["holds_cells"], shares[MULTI_HERTZ]["holds_cells"], shares["half_space"]["holds_cells"]) == (
        *(1, 1),
        2,
    )
    assert shares["half_space"]["cheapest_cells"] == 0
    cheapest_cells = {
        share_record["theory"]: share_record["cheapest_cells"]
        for share_record in count_theory_shares(failing(base_map))
    }
    assert (cheapest_cells["none"], cheapest_cells["UNRESOLVED"], cheapest_cells["failed"]) == (1, 0, 1)
    table = build_shares_table(count_theory_shares(base_map))
    assert [row.cells[0] for row in table.rows][-1] == "could not be solved"
    assert "no theory holds" not in [row.cells[0] for row in table.rows]


def test_the_cheapest_theory_is_printed_with_its_shares_and_drawn(base_map, tmp_path, monkeypatch):
    text = io.StringIO()
    print_parts(format_map_lines(base_map, "theory", HERTZ, width=100), Console(file=text, width=100))
    text_shown = text.getvalue()
    assert "the cheapest theory that holds, with its limit utilisation" in text_shown
    assert "Cheapest theory that holds, and cells in which each theory holds" in text_shown
    narrow = io.StringIO()
    print_parts([build_shares_table(count_theory_shares(base_map))], Console(file=narrow, width=80))
    # headings are whole where a terminal is no wider
    (line,) = [line for line in narrow.getvalue().splitlines() if line.lstrip().startswith("theory")]
    assert line.split()[-2:] == ["utilisation", "%"]
    alone = io.StringIO()
    print_parts(format_map_lines(base_map, "pressure", MULTI_HERTZ, width=100), Console(file=alone, width=100))
    assert "cells in which each theory holds" not in alone.getvalue()
    titles = {}
    monkeypatch.setattr(
        "fecontact.maps.files.save_map_figure", lambda view, path: titles.update({path.name: view.title})
    )
    (tmp_path / "map_strip.svg").write_text("of another map", "utf-8")
    write_map(base_map, tmp_path, theory=MULTI_HERTZ)
    assert titles == {
        "map.png": "where Hertz holds",
        "map_theory.png": "the cheapest theory that holds",
        "map_multi_hertz.png": f"where {THEORIES[MULTI_HERTZ].words} holds",
    }
    assert sorted(path.name for path in tmp_path.iterdir()) == ["contacts.csv", "map.csv", "map.json"]
    assert json.loads((tmp_path / "map.json").read_text("utf-8"))["theory_shares"] == json.loads(
        format_json(count_theory_shares(base_map))
    )


def contacts(folder):
    return list(csv.DictReader((folder / "contacts.csv").read_text("utf-8").splitlines()))


def numbers(row, *names):
    return [float(row[name]) for name in names]


def test_contacts_of_a_map_are_those_of_theories_alone(base_map, tmp_path, monkeypatch):
    monkeypatch.setattr("fecontact.maps.files.save_map_figure", lambda view, path: None)
    write_map(base_map, tmp_path)
    single, several, lost = contacts(tmp_path)
    assert [row["cheapest_theory"] for row in (single, several, lost)] == [HERTZ, MULTI_HERTZ, ""]
    assert [row["verdict"] for row in (single, several, lost)] == ["HOLDS", "FAILS", "failed"]
    assert {name for name, value in lost.items() if value} == {"lateral_shift_mm", "load_kN", "status", "verdict"}
    # contact points and springs of a table are found from the pair and the load alone; pressures on a round rail have
    # other directions than the contact point, so that their normal force is some 1e-5 off
    alone = fecontact.table(base_map.case, [-4.0, 5.0], [LOAD_N])
    for row, same in zip((single, several), alone, strict=True):
        shared = [name for name in row if name.startswith("touch") and isinstance(same.get(name), float)]
        assert numbers(row, *shared) == pytest.approx([same[name] for name in shared], rel=2e-5)
        # a half-space in place of the finite elements is where strips are; its nodes are few on the narrow patch
        assert float(row["fe_p_max_MPa"]) == pytest.approx(same["strip_p_max_MPa"], rel=2e-3)
        assert numbers(row, "fe_a_mm", "fe_b_mm") == pytest.approx([same["strip_a_mm"], same["strip_b_mm"]], rel=0.05)
        assert float(row["fe_centre_mm"]) == pytest.approx(same["strip_centre_mm"], abs=0.02)
    # a patch lies where its contact point was found, the centre of pressure as far beside it on both profiles
    places = ("rail_y_mm", "wheel_y_mm", "contact_angle_rad")
    touch = numbers(single, *(f"touch1_{name}" for name in places))
    assert numbers(single, *(f"patch1_{name}" for name in places)) == pytest.approx(touch, abs=1e-9)
    centre = numbers(single, "fe_centre_rail_y_mm", "fe_centre_wheel_y_mm")
    assert [at_centre - at for at_centre, at in zip(centre, touch, strict=False)] == pytest.approx(
        [float(single["fe_centre_mm"])] * 2, abs=1e-4
    )
    # the patch of the larger force comes first: it is that of the second contact point
    forces = numbers(several, "touch1_spring_force_N", "touch2_spring_force_N")
    shares = numbers(several, "patch2_load_share", "patch1_load_share")
    assert shares == pytest.approx([force / sum(forces) for force in forces])
    assert several["patch1_rail_y_mm"] == several["touch2_rail_y_mm"]
    assert (single["patch1_load_share"], single["patch2_load_share"]) == ("1.0", "")


def verdicts(base_map, shifts_mm, loads_kN, answers, causes=None):
    """A map with planted verdicts of Hertz.

    Each shift has a row of letters: h holds, f fails, o open, ! lost.
    """
    like = base_map.cells[0].judged
    names = {"h": "HOLDS", "f": "FAILS", "o": "UNRESOLVED"}
    positions = []
    for shift, row in zip(shifts_mm, answers, strict=True):
        cells = []
        for load_kN, letter in zip(loads_kN, row, strict=True):
            if letter == "!":
                cells.append(MapCell(lateral_shift_mm=shift, load_N=1e3 * load_kN, status="failed: no memory"))
                continue
            cause = (causes or {}).get(shift, "second lobe") if letter == "f" else None
            verdict = Verdict(answer=names[letter], measure="area_mm2", each={"area_mm2": names[letter]}, cause=cause)
            case = replace(like.case, lateral_shift_mm=shift, load_N=1e3 * load_kN)
            judged_load = replace(like, solved=replace(like.solved, case=case), verdict=verdict)
            cells.append(build_solved_cell(shift, judged_load))
        positions.append(MapPosition(lateral_shift_mm=shift, cells=tuple(cells), limit=find_load_limit(cells)))
    return ApplicabilityMap(
        case=base_map.case,
        loads_N=tuple(1e3 * load_of_map_kN for load_of_map_kN in loads_kN),
        positions=tuple(positions),
    )


def test_the_answer_of_a_map_is_a_few_sentences(base_map):
    shifts = [-2.0, -1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0]
    rows = ["hhh", "hhh", "hhh", "hff", "hhf", "fff", "fhh", "hoh", "!!!"]
    shown_map = verdicts(base_map, shifts, [20, 50, 100], rows, {0.5: "finite bodies"})
    assert write_map_answer(shown_map, "pressure") == [
        "From -2 to -1 mm Hertz holds at all loads (20 to 100 kN).",
        "At -0.5 and 0 mm it holds up to 20 and 50 kN, where the pressure has a second lobe.",
        "At 0.5 mm it fails at all loads, where the finite bodies change the pressure.",
        "At 1 mm it fails 20, is not solved 20 to 50, holds 50 to 100 kN.",
        "At 1.5 mm it holds 20, is unresolved 20 to 100, holds 100 kN.",
        "At 2 mm there is no result.",
        "Of 27 cells, 1 is unresolved and 3 are without a result.",
    ]
    # shifts that are far apart say nothing of what is between them
    apart = verdicts(base_map, [-4.0, 0.0, 4.0], [50, 100], ["hh", "hh", "hh"])
    assert write_map_answer(apart, "pressure") == ["At -4, 0 and 4 mm Hertz holds at all loads (50 to 100 kN)."]
    # one that could not be used says nothing of "all loads"
    partly = verdicts(base_map, [0.0, 1.0], [20, 50], ["h!", "!f"])
    assert write_map_answer(partly, "pressure")[0] == "At 0 mm Hertz holds 20 kN (50 kN: failed: no memory)."
    assert (
        write_map_answer(verdicts(base_map, [0.0], [20, 50], ["oo"]), "pressure")[0]
        == "At 0 mm Hertz is unresolved 20 to 50 kN."
    )
    assert write_map_answer(verdicts(base_map, [0.0], [50], ["h"]), "pressure") == [
        "At 0 mm Hertz holds at all loads (50 kN)."
    ]


def test_a_theory_has_its_article_within_a_sentence(base_map):
    """Article of a theory in a sentence.

    "It is Strip method at 0 mm" was wrong. Names of people and codes have no article.
    """
    assert build_verdict_view(base_map, "strip").title == "where the strip method holds"
    assert any("the strip method " in sentence for sentence in write_map_answer(base_map, "pressure", "strip"))
    assert {theory.in_sentence for theory in THEORIES.values()} >= {"Hertz", "ANALYN", "the half-space"}


def test_the_answer_by_the_cheapest_theory_says_which_where(base_map):
    assert write_map_answer(base_map, "theory") == [
        f"The cheapest theory that holds is {THEORIES[HERTZ].words} at -4 mm at all loads.",
        f"It is {THEORIES[MULTI_HERTZ].words} at 5 mm at all loads.",
        "Of 3 cells, 1 is without a result.",
    ]
    assert write_map_answer(failing(base_map), "theory")[1:] == [
        "No theory holds at 5 mm at all loads.",
        "Of 3 cells, 1 is without a result.",
    ]
    text = io.StringIO()
    print_parts(format_map_lines(base_map, "theory", HERTZ, width=80), Console(file=text))
    assert text.getvalue().startswith("The cheapest theory that holds is")
    assert max(map(len, text.getvalue().partition("shift mm")[0].splitlines())) <= 80


def test_a_report_defines_every_theory_of_its_table(base_map, tmp_path):
    text = write_map_report(base_map, tmp_path).read_text("utf-8")
    for record in count_theory_shares(base_map):
        if record["theory"] in THEORIES and record["theory"] != HERTZ:
            assert f"<dt>{record['words']}</dt><dd>{html.escape(THEORIES[record['theory']].source)}. Range: " in text
    # the answer first
    assert text.index("At -4 mm Hertz holds at all loads") < text.index("Can Hertz")


def test_a_report_of_many_cells_stays_below_5_mb(base_map, tmp_path, monkeypatch):
    def pictures() -> list[str]:
        text = write_map_report(base_map, tmp_path).read_text("utf-8")
        details = [detail.partition("</details>")[0] for detail in text.split('id="cell-')[1:]]
        return re.findall('src="(data:[^"]+)"', "".join(details))

    # what a picture of a cell is taken to need
    with_both = pictures()
    assert len(with_both) == 2
    assert 0.5 < len(with_both[0]) / report._BYTES_PER_PICTURE < 1.1
    fits = [
        report.count_fitting_pictures([Picture(content=b"." * 300_000, words="map")] * 4, count)
        for count in (3, 175, 1000)
    ]
    assert fits[0] > fits[1] > fits[2] == 0
    assert 1.6e6 + 6e3 * 175 + 32e3 * fits[1] == pytest.approx(4.9e6, abs=32e3)
    monkeypatch.setattr(report, "count_fitting_pictures", lambda figures, cells: 1)
    (worst,) = pictures()
    assert worst in with_both


def test_a_report_takes_the_pictures_that_workers_drew(base_map, tmp_path, monkeypatch):
    whole_report = write_map_report(base_map, tmp_path).read_text("utf-8")
    handed = {
        (cell.lateral_shift_mm, cell.load_N): report.draw_cell_picture(cell.judged, position.placement)
        for position in base_map.positions
        for cell in position.cells
        if cell.judged is not None
    }
    assert len(handed) == 2

    def drawn_again(*arguments):
        pytest.fail("drawn again")

    monkeypatch.setattr(report, "small_figure", drawn_again)
    assert write_map_report(base_map, tmp_path, pictures=handed).read_text("utf-8") == whole_report


TOUCHED = """
<script>addEventListener("load", () => {
  const must = (right, what) => { if (!right) console.error(what); };
  const spots = [...document.querySelectorAll(".spots a")], spot = spots[0], tip = document.getElementById("tip");
  const words = spot.getAttribute("aria-label"), dialog = document.querySelector("dialog");
  must(tip.hidden && !dialog.open, "something is open at the start");
  spot.dispatchEvent(new PointerEvent("pointerenter"));
  must(!tip.hidden && tip.textContent === words, "the pointer shows no words");
  must(/^-4.00 mm, 50 kN: Hertz HOLDS\\n/.test(words), "another cell: " + words);
  must(/peak pressure.*limit.*HOLDS/.test(words), "no measures: " + words);
  const box = tip.getBoundingClientRect();
  must(box.left >= 0 && box.right <= document.documentElement.clientWidth && box.top >= 0, "the words stick out");
  spot.dispatchEvent(new PointerEvent("pointerleave"));
  must(tip.hidden, "the words stay");
  spot.click();
  must(dialog.open && tip.hidden, "a click opens nothing");
  must(dialog.querySelector("h3").textContent === "-4.00 mm, 50 kN: Hertz HOLDS", "another title");
  must(dialog.querySelectorAll("tr").length > 5, "no table of measures");
  must([...dialog.querySelectorAll("img")].every(one => one.naturalWidth > 100), "a picture is not there");
  must(dialog.getBoundingClientRect().right <= document.documentElement.clientWidth, "the dialog sticks out");
  dialog.querySelector("button").click();
  must(!dialog.open, "it does not close");
  spot.focus();
  spot.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowRight", cancelable: true}));
  must(document.activeElement === spots[1], "an arrow goes to no neighbour");
  console.log("touched");
});</script></body>"""


@pytest.mark.parametrize("width", slow_but([400, 1400], 1))
def test_a_cell_of_a_map_can_be_touched_in_a_browser(base_map, width, tmp_path):
    page = write_map_report(base_map, tmp_path)
    page.write_text(page.read_text("utf-8").replace("</body>", TOUCHED), "utf-8")
    sizes = shown(page, width, tmp_path)
    assert [line.partition("CONSOLE")[2].split('"')[1] for line in sizes["console"]] == ["touched"]
    assert sizes["requests"] == []
    assert sizes["content_width"] <= width


def test_a_report_of_a_map_says_what_would_decide_an_open_cell(tmp_path):
    off = abs(position(-4.0).cells[0].judged.deviation["p_max_MPa"])
    # a limit at the deviation itself
    open_position = position(-4.0, p_max=off, judged_by=("p_max",))
    assert open_position.cells[0].verdict == "UNRESOLVED"
    one_cell_map = ApplicabilityMap(case=Case(roll="touching"), loads_N=(LOAD_N,), positions=(open_position,))
    assert "finer meshes cannot decide: the deviation is only 0.00 % from its limit" in write_map_report(
        one_cell_map, tmp_path
    ).read_text("utf-8")


def test_columns_are_as_wide_as_the_smallest_step_and_wide_ones_leave_gaps(base_map, monkeypatch):
    figures = []
    monkeypatch.setattr("fecontact.maps.picture.save_figure", lambda figure, path: figures.append(figure))
    for shifts in ([-4.0, -2.0, 0.0], [0.0, 0.5, 1.0, 4.0], [3.0], [0.0, 1.0]):
        save_map_figure(build_verdict_view(verdicts(base_map, shifts, [50, 100], ["hf"] * len(shifts))), "unused.png")
    widths = [{round(bar.get_width(), 9) for bar in figure.axes[0].patches} for figure in figures]
    assert widths == [{1.0}, {0.5}, {1.0}, {0.7}]
    # what was not solved is hatched and white, and the legend says so
    white = [bar for bar in figures[0].axes[0].patches if bar.get_hatch()]
    assert {bar.get_y() for bar in white} == {50.0}
    assert {bar.get_facecolor() for bar in white} == {(1.0, 1.0, 1.0, 1.0)}
    legend = [text.get_text() for text in figures[0].legends[0].get_texts()]
    assert "not solved: between two verdicts" in legend
    assert "unresolved" not in legend


def test_load_on_separate_patches_has_a_letter_and_no_number(base_map):
    cell = base_map.cells[1]
    load = cell.judged
    verdict = replace(load.verdict, answer="FAILS", measure="separate_load")
    judgements = {
        name: replace(judgement, deviation={**judgement.deviation, "separate_load": 0.333})
        for name, judgement in load.judgements.items()
    }
    separate = replace(load, verdict=verdict, judgements=judgements)
    position = replace(base_map.positions[1], cells=(replace(cell, judged=separate),))
    view = build_verdict_view(replace(base_map, positions=(position,)))
    assert cells_of(view)[0].text == "S"
    assert view.number == "limit utilisation of Hertz;\nabove 1 it does not hold"


def test_a_map_is_gone_through_cell_by_cell_drawn_and_told_in_a_line(base_map):
    assert list(base_map) == list(base_map.cells)
    assert (len(base_map), base_map[0]) == (3, base_map.cells[0])
    assert fecontact.to_dataframe(base_map).to_dict("records")[0]["verdict_answer"] == "HOLDS"
    assert repr(base_map).endswith("3 shifts, 1 load: Hertz in 3 cells 1 HOLDS, 1 FAILS, 1 failed>")
    assert "<td>HOLDS</td>" in base_map._repr_html_()
    figure = fecontact.plot.map(base_map, measure="theory")
    assert "the cheapest theory that holds" in figure.axes[0].get_title()
    # for a paper: its width, without title and numbers
    narrow = fecontact.plot.map(base_map, width_mm=85, title=False, numbers=False)
    assert narrow.get_figwidth() == pytest.approx(85.0 / 25.4)
    assert narrow.axes[0].get_title() == ""
    assert not any(character.isdigit() for text in narrow.axes[0].texts for character in text.get_text())
    axes = Figure().subplots()
    assert fecontact.plot.map(base_map, axes) is axes.figure
    assert axes.get_legend() is not None
    with pytest.raises(InputError, match="allowed: 40 to 1000"):
        fecontact.plot.map(base_map, width_mm=10)
    with pytest.raises(InputError, match="leave one of them out"):
        fecontact.plot.map(base_map, axes, width_mm=85)
    with pytest.raises(InputError, match="measure is 'depth'"):
        fecontact.plot.map(base_map, measure="depth")
