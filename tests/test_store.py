"""Finished cases on disk: whose result it is, whether it is whole, and who may write."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import fake_solve
import pytest

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.jobs import provenance as identity
from fecontact.jobs.lock import locked
from fecontact.jobs.provenance import case_id, difference, fingerprint, makers, source_digest
from fecontact.jobs.store import CHECKSUMS, case_folder, kept_case, new_case_folder, remove_leftovers

CASE = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)


def stored(out: Path, case: Case = CASE) -> str:
    name = case_id(case)
    with new_case_folder(out, name) as folder:
        fake_solve.solve_into(case, folder, name, {})
    return name


def profile(path: Path, radius: float) -> str:
    path.parent.mkdir(exist_ok=True)
    path.write_text("".join(f"{y} {-(y**2) / (2 * radius)}\n" for y in range(-20, 21)))
    return str(path)


def test_the_id_follows_a_profile_s_content_and_not_its_folder(tmp_path):
    first = replace(CASE, rail=profile(tmp_path / "a" / "head.txt", 300.0))
    same = replace(CASE, rail=profile(tmp_path / "b" / "head.txt", 300.0))
    assert case_id(first) == case_id(same)
    before = case_id(first)
    profile(tmp_path / "a" / "head.txt", 299.0)
    assert case_id(first) != before
    assert case_id(replace(CASE, rail="nowhere.txt")) != before


@pytest.mark.parametrize(
    "change", [{"load_N": 1e5 + 1e-6}, {"solver": "amg"}, {"resolution": (0.5, 0.5)}, {"rail": "circle:301"}]
)
def test_every_input_changes_the_id(change):
    assert case_id(replace(CASE, **change)) != case_id(CASE)


def test_the_id_does_not_depend_on_versions_and_the_fingerprint_does(monkeypatch):
    name, made_by = case_id(CASE), makers(CASE)
    newer = made_by | {"numpy": "99.1"}
    assert fingerprint(name, newer) != fingerprint(name, made_by)
    assert difference(made_by, newer) == f"numpy {made_by['numpy']} -> 99.1"
    assert makers(replace(CASE, solver="amg"))["pyamg"]
    monkeypatch.setattr(identity, "__version__", "99")
    assert case_id(CASE) == name
    assert makers(CASE)["fecontact"] == "99"


def test_the_source_digest_sees_numerical_files_and_no_others(tmp_path, monkeypatch):
    package = tmp_path / "fecontact"
    shutil.copytree(Path(identity.__file__).parents[1], package, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(identity, "_PACKAGE", package)

    def digest_after(file: str) -> str:
        with (package / file).open("a") as opened:
            opened.write("\n# changed\n")
        return source_digest.__wrapped__()

    before = source_digest.__wrapped__()
    assert before == source_digest()
    for file in ("outputs/tables.py", "cli.py", "jobs/workers.py", "runs/study.py"):
        assert digest_after(file) == before, file
    for file in ("contact/solver.py", "outputs/record.py", "profiles/curve.py", "profiles/data/60E1.toml"):
        after = digest_after(file)
        assert after != before, file
        before = after


def test_a_whole_case_is_kept_with_its_provenance(tmp_path):
    name = stored(tmp_path)
    kept = kept_case(tmp_path, name, makers(CASE))
    assert kept.problem is None
    assert kept.record["provenance"]["fingerprint"] == fingerprint(name, makers(CASE))
    assert kept_case(tmp_path, "another", makers(CASE)) == type(kept)()
    assert [path.name for path in (tmp_path / "cases").iterdir()] == [name]


@pytest.mark.parametrize("file", ["rail.vtu", "result.json", CHECKSUMS])
@pytest.mark.parametrize("damage", ["removed", "cut", "changed"])
def test_a_damaged_file_is_named(tmp_path, file, damage):
    name = stored(tmp_path)
    path = case_folder(tmp_path, name) / file
    data = path.read_bytes()
    if damage == "removed":
        path.unlink()
    else:
        path.write_bytes(data[: len(data) // 2] if damage == "cut" else bytes([data[0] ^ 1]) + data[1:])
    kept = kept_case(tmp_path, name, makers(CASE))
    assert kept.record is None
    assert file in kept.problem


def test_another_version_is_a_reason(tmp_path):
    name, made_by = stored(tmp_path), makers(CASE)
    kept = kept_case(tmp_path, name, made_by | {"numpy": "99.1"})
    assert kept.problem == f"made by another version: numpy {made_by['numpy']} -> 99.1"


def test_a_folder_that_was_not_finished_leaves_the_older_one(tmp_path):
    name = stored(tmp_path)

    def half_a_case() -> None:
        with new_case_folder(tmp_path, name) as folder:
            (folder / "result.json").write_text("half")
            raise OSError("disk full")

    with pytest.raises(OSError, match="full"):
        half_a_case()
    assert kept_case(tmp_path, name, makers(CASE)).record is not None
    assert [path.name for path in (tmp_path / "cases").iterdir()] == [name]


def test_leftovers_of_killed_runs_are_removed_and_cases_stay(tmp_path):
    name = stored(tmp_path)
    (tmp_path / "cases" / f".{name}.0123").mkdir()
    remove_leftovers(tmp_path)
    assert [path.name for path in (tmp_path / "cases").iterdir()] == [name]


HOLD = "import sys, time; from pathlib import Path; from fecontact.jobs.lock import locked\n"
HOLD += "with locked(Path(sys.argv[1]), eval(sys.argv[2])): print('held', flush=True); time.sleep(60)"


def holder(out: Path, part: object = None) -> subprocess.Popen[str]:
    process = subprocess.Popen([sys.executable, "-c", HOLD, out, str(part)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    return process


def test_a_second_run_is_refused_until_the_first_is_gone(tmp_path):
    process = holder(tmp_path)
    try:
        with pytest.raises(InputError, match=f"in use by process {process.pid} on "), locked(tmp_path):
            pass
        with pytest.raises(InputError, match="in use by"), locked(tmp_path, (1, 2)):
            pass
    finally:
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        process.stdout.close()
    with locked(tmp_path):
        pass


def test_parts_run_beside_each_other_and_not_beside_the_whole(tmp_path):
    process = holder(tmp_path, (1, 2))
    try:
        with locked(tmp_path, (2, 2)):
            pass
        with pytest.raises(InputError, match=f"process {process.pid} on .*, part 1/2"), locked(tmp_path, (1, 2)):
            pass
        with pytest.raises(InputError, match="--part"), locked(tmp_path):
            pass
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def test_a_digest_is_cheap():
    start = time.perf_counter()
    source_digest.__wrapped__()
    assert time.perf_counter() - start < 1.0


def test_result_json_of_a_stored_case_is_json_without_nan(tmp_path):
    name = stored(tmp_path)
    record = json.loads((case_folder(tmp_path, name) / "result.json").read_text())
    assert record["uncertainty"]["approach_mm"] is None
