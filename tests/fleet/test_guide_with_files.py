"""The example of the guide with the files of an instrument, as it is pasted."""

import re
import shlex
import shutil
from pathlib import Path

import pyarrow.parquet
import pytest
from test_documents import GUIDE, ROOT, fenced, not_printed

from fecontact.cli import call

SECTION = re.search(
    r"^## With the files of an instrument\n(.*?)^## ", (GUIDE / "fleet.md").read_text("utf-8"), re.MULTILINE | re.DOTALL
)
assert SECTION is not None
TEXT = SECTION[1]
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)


@pytest.fixture
def checkout(tmp_path, monkeypatch) -> Path:
    """A folder with the measured files of a checkout and the file of the fleet."""
    shutil.copytree(ROOT / "tests" / "profiles", tmp_path / "tests" / "profiles")
    (toml,) = fenced(TEXT, "toml")
    (tmp_path / "measured.toml").write_text(toml, "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def paste(blocks: list[tuple[str, str]], folder: Path, capsys) -> str:
    """Type the commands of blocks, and compare each shown line with the output."""
    printed = ""
    for language, content in blocks:
        if language == "csv":
            (folder / "settled.csv").write_text(content, "utf-8")
            (files,) = re.findall(r"Add the table to `\[rails\]`: `(files = .*?)`", TEXT)
            path = folder / "measured.toml"
            text, changes = re.subn(r"(?<=\[rails\]\n)files = .*", files, path.read_text("utf-8"))
            assert changes == 1
            path.write_text(text, "utf-8")
        elif language == "sh":
            for line in content.splitlines():
                assert call(shlex.split(line)[1:]) == 0, line
                printed += "".join(capsys.readouterr())
        elif language == "text":
            assert not_printed(content, printed) == []
    return printed


@pytest.mark.slow
def test_files_are_checked_screened_and_settled_as_shown(checkout, capsys):
    end = next(number for number, (_, content) in enumerate(BLOCKS) if "fleet sample" in content)
    printed = paste(BLOCKS[:end], checkout, capsys)
    assert printed.count("are suspicious") == 2, "in the headline and with the reasons, before they are settled"


@pytest.mark.slow
def test_the_sample_gives_the_answer_as_shown(checkout, capsys):
    printed = paste(BLOCKS, checkout, capsys)
    # as the section says in words; the times depend on the machine
    assert re.search(
        r"What would decide 6 unresolved positions: less noise, or closer points at 5 \(measure up to 3 wheels and 2"
        r" rails again\); finite elements at 1 \(about \d+ s of CPU time\)\.",
        printed,
    )
    assert re.search(r"Finite elements take [\d.]+ CPU s per position \(mean of 6 solved positions of the sam", printed)
    assert "14 positions." in printed
    screen = [
        row for path in Path("out/measured/screen").iterdir() for row in pyarrow.parquet.read_table(path).to_pylist()
    ]
    pair = {row["rail"]: row for row in screen if row["wheel"] == "worn_high_mileage"}["rail_left_iter288"]
    assert round(pair["place_y_mm"]) == 27
