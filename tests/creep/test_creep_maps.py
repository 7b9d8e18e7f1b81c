"""Maps by forces and by the cheapest theory, with planted verdicts."""

import json
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import pytest
from matplotlib.colors import to_hex

from fecontact.case import Case
from fecontact.cli import call
from fecontact.contact_theories.registry import MULTI_HERTZ
from fecontact.contact_theories.rolling.creepage import Creepages
from fecontact.criteria import Creep
from fecontact.errors import InputError
from fecontact.features.creep.force_verdict import DISPLACED_CENTRE, PATCH_SHAPE
from fecontact.features.creep.judged_force import ForceDeviation, judge_force
from fecontact.features.creep.laws import REFERENCE_LAW
from fecontact.features.creep.maps import FORCE_MAP, LAW_MAP
from fecontact.maps.files import write_map
from fecontact.maps.model import FIRST_YIELD, ApplicabilityMap, LoadInterval, LoadLimit, MapCell, MapPosition
from fecontact.maps.picture import save_map_figure
from fecontact.maps.positions import add_slow_readings, find_feature_limits
from fecontact.maps.telling import build_law_row, build_map_record
from fecontact.maps.text_map import format_map_table
from fecontact.maps.theory_views import build_law_view
from fecontact.maps.verdict_views import YIELD_WORDS, build_feature_view
from fecontact.maps.views import refuse_measure
from fecontact.outputs.style import ANSWER_COLOURS, BETWEEN_VERDICTS

CASE = Case(roll="touching", creep=Creep(friction=0.3))
LOADS = (20e3, 50e3, 100e3)


def judged_as(answer, percent, cause=None, at=None, uncertainty=0.002):
    """A judgement of forces with a planted verdict."""
    creepages = Creepages(xi=1e-3) if at is None else at
    force_judgement = judge_force(
        [ForceDeviation(creepages=creepages, deviation_of_muN=percent / 100.0, uncertainty_of_muN=uncertainty)], 0.05
    )
    return replace(force_judgement, verdict=replace(force_judgement.verdict, answer=answer, cause=cause))


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A load with only its verdict of forces and the verdicts of the laws."""

    load_N: float
    features: dict
    status: str = "converged"
    usable: bool = True
    plastic: None = None
    case: Case = CASE
    verdict: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(answer="HOLDS", cause=None))


def judged_load(load_N, percent, answer, cause=None, laws=None):
    creep = SimpleNamespace(verdict=judged_as(answer, percent, cause))
    return Judged(load_N=load_N, features={"creep": creep, "creep_laws": laws or {}})


def cell(load, status="converged", shift=0.0):
    return MapCell(lateral_shift_mm=shift, load_N=load.load_N, status=status, judged=load)


def position(shift, cells, tried=()):
    """Position of a map at which Hertz holds by pressure at all loads."""
    # by pressure Hertz holds at all loads here
    all_loads = LoadInterval(low_N=LOADS[0], high_N=LOADS[-1], answer="HOLDS")
    limit = LoadLimit(intervals=(all_loads,), tried=tuple((load.load_N, "HOLDS") for load in tried))
    placement = object()
    return MapPosition(
        lateral_shift_mm=shift,
        cells=cells,
        limit=limit,
        limits_of=find_feature_limits(cells, tried, placement, limit),
        placement=placement,
        tried=tried,
    )


def laws_of(polach, fastsim, exact="HOLDS"):
    judgements = {
        name: judged_as(answer, off, at=Creepages(eta=2e-3), uncertainty=0.01)
        for name, answer, off in (("polach", polach, 12.0), ("fastsim", fastsim, 3.1), ("exact", exact, 1.0))
    }
    return judgements | {REFERENCE_LAW: judged_as("HOLDS", 0.0, uncertainty=0.0)}


@pytest.fixture
def planted_map(monkeypatch):
    """Three positions: Hertz holds up to some load, fails at all loads, or has no solution."""
    tried = (judged_load(30e3, 3.0, "HOLDS"), judged_load(70e3, 6.0, "FAILS", DISPLACED_CENTRE))
    loads_seen = []

    def judge_and_note(load, placement):
        assert load in tried
        loads_seen.append(load.load_N)
        return load.features["creep"].verdict

    monkeypatch.setattr("fecontact.features.creep.maps.FORCE_MAP", replace(FORCE_MAP, judge=judge_and_note))
    first = (
        cell(judged_load(20e3, 1.0, "HOLDS", laws=laws_of("HOLDS", "HOLDS"))),
        cell(judged_load(50e3, 4.0, "HOLDS", laws=laws_of("FAILS", "HOLDS"))),
        cell(judged_load(100e3, 9.0, "FAILS", DISPLACED_CENTRE, laws=laws_of("FAILS", "UNRESOLVED"))),
    )
    fails = laws_of("FAILS", "FAILS", "FAILS")
    second = tuple(cell(judged_load(load, 20.0, "FAILS", PATCH_SHAPE, laws=fails), shift=1.0) for load in LOADS)
    lost = tuple(MapCell(lateral_shift_mm=2.0, load_N=load, status="failed: no memory") for load in LOADS)
    applicability_map = ApplicabilityMap(
        case=CASE,
        loads_N=LOADS,
        positions=(
            position(0.0, first, tried),
            position(1.0, second),
            MapPosition(lateral_shift_mm=2.0, cells=lost, limit=LoadLimit(reason="failed: no memory")),
        ),
    )
    return applicability_map, loads_seen


def test_limits_of_forces_come_from_the_loads_that_were_solved(planted_map):
    applicability_map, loads_seen = planted_map
    limits = [position.limits_of.get("force") for position in applicability_map.positions]
    assert [
        [(interval.low_N, interval.high_N, interval.answer) for interval in limit.intervals] for limit in limits[:2]
    ] == [
        [(20e3, 50e3, "HOLDS"), (50e3, 70e3, "UNRESOLVED"), (70e3, 100e3, "FAILS")],
        [(20e3, 100e3, "FAILS")],
    ]
    # of the loads of the search, only the loads that add information
    assert loads_seen == [70e3]
    assert limits[0].tried == ((70e3, "FAILS"),)
    assert limits[0].F_max_N == 50e3
    # unsolved loads have no verdict, and the limit of pressure gives the reason
    assert limits[2] is None


def test_limits_of_forces_with_no_friction_and_of_loads_that_must_not_be_used():
    limit = LoadLimit(reason="no load could be solved", note="20 kN: not converged")
    without = Judged(load_N=20e3, features={})
    assert find_feature_limits((cell(without),), (), object(), limit) == {}
    # forces were judged, but of a contact that did not converge
    lost = replace(judged_load(20e3, 1.0, "UNRESOLVED"), status="not converged")
    limits_found = find_feature_limits((cell(lost, status="not converged"),), (), object(), limit)["force"]
    assert (limits_found.intervals, limits_found.reason, limits_found.note) == ((), limit.reason, limit.note)


def test_laws_of_forces_are_judged_at_loads_that_may_be_used(monkeypatch):
    loads_seen = []

    def judged_by(load, placement):
        loads_seen.append((load.load_N, placement))
        return laws_of("HOLDS", "HOLDS")

    monkeypatch.setattr("fecontact.features.creep.laws.judge_creep_laws", judged_by)
    usable, lost = judged_load(20e3, 1.0, "HOLDS"), judged_load(50e3, 1.0, "HOLDS")
    nothing = MapCell(lateral_shift_mm=0.0, load_N=100e3, status="failed: no memory")
    before = position(0.0, (cell(usable), cell(lost, status="not converged"), nothing))
    after = add_slow_readings(before)
    assert loads_seen == [(20e3, before.placement)]
    assert list(after.cells[0].judged.features["creep_laws"]) == ["polach", "fastsim", "exact", REFERENCE_LAW]
    assert after.cells[1:] == before.cells[1:]
    assert (after.limit, after.limits_of) == (before.limit, before.limits_of)


def bands(ax):
    return [
        (to_hex(bar.get_facecolor()), round(bar.get_x(), 3), round(bar.get_y(), 3))
        for bar in ax.patches
        if bar.get_fill()
    ]


def test_the_picture_of_forces_has_the_lines_of_yielding(planted_map, monkeypatch):
    figures = []
    monkeypatch.setattr("fecontact.maps.picture.save_figure", lambda figure, path: figures.append(figure))
    view = build_feature_view(planted_map[0], "force")
    words = YIELD_WORDS[FIRST_YIELD]
    save_map_figure(
        replace(view, columns=tuple(replace(column, lines=[(60.0, words)]) for column in view.columns)), "unused.png"
    )
    (ax,) = figures[0].axes
    assert words in [text.get_text() for text in ax.figure.legends[0].get_texts()]


def test_the_png_of_forces_is_drawn_as_that_of_pressure(planted_map, monkeypatch):
    figures = []
    monkeypatch.setattr("fecontact.maps.picture.save_figure", lambda figure, path: figures.append(figure))
    save_map_figure(build_feature_view(planted_map[0], "force"), "unused.png")
    (ax,) = figures[0].axes
    assert [colour for colour, *_ in bands(ax)] == [
        # between 50 and 70 kN nothing was solved: it is not painted as an open verdict is
        ANSWER_COLOURS[answer]
        for answer in ("HOLDS", BETWEEN_VERDICTS, "FAILS", "FAILS", "failed")
    ]
    assert [text.get_text() for text in ax.texts] == ["0.20", "0.80", "1.8 D", *["4.0 F"] * 3, *"!!!"]
    legend = " ".join(text.get_text().replace("\n", " ") for text in ax.figure.legends[0].get_texts())
    for words in (
        "centre of pressure away from the contact point",
        "shape of the patch",
        "above 1 it does not hold",
        "no usable result",
    ):
        assert words in legend
    conditions = " ".join(ax.figure.legends[0].get_title().get_text().split())
    assert "5 % of µN, friction 0.3, creepages up to 2 %" in conditions
    # one picture is both wheels
    assert [axis.get_xlabel()[:11] for axis in ax.child_axes] == ["right wheel"]


def test_tables_of_forces_and_theories(planted_map):
    lines = format_map_table(build_feature_view(planted_map[0], "force")).splitlines()
    assert lines[1].split() == [
        "+0.00",
        "+",
        "0.20",
        "+",
        "0.80",
        "xD",
        "1.8",
        *["holds", "20", "to", "50,", "not", "solved", "50", "to", "70,", "fails", "70", "to", "100", "kN"],
    ]
    assert lines[3].split()[:4] == ["+2.00", "!", "!", "!"]
    assert any("number: limit utilisation, limit 5 % of µN" in line for line in lines)
    lines = format_map_table(build_law_view(planted_map[0], LAW_MAP)).splitlines()
    assert lines[1].split() == ["+0.00", "Po", "12.0", "FA", "3.1", "EX", "1.0"]
    # the third law is known to hold, and the second may
    assert any("cells in which a cheaper one may hold: 1 (" in line for line in lines)
    assert lines[2].split() == ["+1.00", "ER", "ER", "ER"]


def test_the_png_of_theories_has_a_colour_for_each_and_says_what_is_open(planted_map, monkeypatch):
    colours = build_law_view(planted_map[0], LAW_MAP).colours

    figures = []
    monkeypatch.setattr("fecontact.maps.picture.save_figure", lambda figure, path: figures.append(figure))
    save_map_figure(build_law_view(planted_map[0], LAW_MAP), "unused.png")
    (ax,) = figures[0].axes
    # what lies between two loads with different theories was not solved
    assert [colour for colour, *_ in bands(ax)] == [
        *(
            colours["polach"],
            ANSWER_COLOURS[BETWEEN_VERDICTS],
            colours["fastsim"],
            ANSWER_COLOURS[BETWEEN_VERDICTS],
            colours["exact"],
        ),
        *(colours["real"], ANSWER_COLOURS["failed"]),
    ]
    assert [text.get_text() for text in ax.texts] == ["Po 12.0", "FA 3.1", "EX 1.0", "ER", "ER", "ER", *"!!!"]
    rows = [build_law_row(cell, LAW_MAP) for cell in planted_map[0].cells]
    assert [row.get("cheapest_theory") for row in rows] == [
        *("polach", "fastsim", "exact"),
        *(["real"] * 3 + [None] * 3),
    ]
    assert rows[1]["fastsim_off_percent_of_muN"] == pytest.approx(3.1)
    assert rows[8]["status"] == "failed: no memory"


def test_a_measure_of_forces_needs_friction(tmp_path, capsys):
    with pytest.raises(InputError, match=r"--friction 0\.3"):
        refuse_measure(Case(), "force")
    refuse_measure(CASE, "force")
    with pytest.raises(InputError, match="needs the measure pressure"):
        refuse_measure(CASE, "force", MULTI_HERTZ)
    with pytest.raises(InputError, match="allowed: pressure, theory, force"):
        refuse_measure(CASE, "speed")
    # the cheapest theory of the pressure needs none
    for measure in ("pressure", "theory"):
        refuse_measure(Case(), measure)
    # before anything is solved
    assert call(["map", "--shifts", "0", "--measure", "force", "--out", str(tmp_path / "map")]) == 2
    assert "friction" in capsys.readouterr().err
    assert not (tmp_path / "map").exists()


def test_the_record_of_a_map_with_friction_has_the_limits_of_forces(planted_map, monkeypatch):
    monkeypatch.setattr("fecontact.maps.telling.build_cell_record", lambda cell: {})
    monkeypatch.setattr("fecontact.maps.telling.build_stiffness_rows", lambda position: [])
    monkeypatch.setattr("fecontact.maps.telling.count_theory_shares", lambda planted_map: [])
    limits = json.loads(json.dumps(build_map_record(planted_map[0])["force_limits"]))
    assert [limit["F_max_N"] for limit in limits] == [50e3, None, None]


def test_pictures_and_tables_of_another_friction_go(planted_map, tmp_path, monkeypatch):
    for name in ("build_result_record", "build_contact_row", "save_map_figure"):
        monkeypatch.setattr(f"fecontact.maps.files.{name}", lambda *_: {})
    monkeypatch.setattr("fecontact.maps.files.build_views", lambda *_, **__: {})
    monkeypatch.setattr("fecontact.maps.files.build_stiffness_rows", lambda position: [])
    old = ("map_force.png", "map_force.svg", "map_law.csv", "map_law.png")
    for name in old:
        (tmp_path / name).write_text("of another map", "utf-8")
    bare = [replace(cell, judged=None) for cell in planted_map[0].cells]
    position = replace(planted_map[0].positions[0], cells=tuple(bare))
    write_map(replace(planted_map[0], case=Case(roll="touching"), positions=(position,)), tmp_path)
    assert not {path.name for path in tmp_path.iterdir()} & {*old}
