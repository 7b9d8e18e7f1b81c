"""What an installation holds beside the modules."""

import os
import tarfile
from importlib import resources
from pathlib import Path
from zipfile import ZipFile

import pytest
from flit_core import buildapi

from fecontact.profiles.library import names

ROOT = Path(__file__).parents[1]
# Without the marker, type checkers of those who import the package look at none of its annotations.
WANTED = {"fecontact/py.typed", *(f"fecontact/profiles/data/{name}.toml" for name in names())}


def test_the_package_says_that_it_is_typed():
    assert resources.files("fecontact").joinpath("py.typed").read_bytes() == b""


@pytest.mark.parametrize("kind", ["wheel", "sdist"])
def test_archives_hold_the_files_that_are_no_modules(tmp_path, monkeypatch, kind):
    # flit builds the project of the current folder
    monkeypatch.chdir(ROOT)
    if kind == "wheel":
        with ZipFile(tmp_path / buildapi.build_wheel(os.fspath(tmp_path))) as archive:
            held = set(archive.namelist())
    else:
        with tarfile.open(tmp_path / buildapi.build_sdist(os.fspath(tmp_path))) as archive:
            held = {name.partition("/")[2] for name in archive.getnames()}
    assert held >= WANTED
