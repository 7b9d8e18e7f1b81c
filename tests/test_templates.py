"""Template files of `fecontact init`: each default in them is the default of its input."""

import re
from pathlib import Path

import pytest
from test_features import copied, python

from fecontact.case import INPUTS, Case
from fecontact.criteria import Criteria
from fecontact.inputs.templates import fill_python_template, fill_toml_template
from fecontact.runs.study_templates import write_templates

TEMPLATES = Path(__file__).parents[1] / "fecontact" / "runs" / "templates"
# Text of each default as a user would write it, typed here by hand.
TOML_TEXTS = {
    "rail": '"60E1"',
    "wheel": '"S1002"',
    "inclination": '"1:40"',
    "load_kN": "100.0",
    "roll": '"touching"',
    "yaw_mrad": "0.0",
    "resolution": '"quick"',
    "refine": '"verdict"',
    "criteria.p_max_percent": "5.0",
    "criteria.area_percent": "10.0",
    "criteria.judged_by": '"all"',
    "criteria.theories_out_of_range": "false",
    "track.gauge_mm": "1435.0",
    "rail_material.young_MPa": "210000.0",
    "rail_material.tangent_MPa": "0.0",
}
PYTHON_TEXTS = {"rail": '"60E1"', "wheel": '"S1002"', "load_N": "100e3"}
FILES = {"cases.toml": ("cases.toml", TOML_TEXTS), "study.py": ("study.py.txt", PYTHON_TEXTS)}


def replace_default(file: Path, before: str, after: str) -> None:
    """Replace the only occurrence of a default in a source file."""
    source = file.read_text("utf-8")
    assert source.count(before) == 1, (file, before)
    file.write_text(source.replace(before, after), "utf-8")


@pytest.mark.parametrize("name", FILES)
def test_templates_have_the_text_of_each_default(name, tmp_path):
    template, texts = FILES[name]
    expected = (TEMPLATES / template).read_text("utf-8")
    assert set(re.findall(r"\$\{(.*?)\}", expected)) == set(texts)
    for key, text in texts.items():
        expected = expected.replace(f"${{{key}}}", text)
    write_templates(tmp_path)
    assert (tmp_path / name).read_bytes() == expected.encode()


@pytest.mark.parametrize("name", FILES)
def test_templates_have_no_default_as_a_live_value(name):
    # a number or a name after the key of an input is an example, which differs from the default
    template, _ = FILES[name]
    text = (TEMPLATES / template).read_text("utf-8")
    defaults = {(place.key, place.shown_default) for place in INPUTS}
    for key, value in re.findall(r"(\w+) = (\"[^\"]*\"|[-\d.e]+)", text):
        user_text = value.strip('"') if value.startswith('"') else f"{float(value):.12g}"
        assert (key, user_text) not in defaults, (key, value)


def test_a_changed_default_changes_the_templates(tmp_path):
    package = copied(tmp_path) / "fecontact"
    replace_default(package / "criteria.py", '_limit(0.05, "p_max_MPa"', '_limit(0.07, "p_max_MPa"')
    replace_default(package / "criteria.py", '("all",),', '("patch", "p_max"),')
    replace_default(package / "bodies.py", "_STEEL_YOUNG_MPA = 210_000.0", "_STEEL_YOUNG_MPA = 206e3")
    replace_default(package / "case.py", 'text_field("60E1"', 'text_field("54E1"')
    replace_default(package / "case.py", "_LOAD_N = 100e3", "_LOAD_N = 112.5e3")
    process = python(tmp_path, "-m", "fecontact", "init", "own")
    assert process.returncode == 0, process.stderr
    text = (tmp_path / "own" / "cases.toml").read_text("utf-8")
    for line in (
        'rail = "54E1" ',
        "load_kN = [50.0, 112.5] ",
        "# p_max_percent = 7.0 ",
        '# judged_by = "patch,p_max" ',
        "# young_MPa = 206000.0\n",
    ):
        assert f"\n{line}" in text
    script = (tmp_path / "own" / "study.py").read_text("utf-8")
    assert 'Case(rail="54E1", wheel="S1002", lateral_shift_mm=shift, load_N=112.5e3)' in script
    # the changed templates are a study of the changed program
    check = python(tmp_path, "-m", "fecontact", "check", "own/cases.toml")
    assert check.returncode == 0, check.stderr


def test_filled_texts_are_read_back_as_the_defaults(tmp_path):
    from fecontact.runs.toml_cases import read_toml_cases

    places = [place for place in INPUTS if place.default is not None and place.field not in ("roll_rad",)]
    lines: dict[str, list[str]] = {}
    for place in places:
        key = f"{place.table}.{place.key}".lstrip(".")
        lines.setdefault(place.table, []).append(f"{place.key} = ${{{key}}}")
    text = "".join(f"[{table}]\n" * bool(table) + "\n".join(keys) + "\n" for table, keys in lines.items())
    file = tmp_path / "cases.toml"
    file.write_text(fill_toml_template(text, INPUTS), "utf-8")
    assert read_toml_cases(file) == (Case(),)
    python_text = fill_python_template("Criteria(area=${criteria.area}, judged_by=${criteria.judged_by})", INPUTS)
    assert eval(python_text) == Criteria()
    assert fill_python_template("${inclination_rad}", INPUTS) == repr(Case().inclination_rad)
    assert eval(fill_python_template("${criteria.p_max}", INPUTS)) == 0.05


def test_a_template_with_a_key_of_no_input_is_refused():
    with pytest.raises(KeyError, match=r"criteria\.peak"):
        fill_toml_template("peak = ${criteria.peak}", INPUTS)
    # an input without a default has no value
    with pytest.raises(KeyError, match=r"yield_MPa"):
        fill_toml_template("yield_MPa = ${rail_material.yield_MPa}", INPUTS)
