"""File of an example fleet: each default in it is the default of its input."""

import inspect

import pytest
from test_features import copied, python
from test_templates import replace_default

from fecontact.cli import call
from fecontact.features.fleet.command import examples
from fecontact.features.fleet.examples import write_fleet
from fecontact.files import write_text

EXPECTED = """\
# Example of a fleet: worn copies of library profiles with noise.
seed = 3
theory = "strip"

[wheels]
files = "wheels.csv"

[rails]
files = "rails.csv"

[shifts_mm]
normal = [0.0, 2.0]
count = 5

[loads_kN]
values = [60, 100]

[case]
inclination = "1:40"
"""


def test_the_example_has_the_text_of_each_default(tmp_path):
    assert write_fleet(tmp_path, wheels=1, rails=1, seed=3).read_bytes() == EXPECTED.encode()


def test_a_changed_default_changes_the_example(tmp_path):
    package = copied(tmp_path) / "fecontact"
    model = package / "features" / "fleet" / "model.py"
    replace_default(model, 'choice_field("strip",', 'choice_field("half_space",')
    replace_default(package / "case.py", "math.atan(1.0 / 40.0)", "math.atan(1.0 / 20.0)")
    process = python(tmp_path, "-m", "fecontact", "fleet", "examples", "own", "--wheels", "1", "--rails", "1")
    assert process.returncode == 0, process.stderr
    text = (tmp_path / "own" / "fleet.toml").read_text("utf-8")
    for line in ('theory = "half_space"', 'inclination = "1:20"'):
        assert f"\n{line}\n" in text


def test_numbers_of_an_example_are_the_numbers_of_the_function():
    option_defaults, function_defaults = (
        {name: parameter.default for name, parameter in inspect.signature(function).parameters.items()}
        for function in (examples, write_fleet)
    )
    assert option_defaults == function_defaults


@pytest.mark.parametrize("name", ["wheels.csv", "rails.csv", "fleet.toml", "wheels/wheel00000.csv"])
def test_an_example_overwrites_files_by_force_alone(tmp_path, capsys, name):
    mine = tmp_path / "trial" / name
    mine.parent.mkdir(parents=True)
    mine.write_text("keep", "utf-8")
    line = ["fleet", "examples", str(tmp_path / "trial"), "--wheels", "1", "--rails", "1"]
    assert call(line) == 2
    message = f"error: the example would overwrite {mine}; give another folder, or --force\n"
    assert capsys.readouterr().err == message
    assert [path for path in (tmp_path / "trial").rglob("*") if path.is_file()] == [mine]
    assert mine.read_text("utf-8") == "keep"
    notes = tmp_path / "trial" / "notes.txt"
    notes.write_text("keep", "utf-8")
    assert call([*line, "--force"]) == 0
    assert mine.read_text("utf-8") != "keep"
    assert notes.read_text("utf-8") == "keep"
    # of another seed, all files differ
    assert call([*line, "--seed", "2"]) == 2
    assert "rail00000.csv, " in (error := capsys.readouterr().err)
    assert "and 2 more; give another folder, or --force" in error


def read_files(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("finished", range(7))
def test_an_interrupted_example_resumes_with_the_same_command(tmp_path, monkeypatch, finished):
    write_fleet(tmp_path / "whole", wheels=2, rails=2)
    folder, written = tmp_path / "trial", []

    def write_some(path, text):
        if len(written) == finished:
            path.parent.mkdir(parents=True, exist_ok=True)
            # a kill leaves the temporary file
            path.with_name(f".{path.stem}.0123456789ab{path.suffix}").write_text(text[:100])
            raise KeyboardInterrupt
        written.append(path)
        return write_text(path, text)

    monkeypatch.setattr("fecontact.features.fleet.examples.write_text", write_some)
    with pytest.raises(KeyboardInterrupt):
        write_fleet(folder, wheels=2, rails=2)
    monkeypatch.undo()
    foreign_file = folder / ".plan.0123456789ab.csv"
    foreign_file.write_text("of another program")
    assert call(["fleet", "examples", str(folder), "--wheels", "2", "--rails", "2"]) == 0
    assert foreign_file.read_text() == "of another program"
    foreign_file.unlink()
    assert read_files(folder) == read_files(tmp_path / "whole")


def test_a_link_to_an_equal_file_is_not_overwritten(tmp_path, capsys):
    write_fleet(tmp_path / "whole", wheels=1, rails=1)
    link = tmp_path / "trial" / "fleet.toml"
    link.parent.mkdir()
    link.symlink_to(tmp_path / "whole" / "fleet.toml")
    assert call(["fleet", "examples", str(tmp_path / "trial"), "--wheels", "1", "--rails", "1"]) == 2
    assert f"would overwrite {link}; give another folder, or --force" in capsys.readouterr().err
    assert link.is_symlink()
