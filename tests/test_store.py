"""Finished cases on disk: the inputs of a result, its completeness, and the right to write."""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import fake_solve
import pytest

from fecontact.case import Case, Criteria
from fecontact.errors import InputError
from fecontact.files import read_json
from fecontact.jobs.store import (
    MANIFEST,
    StoredJob,
    check_stored_job,
    describe_differences,
    lock_folder,
    remove_leftovers,
    replace_folder,
)
from fecontact.outputs.records.results import read_row
from fecontact.runs import identity
from fecontact.runs.identity import determine_origin, make_case_id
from fecontact.runs.store import name_case_folder

CASE = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)


def stored(out: Path, case: Case = CASE) -> str:
    name = make_case_id(case)
    with replace_folder(name_case_folder(out, name), name, determine_origin(case), "run 1") as folder:
        fake_solve.FakeWork(case=case, name=name, settings={})(folder, None)
    return name


def stored_state(out: Path, name: str, origin=None) -> StoredJob:
    return check_stored_job(name_case_folder(out, name), name, origin or determine_origin(CASE))


def profile(path: Path, radius: float) -> str:
    path.parent.mkdir(exist_ok=True)
    path.write_text("".join(f"{y} {-(y**2) / (2 * radius)}\n" for y in range(-20, 21)))
    return str(path)


def test_the_id_follows_a_profile_s_content_and_not_its_folder(tmp_path):
    first = replace(CASE, rail=profile(tmp_path / "a" / "head.txt", 300.0))
    same = replace(CASE, rail=profile(tmp_path / "b" / "head.txt", 300.0))
    assert make_case_id(first) == make_case_id(same)
    before = make_case_id(first)
    profile(tmp_path / "a" / "head.txt", 299.0)
    assert make_case_id(first) != before
    assert make_case_id(replace(CASE, rail="nowhere.txt")) != before


@pytest.mark.parametrize(
    "change", [{"load_N": 1e5 + 1e-6}, {"solver": "amg"}, {"resolution": (0.5, 0.5)}, {"rail": "circle:301"}]
)
def test_every_input_changes_the_id(change):
    assert make_case_id(replace(CASE, **change)) != make_case_id(CASE)


def test_criteria_by_which_a_solved_case_is_judged_do_not_change_its_id():
    other_case = replace(CASE, criteria=Criteria(p_max=0.03))
    assert make_case_id(other_case) == make_case_id(CASE)
    assert determine_origin(other_case).solved_by == determine_origin(CASE).solved_by
    changes = describe_differences(determine_origin(CASE).evaluated_by, determine_origin(other_case).evaluated_by)
    assert changes == "criterion p_max 0.05 -> 0.03"


def test_the_id_does_not_depend_on_versions_and_the_origin_does(monkeypatch):
    name, made_by = make_case_id(CASE), determine_origin(CASE).solved_by
    newer = {**made_by, "numpy": "99.1"}
    assert describe_differences(made_by, newer) == f"numpy {made_by['numpy']} -> 99.1"
    assert determine_origin(replace(CASE, solver="amg")).solved_by["pyamg"]
    monkeypatch.setattr(identity, "__version__", "99")
    identity._determine_solving_origin.cache_clear()
    assert make_case_id(CASE) == name
    assert determine_origin(CASE).solved_by["fecontact"] == "99"
    identity._determine_solving_origin.cache_clear()


def test_a_whole_case_is_kept_with_its_provenance(tmp_path):
    name = stored(tmp_path)
    assert stored_state(tmp_path, name) == StoredJob(found=True, run="run 1")
    provenance = read_json(name_case_folder(tmp_path, name) / "result.json")["provenance"]
    assert provenance["made_by"] == determine_origin(CASE).solved_by
    assert stored_state(tmp_path, "another") == StoredJob()
    assert [path.name for path in (tmp_path / "cases").iterdir()] == [name]


@pytest.mark.parametrize("file", ["rail.vtu", "result.json", MANIFEST])
@pytest.mark.parametrize("damage", ["removed", "cut", "changed"])
def test_a_damaged_file_is_named(tmp_path, file, damage):
    name = stored(tmp_path)
    path = name_case_folder(tmp_path, name) / file
    data = path.read_bytes()
    if damage == "removed":
        path.unlink()
    else:
        path.write_bytes(data[: len(data) // 2] if damage == "cut" else bytes([data[0] ^ 1]) + data[1:])
    assert not stored_state(tmp_path, name).usable
    assert file in (stored_state(tmp_path, name).problem or "")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"fecontact/stored/1"', '"fecontact/stored/0"', "does not have the layout"),
        ('"files": {', '"file": {', "is damaged"),
        ('"run": "run 1"', '"run": 1', "is damaged"),
    ],
)
def test_a_manifest_of_another_layout_is_said(tmp_path, old, new, says):
    name = stored(tmp_path)
    path = name_case_folder(tmp_path, name) / MANIFEST
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    assert says in (stored_state(tmp_path, name).problem or "")


def test_the_result_of_other_inputs_under_a_case_s_name_is_said(tmp_path):
    name = stored(tmp_path)
    other_folder = name_case_folder(tmp_path, name).rename(name_case_folder(tmp_path, "other"))
    assert "different inputs" in (check_stored_job(other_folder, "other", determine_origin(CASE)).problem or "")


def test_another_version_is_a_reason(tmp_path):
    name, made_by = stored(tmp_path), determine_origin(CASE)
    newer = replace(made_by, solved_by={**made_by.solved_by, "numpy": "99.1"})
    stored_case = stored_state(tmp_path, name, newer)
    assert stored_case.problem == f"made by a different version: numpy {made_by.solved_by['numpy']} -> 99.1"
    newer_judge = replace(made_by, evaluated_by={**made_by.evaluated_by, "criterion p_max": "0.1"})
    stored_case = stored_state(tmp_path, name, newer_judge)
    assert stored_case.problem is None
    assert stored_case.outdated == "judged by different criteria: criterion p_max 0.05 -> 0.1"


def test_a_folder_that_was_not_finished_leaves_the_older_one(tmp_path):
    name = stored(tmp_path)

    def half_a_case() -> None:
        with replace_folder(name_case_folder(tmp_path, name), name, determine_origin(CASE)) as folder:
            (folder / "result.json").write_text("half")
            raise OSError("disk full")

    with pytest.raises(OSError, match="full"):
        half_a_case()
    assert stored_state(tmp_path, name).usable
    assert [path.name for path in (tmp_path / "cases").iterdir()] == [name]


def test_leftovers_of_killed_runs_are_removed_and_cases_stay(tmp_path):
    name = stored(tmp_path)
    (tmp_path / "cases" / f".{name}.0123456789ab").mkdir()
    notes = tmp_path / "cases" / ".notes.2024"
    notes.write_text("keep", "utf-8")
    remove_leftovers(tmp_path / "cases")
    assert {path.name for path in (tmp_path / "cases").iterdir()} == {name, notes.name}


def list_names(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir()}


def add_notes(folder: Path) -> dict[str, str]:
    """Texts of the files that a user has in the folder of a case."""
    texts = {"notes.txt": "a note", "more/deep/notes.txt": "further notes", ".hidden": "hidden", "rail.vtu/x": "x"}
    (folder / "rail.vtu").unlink(missing_ok=True)
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, "utf-8")
    (folder / "away").symlink_to("/nowhere")
    return {name.replace("rail.vtu/", "rail.vtu.1/"): text for name, text in texts.items()}


@pytest.mark.parametrize("has_manifest", [True, False])
def test_files_of_a_user_stay_in_the_folder_of_a_case(tmp_path, has_manifest):
    name = stored(tmp_path)
    folder = name_case_folder(tmp_path, name)
    written = list_names(folder)
    texts = add_notes(folder)
    (folder / "result.json").write_text("damaged", "utf-8")
    if not has_manifest:
        (folder / MANIFEST).unlink()
    for _ in range(2):
        stored(tmp_path)
        assert stored_state(tmp_path, name).usable
        assert list_names(folder) == {*written, *texts, "away"}
        assert {name: (folder / name).read_text("utf-8") for name in texts} == texts
        assert list_names(folder.parent) == {f"{name}/{file}" for file in list_names(folder)}


def test_a_note_with_the_name_of_a_new_file_stays(tmp_path):
    folder = tmp_path / "cases" / "job"
    for file in ("a.txt", "b.txt", "b.txt"):
        with replace_folder(folder, "job", determine_origin(CASE)) as temporary:
            (temporary / file).write_text("result", "utf-8")
        (folder / "b.txt").write_text("a note", "utf-8")
    # the second run wrote b.txt itself, so that the last one replaced a changed result
    assert (folder / "b.txt.1").read_text("utf-8") == "a note"
    assert list_names(folder) == {"b.txt", "b.txt.1", MANIFEST}


@pytest.mark.parametrize("ended_at", [1, 2, 3])
@pytest.mark.parametrize("is_restarted", [True, False])
def test_files_of_a_user_survive_a_kill_during_the_replacement(tmp_path, monkeypatch, ended_at, is_restarted):
    name = stored(tmp_path)
    folder = name_case_folder(tmp_path, name)
    texts = add_notes(folder)
    rename, moves = Path.rename, []

    def killed(self: Path, target: Path) -> Path:
        moves.append(target)
        if len(moves) == ended_at:
            raise KeyboardInterrupt
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", killed)
    with pytest.raises(KeyboardInterrupt):
        stored(tmp_path)
    monkeypatch.undo()
    if is_restarted:
        remove_leftovers(folder.parent)
        assert [path.name for path in folder.parent.iterdir()] == [name]
    stored(tmp_path)
    remove_leftovers(folder.parent)
    assert stored_state(tmp_path, name).usable
    assert {name: (folder / name).read_text("utf-8") for name in texts} == texts


@pytest.mark.parametrize("kind", ["link", "file"])
def test_a_link_or_a_file_with_the_name_of_a_case_is_refused(tmp_path, kind):
    folder = name_case_folder(tmp_path, make_case_id(CASE))
    folder.parent.mkdir()
    if kind == "link":
        (tmp_path / "mine").mkdir()
        folder.symlink_to(tmp_path / "mine")
    else:
        folder.write_text("keep", "utf-8")
    with pytest.raises(InputError, match=f"is a {kind} instead of a folder; remove it"):
        stored(tmp_path)
    assert os.path.lexists(folder)
    assert [path.name for path in folder.parent.iterdir()] == [folder.name]


HOLD = "import sys, time; from pathlib import Path; from fecontact.jobs.store import lock_folder\n"
HOLD += "with lock_folder(Path(sys.argv[1]), eval(sys.argv[2])): print('held', flush=True); time.sleep(60)"


def holder(out: Path, locked: object = None) -> subprocess.Popen[str]:
    process = subprocess.Popen([sys.executable, "-c", HOLD, out, str(locked)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    return process


def test_a_second_run_is_refused_until_the_first_is_gone(tmp_path):
    process = holder(tmp_path)
    try:
        with pytest.raises(InputError, match=f"in use by process {process.pid} on "), lock_folder(tmp_path):
            pass
        with pytest.raises(InputError, match="in use by"), lock_folder(tmp_path, (1, 2)):
            pass
    finally:
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        process.stdout.close()
    with lock_folder(tmp_path):
        pass


def test_parts_run_beside_each_other_and_not_beside_the_whole(tmp_path):
    process = holder(tmp_path, (1, 2))
    try:
        with lock_folder(tmp_path, (2, 2)):
            pass
        with pytest.raises(InputError, match=f"process {process.pid} on .*, part 1/2"), lock_folder(tmp_path, (1, 2)):
            pass
        with pytest.raises(InputError, match="--part"), lock_folder(tmp_path):
            pass
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def test_a_row_is_read_as_it_was_written(tmp_path):
    name = stored(tmp_path)
    row = read_row(name_case_folder(tmp_path, name) / "row.json")
    assert row["hertz_uncertainty_p_max_percent"] != row["hertz_uncertainty_p_max_percent"]
    assert (row["verdict_answer"], row["verdict_failing"]) == ("FAILS", "separate_load")
    assert row["geometry_junction_distance_mm"] == float("inf")
    assert row["verdict_cause"] is None
    with pytest.raises(InputError, match=r"rail\.vtu is not valid JSON"):
        read_row(name_case_folder(tmp_path, name) / "rail.vtu")
    with pytest.raises(InputError, match=r"fecontact/row/3.*again"):
        read_row(name_case_folder(tmp_path, name) / MANIFEST)
