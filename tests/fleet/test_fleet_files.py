"""The file of a fleet, its population and its weights, with inputs by hand and refusals."""

import json
import re
import shutil
import sys
from statistics import NormalDist

import numpy as np
import pytest
from inline import inline_crew, stand_ins

import fecontact
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.features.fleet.answer import evaluate_fleet
from fecontact.features.fleet.examples import write_fleet
from fecontact.features.fleet.model import normalise_weights, read_fleet
from fecontact.features.fleet.paired_profiles import read_paired_profiles
from fecontact.features.fleet.population import Candidate, find_candidates, list_all_pairs
from fecontact.features.fleet.profile_files import ReadProfile
from fecontact.features.fleet.report import write_report
from fecontact.jobs.workers import WorkersLost
from fecontact.profiles.examples import write_examples

FLEET = """
[wheels]
files = "wheels.csv"
[rails]
files = ["60E1", "54E1"]
[shifts_mm]
values = [2, 0]
weights = [1, 3]
[loads_kN]
values = [60]
"""


def written(folder, text=FLEET, wheels="file,weight\nS1002,3\nEN13715_1in40,1\n"):
    (folder / "wheels.csv").write_text(wheels)
    (folder / "fleet.toml").write_text(text)
    return folder / "fleet.toml"


def make_candidates(wheels, rails):
    """Candidates from the weights of wheels and rails by name."""
    return [
        Candidate(body=body, name=name, spec=name, weight=weight)
        for body, weights in (("wheel", wheels), ("rail", rails))
        for name, weight in weights.items()
    ]


def read_with_statuses(statuses, names=None):
    """Reader without files: the status is `read` if it is not given; the names are added to a list."""

    def read(candidates):
        if names is not None:
            names.extend(candidate.name for candidate in candidates)
        return [
            ReadProfile(
                candidate=candidate,
                record={"status": statuses.get(candidate.name, "read"), "reason": "given", "remedy": "none"},
            )
            for candidate in candidates
        ]

    return read


def test_weights_of_positions_are_products_and_sum_to_one(tmp_path):
    (tmp_path / "pairs.csv").write_text("wheel,rail,weight\na,x,1\na,y,2\nb,x,1\nlost,x,9\n")
    text = FLEET + '[pairs]\ntable = "pairs.csv"\n'
    fleet = read_fleet(written(tmp_path, text))
    assert fleet.positions == {(0.0, 60.0): 0.75, (2.0, 60.0): 0.25}
    candidates = make_candidates({"a": 2.0, "b": 6.0, "lost": 1.0, "unlisted": 5.0}, {"x": 1.0, "y": 1.0})
    paired = read_paired_profiles(fleet, candidates, read_with_statuses({"lost": "refused"}))
    statuses = {profile.candidate.name: profile.record["status"] for profile in paired.profiles}
    assert statuses == {"a": "read", "b": "read", "lost": "refused", "unlisted": "unused", "x": "read", "y": "read"}
    # by hand: a x 1 * 2, a y 2 * 2, b x 1 * 6, over 12; what was refused is left out: 9 * 1 of 12 + 9
    assert paired.unusable_text == ("1 of 4 listed pairs, 42.9 % by weight, is left out, because a file cannot be used")
    assert paired.pairs == {
        ("a", "x"): pytest.approx(2 / 12),
        ("a", "y"): pytest.approx(4 / 12),
        ("b", "x"): pytest.approx(0.5),
    }


def test_quantiles_of_a_normal_distribution_are_equally_likely(tmp_path):
    text = FLEET.replace("values = [2, 0]\nweights = [1, 3]", "normal = [1.0, 2.0]\ncount = 4")
    fleet = read_fleet(written(tmp_path, text))
    assert list(fleet.positions.values()) == [0.25] * 4
    expected = [1.0 + 2.0 * NormalDist().inv_cdf(quantile) for quantile in (0.125, 0.375, 0.625, 0.875)]
    assert fleet.shifts_mm == pytest.approx(expected)
    text = FLEET.replace("values = [2, 0]\nweights = [1, 3]", "uniform = [-4, 4]\ncount = 4")
    assert read_fleet(written(tmp_path, text)).shifts_mm == (-3.0, -1.0, 1.0, 3.0)


TOGETHER = f"{FLEET[: FLEET.index('[shifts_mm]')]}[positions]\ntable = 'places.csv'\n"


def test_shifts_and_loads_that_go_together_stand_in_a_table(tmp_path):
    (tmp_path / "places.csv").write_text("radius_m,shift_mm,load_kN,weight\n500,2,60,1\n500,-1,55,2\n900,2,60,1\n")
    fleet = read_fleet(written(tmp_path, TOGETHER))
    assert fleet.positions == {(-1.0, 55.0): 0.5, (2.0, 60.0): 0.5}
    assert fecontact.check_fleet(tmp_path / "fleet.toml").positions == 2 * 2 * 2
    # equal weights without a column of them
    (tmp_path / "places.csv").write_text("shift_mm,load_kN\n2,60\n2,70\n")
    assert read_fleet(tmp_path / "fleet.toml").positions == {(2.0, 60.0): 0.5, (2.0, 70.0): 0.5}


@pytest.mark.parametrize(
    ("content", "text", "said"),
    [
        ("shift_mm,load_kN\n2,60\n", TOGETHER + "[loads_kN]\nvalues = [60]\n", "both given"),
        ("shift_mm,load_kN\n2,60\n", TOGETHER.replace("table =", "#"), "table is missing"),
        ("shift_mm,radius_m\n2,60\n", TOGETHER, "no column load_kN; columns: shift_mm, radius_m"),
        ("shift_mm,load_kN\n2,\n", TOGETHER, "row 1: load_kN is empty"),
        ("shift_mm,load_kN\nleft,60\n", TOGETHER, "row 1: shift_mm is 'left'"),
        ("shift_mm,load_kN\n2,-60\n", TOGETHER, "-60"),
        ("shift_mm,load_kN\n2.5,60\nnan,60\n", TOGETHER, "row 2: shift_mm is 'nan'; allowed: a number"),
        ("shift_mm,load_kN,weight\n2,60,-1\n", TOGETHER, "row 1: weight is -1"),
        ("shift_mm,load_kN\n", TOGETHER, "row 1 is missing"),
        ("shift_mm,load_kN,weight\n2,60,0\n", TOGETHER, "the sum of the weights is 0"),
    ],
)
def test_positions_that_cannot_be_are_refused_with_their_value(tmp_path, content, text, said):
    (tmp_path / "places.csv").write_text(content)
    with pytest.raises(InputError, match=said):
        fecontact.check_fleet(written(tmp_path, text))


def test_pairs_are_drawn_by_weight_with_a_seed(tmp_path):
    fleet = read_fleet(written(tmp_path, FLEET + "[pairs]\ndraw = 2000\n"))
    candidates = make_candidates({"a": 3.0, "b": 1.0}, {"x": 1.0, "y": 1.0})
    pairs = read_paired_profiles(fleet, candidates, read_with_statuses({})).pairs
    assert pairs == read_paired_profiles(fleet, candidates, read_with_statuses({})).pairs
    assert sum(pairs.values()) == pytest.approx(1.0)
    # 2,000 draws at 3/4: one standard deviation is 0.0097
    assert pairs["a", "x"] + pairs["a", "y"] == pytest.approx(0.75, abs=0.04)


def test_only_the_files_of_drawn_pairs_are_read(tmp_path):
    fleet = read_fleet(written(tmp_path, FLEET + "[pairs]\ndraw = 20\n"))
    candidates = make_candidates({f"w{k}": 1.0 for k in range(1000)}, {f"r{k}": 1.0 for k in range(1000)})
    names: list[str] = []
    paired = read_paired_profiles(fleet, candidates, read_with_statuses({}, names))
    assert set(names) == {name for pair in paired.pairs for name in pair}
    assert len(names) == len(set(names)) <= 40
    assert paired.count_files("unused") == 2000 - len(names)
    assert [profile.candidate for profile in paired.profiles] == candidates


def test_more_draws_and_a_new_file_keep_the_pairs(tmp_path):
    wheels, rails = ({f"{body}{k}": 1.0 + k % 3 for k in range(40)} for body in "wr")
    pairs = {}
    for count in (50, 80):
        fleet = read_fleet(written(tmp_path, FLEET + f"[pairs]\ndraw = {count}\n"))
        pairs[count] = read_paired_profiles(fleet, make_candidates(wheels, rails), read_with_statuses({})).pairs
    assert pairs[50].keys() <= pairs[80].keys()
    fleet = read_fleet(written(tmp_path, FLEET + "[pairs]\ndraw = 80\n"))
    more_pairs = read_paired_profiles(
        fleet, make_candidates(wheels | {"a new one": 2.0}, rails), read_with_statuses({})
    ).pairs
    # the new wheel has one fortieth of the weight, and replaces no other draws than its own
    assert {wheel for wheel, _ in more_pairs.keys() - pairs[80].keys()} <= {"a new one"}
    assert len(pairs[80].keys() & more_pairs.keys()) > 70
    # a file that cannot be read is replaced by later draws
    fewer_pairs = read_paired_profiles(
        fleet, make_candidates(wheels, rails), read_with_statuses({"w3": "refused"})
    ).pairs
    assert {pair for pair in pairs[80] if pair[0] != "w3"} <= fewer_pairs.keys()


def test_a_drawn_pair_that_cannot_be_used_is_replaced(tmp_path):
    fleet = read_fleet(written(tmp_path, FLEET + "[pairs]\ndraw = 3000\n"))
    candidates = make_candidates({"a": 1.0, "b": 2.0, "c": 2.0, "d": 1.0}, {"x": 1.0, "y": 3.0, "z": 4.0})
    statuses = {"c": "refused", "d": "suspicious", "z": "suspicious"}
    names: list[str] = []
    paired = read_paired_profiles(fleet, candidates, read_with_statuses(statuses, names))
    assert sorted(names) == ["a", "b", "c", "d", "x", "y", "z"]
    assert {wheel for wheel, _ in paired.pairs} == {"a", "b"}
    # 3,000 usable pairs, of which b is in 2/3 and y in 3/4: one standard deviation is 0.009
    assert round(3000 * min(paired.pairs.values())) == 3000 * min(paired.pairs.values())
    assert paired.pairs["b", "x"] + paired.pairs["b", "y"] == pytest.approx(2 / 3, abs=0.04)
    assert paired.pairs["a", "y"] + paired.pairs["b", "y"] == pytest.approx(3 / 4, abs=0.04)
    # without c, 3/4 of the weight of the wheels and 1/2 of the weight of the rails is usable
    assert paired.suspicious_share == pytest.approx(1.0 - 3 / 4 * 1 / 2, abs=0.03)


def test_a_draw_from_files_that_cannot_be_used_is_refused(tmp_path):
    fleet = read_fleet(written(tmp_path, FLEET + "[pairs]\ndraw = 50\n"))
    wheels = {f"w{k}": 1.0 for k in range(100)}
    statuses = dict.fromkeys([*wheels][1:], "refused")
    with pytest.raises(InputError, match=r"\[pairs\]: draw is 50, but of 1000 drawn pairs only \d+ have two files"):
        read_paired_profiles(fleet, make_candidates(wheels, {"x": 1.0}), read_with_statuses(statuses))
    with pytest.raises(InputError, match=r"\[wheels\]: 0 of 100 files can be used; first reason: given; remedy: none"):
        read_paired_profiles(
            fleet, make_candidates(wheels, {"x": 1.0}), read_with_statuses(dict.fromkeys(wheels, "refused"))
        )


def test_without_memory_no_further_pairs_are_drawn(tmp_path):
    fleet = read_fleet(written(tmp_path, FLEET + "[pairs]\ndraw = 50\n"))
    candidates = make_candidates({"a": 1.0, "b": 1.0}, {"x": 1.0})
    paired = read_paired_profiles(fleet, candidates, read_with_statuses({"b": "unread"}))
    assert paired.pairs == {("a", "x"): 1.0}
    with pytest.raises(WorkersLost, match=r"\[rails\]: no file could be read"):
        read_paired_profiles(fleet, candidates, read_with_statuses({"x": "unread"}))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("weights = [1, 3]", "weights = [1, -3]", r"weight of 0.0 is -3; allowed: finite and >= 0"),
        ("weights = [1, 3]", "weights = [0, 0]", r"\[shifts_mm\]: weights: the sum of the weights is 0"),
        ("weights = [1, 3]", "weights = [1]", "1 weight for 2 values"),
        ("values = [60]", "values = []", "loads_kN"),
        ("values = [60]", "values = [60, -60]", "-60"),
        ("values = [2, 0]", "values = [2, nan]", "nan"),
        ("values = [60]", "normal = [60, 0]", "standard deviation is 0"),
        ("values = [60]", "values = [60]\nuniform = [1, 2]", "allowed: exactly one of"),
        ("values = [60]", "value = [60]", "did you mean values"),
        ('files = "wheels.csv"', 'files = "none/*.csv"', r"no file in none/\*\.csv"),
        (
            "[wheels]",
            "[case]\nrail = '60E1'\n[wheels]",
            r"\[case\]: rail not allowed here; give profiles, shifts and loads in \[wheels\]",
        ),
        ("[wheels]", "[case]\ninclination = ['1:40', '1:20']\n[wheels]", "make 2 cases"),
        ("[wheels]", "[case]\nroll = 'loaded'\n[wheels]", "roll_load_kN"),
        ("[wheels]", "[case]\nrail_irregularity = 'chord:length_mm=40'\n[wheels]", "smooth bodies"),
        ("[wheels]", "filters_mm = [5, 7]\n[wheels]", "there is no such key; keys: filter_mm"),
        ("[wheels]", "filter_mm = -4\n[wheels]", "4 to 8 mm is usual"),
        ("[wheels]", "theory = 'hertz'\n[wheels]", "strip"),
        ("[wheels]", "thoery = 'strip'\n[wheels]", "thoery: there is no such key"),
        ("[wheels]", "[pairs]\ndraw = 0\n[wheels]", "allowed"),
    ],
)
def test_what_cannot_be_is_refused_with_its_value(tmp_path, old, new, said):
    path = written(tmp_path, FLEET.replace(old, new, 1))
    with pytest.raises(InputError, match=said):
        fecontact.check_fleet(path)


@pytest.mark.parametrize("name", ["wheels.csv", "wheels.txt", "wheels.tsv", "wheels"])
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty; give a file of points, or a table with the heading file"),
        ("\n \n", "is empty; give"),
        ("Datei;Gewicht\nS1002;1\n", "no heading file, as a table has; its first line is 'Datei, Gewicht'"),
        ("Datei,Gewicht,km\nwheel.csv,1,100\n", "its first line is 'Datei, Gewicht, km'"),
        ("fichier\nroues/a.whl\n", "its first line is 'fichier'"),
        ("S1002\nEN13715_1in40\n", "its first line is 'S1002'"),
        ("wheel.csv,1,2\nother.csv,2,3\n", "no heading file"),
        ("sep=;\nDatei;Gewicht\na.csv;1\n", "its first line is 'Datei, Gewicht'"),
        ("Files;weight\nS1002;1\n", "did you mean file"),
        ("path;weight\nS1002;1\n", "no column file; columns: path, weight"),
    ],
)
def test_a_table_without_the_heading_of_files_is_refused(tmp_path, name, text, said):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=re.escape(said)):
        fecontact.check_fleet(
            written(
                tmp_path, FLEET.replace("wheels.csv", name), wheels="file\nS1002\n" if name != "wheels.csv" else text
            )
        )


@pytest.mark.parametrize("name", ["wheels.xlsx", "wheels.XLS", "wheels.ods"])
def test_a_workbook_is_not_a_profile(tmp_path, name):
    (tmp_path / name).write_bytes(b"PK\x03\x04")
    with pytest.raises(InputError, match="is a workbook of a spreadsheet; allowed: CSV or Parquet; save the table"):
        fecontact.check_fleet(written(tmp_path, FLEET.replace("wheels.csv", name)))


@pytest.mark.parametrize("name", ["wheels.txt", "wheels.tsv", "wheels.csv"])
def test_a_table_of_excel_lists_its_files(tmp_path, name):
    text = "sep=;\nfile;weight;;\nS1002;1,5;;\nEN13715_1in40;1;;\n"
    path = written(tmp_path, FLEET.replace("wheels.csv", name))
    (tmp_path / name).write_text(text)
    assert {wheel.name: wheel.weight for wheel in find_candidates(read_fleet(path), "wheel")} == {
        "S1002": 1.5,
        "EN13715_1in40": 1.0,
    }


@pytest.mark.parametrize(
    "text",
    ["y,z\n0,1\n1,2\n", "# from a.csv, b.csv\n0 1\n1 2\n", "0;1,5\n1;2,5\n", "label;y;z\na;1;2\nb;2;3\n", "0\t1\n"],
)
def test_a_file_of_points_is_not_a_table(tmp_path, text):
    (tmp_path / "one.csv").write_text(text)
    fleet = read_fleet(written(tmp_path, FLEET.replace("wheels.csv", "one.csv")))
    assert [wheel.name for wheel in find_candidates(fleet, "wheel")] == ["one"]


@pytest.mark.parametrize("value", ["1.5", "true", "nan", "inf", '"3"', "2.0000001", "-1"])
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("[wheels]", "seed = {}\n[wheels]"),
        ("[wheels]", "[pairs]\ndraw = {}\n[wheels]"),
        ("values = [60]", "uniform = [40, 60]\ncount = {}"),
        ("[wheels]", "[case.wheel_file]\nsection = {}\n[wheels]"),
    ],
)
def test_counts_are_whole_numbers(tmp_path, old, new, value):
    name = new.partition(" = {}")[0].split("\n")[-1]
    message = f"{'number of the profile' if name == 'section' else name} is .*; allowed: .*whole numbers from"
    with pytest.raises(InputError, match=message):
        fecontact.check_fleet(written(tmp_path, FLEET.replace(old, new.format(value), 1)))


def test_a_whole_number_with_a_decimal_point_is_a_count(tmp_path):
    text = FLEET.replace("[wheels]", "seed = 2.0\n[pairs]\ndraw = 3.0\n[wheels]", 1)
    fleet = read_fleet(written(tmp_path, text))
    assert (fleet.seed, fleet.pairing.draw) == (2, 3)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("values = [60]", "values = [true]"),
        ("weights = [1, 3]", "weights = [true, 3]"),
        ("values = [60]", "normal = [60, true]"),
        ("values = [60]", "uniform = [true, 60]"),
        ("[wheels]", "filter_mm = true\n[wheels]"),
        ("[wheels]", "[case]\nrolling_radius_mm = true\n[wheels]"),
    ],
)
def test_a_truth_value_is_not_a_number(tmp_path, old, new):
    with pytest.raises(InputError, match=r"True.*; allowed"):
        fecontact.check_fleet(written(tmp_path, FLEET.replace(old, new, 1)))


def test_weights_of_files_that_cannot_be_are_refused(tmp_path):
    for row, said in (("S1002,-1", "row 1: weight is -1"), ("S1002,much", "weight is 'much'")):
        with pytest.raises(InputError, match=said):
            fecontact.check_fleet(written(tmp_path, wheels=f"file,weight\n{row}\n"))
    with pytest.raises(InputError, match="the sum of the weights is 0"):
        fecontact.check_fleet(written(tmp_path, wheels="file,weight\nS1002,0\n"))
    with pytest.raises(InputError, match="inf"):
        normalise_weights([("a", float("inf"))], "weights")


def test_a_table_of_a_million_rows_is_refused(tmp_path):
    rows = "file\n" + "S1002\n" * 1_000_000
    with pytest.raises(InputError, match="1000000 rows; allowed: at most 100000"):
        fecontact.check_fleet(written(tmp_path, wheels=rows))


def test_an_empty_folder_and_too_many_pairs_are_refused(tmp_path):
    (tmp_path / "empty").mkdir()
    path = written(tmp_path, FLEET.replace("wheels.csv", "empty"))
    with pytest.raises(InputError, match="no file in empty"):
        fecontact.check_fleet(path)
    many = {str(k): 1.0 for k in range(1001)}
    with pytest.raises(InputError, match="1002001 pairs; allowed: at most 1000000; draw a sample"):
        list_all_pairs(many, many)


def test_doubled_files_and_files_of_the_other_body_in_a_folder(tmp_path):
    rail, wheel = write_examples(tmp_path / "one")
    mixed = tmp_path / "mixed"
    mixed.mkdir()
    for source, name in ((wheel, "a.csv"), (wheel, "b.csv"), (rail, "head.ban"), (wheel, "tread.whl")):
        shutil.copyfile(source, mixed / name)
    (mixed / ".hidden").write_text("")
    fleet = read_fleet(written(tmp_path, FLEET.replace("wheels.csv", "mixed")))
    problems = {candidate.name: candidate.problem for candidate in find_candidates(fleet, "wheel")}
    assert problems == {"a": "", "b": "same content as a", "tread": "same content as a"}
    # names are made different, whatever the files are called
    (mixed / "a.txt").write_text("1 2\n")
    assert [candidate.name for candidate in find_candidates(fleet, "wheel")] == ["a", "a.txt", "b", "tread"]


def list_wheels(path):
    """Names of the wheels of a fleet, and of those that cannot be used."""
    candidates = find_candidates(read_fleet(path), "wheel")
    return [wheel.name for wheel in candidates], [wheel.name for wheel in candidates if wheel.problem]


def test_a_file_is_counted_once_by_its_real_path(tmp_path):
    _, wheel = write_examples(tmp_path / "one")
    folder = tmp_path / "wheels"
    folder.mkdir()
    shutil.copyfile(wheel, folder / "a.csv")
    (folder / "b.csv").symlink_to("a.csv")
    (tmp_path / "linked").symlink_to("wheels")
    (tmp_path / "table.csv").write_text("file,weight\nwheels/a.csv,3\n")
    for texts, weight in (
        (["wheels"], 1.0),
        (["wheels", "wheels/*.csv", "wheels/a.csv", "./wheels/../wheels/a.csv", "linked"], 1.0),
        (["wheels", "table.csv"], 3.0),
        (["table.csv", "linked/*"], 3.0),
    ):
        path = written(tmp_path, FLEET.replace('"wheels.csv"', json.dumps(texts)))
        (candidate,) = find_candidates(read_fleet(path), "wheel")
        assert (candidate.weight, candidate.problem) == (weight, ""), texts


def test_files_of_the_fleet_and_results_are_not_profiles(tmp_path):
    """The folder of the fleet has its tables, a study and results."""
    folder = tmp_path / "fleet"
    folder.mkdir()
    _, wheel = write_examples(tmp_path / "one")
    shutil.copyfile(wheel, folder / "a.csv")
    (folder / "pairs.csv").write_text("wheel,rail\na,60E1\n")
    (folder / "places.csv").write_text("shift_mm,load_kN\n0,60\n")
    (folder / "rails.csv").write_text("file\n60E1\n")
    (folder / "study.toml").write_text("[[case]]\nload_kN = 60\n")
    texts = TOGETHER.replace('"wheels.csv"', '"a.csv"').replace('["60E1", "54E1"]', '"rails.csv"')
    path = written(folder, texts + '[pairs]\ntable = "pairs.csv"\n', wheels="file\na.csv\n")
    for out in (folder, folder / "out"):
        with stand_ins(inline_crew(), None, ""):
            fecontact.run_fleet(path, out)
        write_report(evaluate_fleet(out), out)
    definition = path.read_text("utf-8")

    def check_wheels() -> None:
        for text in (".", "*", "./*", "**/*", "../fleet/*", "*.*", "**/*.csv"):
            path.write_text(definition.replace('"a.csv"', json.dumps(text)), "utf-8")
            assert list_wheels(path) == (["a"], []), text

    check_wheels()
    # also after a run that ended before its record was written
    for out in (folder, folder / "out"):
        (out / "fleet.json").unlink()
        (out / "answer.json").unlink()
    shutil.rmtree(folder / "report")
    shutil.rmtree(folder / "out/report")
    for out in (folder, folder / "out"):
        for name in ("answer.csv", "report.html"):
            (out / name).unlink()
    check_wheels()


def test_check_counts_positions_without_reading_profiles(tmp_path, capsys):
    assert call(["fleet", "check", str(written(tmp_path))]) == 0
    assert "2 wheels, 2 rails, 4 pairs, 8 positions" in capsys.readouterr().out


def test_without_pyarrow_the_command_names_the_remedy(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    assert call(["fleet", "run", str(written(tmp_path)), "--out", str(tmp_path / "out")]) == 2
    assert "pip install 'fecontact[fleet]'" in capsys.readouterr().err


@pytest.mark.parametrize("seed", [-1, 2**60])
def test_a_seed_outside_its_range_is_refused_before_anything_is_written(tmp_path, capsys, seed):
    folder = tmp_path / "examples"
    assert call(["fleet", "examples", str(folder), "--wheels", "1", "--rails", "1", "--seed", str(seed)]) == 2
    assert f"error: seed is {seed}; allowed: whole numbers from 0 to 9.00719925474e+15;" in capsys.readouterr().err
    assert not folder.exists()


def test_examples_are_the_same_for_a_seed_and_say_what_they_are(tmp_path):
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        assert (
            call(["fleet", "examples", str(tmp_path / name), "--wheels", "1", "--rails", "1", "--seed", str(seed)]) == 0
        )
    texts = [(tmp_path / name / "rails" / "rail00000.csv").read_bytes() for name in "abc"]
    assert texts[0] == texts[1] != texts[2]
    assert np.loadtxt(tmp_path / "a/rails/rail00000.csv", delimiter=",", skiprows=2).shape[1] == 2
    assert json.dumps(fecontact.check_fleet(tmp_path / "a/fleet.toml").positions) == "10"


@pytest.mark.parametrize(
    ("table", "option"),
    [
        ("file\na.csv\n", '[case.wheel_file]\ncolumns = "3,4"\n'),
        ('file,columns\na.csv,"3,4"\n', ""),
        ('file,columns\na.csv,"y,x"\n', ""),
        ("file\na.csv\n", "[case.wheel_file]\nsection = 2\n"),
        ("file\nempty.csv\n", ""),
        ("file\nmissing.csv\n", ""),
        ("file,accepted\na.csv,no\n", ""),
        ("file\nrail.csv\n", ""),
        ("file\nfew.csv\n", ""),
        ("file\nrail.ban\n", ""),
        ("file,tape_circle_mm\nS1002.toml,2000\n", ""),
    ],
)
def test_check_refuses_what_a_run_refuses_with_the_same_text(tmp_path, table, option):
    rail, wheel = write_examples(tmp_path / "one")
    for source, name in ((wheel, "a.csv"), (rail, "rail.csv"), (rail, "rail.ban")):
        shutil.copyfile(source, tmp_path / name)
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "few.csv").write_text("0,0\n1,0\n")
    path = written(tmp_path, FLEET + option, wheels=table)
    messages = []
    for use in (fecontact.check_fleet, lambda file: fecontact.run_fleet(file, tmp_path / "out")):
        with stand_ins(inline_crew(), None, ""):
            try:
                use(path)
            except InputError as error:
                messages.append(str(error))
            else:
                messages.append("")
    assert messages[0] == messages[1] != ""


def test_check_and_run_print_each_kind_of_refusal_once(tmp_path, capsys):
    _, wheel = write_examples(tmp_path / "one")
    shutil.copyfile(wheel, tmp_path / "good.csv")
    for number in range(5):
        (tmp_path / f"bad{number}.csv").write_text(f"0,{number}\n1,0\n")
        (tmp_path / f"text{number}.csv").write_text(f"nothing {number}\n")
    names = ["good", *(f"{kind}{number}" for kind in ("bad", "text") for number in range(5))]
    path = written(tmp_path, wheels="file\n" + "".join(f"{name}.csv\n" for name in names))
    with stand_ins(inline_crew(), None, ""):
        assert call(["fleet", "check", str(path)]) == 0
        checked = capsys.readouterr()
        assert call(["fleet", "run", str(path), "--out", str(tmp_path / "out")]) == 0
    run = capsys.readouterr()
    lines = [line for line in checked.err.splitlines() if line.startswith("  5 files, wheel ")]
    assert [line.partition(": ")[0] for line in lines] == [
        "  5 files, wheel bad0, wheel bad1, wheel bad2, ...",
        "  5 files, wheel text0, wheel text1, wheel text2, ...",
    ]
    assert all("; " in line for line in lines)
    assert [line for line in run.err.splitlines() if line.startswith("  5 files, wheel ")] == lines
    assert "10 files cannot be used:" in checked.err
    assert "1 wheel, 2 rails, 2 pairs, 4 positions" in checked.out
    assert "10 of 13 files could not be read:" in run.err


def test_single_things_are_singular(tmp_path, capsys):
    text = FLEET.replace("values = [2, 0]\nweights = [1, 3]", "values = [0]").replace('["60E1", "54E1"]', '"60E1"')
    path = written(tmp_path, text, wheels="file\nS1002\nmissing.csv\n")
    with stand_ins(inline_crew(), None, ""):
        assert call(["fleet", "run", str(path), "--out", str(tmp_path / "out"), "--workers", "1"]) == 0
        assert call(["fleet", "run", str(path), "--out", str(tmp_path / "out"), "--workers", "1"]) == 0
        assert call(["fleet", "check", str(path)]) == 0
    printed = capsys.readouterr()
    text = printed.out + printed.err
    assert "1 wheel, 1 rail, 1 pair, 1 position" in text
    assert "with 1 worker\n" in text
    assert "1 position of 1 pair, by weight" in text
    assert "1 of 1 pair finished by an earlier run" in text
    assert "1 file cannot be used:" in text
    assert "0 of 1 pair done" in text
    assert not re.search(r"(?<![\d.])1 (?:pairs|positions|wheels|rails|files|workers)\b", text)


@pytest.mark.parametrize(("count", "idle_s"), [(2, 9.0), (4, 13.0), (10, 35.0)])
def test_the_expected_time_is_within_a_factor_of_two(tmp_path, count, idle_s):
    """Compared with runs of the example by two workers (November 2026)."""
    cost = fecontact.check_fleet(write_fleet(tmp_path, wheels=count, rails=count))
    assert cost.pairs == count**2
    assert 0.5 < cost.estimate_seconds(2) / idle_s < 2.0
    # the half-space takes four times as long
    path = tmp_path / "fleet.toml"
    path.write_text(path.read_text("utf-8").replace('"strip"', '"half_space"'), "utf-8")
    assert fecontact.check_fleet(path).cpu_seconds > 2.0 * cost.cpu_seconds
