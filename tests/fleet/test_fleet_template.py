"""File of an example fleet: each default in it is the default of its input."""

import inspect

import pytest
from test_features import copied, python
from test_templates import replace_default

from fecontact.cli import call
from fecontact.features.fleet.command import examples
from fecontact.features.fleet.examples import write_fleet

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
    assert call(line) == 2
    assert "fleet.toml and 2 further files; give another folder, or --force" in capsys.readouterr().err
