"""Pipes, devices and folders in the place of a file are refused."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.features.curves.model import load_vehicle
from fecontact.files import read_toml, read_toml_text, write_text
from fecontact.jobs.store import LOCK, lock_folder
from fecontact.regression.tables import read_tolerances
from fecontact.runs.toml_cases import read_toml_cases

# A place for the path that is no file, in a command that reads or writes it.
COMMANDS = (
    "hertz --rail PATH",
    "hertz --wheel PATH",
    "hertz --rail-irregularity table:PATH,distance=mm,opening=um",
    "profiles PATH",
    "check PATH.toml",
    "check PATH.py",
    "run PATH.toml --out out",
    "run PATH.py --out out",
    "compare PATH.csv PATH.csv",
    "compare PATH.json PATH.json",
    "compare good.csv good.csv --tolerance PATH",
    "curve --vehicle PATH --radii 300",
    "fleet run PATH --out out",
    "judge PATH",
    "view PATH",
    "solve --out PATH",
    "map --shifts 0 --loads-kn 50 --out PATH",
    "place --out PATH.png",
    "profiles 60E1 --write PATH.csv",
    "table --shifts 0 --loads-kn 50 --out PATH.csv",
    "demo --out PATH",
    "init PATH",
)


@pytest.fixture(scope="module")
def places(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("places")
    (folder / "good.csv").write_text("id,p_max_fe_MPa\na,1.0\n")
    for ending in ("", ".csv", ".json", ".toml", ".py", ".png", ".svg"):
        os.mkfifo(folder / f"pipe{ending}")
        (folder / f"device{ending}").symlink_to("/dev/zero")
    return folder


@pytest.mark.parametrize("kind", ["pipe", "device"])
@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_waits_for_a_pipe_or_a_device(places, monkeypatch, capsys, command, kind):
    monkeypatch.chdir(places)
    before = {path.name: os.lstat(path).st_mode for path in places.iterdir()}
    started = time.monotonic()
    assert call(command.replace("PATH", kind).split()) == 2
    assert time.monotonic() - started < 20.0
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert kind in line
    # also what was there is there still: a file that replaced the pipe would have taken it from its reader
    after = {path.name: os.lstat(path).st_mode for path in places.iterdir()}
    assert {name: after.get(name) for name in before} == before


def test_a_command_that_reads_a_pipe_ends_without_its_writer(places):
    """A separate process ends too, because no pipe is opened."""
    words = [sys.executable, "-m", "fecontact", "compare", "good.csv", "good.csv", "--tolerance", "pipe"]
    ended = subprocess.run(words, cwd=places, capture_output=True, text=True, timeout=60, check=False)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert "tolerances pipe cannot be read: a pipe or a device instead of a file" in ended.stderr


@pytest.mark.parametrize("kind", ["pipe", "folder", "link"])
def test_a_lock_that_is_no_file_is_named(tmp_path, kind):
    lock, victim = tmp_path / LOCK, tmp_path / "kept.txt"
    victim.write_text("kept")
    match kind:
        case "pipe":
            os.mkfifo(lock)
        case "folder":
            lock.mkdir()
        case "link":
            lock.symlink_to(victim)
    with pytest.raises(InputError, match=rf"{LOCK}: a .*instead of a file; remove it"), lock_folder(tmp_path):
        pytest.fail("it was locked")
    assert victim.read_text() == "kept"


def test_a_pipe_is_not_replaced_by_a_result(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="a pipe or a device instead of a file"):
        write_text(tmp_path / "pipe", "text")
    assert (tmp_path / "pipe").is_fifo()
    assert [path.name for path in tmp_path.iterdir()] == ["pipe"]


READERS = (read_toml_cases, read_tolerances, lambda path: load_vehicle(str(path)), lambda path: read_toml(path, "it"))
HOSTILE = {
    "dots": "a" + ".a" * 50_000 + " = 1\n",
    "dots behind quoted commas": "a" + (".a" * 99 + '.","') * 500 + " = 1\n",
    "dots behind other newlines": "a" + (".a" * 99 + '."\u2028"') * 500 + " = 1\n",
    "nested": "a = " + "[" * 5000 + "\n",
    "large": "# \n" * 2_000_000,
    "digits": "load_kN = " + "9" * 5000 + "\n",
    "half a character": b"a = '\xff'\n",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_every_toml_file_is_read_with_the_same_limits(tmp_path, name):
    path = tmp_path / "hostile.toml"
    content = HOSTILE[name]
    path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
    started = time.process_time()
    for reader in READERS:
        with pytest.raises(InputError, match=r"hostile\.toml|^it\b"):
            reader(path)
    assert time.process_time() - started < 2.0


def test_quoted_texts_with_many_dots_and_commas_are_read():
    assert read_toml_text(f'a."b,c" = "{"., " * 60}"\n', "t")["a"]["b,c"].count(".") == 60
