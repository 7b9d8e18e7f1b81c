"""A results folder of a stranger is data: whatever is in it is read, or refused in a line that names the file."""

import io
import json
import os
import re
import resource
import shutil
import time
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil
import pytest
from test_load import solved_folder as _solved_folder
from test_study import run as run_fakes
from test_study import study

import fecontact
from fecontact.case import Case
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.files import SEAL_KEY, explain_broken_seal, format_json, read_json, write_json, write_sealed
from fecontact.jobs.store import MANIFEST, write_manifest
from fecontact.outputs.pair_names import body_words, pair_words, short_name
from fecontact.outputs.records.stored import read_arrays
from fecontact.profiles.library import profile_identity
from fecontact.runs.identity import determine_origin, make_case_id
from fecontact.runs.store import FIELDS_FILE, SOLUTION_FILE

solved_folder = _solved_folder


def resealed(elliptic_quick, folder: Path) -> Path:
    """Renew the checksums of a folder after its files have changed."""
    (folder / MANIFEST).unlink(missing_ok=True)
    files = [path for path in folder.rglob("*") if path.is_file()]
    write_manifest(folder, files, make_case_id(elliptic_quick.case), determine_origin(elliptic_quick.case))
    return folder


def archive(path: Path, name: str, header: bytes, content: bytes = b"") -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(f"{name}.npy", header + content)


def header(shape: tuple[int, ...], kind: str = "<f8") -> bytes:
    text = io.BytesIO()
    np.lib.format.write_array_header_1_0(text, {"descr": kind, "fortran_order": False, "shape": shape})
    return text.getvalue()


def bomb(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as file, file.open("a.npy", "w") as member:
        member.write(header((30_000_000,)))
        for _ in range(30):
            member.write(bytes(8_000_000))


ARCHIVES = {
    "bomb": bomb,
    "claims 1e14 numbers": lambda path: archive(path, "load0_level0_fe_x_mm", header((10**14,))),
    "objects": lambda path: archive(path, "load0_level0_fe_x_mm", header((1,), "|O"), b"cos\nsystem\n(S'true'\ntR."),
    "no zip": lambda path: path.write_bytes(b"PK\x03\x04" + bytes(300)),
    "empty": lambda path: path.write_bytes(b""),
    "none of its arrays": lambda path: archive(path, "other", header((1,)), bytes(8)),
}


@pytest.mark.parametrize("what", ARCHIVES)
def test_an_archive_is_looked_at_before_it_is_unpacked(elliptic_quick, solved_folder, tmp_path, what):
    folder = shutil.copytree(solved_folder, tmp_path / "one")
    ARCHIVES[what](folder / FIELDS_FILE)
    resealed(elliptic_quick, folder)
    start = time.process_time()
    with pytest.raises(InputError, match=r"one cannot be read \(.*solve it again") as refused:
        fecontact.load(folder)
    assert len(str(refused.value)) < 600
    # 240 MB would take seconds
    assert time.process_time() - start < 1.5


@pytest.mark.parametrize("number", range(24))
def test_a_damaged_archive_with_its_checksum_is_refused_or_read(elliptic_quick, solved_folder, tmp_path, number):
    folder = shutil.copytree(solved_folder, tmp_path / "one")
    data = bytearray((folder / FIELDS_FILE).read_bytes())
    rng = np.random.default_rng(number)
    if number % 3 == 0:
        data = data[: rng.integers(len(data))]
    else:
        for at in rng.integers(len(data), size=1 + number):
            data[at] ^= 1 << rng.integers(8)
    (folder / FIELDS_FILE).write_bytes(data)
    resealed(elliptic_quick, folder)
    with pytest.raises(InputError, match="cannot be read"):
        fecontact.load(folder)


def test_fields_of_another_grid_are_refused(elliptic_quick, solved_folder, tmp_path):
    folder = shutil.copytree(solved_folder, tmp_path / "one")
    arrays = read_arrays(folder / FIELDS_FILE)
    arrays["load0_half_space_x_mm"] = arrays["load0_half_space_x_mm"][:-1]
    np.savez_compressed(folder / FIELDS_FILE, **arrays)
    resealed(elliptic_quick, folder)
    with pytest.raises(InputError, match="half_space: the fields do not match the grid"):
        fecontact.load(folder)


@pytest.mark.parametrize("name", ["../../etc/passwd", "/dev/zero", "pipe", "a\0b"])
def test_a_manifest_leads_nowhere_but_to_files_of_its_folder(solved_folder, tmp_path, name):
    folder = shutil.copytree(solved_folder, tmp_path / "one")
    os.mkfifo(folder / "pipe")
    manifest = read_json(folder / MANIFEST)
    manifest["files"] = {name: "0" * 64}
    write_json(folder / MANIFEST, manifest)
    with pytest.raises(InputError, match=r"one: .*solve it again"):
        fecontact.load(folder)


@pytest.mark.parametrize("rail", ["/dev/zero", "../../x.txt@01234567", "..\\x.txt@01234567", "x.txt", "/etc/hostname"])
def test_a_profile_of_a_result_lies_beside_it(elliptic_quick, solved_folder, tmp_path, rail):
    folder = shutil.copytree(solved_folder, tmp_path / "one")
    record = read_json(folder / SOLUTION_FILE)
    record["case"]["rail"] = rail
    write_json(folder / SOLUTION_FILE, record)
    resealed(elliptic_quick, folder)
    with pytest.raises(InputError, match=r"rail is .*allowed is NAME@HASH|allowed: the name of a file in this folder"):
        fecontact.load(folder)


def test_a_small_document_is_read_in_little_memory(tmp_path):
    """Where memory is limited to 200 MB more than there is: the largest document that is allowed has 1 GB."""
    path = tmp_path / "small.json"
    write_json(path, {"small": 1})
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (psutil.Process().memory_info().vms + 200_000_000, before[1]))
    try:
        assert read_json(path) == {"small": 1}
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


# --- tables of studies ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def fake_study(tmp_path_factory) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        from pictures import draw_nothing

        draw_nothing(patch)
        out = tmp_path_factory.mktemp("study") / "out"
        out.mkdir()
        run_fakes(out, study((50, 60)))
    return out


@pytest.mark.parametrize("damage", ["digit", "seal", "removed", "table"])
def test_a_changed_table_is_named_by_whoever_reads_it(fake_study, tmp_path, damage, capsys):
    out = shutil.copytree(fake_study, tmp_path / "out")
    path = out / "study.json"
    text = path.read_text("utf-8")
    match damage:
        case "digit":
            assert '"normal_force_N"' in text or '"load_kN": 50.0' in text
            path.write_text(text.replace('"load_kN": 50.0', '"load_kN": 50.1'), "utf-8")
        case "seal":
            path.write_text(text.replace('"all but sha256": "', '"all but sha256": "0'), "utf-8")
        case "removed":
            document = json.loads(text)
            del document[SEAL_KEY]
            path.write_text(format_json(document), "utf-8")
        case "table":
            (out / "study.csv").unlink()
    if damage != "table":
        with pytest.raises(InputError, match=r"study\.json was changed after it was written"):
            fecontact.load(out)
        assert call(["judge", str(out)]) == 2
    assert call(["compare", str(fake_study), str(out)]) == 2
    assert "study." in " ".join(capsys.readouterr().err.split())


def test_a_seal_is_that_of_what_is_said_and_not_of_how_it_is_written(tmp_path):
    path = write_sealed(tmp_path / "a.json", {"b": [1.0 / 3.0, float("nan")], "a": {"text": "ü"}})
    document = read_json(path)
    assert explain_broken_seal(path, document) is None
    path.write_text(json.dumps(document), "utf-8")
    assert explain_broken_seal(path, read_json(path)) is None
    document["b"][0] = 0.3333333333333334
    assert "a.json was changed" in (explain_broken_seal(path, document) or "")


def test_a_study_whose_ids_lead_elsewhere_is_refused(fake_study, tmp_path):
    out = shutil.copytree(fake_study, tmp_path / "out")
    document = {name: value for name, value in read_json(out / "study.json").items() if name != SEAL_KEY}
    for name in ("../../elsewhere", "/etc", "", ".."):
        document["rows"][0]["id"] = name
        write_sealed(out / "study.json", document)
        with pytest.raises(InputError, match="not a list of rows"):
            fecontact.load(out)


@pytest.mark.parametrize("stem", ["r" * 215, "r" * 250, "ß" * 120])
def test_a_long_profile_name_is_cut_in_ids_alone(elliptic_quick, tmp_path, stem):
    rail = tmp_path / f"{stem}.txt"
    rail.write_text("".join(f"{y} {-(y**2) / 600.0}\n" for y in range(-20, 21)))
    case = replace(elliptic_quick.case, rail=str(rail))
    name = make_case_id(case)
    assert len(f".{name}_01234567.0123456789ab.error.txt".encode()) < 255
    assert name.startswith(stem[:10])
    # a title of a table or a picture has room for it, and tells it from another one that begins alike
    first_name, alike = (short_name(f"{rail.name}@{digest}") for digest in ("01234567", "89abcdef"))
    assert len(first_name) <= 60
    assert first_name != alike
    second_rail = rail.with_name(f"{stem}2.txt")
    if len(second_rail.name.encode()) < 255:
        second_rail.write_text(rail.read_text().replace("-20", "-19.9"))
        assert make_case_id(replace(case, rail=str(second_rail))) != name


def test_files_that_are_called_rail_and_wheel_are_told_by_their_hashes(tmp_path):
    """Files with the stems rail and wheel are distinguished by their hashes.

    "rail rail 1:40" was every pair of such files.
    """
    titles = []
    for site, crown_mm in (("site1", 300.0), ("site2", 310.0)):
        (folder := tmp_path / site).mkdir()
        paths = {body: folder / f"{body}.csv" for body in ("rail", "wheel")}
        for path in paths.values():
            path.write_text(f"-1,0\n0,0\n1,{crown_mm}\n")
        titles.append(pair_words(Case(**{body: str(path) for body, path in paths.items()})))
    first, second = titles
    assert first != second
    assert re.fullmatch(r"rail\.csv@[0-9a-f]{8} 1:40, wheel\.csv@[0-9a-f]{8}", first)
    # the hash is that of the table's column
    assert profile_identity(str(tmp_path / "site2" / "rail.csv")) in second
    assert body_words("rail", "worn_rail.csv@01234567") == "rail worn_rail"
    assert body_words("wheel", "Rail.csv@01234567") == "wheel Rail.csv@01234567"
    assert [body_words("rail", name) for name in ("rail", "60E1")] == ["rail", "rail 60E1"]
