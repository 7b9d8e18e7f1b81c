"""Maps at several yaws of the wheelset: inputs, resumed runs, files, sentences, lookups, and equality with cases."""

import csv
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import positions
import pytest
from positions import map_by
from test_map_views import position

import fecontact
from fecontact.case import INPUTS, Case
from fecontact.cli import call
from fecontact.criteria import Creep
from fecontact.errors import InputError
from fecontact.files import write_sealed
from fecontact.jobs.workers import Crew
from fecontact.judging.verdict import Verdict
from fecontact.maps.files import write_map
from fecontact.maps.model import ApplicabilityMap
from fecontact.maps.report import format_map_lines, write_yaw_report
from fecontact.maps.telling import build_map_record
from fecontact.maps.views import build_views, write_yaw_answer
from fecontact.maps.yaw_map import YawMap, choose_reference_yaw, find_yaw_changes, format_yaw, require_yaws_rad
from fecontact.maps.yaw_records import build_result_record
from fecontact.outputs.comparison.tables import case_names
from fecontact.outputs.comparison.verdicts import changed_verdicts
from fecontact.outputs.records.results import load_row
from fecontact.outputs.tables import write_csv
from fecontact.regression.compare import compare_tables
from fecontact.regression.tables import load_table
from fecontact.runs.identity import make_case_id
from fecontact.runs.map_lookup import read_map_bands, read_map_rows
from fecontact.runs.map_run import prepare_for_map

LOADS_N = (50e3, 100e3)
YAW_SLOT = next(slot for slot in INPUTS if slot.place == ("", "yaw_rad"))


# --- yaws as inputs


@pytest.mark.parametrize(
    ("yaws_mrad", "case", "message"),
    [
        ([0.0, 5.0, 5.0], Case(), r"yaws are 0, 5, 5 mrad, with 5 mrad more than once; give each yaw once"),
        ([0.0, -0.0], Case(), r"with 0 mrad more than once"),
        ([1.0, 1.0 + 1e-8], Case(), r"with 1 mrad more than once"),
        ([0.0, 101.0], Case(), r"yaw is 0\.101 rad \(101 mrad\); allowed: -0\.1 to 0\.1 rad \(-100 to 100 mrad\); "),
        ([0.0, float("nan")], Case(), r"yaw is nan .*allowed: -0\.1 to 0\.1 rad"),
        ([float("inf")], Case(), r"yaw is inf .*allowed: -0\.1 to 0\.1 rad"),
        ([], Case(), r"yaws are an empty list; give at least one yaw"),
        (
            [0.0],
            Case(yaw_rad=0.005),
            r"yaw is 5 mrad \(--yaw-mrad, yaw_rad\), and yaws are given too; give one of them",
        ),
    ],
)
def test_yaws_that_are_not_allowed_are_refused_with_a_remedy(yaws_mrad, case, message, tmp_path):
    with pytest.raises(InputError, match=message):
        require_yaws_rad(case, yaws_mrad)
    out = tmp_path / "map"
    with pytest.raises(InputError, match=message):
        fecontact.map(case, [0.0], [50e3], out, yaws_mrad=yaws_mrad)
    assert not out.exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--yaws-mrad", "0,5,5"], "with 5 mrad more than once; give each yaw once"),
        (["--yaws-mrad=-5:5:5,0"], "with 0 mrad more than once"),
        (["--yaws-mrad", "0,200"], "allowed: -0.1 to 0.1 rad (-100 to 100 mrad)"),
        (["--yaws-mrad", "0,x"], "'x' is neither a number nor a range FROM:TO:STEP"),
        (["--yaws-mrad", "0,5", "--yaw-mrad", "3"], "yaw is 3 mrad (--yaw-mrad, yaw_rad), and yaws are given too"),
    ],
)
def test_the_command_refuses_yaws_before_it_makes_a_folder(options, message, tmp_path, capsys):
    out = tmp_path / "map"
    assert call(["map", "--shifts", "0", "--loads-kn", "50", *options, "--out", str(out)]) == 2
    assert message in capsys.readouterr().err
    assert not out.exists()


def test_a_single_number_of_yaws_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"yaws_mrad is 5; give a list, for example \[5\]"):
        fecontact.map(Case(), [0.0], [50e3], tmp_path, yaws_mrad=5)


def test_yaws_are_exactly_those_of_a_case():
    # all yaws of 0.1 mrad steps: multiplying by 0.001 instead of dividing by 1000 differs in the last bit
    yaws_mrad = [round(0.1 * number, 1) for number in range(-200, 201)]
    assert require_yaws_rad(Case(), yaws_mrad[::-1]) == tuple(YAW_SLOT.input.read(yaw) + 0.0 for yaw in yaws_mrad)
    # the sign of zero would make another position
    (zero,) = require_yaws_rad(Case(), [-0.0])
    assert make_case_id(replace(Case(), yaw_rad=zero)) == make_case_id(Case())


def test_texts_of_different_yaws_differ():
    yaws_mrad = [0.0, 5.0, -5.0, 4.1, 1e-6, 12.345678, 12.345679]
    texts = [format_yaw(1e3 * yaw_rad) for yaw_rad in require_yaws_rad(Case(), yaws_mrad)]
    assert len({*texts}) == len(yaws_mrad)
    assert {"0", "5", "-5", "4.1"} <= {*texts}


# --- runs that are resumed


def run_fake(out, yaws_mrad, shifts=(0.0, 1.0), case=None):
    """Run a map of failing positions, and count its new positions."""
    before = solves(out)
    outcome = map_by(
        case or Case(),
        shifts,
        LOADS_N,
        out,
        yaws_mrad=yaws_mrad,
        crew=Crew(open=ThreadPoolExecutor, workers=1, together=1),
        work=positions.FakePosition,
    )
    return outcome, solves(out) - before


def solves(out):
    """Number of positions that were worked on in a folder."""
    file = out / "solves.txt"
    return len(file.read_text("utf-8").splitlines()) if file.is_file() else 0


def read_rows(path):
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_a_map_at_several_yaws_has_a_position_for_each_yaw_and_every_row_its_yaw(tmp_path):
    outcome, worked = run_fake(tmp_path, [10.0, 0.0])
    assert worked == 4
    assert isinstance(outcome.made, YawMap)
    assert outcome.made.yaws_mrad == (0.0, 10.0)
    rows = read_rows(tmp_path / "map.csv")
    # failed cells have a yaw too
    places = [(float(row["yaw_mrad"]), float(row["lateral_shift_mm"]), float(row["load_kN"])) for row in rows]
    assert places == [(yaw, shift, load) for yaw in (0.0, 10.0) for shift in (0.0, 1.0) for load in (50.0, 100.0)]
    assert {row["verdict_answer"] for row in rows} == {"failed"}
    assert [row["yaw_mrad"] for row in read_rows(tmp_path / "contacts.csv")] == [row["yaw_mrad"] for row in rows]
    names = {path.name for path in (tmp_path / "positions").iterdir()}
    assert names == {
        make_case_id(Case(lateral_shift_mm=shift, yaw_rad=yaw_rad), LOADS_N)
        for shift in (0.0, 1.0)
        for yaw_rad in (0.0, 0.01)
    }
    assert {f"map_yaw_{yaw}mrad.png" for yaw in (0, 10)} <= {path.name for path in tmp_path.iterdir()}
    assert not (tmp_path / "map.png").exists()
    assert (tmp_path / "report.html").is_file()


def test_a_map_goes_on_with_more_yaws_and_never_loses_one(tmp_path, monkeypatch):
    # finished positions whose loads failed are tried again; here they count as finished
    monkeypatch.setattr("fecontact.runs.map_run.has_open_loads", lambda folder: False)
    case, shifts = Case(), [0.0, 1.0]
    _, worked = run_fake(tmp_path, None)
    assert worked == 2
    assert (tmp_path / "map.png").is_file()
    prepare_for_map(tmp_path, case, shifts, LOADS_N, yaws_mrad=[0.0, 5.0])
    _, worked = run_fake(tmp_path, [0.0, 5.0])
    # the positions of the map without a list of yaws are those at yaw 0
    assert worked == 2
    # the picture of the map without yaws would not belong to it
    assert not (tmp_path / "map.png").exists()
    assert run_fake(tmp_path, [0.0, 5.0])[1] == 0
    prepare_for_map(tmp_path, case, [*shifts, 2.0], LOADS_N, yaws_mrad=[10.0, 0.0, 5.0])
    for yaws_mrad in (None, [0.0], [5.0, 10.0]):
        with pytest.raises(InputError, match="a different map"):
            prepare_for_map(tmp_path, case, shifts, LOADS_N, yaws_mrad=yaws_mrad)
    with pytest.raises(InputError, match="a different map"):
        prepare_for_map(tmp_path, replace(case, yaw_rad=0.005), shifts, LOADS_N)


def test_pictures_of_yaws_that_a_map_no_longer_has_go(tmp_path, monkeypatch):
    monkeypatch.setattr("fecontact.maps.files.save_map_figure", lambda view, path: path.write_text("new", "utf-8"))
    for name in ("map_yaw_5mrad.png", "map_yaw_-5mrad_theory.svg", "map.svg", "map_theory.png", "notes_yaw.png"):
        (tmp_path / name).write_text("old", "utf-8")
    run_fake(tmp_path, [0.0])
    left = {path.name: path.read_text("utf-8") for path in tmp_path.glob("*.png")}
    assert left == {"map_yaw_0mrad.png": "new", "map_yaw_0mrad_theory.png": "new", "notes_yaw.png": "old"}


# --- what changes with the yaw


def plant_verdict(single_position, answer):
    """Position with a planted verdict on Hertz in its cells."""
    cells = []
    for cell in single_position.cells:
        verdict = Verdict(answer=answer, measure="area_mm2", each={"area_mm2": answer})
        judgement = replace(cell.judged.judgements["hertz"], verdict=verdict)
        judgements = {**cell.judged.judgements, "hertz": judgement}
        cells.append(replace(cell, judged=replace(cell.judged, verdict=verdict, judgements=judgements)))
    return replace(single_position, cells=tuple(cells))


def turn(single_position, yaw_rad):
    """Position at a yaw."""
    cells = []
    for cell in single_position.cells:
        solved_load = replace(cell.judged.solved, case=replace(cell.judged.case, yaw_rad=yaw_rad))
        cells.append(replace(cell, judged=replace(cell.judged, solved=solved_load)))
    return replace(single_position, cells=tuple(cells))


@pytest.fixture(scope="module")
def planted():
    """Maps at 0, 5 and 10 mrad: at 10 mrad Hertz fails at -4 mm and holds at 5 mm."""
    holds, fails = position(-4.0), position(5.0)
    by_yaw = {
        0.0: (holds, fails),
        0.005: (holds, fails),
        0.01: (plant_verdict(holds, "FAILS"), plant_verdict(fails, "HOLDS")),
    }
    return YawMap(
        maps=tuple(
            ApplicabilityMap(
                case=Case(roll="touching", yaw_rad=yaw_rad),
                loads_N=(50e3,),
                positions=tuple(turn(single_position, yaw_rad) for single_position in at_yaw),
            )
            for yaw_rad, at_yaw in by_yaw.items()
        )
    )


def test_the_answer_says_where_the_verdict_changes_with_the_yaw(planted):
    assert write_yaw_answer(planted, "pressure") == [
        "At 5 mrad the verdict on Hertz is the same as at 0 mrad in every cell.",
        "At 10 mrad Hertz fails in 1 cell where it holds at 0 mrad (-4 mm 50 kN); it holds in 1 cell where it fails at"
        " 0 mrad (5 mm 50 kN).",
    ]
    # an independent count from the rows
    rows = planted.rows()
    verdicts = {(row["yaw_mrad"], row["lateral_shift_mm"]): row["verdict_answer"] for row in rows}
    assert [verdicts[0.0, shift] for shift in (-4.0, 5.0)] == ["HOLDS", "FAILS"]
    assert [verdicts[10.0, shift] for shift in (-4.0, 5.0)] == ["FAILS", "HOLDS"]
    same = YawMap(maps=planted.maps[:2])
    assert write_yaw_answer(same, "pressure") == [
        "At 0 and 5 mrad the verdict on Hertz is the same in all of 2 cells (shift and load)."
    ]
    # a single yaw has nothing to compare
    assert write_yaw_answer(YawMap(maps=planted.maps[:1]), "pressure") == []


def test_the_cheapest_theory_changes_with_the_yaw_too(planted):
    sentences = write_yaw_answer(planted, "theory")
    assert sentences[0] == "At 5 mrad the cheapest theory that holds is the same as at 0 mrad in every cell."
    assert sentences[1].startswith("At 10 mrad the cheapest theory that holds is ")
    assert " in 1 cell where it is Hertz at 0 mrad (-4 mm 50 kN)" in sentences[1]


def test_many_changed_cells_are_counted_and_the_first_are_named():
    cells = {(float(shift), 50e3): "HOLDS" for shift in range(12)}
    changes = find_yaw_changes({0.0: cells, 10.0: dict.fromkeys(cells, "FAILS")})
    assert len(changes) == 12
    # cells that one of the yaws does not have yet are left out
    assert find_yaw_changes({0.0: cells, 10.0: {(0.0, 50e3): "HOLDS"}}) == ()
    assert [choose_reference_yaw(yaws) for yaws in ([-5.0, 5.0, 10.0], [-3.0, 4.0], [0.0, 10.0])] == [5.0, -3.0, 0.0]


def test_the_terminal_has_the_changes_first_and_then_each_yaw(planted):
    lines = [str(line) for line in format_map_lines(planted, "pressure", "hertz", width=None)]
    assert lines[1].startswith("At 10 mrad Hertz fails in 1 cell where it holds at 0 mrad")
    assert [line for line in lines if line.startswith("Yaw ")] == ["Yaw 0 mrad:", "Yaw 5 mrad:", "Yaw 10 mrad:"]
    # the mirror image of a wheel with a yaw has the opposite yaw
    assert sum("read the opposite shift of a map with the opposite yaw" in line for line in lines) == 2


def test_the_report_has_a_section_for_each_yaw_and_places_of_its_own_for_all_cells(planted, tmp_path):
    text = write_yaw_report(planted, tmp_path).read_text("utf-8")
    for words in ("Verdicts that change with the yaw", "Load limits at each yaw", "Yaw 0 mrad", "Yaw 10 mrad"):
        assert words in text
    assert "At 10 mrad Hertz fails in 1 cell where it holds at 0 mrad" in text
    assert [text.count(f'id="cell-{number}"') for number in range(1, 8)] == [1] * 6 + [0]


def test_pictures_and_data_sets_are_of_one_yaw_or_have_the_yaw_as_an_axis(planted):
    with pytest.raises(
        InputError,
        match=r"maps at 0, 5 and 10 mrad, and a picture shows one yaw; give one of them, such as select_yaw\(0\)",
    ):
        fecontact.plot.map(planted)
    page = planted._repr_html_()
    assert [page.count(f"<p>Yaw {yaw} mrad</p>") for yaw in (0, 5, 10, 7)] == [1, 1, 1, 0]
    assert page.count("<table") == 3
    pytest.importorskip("xarray")
    data_set = fecontact.to_xarray(planted)
    assert dict(data_set.sizes) == {"lateral_shift_mm": 2, "yaw_mrad": 3, "load_kN": 1}
    cell = data_set.sel(lateral_shift_mm=5.0, yaw_mrad=10.0, load_kN=50.0)
    assert str(cell.verdict_answer.item()) == "HOLDS"


def test_pictures_state_their_yaw(planted):
    for yaw_rad, single_map in zip((0.0, 0.005, 0.01), planted.maps, strict=True):
        assert {view.yaw_mrad for view in build_views(single_map, at_yaw=True).values()} == {1e3 * yaw_rad}
    assert {view.yaw_mrad for view in build_views(planted.maps[0]).values()} == {None}
    assert {view.yaw_mrad for view in build_views(planted.maps[1]).values()} == {5.0}


def test_the_record_of_several_yaws_has_the_records_of_the_maps(planted):
    record = json.loads(json.dumps(build_result_record(planted)))
    assert record["schema"] == "fecontact/yaw_map/1"
    assert record["yaws_rad"] == [0.0, 0.005, 0.01]
    assert record["maps"][1] == json.loads(json.dumps(build_map_record(planted.maps[1])))
    assert [(change["lateral_shift_mm"], change["load_N"]) for change in record["verdict_changes"]] == [
        (-4.0, 50e3),
        (5.0, 50e3),
    ]
    assert [change["verdict"] for change in record["verdict_changes"][0]["verdicts"]] == ["HOLDS", "HOLDS", "FAILS"]
    # a map without a list of yaws keeps its layout
    assert build_result_record(planted.maps[0]) == build_map_record(planted.maps[0])


# --- lookups by yaw


@pytest.fixture
def stored(planted, tmp_path):
    """The planted maps as `fecontact map` writes them."""
    write_map(planted, tmp_path, drawn=False)
    return tmp_path


def test_a_map_answers_at_its_yaws_alone(planted, stored):
    assert planted.select_yaw(10.0) is planted.maps[2]
    for yaw_mrad in (2.5, 11.0, -5.0):
        with pytest.raises(InputError, match=rf"yaw is {yaw_mrad:g} mrad, but the map has 0, 5 and 10 mrad and no"):
            planted.select_yaw(yaw_mrad)
        with pytest.raises(InputError, match=r"or make the map with this yaw added to --yaws-mrad"):
            read_map_rows(stored, Case(roll="touching", yaw_rad=yaw_mrad / 1e3))
        with pytest.raises(InputError, match=rf"yaw is {yaw_mrad:g} mrad"):
            read_map_bands(stored, yaw_mrad / 1e3)
    for yaw_rad, verdicts in ((0.0, ["HOLDS", "FAILS"]), (0.01, ["FAILS", "HOLDS"])):
        rows = read_map_rows(stored, Case(roll="touching", yaw_rad=yaw_rad))
        assert [row["verdict_answer"] for row in rows] == verdicts
        assert {float(row["yaw_mrad"]) for row in rows} == {1e3 * yaw_rad}
    with pytest.raises(InputError, match="the map of a different contact"):
        read_map_rows(stored, Case(rail="54E1", roll="touching"))


def test_a_contact_table_has_the_verdicts_at_the_yaws_of_the_map_alone(stored):
    rows = fecontact.table(Case(roll="touching"), [-4.0], [50e3], yaws_mrad=[0.0, 2.5, 10.0], map_folder=stored)
    assert [(row["yaw_mrad"], row["map_status"], row["map_hertz_verdict"]) for row in rows] == [
        (0.0, "converged", "HOLDS"),
        (2.5, "not in the map", None),
        (10.0, "converged", "FAILS"),
    ]
    with pytest.raises(InputError, match=r"yaw is 2\.5 mrad, but the map has 0, 5 and 10 mrad"):
        fecontact.table(Case(roll="touching"), [-4.0], [50e3], yaws_mrad=[2.5], map_folder=stored)


def test_maps_are_compared_by_shift_yaw_and_load(stored, planted, tmp_path):
    comparison = compare_tables(load_table(stored), load_table(stored))
    assert comparison.same
    assert comparison.cases[-1] == "lateral_shift_mm 5, yaw_mrad 10, load_kN 50"
    assert len(comparison.cases) == 6
    assert list(case_names(comparison).values())[-1] == "+5 mm, yaw 10 mrad, 50 kN"
    # verdicts that differ have their yaw
    changed = load_table(stored)
    changed.rows.loc[comparison.cases[-1], "verdict_answer"] = "FAILS"
    (change,) = changed_verdicts(compare_tables(load_table(stored), changed))
    assert (change["baseline"], change["new"], change["where"]) == ("HOLDS", "FAILS", "yaw 10 mrad: +5 mm: 50 kN")
    # the table alone is enough
    (tmp_path / "alone").mkdir()
    write_csv(planted.rows(), tmp_path / "alone" / "map.csv")
    assert load_table(tmp_path / "alone").key == ("lateral_shift_mm", "yaw_mrad", "load_kN")


def test_a_changed_map_of_several_yaws_is_refused(stored):
    text = (stored / "map.csv").read_text("utf-8")
    (stored / "map.csv").write_text(text.replace("FAILS", "HOLDS"), "utf-8")
    with pytest.raises(InputError, match="was changed"):
        load_table(stored)
    with pytest.raises(InputError, match=r"map\.csv"):
        read_map_rows(stored, Case(roll="touching"))
    # a record without a map
    write_sealed(stored / "map.json", {"schema": "fecontact/yaw_map/9"}, [stored / "map.csv"])
    with pytest.raises(InputError, match="make the map again"):
        read_map_rows(stored, Case(roll="touching"))


# --- solved


@pytest.mark.slow
def test_cells_at_a_yaw_are_cases_at_this_yaw_and_yaw_0_is_the_map_without_yaws(tmp_path):
    """Equality is exact, because meshes, solution and judgement are equal."""
    pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0, "refine": "never"}
    case = Case(**pair, creep=Creep(friction=0.3, xi=1e-3))
    outcome = fecontact.map(case, [0.0], [100e3], tmp_path / "yaws", yaws_mrad=[0.0, 50.0])
    for yaw_mrad in (0.0, 50.0):
        result = fecontact.solve(replace(case, yaw_rad=yaw_mrad / 1e3, load_N=100e3))
        (row,) = outcome.made.select_yaw(yaw_mrad).rows()
        columns = {key: value for key, value in load_row(result.load, result.placement).items() if key in row}
        ignored = {name for name in columns if name.startswith("solver_") or name.endswith(("_s", "_MB"))}
        assert len(columns) > 60
        assert {key: row[key] for key in columns if key not in ignored} == {
            key: value for key, value in columns.items() if key not in ignored
        }
        for name in ("t_gamma_deviation_percent", "fx_deviation_N", "mz_deviation_Nmm", "y_over_q_deviation"):
            assert isinstance(row[f"creep_theories_rolling_half_space_{name}"], float)
    single = fecontact.map(case, [0.0], [100e3], tmp_path / "single").made
    first = build_map_record(outcome.made.select_yaw(0.0))
    assert json.dumps(first["cells"], default=str) == json.dumps(build_map_record(single)["cells"], default=str)
    loaded = fecontact.load(tmp_path / "yaws")
    assert loaded.rows() == outcome.made.rows()
    with pytest.raises(InputError, match="3 mrad"):
        loaded.select_yaw(3.0)
