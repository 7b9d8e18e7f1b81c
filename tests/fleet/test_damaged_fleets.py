"""Folders of fleets that were changed, linked, or have results of a different fleet."""

import json
import os
import random
import shutil
from pathlib import Path

import duckdb
import pyarrow.parquet
import pytest
from inline import inline_crew, stand_ins
from made_fleet import Made, made_fleet, seal, write

import fecontact
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.features.fleet import answer as answer_module
from fecontact.features.fleet import report as report_module
from fecontact.features.fleet.answer import evaluate_fleet
from fecontact.features.fleet.checking import open_fleet
from fecontact.features.fleet.reading import find_origin
from fecontact.features.fleet.report import make_answer_rows, write_report
from fecontact.features.fleet.sampling import draw_sample
from fecontact.features.fleet.sealed_folder import digest_screen, lock_fleet, write_sample_record
from fecontact.files import SEAL_KEY, read_json, write_sealed
from fecontact.jobs.engine import RunSettings
from fecontact.jobs.store import MANIFEST, write_manifest

FLEET = """
[wheels]
files = {wheels}
[rails]
files = ["60E1", "54E1"]
[shifts_mm]
values = [0, 3]
[loads_kN]
values = [60, 100]
"""
COMMAND = "fecontact fleet run FLEET.toml"


def fleet_file(path: Path, wheels: str = '["S1002"]') -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(FLEET.format(wheels=wheels), "utf-8")
    return path


def run(path: Path, out: Path, **settings):
    with stand_ins(inline_crew(), None, ""):
        return fecontact.run_fleet(path, out, settings=RunSettings(**settings))


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Path:
    """Folder with the screened fleet `out`, its file `fleet.toml`, and a different screened fleet `other`."""
    folder = tmp_path_factory.mktemp("finished")
    run(fleet_file(folder / "fleet.toml"), folder / "out")
    run(fleet_file(folder / "other.toml", '["EN13715_1in40", "S1002"]'), folder / "other")
    return folder


@pytest.fixture
def copied(finished, tmp_path) -> Path:
    """A copy of the finished fleets."""
    return Path(shutil.copytree(finished, tmp_path / "fleets"))


def files_of(folder: Path) -> dict[str, bytes]:
    """Content of all files of a folder but the log and the lock."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.suffix not in (".log", ".lock")
    }


def answer_of(folder: Path) -> str:
    """Answers of all readers of a fleet."""
    answer, opened = evaluate_fleet(folder), open_fleet(folder)
    tables = (answer.cells, answer.causes, answer.theories, answer.worst, answer.strata, answer.files, answer.notes)
    return json.dumps([make_answer_rows(answer), tables, opened.record["headline"], repr(opened.fleet)])


# --- Damage.


def sampled_copy(finished: Path, sampled, tmp_path: Path) -> tuple[Path, Path]:
    """A screened fleet with a sample, and a different fleet to take files from."""
    fleets = [made_fleet(tmp_path / name, wheels=2, rails=3, seed=seed) for name, seed in (("out", 1), ("other", 2))]
    for fleet in fleets:
        shutil.copyfile(finished / "fleet.toml", fleet.folder / "fleet.toml")
        about = {"theory": "strip", "headline": fleet.folder.name, "folder": str(finished), "file": "../fleet.toml"}
        seal(fleet.folder, {"population": "2 wheels on 3 rails", **about})
        sampled(fleet, 12)
    return fleets[0].folder, fleets[1].folder


KINDS = ("cut", "changed", "emptied", "exchanged", "removed", "linked", "pipe", "folder", "longer", "renamed")


def damage(path: Path, kind: str, foreign: Path, random_numbers: random.Random) -> None:
    """Damage a file of a fleet in a way of `KINDS`; `foreign` is the file of a different fleet."""
    content = path.read_bytes()
    path.unlink()
    at = random_numbers.randrange(len(content))
    if kind == "cut":
        path.write_bytes(content[:at])
    elif kind == "changed":
        path.write_bytes(content[:at] + bytes([content[at] ^ (1 << random_numbers.randrange(8))]) + content[at + 1 :])
    elif kind == "emptied":
        path.write_bytes(b"")
    elif kind == "exchanged":
        path.write_bytes(foreign.read_bytes())
    elif kind == "linked":
        path.symlink_to(foreign)
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "longer":
        path.write_bytes(content + b"\n")
    elif kind == "renamed":
        path.with_name(f"part-{random_numbers.randrange(100, 999):06d}{path.suffix}").write_bytes(content)


def test_a_damaged_fleet_is_refused_or_says_the_same(finished, sampled, tmp_path):
    """160 changes end in a single line, or in an equal answer."""
    out, foreign_folder = sampled_copy(finished, sampled, tmp_path)
    names = ["profiles.parquet", "fleet.json", "fleet.toml", "sample.parquet", "sample.json"]
    names += [f"screen/part-{number}.parquet" for number in range(3)]
    undamaged, random_numbers = answer_of(out), random.Random(1)
    messages: list[str] = []
    for number in range(160):
        name, kind = names[number % len(names)], KINDS[number // len(names) % len(KINDS)]
        damaged = tmp_path / "damaged"
        shutil.copytree(out, damaged)
        damage(damaged / name, kind, foreign_folder / name, random_numbers)
        try:
            assert answer_of(damaged) == undamaged, (name, kind)
        except InputError as error:
            messages.append(str(error))
            # damaged tables cannot be sampled
            if "sample" not in name:
                with pytest.raises(InputError):
                    draw_sample(damaged, 12)
        shutil.rmtree(damaged)
    # a line more at the end of a record, or a bit of a space, may say the same
    assert len(messages) > 145
    for message in messages:
        assert "\n" not in message
        assert COMMAND in message or "fecontact fleet sample" in message, message


@pytest.mark.parametrize("name", ["part-000001.parquet", "part-000777.parquet", "mine.parquet"])
def test_an_added_table_is_refused(copied, name):
    shutil.copyfile(copied / "other/screen/part-000001.parquet", copied / "out/screen" / name)
    with pytest.raises(InputError, match=f"screen/{name} was added after the screening; run the same command again"):
        evaluate_fleet(copied / "out")


def test_a_removed_sample_is_not_an_answer_without_sample(fleet, sampled):
    sampled(fleet, 60)
    (fleet.folder / "sample.parquet").unlink()
    with pytest.raises(InputError, match=r"sample.parquet is missing; remove sample.parquet and sample.json"):
        evaluate_fleet(fleet.folder)
    (fleet.folder / "sample.json").unlink()
    assert evaluate_fleet(fleet.folder).whole.drawn == 0


def test_a_killed_sample_leaves_the_earlier_sample(fleet, sampled, monkeypatch):
    """The checksums of both samples are valid while the new sample replaces the earlier sample."""
    sampled(fleet, 60)
    before = (fleet.folder / "sample.parquet").read_bytes()
    replace = Path.replace

    def killed(self: Path, target: Path) -> Path:
        if Path(target).name == "sample.parquet":
            raise KeyboardInterrupt
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", killed)
    with pytest.raises(KeyboardInterrupt):
        sampled(fleet, 90)
    monkeypatch.undo()
    assert (fleet.folder / "sample.parquet").read_bytes() == before
    assert evaluate_fleet(fleet.folder).whole.drawn == 60


def test_a_sample_of_tables_that_were_screened_again_is_refused(fleet, sampled):
    """New numbers with equal strata and weights."""
    sampled(fleet, 60)
    path = fleet.folder / "screen/part-0.parquet"
    rows = pyarrow.parquet.read_table(path).to_pylist()
    write(path, [row | {"p_max_percent": 1.0 + row["p_max_percent"]} for row in rows])
    seal(fleet.folder)
    with pytest.raises(InputError, match=r"screened again .* fecontact fleet sample .* --finite-elements 60"):
        evaluate_fleet(fleet.folder)


def test_a_folder_without_checksums_of_its_tables_is_refused_and_goes_on(copied):
    out = copied / "out"
    record = {key: value for key, value in read_json(out / "fleet.json").items() if key not in (SEAL_KEY, "file")}
    write_sealed(out / "fleet.json", record, [out / "profiles.parquet"])
    with pytest.raises(InputError, match=r"no checksums of the tables .* run the same command again"):
        evaluate_fleet(out)
    again = run(copied / "fleet.toml", out)
    assert again.reused == again.pairs == 2
    assert evaluate_fleet(out).whole.positions == 8


def test_a_damaged_screening_goes_on(copied):
    run(copied / "fleet.toml", copied / "out")
    before = files_of(copied / "out")
    for number, name in enumerate(("screen/part-000000.parquet", "profiles.parquet", "fleet.json")):
        (copied / "out" / name).write_bytes(b"nothing" * number)
        assert run(copied / "fleet.toml", copied / "out").reused == 2
        assert files_of(copied / "out") == before


def test_tables_that_were_replaced_with_their_checksums_end_in_one_line(fleet, capsys):
    """A verdict as a number, and a theory that does not exist."""
    write(fleet.folder / "screen/part-0.parquet", [{"wheel": "w0", "verdict": 7, "weight": "much", "margin": None}])
    seal(fleet.folder)
    assert call(["fleet", "report", str(fleet.folder)]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ")
    assert said.count("\n") == 1
    assert COMMAND in said


def rewrite(path: Path, change) -> None:
    """Write a table again, with a change of its rows."""
    rows = pyarrow.parquet.read_table(path).to_pylist()
    write(path, [{**row, **change(number, row)} for number, row in enumerate(rows)])


PART, PROFILES, SAMPLE = "screen/part-0.parquet", "profiles.parquet", "sample.parquet"
CHANGES = [
    (PART, "weight", lambda number, row: "much", "weight has the type string; allowed: number"),
    (PART, "weight", lambda number, row: None if number == 7 else row["weight"], "weight has an empty cell"),
    (PART, "weight", lambda number, row: float("nan") if number == 7 else row["weight"], "weight has a value outside"),
    (PART, "weight", lambda number, row: -row["weight"], "weight has a value outside its range, 0 to 1"),
    (PART, "shift_mm", lambda number, row: float("inf"), "shift_mm has a value outside"),
    (PART, "verdict", lambda number, row: "PERHAPS" if number == 7 else row["verdict"], "verdict has the value 'PERHA"),
    (PART, "verdict", lambda number, row: None, "verdict has the type null"),
    (PART, "margin", lambda number, row: [1.0], "margin has the type list"),
    (PART, "cheapest_theory", lambda number, row: "guess", "cheapest_theory has the value 'guess'"),
    (PART, "wheel", lambda number, row: "nobody", "has the wheel 'nobody', which is not a single row"),
    (PART, "Weight", lambda number, row: 1.0, "more than one column has the name weight"),
    (PART, "remedy", lambda number, row: 1.5, "remedy has the type double; allowed: text"),
    (PROFILES, "name", lambda number, row: "w0", "which is not a single row of profiles.parquet"),
    (PROFILES, "status", lambda number, row: "good", "status has the value 'good'"),
    (PROFILES, "file", lambda number, row: "a\0b", "file has a text with a NUL character"),
    (PROFILES, "wear_mm", lambda number, row: "deep", "wear_mm has the type string; allowed: number"),
    (PROFILES, "mirror", lambda number, row: 1, "mirror has the type int64; allowed: flag"),
    (PROFILES, "line", lambda number, row: {"a": 1}, "line has the type struct"),
    (SAMPLE, "draw", lambda number, row: None, "draw has the type null"),
    (SAMPLE, "draw", lambda number, row: 1.5, "draw has the type double; allowed: integer"),
    (SAMPLE, "stratum", lambda number, row: "far", "stratum has the value 'far'"),
    (SAMPLE, "fe_verdict", lambda number, row: "MAYBE", "fe_verdict has the value 'MAYBE'"),
    (SAMPLE, "inclusion_probability", lambda number, row: 0.0, "inclusion_probability has a value outside"),
]


@pytest.mark.parametrize(("name", "column", "value", "said"), CHANGES)
def test_a_table_with_new_checksums_is_checked_against_its_declaration(fleet, sampled, name, column, value, said):
    sampled(fleet, 12)
    rewrite(fleet.folder / name, lambda number, row: {column: value(number, row)})
    renew_checksums(fleet.folder)
    for use in (evaluate_fleet, lambda folder: draw_sample(folder, 12)):
        with pytest.raises(InputError) as refused:
            use(fleet.folder)
        message = str(refused.value)
        assert said in message
        assert "\n" not in message
        assert (COMMAND if name != SAMPLE else "fecontact fleet sample") in message


@pytest.mark.parametrize(
    ("name", "column"),
    [
        *((PART, column) for column in ("wheel", "shift_mm", "weight", "verdict", "margin", "variants", "cause")),
        *((PROFILES, column) for column in ("body", "name", "file", "status", "nominal")),
        *((SAMPLE, column) for column in ("rail", "draw", "seed", "fe_verdict", "stratum")),
    ],
)
def test_a_table_without_a_column_is_refused(fleet, sampled, name, column):
    sampled(fleet, 12)
    path = fleet.folder / name
    pyarrow.parquet.write_table(pyarrow.parquet.read_table(path).drop_columns([column]), path)
    renew_checksums(fleet.folder)
    for use in (lambda: evaluate_fleet(fleet.folder), lambda: draw_sample(fleet.folder, 12)):
        with pytest.raises(InputError, match=rf"{path.name}: the column {column} is missing \(an ear.*; .* fecontact"):
            use()


@pytest.mark.parametrize("name", [PART, PROFILES, SAMPLE])
def test_a_table_that_is_not_parquet_is_refused_in_a_line(fleet, sampled, name):
    """Its checksum is right, so that only its reader notices."""
    sampled(fleet, 12)
    content = (fleet.folder / name).read_bytes()
    for damaged in (b"", b"PAR1", content[:-9], content[: len(content) // 2] + bytes(60) + content[-400:]):
        (fleet.folder / name).write_bytes(damaged)
        renew_checksums(fleet.folder)
        with pytest.raises(InputError, match=rf"{Path(name).name}: cannot be read .*fecontact fleet") as refused:
            evaluate_fleet(fleet.folder)
        assert "\n" not in str(refused.value)


def renew_checksums(folder: Path) -> None:
    """Give the present tables and the present sample their checksums."""
    seal(folder)
    write_sample_record(folder, folder / SAMPLE, digest_screen(read_json(folder / "fleet.json")), keep_earlier=False)


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        ({"theory": "guess"}, "theory is 'guess'; allowed: strip, half_space"),
        ({"theory": None}, "theory is None"),
        ({"folder": 7}, "folder is not a text"),
        ({"folder": "a\0b"}, "folder is not a text, or has a NUL character"),
        ({"population": []}, "population is not a text"),
        ({"suspicious_share": "half"}, "suspicious_share is not a number"),
    ],
)
def test_a_record_of_another_layout_is_refused_in_a_line(fleet, capsys, entries, said):
    record = {key: value for key, value in read_json(fleet.folder / "fleet.json").items() if key != SEAL_KEY}
    seal(fleet.folder, record | entries)
    assert call(["fleet", "report", str(fleet.folder)]) == 2
    printed = capsys.readouterr().err
    assert said in printed
    assert COMMAND in printed
    assert printed.count("\n") == 1


@pytest.mark.parametrize("samples", [None, [], [7], [{"checksum": 7, "screen": ""}], {"checksum": "a"}])
def test_a_record_of_a_sample_of_another_layout_is_refused(fleet, sampled, samples):
    sampled(fleet, 12)
    write_sealed(fleet.folder / "sample.json", {"kind": "fleet sample", "samples": samples})
    with pytest.raises(InputError, match=r"sample.json has a different layout; remove .*fecontact fleet sample"):
        evaluate_fleet(fleet.folder)


@pytest.mark.parametrize("change", [lambda number, row: {"margin": "wide"}, lambda number, row: {"more": 1}])
def test_rows_of_a_pair_with_a_new_manifest_are_checked(copied, change):
    folder = min((copied / "out/pairs").iterdir())
    rewrite(folder / "part.parquet", change)
    (folder / MANIFEST).unlink()
    write_manifest(folder, [folder / "part.parquet"], folder.name, find_origin())
    with pytest.raises(InputError, match=r"does not have the columns and rows of a screened pair; remove "):
        run(copied / "fleet.toml", copied / "out")


@pytest.mark.parametrize("module", [report_module, answer_module])
def test_an_error_of_the_program_is_not_a_damaged_folder(fleet, monkeypatch, module):
    """A programming error in an evaluation or a picture ends in a traceback."""

    def fail(*_, **__):
        raise TypeError("an error of the program")

    fleet_file(fleet.folder / "fleet.toml")
    seal(fleet.folder)
    monkeypatch.setattr(module, "draw_map" if module is report_module else "_make_stratum", fail)
    with pytest.raises(TypeError, match="an error of the program"):
        call(["fleet", "report", str(fleet.folder)])


def test_a_wrong_query_is_not_a_damaged_folder(fleet, monkeypatch):
    monkeypatch.setattr(answer_module, "_WORST_PAIRS", "SELECT nothing FROM screen")
    with pytest.raises(duckdb.BinderException):
        evaluate_fleet(fleet.folder)


def test_a_lack_of_memory_of_the_database_is_a_lack_of_memory(fleet, monkeypatch):
    def fail(*_):
        raise duckdb.OutOfMemoryException("no memory")

    monkeypatch.setattr(answer_module, "_query_shares_by_position", fail)
    with pytest.raises(MemoryError):
        evaluate_fleet(fleet.folder)


def test_a_changed_profile_is_not_drawn_as_the_screened_one(copied, tmp_path):
    rail = tmp_path / "rail.csv"
    rail.write_text("y,z\n" + "".join(f"{y},{-(y**2) / 60.0}\n" for y in range(-30, 31)), "utf-8")
    path = fleet_file(tmp_path / "fleet.toml")
    path.write_text(path.read_text("utf-8").replace('["60E1", "54E1"]', '"rail.csv"'), "utf-8")
    run(path, tmp_path / "out")
    opened = open_fleet(tmp_path / "out")
    assert opened.case("S1002", "rail", 0.0, 60.0).rail == str(rail)
    rail.write_text(rail.read_text("utf-8").replace("-10,", "-10.5,"), "utf-8")
    with pytest.raises(InputError, match=r"rail.csv was changed after it was screened; run the same command again"):
        open_fleet(tmp_path / "out").case("S1002", "rail", 0.0, 60.0)


# --- Files of others.


def test_files_that_the_program_did_not_write_stay(copied):
    """Notes in every folder stay; a table of an earlier wheel goes."""
    out = copied / "other"
    notes = [out / folder / name for folder in ("screen", "profiles", "pairs") for name in ("notes.txt", ".notes")]
    for path in notes:
        path.write_text("keep", "utf-8")
    (out / "pairs/.more").mkdir()
    (out / "pairs" / ".abc.0123456789ab").mkdir()
    fleet_file(copied / "other.toml", '["S1002"]')
    run(copied / "other.toml", out)
    assert {path.name for path in (out / "screen").iterdir()} == {"part-000000.parquet", "notes.txt", ".notes"}
    assert all(path.read_text("utf-8") == "keep" for path in notes)
    assert (out / "pairs/.more").is_dir()
    assert not (out / "pairs" / ".abc.0123456789ab").exists()


def test_a_table_that_no_screening_wrote_is_neither_replaced_nor_removed(tmp_path):
    mine = tmp_path / "out/screen/part-000000.parquet"
    write(mine, [{"a": 1}])
    content = mine.read_bytes()
    with pytest.raises(InputError, match=r"part-000000.parquet is not a table of this fleet; move it"):
        run(fleet_file(tmp_path / "fleet.toml"), tmp_path / "out")
    assert mine.read_bytes() == content


@pytest.mark.parametrize("name", ["screen", "profiles", "pairs", "report", "sample"])
def test_nothing_is_written_through_a_linked_folder(copied, tmp_path, name, capsys):
    victim, out = tmp_path / "victim", copied / "out"
    shutil.rmtree(out / name, ignore_errors=True)
    victim.mkdir()
    (victim / "part-000007.parquet").write_text("keep", "utf-8")
    (victim / "notes.txt").write_text("keep", "utf-8")
    (out / name).symlink_to(victim)
    before, victims_before = files_of(out), files_of(victim)
    for command in (
        ["run", str(copied / "fleet.toml"), "--out", str(out)],
        ["report", str(out)],
        ["sample", str(out), "--finite-elements", "2"],
    ):
        assert call(["fleet", *command]) == 2
        assert f"{out / name} is a link instead of a folder; remove it" in capsys.readouterr().err
    assert files_of(victim) == victims_before
    assert files_of(out) == before
    assert not (out / "run.log").exists()


@pytest.mark.parametrize("name", ["profiles.parquet", "fleet.json", "answer.csv", "report.html", "run.lock"])
@pytest.mark.parametrize("kind", ["link", "pipe", "folder"])
def test_nothing_is_written_in_place_of_a_link_a_pipe_or_a_folder(copied, tmp_path, name, kind, capsys):
    path, victim = copied / "out" / name, tmp_path / "victim.txt"
    victim.write_text("keep", "utf-8")
    path.unlink(missing_ok=True)
    {"link": lambda: path.symlink_to(victim), "pipe": lambda: os.mkfifo(path), "folder": path.mkdir}[kind]()
    for command in (["run", str(copied / "fleet.toml"), "--out", str(path.parent)], ["report", str(path.parent)]):
        assert call(["fleet", *command]) == 2
        assert f"{path} is a {kind}" in capsys.readouterr().err
    assert victim.read_text("utf-8") == "keep"


# --- Files of the user.


@pytest.mark.parametrize("name", ["profiles.parquet", "fleet.json", "fleet.toml"])
def test_files_of_the_user_are_not_replaced_by_a_screening(tmp_path, name, capsys):
    out, path = tmp_path / "out", fleet_file(tmp_path / "mine.toml")
    out.mkdir()
    (out / name).write_text('{"mine": 1}', "utf-8")
    assert call(["fleet", "run", str(path), "--out", str(out)]) == 2
    error = f"error: {out} has {name}, which no run of this program wrote and which would be overwritten; give another"
    assert error in capsys.readouterr().err
    with pytest.raises(InputError, match="no run of this program wrote"):
        run(path, out)
    assert {file.name: file.read_text("utf-8") for file in out.iterdir()} == {name: '{"mine": 1}'}


def test_a_fleet_is_screened_into_the_folder_of_its_file(tmp_path):
    path = fleet_file(tmp_path / "fleet.toml")
    text = path.read_text("utf-8")
    assert run(path, tmp_path).pairs == 2
    assert path.read_text("utf-8") == text
    assert run(path, tmp_path).reused == 2


@pytest.mark.parametrize("name", ["report.html", "answer.csv", "answer.json"])
def test_files_of_the_user_are_not_replaced_by_a_report(copied, name, capsys):
    out = copied / "out"
    for report_file in ("report.html", "answer.csv", "answer.json"):
        (out / report_file).unlink(missing_ok=True)
    (out / name).write_text('{"mine": 1}', "utf-8")
    assert call(["fleet", "report", str(out)]) == 2
    error = f"error: {out} has {name}, which no report of this fleet wrote and which would be overwritten; move or"
    assert error in capsys.readouterr().err
    assert (out / name).read_text("utf-8") == '{"mine": 1}'
    (out / name).rename(out / "mine")
    assert call(["fleet", "report", str(out)]) == 0
    assert call(["fleet", "report", str(out)]) == 0


def test_a_killed_report_is_written_again(copied, monkeypatch):
    out = copied / "out"

    def stop(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("fecontact.features.fleet.report.render_page", stop)
        assert call(["fleet", "report", str(out)]) == 130
    assert (out / "answer.csv").exists()
    # the tables change before the next report
    assert not run(copied / "other.toml", out, force=True).removed_report
    assert call(["fleet", "report", str(out)]) == 0
    assert (out / "report.html").exists()


# --- Results of a different fleet.


def test_a_folder_of_another_fleet_is_taken_by_force_alone(copied, capsys):
    out = copied / "out"
    write_report(evaluate_fleet(out), out)
    before = files_of(out)
    for path in (copied / "other.toml", fleet_file(copied / "elsewhere/fleet.toml")):
        with pytest.raises(InputError, match=r"out has a different fleet \(fleet.json\), which would be overwritten"):
            run(path, out)
        assert call(["fleet", "run", str(path), "--out", str(out)]) == 2
        assert "--force" in capsys.readouterr().err
    assert files_of(out) == before
    # the report of the earlier fleet does not stay beside the tables of the new fleet
    mine = out / "report/mine.txt"
    mine.write_text("keep", "utf-8")
    screening = run(copied / "other.toml", out, force=True)
    assert screening.removed_report
    assert [path.name for path in (out / "report").iterdir()] == ["mine.txt"]
    assert not any((out / name).exists() for name in ("report.html", "answer.csv", "answer.json"))
    assert evaluate_fleet(out).whole.positions == 16


def test_a_fleet_goes_on_where_it_was_moved_renamed_or_changed(copied, tmp_path):
    out = copied / "out"
    assert run(copied / "fleet.toml", out).reused == 2
    assert run((copied / "fleet.toml").rename(copied / "renamed.toml"), out).reused == 2
    assert run(copied / "renamed.toml", out.rename(tmp_path / "moved")).reused == 2
    larger = run(fleet_file(copied / "renamed.toml", '["S1002", "EN13715_1in40"]'), tmp_path / "moved")
    assert (larger.reused, larger.pairs) == (2, 4)


def test_other_commands_do_not_write_into_the_folder_of_a_fleet(copied, capsys):
    study = copied / "study.toml"
    study.write_text("[[case]]\nload_kN = 60\n", "utf-8")
    assert call(["run", str(study), "--out", str(copied / "out")]) == 2
    assert "has a fleet (fleet.json), which would be overwritten" in capsys.readouterr().err
    assert call(["run", str(copied / "out"), "--out", str(copied / "new")]) == 2
    assert "this folder has the results of a fleet" in capsys.readouterr().err


# --- Names that look like patterns.


def test_the_name_of_a_folder_is_not_a_pattern(copied, tmp_path):
    """`a*b` and `aXb` are different folders, and so are `fr[1]` and `fr1`."""
    expected = [evaluate_fleet(copied / name).whole.positions for name in ("out", "other")]
    assert expected == [8, 16]
    for names in (("a*b", "aXb"), ("fr[1]", "fr1"), ("q?", "qx"), ("{a,b}", "a"), ("**", "x"), ("n'\"\n", "ü")):
        for name, source in zip(names, ("out", "other"), strict=True):
            shutil.copytree(copied / source, tmp_path / "names" / name)
        assert [evaluate_fleet(tmp_path / "names" / name).whole.positions for name in names] == expected
        shutil.rmtree(tmp_path / "names")
    with pytest.raises(InputError, match="backslash together with"):
        run(copied / "fleet.toml", tmp_path / "a\\b*")


# --- Reports.


def test_the_temporary_files_of_a_killed_report_are_removed(tmp_path):
    """Files of a user stay, also with similar names."""
    folder = made_fleet(tmp_path / "fleet").folder
    (folder / "report").mkdir()
    temporary_files = [folder / ".report.9cefcd2ac0a9.html", folder / "report" / ".map.0123456789ab.png"]
    own_files = [folder / ".notes.0123456789ab.txt", folder / ".report.html"]
    for path in (*temporary_files, *own_files):
        path.write_text("unfinished")
    with lock_fleet(folder):
        assert not any(path.exists() for path in temporary_files)
        assert all(path.exists() for path in own_files)


@pytest.mark.slow
def test_reports_of_a_fleet_have_equal_bytes(tmp_path):
    """40 tables, so that sums on several threads are in several orders."""
    fleet: Made = made_fleet(tmp_path / "fleet", wheels=40, rails=12, parts=40)
    reports = []
    for _ in range(3):
        write_report(evaluate_fleet(fleet.folder), fleet.folder)
        reports.append(files_of(fleet.folder))
    assert reports[0] == reports[1] == reports[2]


def test_a_position_of_a_pair_is_the_first_of_equal_margins(tmp_path):
    fleet = made_fleet(tmp_path / "fleet", wheels=2, rails=2, parts=1)
    path = fleet.folder / "screen/part-0.parquet"
    rows = [row | {"margin": -3.0, "verdict": "FAILS"} for row in pyarrow.parquet.read_table(path).to_pylist()]
    for order in (1, -1):
        write(path, rows[::order])
        seal(fleet.folder)
        worst = evaluate_fleet(fleet.folder).worst
        assert [(row["shift_mm"], row["load_kN"]) for row in worst] == [(-6.0, 40.0)] * 4
