"""Screened fleets.

Rows are compared with other ways to the same numbers, also after an interrupted run.
"""

import ast
import os
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import duckdb
import numpy as np
import psutil
import pytest
from inline import inline_crew, stand_ins
from marks import slow_but

import fecontact
from fecontact import Case
from fecontact.cli import call
from fecontact.contact_theories.registry import HERTZ, THEORIES, LoadedPlacement, fast_theory
from fecontact.errors import ConvergenceError, InputError, ProgramError
from fecontact.features.fleet import pair_jobs, reading, running, screened_position, screening
from fecontact.features.fleet.answer import evaluate_fleet
from fecontact.features.fleet.model import read_fleet
from fecontact.features.fleet.population import Candidate, find_candidates
from fecontact.features.fleet.profile_files import mark_unusable, select_reading
from fecontact.features.fleet.reading import ReadingProfile, StoredProfile
from fecontact.features.fleet.report import explain_answer, write_report
from fecontact.features.fleet.screened_position import STRIP_UNCERTAINTY, make_position_row, screen_variant
from fecontact.features.fleet.screening_rows import FILTER_COLUMNS, MEASURE_COLUMNS
from fecontact.judging.measures import compare_theories, compute_deviations
from fecontact.profiles.examples import format_points, make_worn_points, write_examples
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.reading import Reading
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.profiles.writers import sample_points
from fecontact.solving.alone import compute_normal_force
from fecontact.solving.placing import make_wheelset, place_case
from fecontact.solving.position import expect_on_half_space
from fecontact.solving.profile_variants import (
    REFERENCE_LABEL,
    judge_case_variants,
    label_reference,
    list_profile_variants,
)

ROOT = Path(__file__).parents[2]
FLEET = """
[wheels]
files = ["S1002", "measured/wheel.csv"]
[rails]
files = {rails}
[shifts_mm]
values = [0, 3]
weights = [1, 3]
[loads_kN]
values = [60, 100]
"""
RAILS = ["60E1", "measured/rail.csv"]


def file_of(folder, rails=RAILS, **changes):
    write_examples(folder / "measured")
    text = FLEET.format(rails=list(rails)).replace("'", '"')
    for old, new in changes.items():
        text = text.replace(f"{old} =", f"{old} = {new} #", 1)
    (folder / "fleet.toml").write_text(text)
    return folder / "fleet.toml"


def run(path, out, **how):
    with stand_ins(inline_crew(), None, ""):
        return fecontact.run_fleet(path, out, **how)


def screened(out):
    return duckdb.sql(f"select * from '{out}/screen/part-*.parquet' order by all").df()


def table_bytes(out):
    return {path.name: path.read_bytes() for path in sorted((out / "screen").iterdir())}


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """A screened fleet of exact and measured wheels and rails.

    It has one wheel and one rail of each kind. Also returns the folder of the screen.
    """
    folder = tmp_path_factory.mktemp("fleet")
    path = file_of(folder)
    return path, run(path, folder / "out")


def test_a_row_a_position_with_weights_that_sum_to_one(fleet):
    rows = screened(fleet[1].out)
    assert len(rows) == fleet[1].positions == 16
    assert rows["weight"].sum() == pytest.approx(1.0, abs=1e-12)
    assert set(rows.loc[rows.shift_mm == 3.0, "weight"].round(9)) == {0.75 / 8}
    assert sum(fleet[1].verdicts.values()) == pytest.approx(1.0)
    by_verdict = rows.groupby("verdict")["weight"].sum().to_dict()
    assert by_verdict == pytest.approx(dict(fleet[1].verdicts))
    # exact lines are one, points allow the lines of both filters
    lines = rows.groupby(["wheel", "rail"])["variants"].first().to_dict()
    assert lines.pop(("S1002", "60E1")) == 1
    assert min(lines.values()) >= 7
    assert set(rows.loc[rows["variants"] > 1, "verdict"]) <= {"HOLDS", "FAILS", "OPEN"}
    assert set(rows["open_because"].dropna()) <= {"filter", "nominal profile", "noise", "accuracy of the screen"}
    assert list(rows["open_because"].isna()) == [verdict != "OPEN" for verdict in rows["verdict"]]
    for row in rows.itertuples():
        assert (row.verdict == "HOLDS") == (row.variants_holding == row.variants)


def test_positions_of_a_table_have_the_rows_of_shifts_and_loads(fleet, tmp_path):
    path = file_of(tmp_path, RAILS[:1])
    (tmp_path / "places.csv").write_text("shift_mm,load_kN,weight\n3,100,3\n0,60,1\n")
    text = path.read_text()
    path.write_text(f'{text[: text.index("[shifts_mm]")]}[positions]\ntable = "places.csv"\n')
    rows = screened(run(path, tmp_path / "out").out)
    assert sorted(rows.groupby(["shift_mm", "load_kN"])["weight"].sum().items()) == [
        ((0.0, 60.0), pytest.approx(0.25)),
        ((3.0, 100.0), pytest.approx(0.75)),
    ]
    keys = ["wheel", "rail", "shift_mm", "load_kN"]
    rows_of_pairs = screened(fleet[1].out).merge(rows[keys], on=keys).sort_values(keys, ignore_index=True)
    assert rows_of_pairs.drop(columns="weight").equals(rows.sort_values(keys, ignore_index=True).drop(columns="weight"))


def test_rows_of_an_exact_pair_are_those_of_a_contact_table(fleet):
    rows = screened(fleet[1].out).query("wheel == 'S1002' and rail == '60E1'").sort_values(["shift_mm", "load_kN"])
    table_row = fecontact.table(Case(), [0.0, 3.0], [60e3, 100e3])
    for row, line in zip(rows.itertuples(), table_row, strict=True):
        assert row.place_y_mm == pytest.approx(line["touch1_rail_y_mm"], abs=1e-6)
        for name, key in (("p_max", "p_max_MPa"), ("area", "area_mm2"), ("a", "a_mm"), ("b", "b_mm")):
            expected = 100.0 * (line[f"hertz_{key}"] / line[f"strip_{key}"] - 1.0)
            # placed with one roll of the wheelset that differs by rounding
            assert getattr(row, f"{name}_percent") == pytest.approx(expected, abs=1e-3), name


def test_conicity_is_that_of_the_wheelset_and_concentration_that_of_cones():
    case = Case(wheel="CONE40", rail="60E1", inclination_rad=0.0)
    wheelset = make_wheelset(case)
    conicity, concentration = screening.calculate_conicity_and_concentration(wheelset)
    # a cone of 1:40 rolls like one, wherever it touches; its contact point moves by the turn of the rail alone
    assert conicity == pytest.approx(1.0 / 40.0, rel=2e-3)
    assert concentration == 1.0
    conicities = [
        conicity_at.unrolled
        for conicity_at in fecontact.geometry(Case(), [-6.0, 0.0, 6.0]).conicities
        if conicity_at.amplitude_mm == 3.0
    ]
    assert screening.calculate_conicity_and_concentration(make_wheelset(Case()))[0] == pytest.approx(
        conicities[0], rel=0.02
    )


@pytest.mark.parametrize(("shift", "load_kN"), [(-4.0, 100.0), (2.0, 60.0), (4.0, 120.0), (5.0, 50.0)])
def test_what_strips_say_of_hertz_is_what_the_half_space_says(shift, load_kN):
    case = Case(lateral_shift_mm=shift, load_N=1e3 * load_kN)
    placement = place_case(case)
    half_space = expect_on_half_space(case, placement)[1].half_space
    ellipse = THEORIES[HERTZ].approximate(
        LoadedPlacement(placement=placement, case=case, normal_force_N=half_space.normal_force_N)
    )
    strips = THEORIES["strip"].approximate(
        LoadedPlacement(placement=placement, case=case, normal_force_N=half_space.normal_force_N)
    )
    expected, off = compute_deviations(half_space, ellipse), compare_theories(strips, ellipse)
    # what is stated as the uncertainty of the strips; at 5 mm patches lie in two planes, which strips do not see
    often = 1.0 if shift < 5.0 else 4.0
    for name in MEASURE_COLUMNS:
        assert off[name] == pytest.approx(expected[name], abs=often * STRIP_UNCERTAINTY[name] + 2e-3), name


def test_an_ellipse_is_no_off_strips_of_constant_curvature():
    case = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)
    placement = place_case(case)
    loaded = LoadedPlacement(placement=placement, case=case, normal_force_N=compute_normal_force(case, placement))
    strips, ellipse = (THEORIES[name].approximate(loaded) for name in ("strip", HERTZ))
    off = compare_theories(strips, ellipse)
    # 100 strips are within 0.3 % of Hertz (contact_theories/strip_method.py), and the load of an edge of cells is
    # elsewhere
    assert all(abs(off[name]) < 3.5e-3 for name in MEASURE_COLUMNS)
    # a peak that is 10 % too large is seen as such
    patch = ellipse.single
    planted = compare_theories(strips, replace(ellipse, patches=(replace(patch, p_max_MPa=1.1 * patch.p_max_MPa),)))
    assert planted["p_max_MPa"] == pytest.approx(1.1 * (1.0 + off["p_max_MPa"]) - 1.0)


def test_theories_in_coarse_steps_find_the_same_contact():
    case = Case(lateral_shift_mm=-3.0)
    placement = place_case(case)
    loaded = LoadedPlacement(placement=placement, case=case, normal_force_N=compute_normal_force(case, placement))
    for name in ("kik_piotrowski", "stripes", "analyn", "equivalent_ellipse", "kpec"):
        coarse, fine = fast_theory(name)(loaded), THEORIES[name].approximate(loaded)
        assert coarse.patches[0].p_max_MPa == pytest.approx(fine.patches[0].p_max_MPa, rel=1e-6), name


@pytest.mark.parametrize(("side", "load_kind", "seed"), [("left", "vertical", 1), ("right", "normal", 2)])
def test_positions_of_a_pair_have_the_rows_that_they_have_alone(side, load_kind, seed):
    """All positions of a pair are screened in arrays, at random shifts and loads."""
    random = np.random.default_rng(seed)
    wheel, rail = (
        StoredProfile(body=body, spec=name, reading=Reading(), folder=Path(), labels=())
        for body, name in (("wheel", "S1002"), ("rail", "60E1"))
    )
    shifts = [round(float(shift), 6) for shift in random.uniform(-6.0, 6.0, 3)]
    positions = tuple((shift, round(float(load), 6)) for shift in shifts for load in random.uniform(30.0, 120.0, 2))
    case = Case(side=side, load_kind=load_kind, inclination_rad=0.025)
    pair = screening.ScreeningPair(wheel=wheel, rail=rail, case=case, positions=positions, theory="strip")
    for position, row in zip(positions, pair.rows(), strict=True):
        (row_alone,) = replace(pair, positions=(position,)).rows()
        assert row.keys() == row_alone.keys()
        for column, value in row.items():
            # The roll of a wheelset is exact to 1e-12 rad, and columns in percent are small differences.
            expected = row_alone[column]
            if isinstance(value, float):
                expected = pytest.approx(expected, rel=1e-8, abs=1e-7, nan_ok=True)
            assert value == expected, column


def test_kept_lines_are_those_that_were_smoothed_to_the_last_bit(tmp_path):
    files = write_examples(tmp_path)
    for path, body in zip(files, ("rail", "wheel"), strict=True):
        folder = tmp_path / body
        folder.mkdir()
        settings = {"body": body, "spec": str(path), "reading": Reading()}
        ReadingProfile(**settings, content_hash="")(folder, None)
        labels = tuple(label for label, *_ in reading.read_record(folder)["lines"])
        kept_lines = StoredProfile(**settings, folder=folder, labels=labels)
        reference = resolve_rail(str(path)) if body == "rail" else resolve_wheel(str(path)).profile
        lines = {label_reference(reference): reference} | list_profile_variants(reference)
        assert labels == tuple(lines)
        for label, line in lines.items():
            u = np.linspace(0.0, len(line.segments), 500)
            for name in ("y", "z", "dy", "dz", "ddz"):
                values, expected = (getattr(kind.evaluate(u), name) for kind in (kept_lines.variant(label), line))
                assert np.array_equal(values, expected), (body, label, name)
        # of a label of the other profile alone the reference variant is used
        assert kept_lines.variant("filter 99 mm") is kept_lines.variant(labels[0])


def counted(monkeypatch):
    """Numbers of files and pairs that are processed from here on."""
    calls = Counter()
    for kind in (ReadingProfile, screening.ScreeningPair):
        call = kind.__call__

        def count_call(self, folder, finished, call=call, name=kind.__name__):
            calls[name] += 1
            return call(self, folder, finished)

        monkeypatch.setattr(kind, "__call__", count_call)
    return calls


def test_a_file_that_is_added_costs_that_file_and_its_pairs(fleet, tmp_path, monkeypatch):
    shutil.copytree(fleet[0].parent, tmp_path / "own")
    path, out = tmp_path / "own" / "fleet.toml", tmp_path / "own" / "out"
    before, calls = table_bytes(out), counted(monkeypatch)
    # the same content elsewhere is the same file
    assert run(path, out).reused == 4
    assert table_bytes(out) == before
    assert not calls
    file_of(path.parent, [*RAILS, "54E1"])
    later = run(path, out)
    assert calls == {"ReadingProfile": 1, "ScreeningPair": 2}
    assert later.pairs == 6
    # weights are of the new population, everything else is as it was
    old, new = screened(fleet[1].out), screened(out).query("rail != '54E1'").reset_index(drop=True)
    assert old.drop(columns="weight").equals(new.drop(columns="weight"))
    assert new["weight"].to_numpy() == pytest.approx(old["weight"].to_numpy() * 2 / 3)
    # what is damaged is done again, and what is no longer asked for is in no table
    next((out / "pairs").iterdir()).joinpath(screening.ROWS_FILE).write_bytes(b"none")
    file_of(path.parent)
    calls.clear()
    run(path, out)
    assert calls["ScreeningPair"] <= 1
    assert table_bytes(out) == before


def test_what_cannot_be_read_is_told_and_stops_nothing(tmp_path):
    junk = tmp_path / "junk"
    write_examples(tmp_path / "measured")
    junk.mkdir()
    (junk / "a.csv").write_bytes(os.urandom(3000))
    (junk / "b.txt").write_text("nothing to see\n")
    (junk / "c.csv").write_text("y,z\n1,2\n")
    shutil.copyfile(tmp_path / "measured/wheel.csv", junk / "wheel.csv")
    shutil.copyfile(tmp_path / "measured/rail.csv", junk / "turned.csv")
    path = file_of(tmp_path, ["60E1"], values="[0]")
    path.write_text(path.read_text().replace('["S1002", "measured/wheel.csv"]', '"junk"').replace("weights", "#"))
    outcome = run(path, tmp_path / "out")
    profiles = duckdb.sql(f"select * from '{tmp_path}/out/profiles.parquet'").df().set_index("name")
    assert set(profiles.query("status == 'refused'").index) == {"a", "b", "c"}
    # a rail among the wheels
    assert set(profiles.query("status == 'suspicious'").index) == {"turned"}
    assert (profiles.query("status == 'refused'")["reason"].str.len() > 10).all()
    assert "3 of 6 files could not be read; 1 of 6 files is suspicious" in outcome.headline
    assert outcome.pairs == 1
    assert 7.0 < profiles.loc["wheel", "noise_um"] < 9.0
    # its noise asks for more than the usual filters
    assert profiles.loc["wheel", "filter_mm"] == "12.8, 9.04, 18.1"
    (junk / "wheel.csv").unlink()
    with pytest.raises(InputError, match=r"0 of \d files? can be used"):
        run(path, tmp_path / "out")


@pytest.mark.slow
def test_notes_of_a_reader_are_in_the_log_the_table_and_the_report(tmp_path):
    """A file without the side of the track.

    The reader assumes that the profile is turned over, and notes this.
    """
    rail = ROOT / "tests/profiles/rail_left_iter288.ban"
    path = file_of(tmp_path, ["60E1", str(rail)], files='["S1002"]', values="[0]", weights="[1]")
    path.write_text(path.read_text().replace("values = [60, 100]", "values = [60]"))
    assert call(["fleet", "run", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    said = "MiniProf file: X points to the track centre, so y = -X"
    profiles = duckdb.sql(f"select name, reader_notes from '{tmp_path}/out/profiles.parquet'").fetchall()
    notes = {name: text.splitlines() for name, text in profiles}
    assert notes["rail_left_iter288"][0] == said
    # exact profiles of the library need no assumption
    assert notes["60E1"] == notes["S1002"] == []
    assert f"rail rail_left_iter288: {said}" in (tmp_path / "out/run.log").read_text("utf-8")
    answer = evaluate_fleet(tmp_path / "out")
    assert [row for row in answer.notes if row["note"] == said] == [
        {"body": "rail", "note": said, "files": 1, "example": str(rail)}
    ]
    report = write_report(answer, tmp_path / "out")
    assert said in report.read_text("utf-8")
    assert said in (tmp_path / "out/report/notes.csv").read_text("utf-8")


def test_a_wheel_has_the_radius_of_its_table_and_no_other_than_a_case_can_have(tmp_path, monkeypatch):
    cases = {}
    monkeypatch.setattr(
        screening.ScreeningPair, "rows", lambda self: cases.update({self.case.rolling_radius_mm: 1}) or []
    )
    monkeypatch.setattr(running, "write_screen", lambda *arguments: {"HOLDS": 1.0})
    path = file_of(tmp_path, ["60E1"])
    path.write_text(path.read_text().replace('["S1002", "measured/wheel.csv"]', '"wheels.csv"'))
    rows = ("S1002,a,425", "EN13715_1in40,b,", "CONE40,c,-3")
    (tmp_path / "wheels.csv").write_text("file,name,rolling_radius_mm\n" + "\n".join(rows) + "\n")
    with pytest.raises(InputError, match=r"row 3: rolling_radius_mm is -3.0 mm; allowed: finite and > 0"):
        run(path, tmp_path / "out")
    (tmp_path / "wheels.csv").write_text("file,name,rolling_radius_mm\n" + "\n".join(rows[:2]) + "\n")
    run(path, tmp_path / "out")
    assert set(cases) == {425.0, 460.0}


def test_a_wheel_has_the_radius_of_its_header_where_no_table_and_no_case_gives_one(tmp_path, monkeypatch):
    cases = set()
    monkeypatch.setattr(screening.ScreeningPair, "rows", lambda self: cases.add(self.case.rolling_radius_mm) or [])
    monkeypatch.setattr(running, "write_screen", lambda *arguments: {"HOLDS": 1.0})
    path = file_of(tmp_path, ["60E1"])
    text = path.read_text().replace('["S1002", "measured/wheel.csv"]', '"wheels.csv"')
    points = sample_points(load_library_profile("S1002"))
    rows = "".join(f"{y + 70.0:.6f} {-z:.6f}\n" for y, z in points[::-1])
    head = "ColumnDef=X,Y\nWheelDiameterTaperline=70.0\nDiameterTaperline=719.1924\n\n"
    for name in ("a", "b"):
        # a file with the same content would be refused
        (tmp_path / f"{name}.whl").write_text(f"Filename={name}\n{head}{rows}")
    (tmp_path / "wheels.csv").write_text("file,name,rolling_radius_mm\na.whl,a,\nb.whl,b,425\nS1002,c,\n")
    path.write_text(text)
    outcome = run(path, tmp_path / "out")
    assert cases == {359.5962, 425.0, 460.0}
    assert [note for note in outcome.notes["wheel b"] if "given rolling radius" in note] == [
        "the given rolling radius is 425 mm, but 359.596 mm in the header of b.whl"
    ]
    assert not [note for note in outcome.notes["wheel a"] if "given rolling radius" in note]
    assert [note for note in outcome.notes["wheel a"] if "gives the rolling radius 359.596 mm" in note]
    stored = duckdb.sql(f"select name, rolling_radius_mm from '{tmp_path}/out/profiles.parquet' where body = 'wheel'")
    assert dict(stored.fetchall())["a"] == 359.5962
    # a radius that the case of the fleet gives counts for all
    cases.clear()
    path.write_text(f"{text}[case]\nrolling_radius_mm = 440\n")
    outcome = run(path, tmp_path / "given")
    assert cases == {440.0, 425.0}
    assert any("is 440 mm, but 359.596 mm" in note for note in outcome.notes["wheel a"])


def test_few_wheels_meet_few_rails_at_a_time():
    pairs = [(f"w{wheel:02d}", f"r{rail:02d}") for wheel in range(40) for rail in range(40)]
    ordered = pair_jobs._sort_into_tiles(pairs)
    assert sorted(ordered) == sorted(pairs)
    first = ordered[: reading.TILE_SIZE**2]
    assert {len({pair[body] for pair in first}) for body in (0, 1)} == {reading.TILE_SIZE}


def test_a_position_that_cannot_be_has_its_reason(tmp_path):
    path = file_of(tmp_path, ["60E1"], values="[0, 40]")
    path.write_text(path.read_text().replace('["S1002", "measured/wheel.csv"]', '"S1002"'))
    outcome = run(path, tmp_path / "out")
    rows = screened(tmp_path / "out").query("shift_mm == 40")
    assert set(rows["verdict"]) == {"NO CONTACT"}
    assert rows["reason"].str.contains("lateral shift 40 mm").all()
    assert not rows["reason_kind"].str.contains("40").any()
    assert outcome.verdicts["NO CONTACT"] == pytest.approx(0.75)


def test_lines_that_do_not_agree_leave_a_position_open():
    case = Case(lateral_shift_mm=4.0)
    line = screen_variant(case, place_case(case), "strip")
    # the same contact with a limit between both deviations: it holds on one line and fails on the other
    far = replace(line, off=lambda theory: {**line.off(theory), "p_max_MPa": 0.2})
    middle, short, long, noise = "filter 5.66 mm", "filter 4 mm", "filter 8 mm", "noise 1"
    row = make_position_row({middle: line, long: line})
    assert (row["verdict"], row["open_because"], row["cheaper_possible_theory"]) == ("HOLDS", None, None)
    row = make_position_row({middle: line, short: line, long: far})
    # the theory of the screening is known to hold, and Hertz may
    assert (row["verdict"], row["cause"], row["variants_holding"]) == ("OPEN", "profile", 2)
    assert (row["cheapest_theory"], row["cheaper_possible_theory"]) == ("strip", "hertz")
    assert row["open_because"] == "filter"
    assert [row[column] for column in FILTER_COLUMNS] == ["HOLDS", "HOLDS", "FAILS"]
    assert row["p_max_uncertainty_percent"] == pytest.approx(abs(20.0 - row["p_max_percent"]) + 0.5, abs=1e-6)
    # a noise sample counts with each filter
    row = make_position_row({middle: line, short: far, long: line, noise: far})
    assert [row[column] for column in FILTER_COLUMNS] == ["FAILS", "OPEN", "OPEN"]
    row = make_position_row({middle: line, short: line, long: line, noise: far})
    assert (row["verdict"], row["open_because"]) == ("OPEN", "noise")
    # a declared filter is the only one
    row = make_position_row({long: line, noise: line})
    assert [row[column] for column in FILTER_COLUMNS] == [None, None, "HOLDS"]
    # exact profiles have no filter
    row = make_position_row({"own line": far})
    assert (row["verdict"], row["margin"]) == ("FAILS", pytest.approx((0.05 - 0.2) / 0.005))
    assert [row[column] for column in FILTER_COLUMNS] == ["FAILS"] * 3
    # a declared filter would replace a longer filter that noise asks for, and was not judged
    row = make_position_row({"filter 12 mm": line, "filter 17 mm": far})
    assert [row[column] for column in FILTER_COLUMNS] == [None] * 3
    row = make_position_row({REFERENCE_LABEL: line, short: line, "filter 9 mm": far})
    assert [row[column] for column in FILTER_COLUMNS] == [None] * 3
    # a variant without a contact leaves the position open
    row = make_position_row({middle: line, long: None})
    assert (row["verdict"], row["open_because"], row["variants_holding"], row["variants"]) == ("OPEN", "filter", 1, 2)


def test_theories_outside_their_range_are_named_if_the_criteria_say_so(monkeypatch):
    case = Case(lateral_shift_mm=4.0)
    line = screen_variant(case, place_case(case), "strip")
    included = replace(case, criteria=replace(case.criteria, theories_out_of_range=True))

    def name_theories(off):
        variants = (
            replace(line, off=off, loaded=replace(line.loaded, case=judged_case)) for judged_case in (case, included)
        )
        rows = [make_position_row({"": variant}) for variant in variants]
        return [(row["verdict"], row["cheapest_theory"], row["cheaper_possible_theory"]) for row in rows]

    # all theories fail but one, which is the contact of the screen outside its range
    outside = replace(line.contact, status="out of range")
    with monkeypatch.context() as patch:
        patch.setattr(
            screened_position,
            "fast_theory",
            lambda name: (lambda loaded: outside) if name == "equivalent_ellipse" else fast_theory(name),
        )
        rows = name_theories(
            lambda theory: line.off(theory) if theory is outside else {**line.off(theory), "p_max_MPa": 0.2}
        )
    assert rows == [("FAILS", "strip", None), ("FAILS", "equivalent_ellipse", None)]
    # Hertz holds outside its range: the verdict is on Hertz, and the next theory is named
    hertz = THEORIES["hertz"]
    monkeypatch.setitem(
        THEORIES,
        "hertz",
        replace(hertz, approximate=lambda loaded: replace(hertz.approximate(loaded), status="out of range")),
    )
    (verdict, theory, _), other_theory = name_theories(line.off)
    assert (verdict, theory == "hertz", other_theory) == ("HOLDS", False, ("HOLDS", "hertz", None))


def test_a_sample_has_the_variants_of_its_screen(fleet):
    """The case of a position is judged on the variants of its row."""
    opened = fecontact.open_fleet(fleet[1].out)
    rows = screened(fleet[1].out).query("shift_mm == 3 and load_kN == 60")
    for row in rows.itertuples():
        case = opened.case(row.wheel, row.rail, 3.0, 60.0)
        variants = judge_case_variants(case, place_case(case))
        assert row.variants == (1 if variants is None else len(variants.all))


def test_shares_of_open_positions_are_sums_of_weights(fleet):
    rows, answer = screened(fleet[1].out), evaluate_fleet(fleet[1].out)
    expected = rows.groupby("open_because")["weight"].sum().to_dict()
    assert {row["value"]: row["share"] for row in answer.open_causes} == pytest.approx(expected)
    # the noise asks for longer filters than the usual ones: what a declared filter would give is not known
    assert rows.loc[rows["variants"] > 1, [*FILTER_COLUMNS]].isna().all(axis=None)
    assert answer.filters == []


@pytest.mark.slow
def test_shares_of_each_filter_are_sums_of_weights_and_are_those_of_a_declared_filter(tmp_path):
    path = file_of(tmp_path, ["60E1", "smooth/rail.csv", "measured/rail.csv"])
    (tmp_path / "smooth").mkdir()
    draws = np.random.default_rng(3)
    for body, name in (("wheel", "S1002"), ("rail", "60E1")):
        points = make_worn_points(name, 0.0, 0.3, 0.0002, draws)
        (tmp_path / "smooth" / f"{body}.csv").write_text(format_points(points, "little noise"))
    options = "".join(f'[case.{body}_file]\nnominal = "none"\n' for body in ("wheel", "rail"))
    text = path.read_text().replace('"measured/wheel.csv"', '"smooth/wheel.csv"') + options
    path.write_text(text)
    out = run(path, tmp_path / "out").out
    rows, answer = screened(out), evaluate_fleet(out)
    assert [share["filter_mm"] for share in answer.filters] == pytest.approx([*FILTER_COLUMNS.values()])
    for share, column in zip(answer.filters, FILTER_COLUMNS, strict=True):
        is_judged = rows[column].notna()
        for name in ("holds", "fails", "open"):
            expected = rows.loc[rows[column] == name.upper(), "weight"].sum()
            assert (share[name] or 0.0) == pytest.approx(expected, abs=1e-12)
        # a third of the rails is noisy
        assert share["unknown"] == pytest.approx(rows.loc[~is_judged, "weight"].sum()) == pytest.approx(1.0 / 3.0)
    assert any("where noise decides the filter, this is unknown" in sentence for sentence in explain_answer(answer))
    # the same verdicts where the filter is declared, except where noise samples differ
    path.write_text(f"filter_mm = 8\n{text}")
    declared = screened(run(path, tmp_path / "declared").out)
    judged_rows = rows["filter_8_mm"].notna()
    verdicts = zip(rows.loc[judged_rows, "filter_8_mm"], declared.loc[judged_rows, "verdict"], strict=True)
    assert all("OPEN" in pair or len({*pair}) == 1 for pair in verdicts)


def test_a_declared_filter_of_a_fleet_is_the_only_one(tmp_path):
    path = file_of(tmp_path)
    path.write_text("filter_mm = 8\n" + path.read_text())
    out = run(path, tmp_path / "out").out
    profiles = duckdb.sql(f"select * from '{out}/profiles.parquet' where file like '%csv'").df()
    assert [*profiles["filter_mm"]] == ["8", "8"]
    case = fecontact.open_fleet(out).case("wheel", "rail", 3.0, 60.0)
    assert (case.wheel_file.filter_mm, case.rail_file.filter_mm) == (8.0, 8.0)
    rows = screened(out).query("wheel == 'wheel'")
    assert evaluate_fleet(out).filters == []
    assert any("declared filter of 8 mm" in sentence for sentence in explain_answer(evaluate_fleet(out)))
    assert rows["filter_4_mm"].isna().all()
    assert rows["filter_8_mm"].equals(rows["verdict"])
    # a filter in the options of a body counts before it
    path.write_text(path.read_text() + "[case.rail_file]\nfilter_mm = 6\n")
    candidate = Candidate(body="rail", name="rail", spec="rail.csv", known={})
    assert select_reading(read_fleet(path), candidate).filter_mm == 6.0


def test_a_screened_fleet_gives_the_cases_of_its_positions(fleet):
    opened = fecontact.open_fleet(fleet[1].out)
    case = opened.case("wheel", "60E1", 3.0, 100.0)
    assert (case.rail, case.load_N, case.lateral_shift_mm) == ("60E1", 100e3, 3.0)
    row = screened(fleet[1].out).query("wheel == 'wheel' and rail == '60E1' and shift_mm == 3 and load_kN == 100")
    # on the reference variant
    placement = place_case(case)
    assert placement.first.rail_y_mm == pytest.approx(row["place_y_mm"].item(), abs=1e-6)
    with pytest.raises(InputError, match="fleet run"):
        fecontact.open_fleet(fleet[0].parent)


def test_no_other_part_of_the_program_needs_pyarrow_or_duckdb():
    for path in (ROOT / "fecontact").rglob("*.py"):
        if path.parent.name != "fleet":
            text = path.read_text("utf-8")
            names = {
                (node.module or "") if isinstance(node, ast.ImportFrom) else alias.name
                for node in ast.walk(ast.parse(text))
                if isinstance(node, ast.Import | ast.ImportFrom)
                for alias in node.names
            }
            assert not any(name.partition(".")[0] in ("pyarrow", "duckdb") for name in names), path


def command(path, out, *options):
    words = [sys.executable, "-m", "fecontact", "fleet", "run", str(path), "--out", str(out), *options]
    return subprocess.Popen(words, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def wait_for_pairs(out, count):
    end = time.monotonic() + 300.0
    while len(list((out / "pairs").glob("[!.]*"))) < count:
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.slow
@pytest.mark.parametrize("whom", ["main", "worker"])
def test_a_killed_run_goes_on_to_the_same_table(fleet, tmp_path, whom):
    path, out = file_of(tmp_path), tmp_path / "out"
    begun = command(path, out, "--workers", "1")
    wait_for_pairs(out, 1)
    if whom == "main":
        begun.send_signal(signal.SIGKILL)
        begun.wait()
        assert not (out / "screen").exists()
        assert command(path, out, "--workers", "2").wait() == 0
    else:
        # the resource tracker of multiprocessing is a child too
        for child in psutil.Process(begun.pid).children():
            if "spawn_main" in " ".join(child.cmdline()):
                child.kill()
        assert begun.wait() == 0
    assert table_bytes(out) == table_bytes(fleet[1].out)


@pytest.mark.slow
def test_dask_gives_the_table_of_a_local_run(fleet, tmp_path):
    pytest.importorskip("distributed")
    from test_study import dask_cluster

    path = file_of(tmp_path)
    with dask_cluster(tmp_path, 2) as (address, _):
        assert command(path, tmp_path / "out", "--scheduler", address).wait() == 0
    assert table_bytes(tmp_path / "out") == table_bytes(fleet[1].out)


@pytest.mark.slow
def test_a_killed_scheduler_leaves_what_was_finished(fleet, tmp_path):
    pytest.importorskip("distributed")
    from test_study import dask_processes

    path, out = file_of(tmp_path), tmp_path / "out"
    with dask_processes(tmp_path, 1) as (address, (scheduler, _)):
        begun = command(path, out, "--scheduler", address)
        wait_for_pairs(out, 1)
        scheduler.kill()
        assert begun.wait() == 3
    assert not (out / "screen").exists()
    finished_before = {
        pair.name: (pair / screening.ROWS_FILE).stat().st_mtime_ns for pair in (out / "pairs").glob("[!.]*")
    }
    assert command(path, out, "--workers", "1").wait() == 0
    assert table_bytes(out) == table_bytes(fleet[1].out)
    assert all(
        (out / "pairs" / name / screening.ROWS_FILE).stat().st_mtime_ns == time
        for name, time in finished_before.items()
    )


def test_the_half_space_may_screen_too(tmp_path):
    path = file_of(tmp_path, ["60E1"], values="[2]")
    text = path.read_text().replace('["S1002", "measured/wheel.csv"]', '"S1002"').replace("weights", "#")
    path.write_text('theory = "half_space"\n' + text)
    assert read_fleet(path).theory == "half_space"
    run(path, tmp_path / "out")
    row = screened(tmp_path / "out").query("load_kN == 100")
    expected = fecontact.theory(Case(lateral_shift_mm=2.0), "half_space")["p_max_MPa"]
    assert row["screen_p_max_MPa"].item() == pytest.approx(expected, rel=2e-3)


def test_the_origin_of_a_fleet_counts_its_own_sources():
    assert running.find_origin().solved_by["source of fleets"]


@pytest.mark.parametrize(
    "error", slow_but([KeyError("area_mm2"), TypeError("no such thing"), AttributeError("nothing")], 0)
)
def test_an_error_of_the_program_is_no_refusal_of_a_pair(tmp_path, monkeypatch, error):
    def wrong(*arguments):
        raise error

    path = file_of(tmp_path)
    monkeypatch.setattr(screening, "make_position_row", wrong)
    with pytest.raises(ProgramError, match=rf"4 of 4 jobs ended with an error of the program.*{type(error).__name__}"):
        run(path, tmp_path / "out")
    assert not (tmp_path / "out" / "screen").exists()
    # with a corrected program the same command resumes
    monkeypatch.undo()
    assert run(path, tmp_path / "out").verdicts.get("REFUSED", 0.0) == 0.0


def test_numbers_that_a_position_does_not_have_are_still_a_refusal_of_the_position(tmp_path, monkeypatch):
    def diverged(*arguments):
        raise ConvergenceError("no such contact")

    path = file_of(tmp_path)
    monkeypatch.setattr(screening, "make_position_row", diverged)
    rows = screened(run(path, tmp_path / "out").out)
    assert set(rows["verdict"]) == {"REFUSED"}
    assert set(rows["reason"]) == {"no such contact"}


@pytest.mark.parametrize(
    ("value", "mirror"), [("no", False), ("YES", True), ("false", False), ("true", True), ("", None)]
)
def test_the_side_in_a_table_is_what_it_says(tmp_path, value, mirror):
    (tmp_path / "rails.csv").write_text(f"file,mirror,line\n60E1,{value},7\n")
    fleet = replace(read_fleet(file_of(tmp_path)), rails=("rails.csv",))
    (rail,) = find_candidates(fleet, "rail")
    assert mark_unusable(fleet, rail).problem == ""
    assert select_reading(fleet, rail).mirror is mirror
