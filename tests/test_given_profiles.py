"""Profiles as arrays: they are accepted wherever a file is accepted.

A result with arrays equals the result with the file.
"""

import copy
import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
from kept import keep_case
from pictures import draw_nothing

import fecontact
from fecontact.case import Case, make_case_record, read_case_record
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.outputs.records.results import case_row
from fecontact.profiles.library import ArrayProfile, profile_identity
from fecontact.profiles.library import load_library_profile as library_profile
from fecontact.profiles.reading import Reading
from fecontact.profiles.resolve import resolve_rail, resolve_wheel, select_used_options
from fecontact.profiles.writers import sample_points
from fecontact.runs.identity import digest_input_files, make_case_id, make_paths_absolute
from fecontact.runs.store import PROFILES_FOLDER, read_case
from fecontact.solving.placing import place_case

COARSE = {"resolution": (1.6, 1.3), "refine": "never"}


def head(noise_mm=0.0, step_mm=0.4):
    points = sample_points(library_profile("54E1"), step_mm)
    return (points + noise_mm * np.random.default_rng(3).normal(size=points.shape)).T


def test_arrays_are_the_file_that_they_would_be(tmp_path):
    profile = fecontact.profile(*head(), name="mine")
    path = tmp_path / "mine.csv"
    path.write_bytes(profile.content)
    assert profile == profile_identity(profile) == profile_identity(str(path))
    array_case, file_case = Case(rail=profile), Case(rail=str(path))
    assert make_case_id(array_case) == make_case_id(file_case)
    assert digest_input_files(array_case) == digest_input_files(file_case)
    assert make_paths_absolute(array_case) == array_case
    # every digit of the points comes back
    rail = resolve_rail(profile, Reading(filter_mm=0.0))
    assert np.array_equal(rail.points, head().T)
    assert rail.name == resolve_rail(str(path)).name == "mine"


@pytest.mark.parametrize("way", [lambda c: pickle.loads(pickle.dumps(c)), copy.deepcopy, lambda c: replace(c)])
def test_a_case_takes_its_points_along(way):
    case = Case(rail=fecontact.profile(*head(), name="mine"))
    again = way(case)
    assert again == case
    assert isinstance(again.rail, ArrayProfile)
    assert again.rail.text == case.rail.text
    assert json.loads(json.dumps(make_case_record(again)))["rail"] == str(case.rail)
    assert isinstance(read_case_record(make_case_record(case)).rail, ArrayProfile)


def test_other_points_are_another_profile():
    original, changed = fecontact.profile(*head()), fecontact.profile(*head(1e-12))
    assert original != changed
    assert make_case_id(Case(rail=original)) != make_case_id(Case(rail=changed))


def test_noisy_points_are_smoothed_as_those_of_a_file():
    noisy = fecontact.profile(*head(0.01, 0.2))
    assert resolve_rail(noisy).measured is not None
    assert resolve_rail(noisy, Reading(filter_mm=0.0)).measured is None


def test_a_wheel_and_the_other_side_may_be_given():
    wheel = fecontact.profile(*sample_points(library_profile("S1002"), 0.4).T, name="worn")
    assert resolve_wheel(wheel).profile.kind == "wheel"
    with pytest.raises(InputError, match="a rail is needed"):
        resolve_rail(wheel)
    case = Case(roll="touching").with_profiles({"opposite_wheel": wheel})
    assert digest_input_files(case)["opposite_wheel"]["name"] == "worn.csv"


@pytest.mark.parametrize(
    ("y", "z", "name", "said"),
    [
        ([0.0, 1.0], [0.0], "p", r"shapes \(2,\) and \(1,\)"),
        (np.zeros((2, 2)), np.zeros((2, 2)), "p", "shapes"),
        ([0.0, np.nan], [0.0, 1.0], "p", "point 2 is"),
        (["a"], [1.0], "p", "arrays of numbers"),
        ([0.0], [1.0], "../p", "profile name"),
        ([0.0], [1.0], "p" * 61, "profile name"),
    ],
)
def test_what_is_no_profile_is_refused(y, z, name, said):
    with pytest.raises(InputError, match=said):
        fecontact.profile(y, z, name=name)


def test_a_stored_result_is_judged_without_the_arrays(tmp_path, monkeypatch):
    draw_nothing(monkeypatch)
    y = np.linspace(-30.0, 30.0, 241)
    case = Case(
        rail=fecontact.profile(y, np.sqrt(300.0**2 - y**2) - 300.0, name="R300"),
        wheel="cylinder:460",
        inclination_rad=0.0,
        track=fecontact.case.Track(rail_crown_y_mm=750.0),
        load_N=20e3,
        **COARSE,
    )
    result = fecontact.solve(case)
    keep_case(result, tmp_path / "one")
    again = read_case(tmp_path / "one")
    stored = tmp_path / "one" / PROFILES_FOLDER / "rail" / "R300.csv"
    assert again.case.rail == str(stored)
    assert stored.read_bytes() == case.rail.content
    assert make_case_id(again.case) == make_case_id(case)
    # as a file's copy: the same row but for what it cost
    assert repr(case_row(again)) == repr(case_row(result))


# --- options of files that a profile has no use for ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("case", "said"),
    [
        (
            {"wheel": "S1002", "wheel_file": Reading(tape_circle_mm=70.0)},
            "tape_circle_mm of the wheel file is 70.0, but 'S1002' is an exact profile, which does not use it; leave"
            " out --wheel-tape-circle-mm",
        ),
        ({"rail": "60E1", "rail_file": Reading(mirror=True)}, "mirror of the rail file is True"),
        ({"rail": "circle:300", "rail_file": Reading(repair=True)}, "repair of the rail file is True"),
        ({"rail": "mine.toml", "rail_file": Reading(units="m")}, "units of the rail file is 'm', but 'mine.toml' is a"),
        ({"rail": "mine.toml", "rail_file": Reading(filter_mm=8.0)}, "filter_mm of the rail file is 8.0"),
    ],
)
@pytest.mark.parametrize("roll", ["given", "touching"])
def test_options_of_a_file_that_no_profile_uses_are_refused(case, said, roll):
    with pytest.raises(InputError) as refusal:
        place_case(Case(**case, roll=roll))
    assert str(refusal.value).startswith(said)


def test_the_command_that_shows_a_profile_refuses_them_too(capsys):
    assert call(["profiles", "S1002", "--wheel-tape-circle-mm", "70"]) == 2
    assert "tape_circle_mm of the wheel file is 70.0" in capsys.readouterr().err
    assert call(["profiles", "S1002"]) == 0


def test_options_that_the_other_side_uses_are_not_refused(tmp_path):
    """An option is for both sides of a wheelset, even if only the opposite side has a file of points."""
    path = tmp_path / "mine.csv"
    path.write_bytes(fecontact.profile(*head(), name="mine").content)
    case = Case(rail="54E1", rail_file=Reading(mirror=False, filter_mm=0.0), roll="touching")
    with pytest.raises(InputError, match="mirror of the rail file is False, but '54E1'"):
        place_case(case)
    across = replace(case, opposite=replace(case.opposite, rail=str(path)))
    assert place_case(across).rail.profile.name == place_case(replace(across, rail_file=Reading())).rail.profile.name


def test_exact_files_use_what_belongs_to_their_place():
    reading = Reading(mirror=True, tape_circle_mm=70.0, tape_circle_z_mm=1.0, filter_mm=4.0, units="m")
    assert select_used_options("mine.toml", reading) == Reading(mirror=True, tape_circle_mm=70.0, tape_circle_z_mm=1.0)
    assert select_used_options("mine.csv", reading) == reading
    assert select_used_options("60E1", reading) == Reading()
