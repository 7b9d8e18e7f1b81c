"""Both wheels on both rails.

Tested: the roll against another code and closed forms, mirror images, ids, refusals.
"""

import json
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from marks import slow_but
from scipy.optimize import brentq

from fecontact.bodies import Material, combine_moduli_MPa
from fecontact.case import Case, Opposite, Track
from fecontact.contact_theories.hertz import hertz_ellipse, hertz_from_hessian
from fecontact.errors import InputError
from fecontact.outputs.records.results import case_inputs, hertz_record, input_columns
from fecontact.outputs.records.stored import placement_from_record, placement_record
from fecontact.placement.wheel_on_rail import SIDE_SIGN, set_up_pair
from fecontact.placement.wheelset import Wheelset, _refine_first_touch
from fecontact.profiles.library import load_library_profile
from fecontact.runs.identity import digest_input_files, make_case_id
from fecontact.runs.store import copy_profiles, read_stored_case
from fecontact.solving.hertz import compute_hertz_points
from fecontact.solving.hertz_alone import evaluate_hertz
from fecontact.solving.placing import (
    compute_roll,
    make_wheelset,
    place_at_shifts,
    place_case,
    place_or_explain,
    place_wheelset_of_case,
)

INCLINATION_40 = math.atan(1.0 / 40.0)
# Manchester Contact Benchmark: shift to the right (mm) and roll (mrad) of the wheelset in CONTACT's examples, which
# yaws by 2.4 mrad a mm.
MANCHESTER_ROLL = (
    *((0.0, 0.0), (0.5, 0.02304), (1.0, 0.05049), (1.5, 0.08103), (2.0, 0.1128), (2.5, 0.1457), (3.0, 0.1803)),
    *((3.5, 0.2168), (4.0, 0.2557), (4.5, 0.2977), (5.0, 0.3554), (5.5, 0.4777), (6.0, 0.6272)),
)


def benchmark(shift_right: float) -> Case:
    return Case(
        rail="MBench_UIC60", lateral_shift_mm=-shift_right, yaw_rad=2.4e-3 * shift_right, roll="touching", load_N=10e3
    )


def assert_same_placement(first, second, tolerance=1e-10):
    assert len(first.contact_points) == len(second.contact_points)
    for a, b in zip(first.contact_points, second.contact_points, strict=True):
        for name in ("x_mm", "y_mm", "z_mm", "rail_y_mm", "wheel_y_mm", "contact_angle_rad", "vertical_gap_mm"):
            assert getattr(a, name) == pytest.approx(getattr(b, name), abs=tolerance), name
        np.testing.assert_allclose(a.curvature.hessian, b.curvature.hessian, atol=tolerance)


@pytest.mark.parametrize(("shift_right", "roll_mrad"), MANCHESTER_ROLL)
def test_roll_of_the_manchester_wheelset(shift_right, roll_mrad):
    case = benchmark(shift_right)
    # those are the rolls of the loaded wheelset (below): the touching one is 0.0064 mrad off at most
    assert 1e3 * place_wheelset_of_case(case).roll_rad == pytest.approx(-roll_mrad, abs=0.01)


# The same examples: shift (mm), roll (mrad) of the input, and height of the unloaded wheelset (mm, down from 460 mm
# over the rails' highest points) with which CONTACT begins, on the right and on the left rail.
MANCHESTER_HEIGHTS = (
    *((0.0, 0.0, 0.1821, None), (0.5, 0.02304, 0.1743, None), (3.0, 0.1803, None, 0.0932), (4.0, 0.2557, None, 0.0462)),
    *((5.0, 0.3554, -0.0271, -0.0205), (5.5, 0.4777, -0.1176, -0.1091), (6.0, 0.6272, -0.2259, -0.2185)),
    *((6.5, 4.376, -3.1382, -3.0696), (7.0, 6.393, -4.6549, -4.6045), (7.5, 7.642, -5.5956, -5.5537)),
    *((8.0, 8.606, -6.3220, -6.2851), (9.0, 10.10113, -7.4455, -7.4161), (9.5, 10.71386, -7.9046, -7.8778)),
    (10.0, 11.26431, -8.3159, -8.2913),
)


@pytest.mark.parametrize(("shift_right", "roll_mrad", "right", "left"), MANCHESTER_HEIGHTS)
def test_heights_of_the_manchester_wheelset_also_where_its_flange_climbs(shift_right, roll_mrad, right, left):
    wheelset = make_wheelset(benchmark(shift_right))
    yaw = 2.4e-3 * shift_right
    # that wheelset yaws before it rolls: seen in the order of here it rolls by the cosine of the yaw less, which is
    # 2.4 micrometres at 10 mm
    roll = -1e-3 * roll_mrad * math.cos(yaw)
    for hung, sign, down in ((wheelset.left, 1.0, left), (wheelset.right, -1.0, right)):
        if down is not None:
            standing = hung.standing(-sign * shift_right, sign * roll, sign * yaw)
            # four decimals there; arcs here are points there. The most is at 6.5 mm on the flange, 0.24 micrometres
            assert 460.0 - standing.axle_mm == pytest.approx(down, abs=3e-4)


@pytest.mark.parametrize(("shift_right", "roll_mrad"), MANCHESTER_ROLL[1:])
def test_roll_of_the_loaded_manchester_wheelset(shift_right, roll_mrad):
    steel = Material.from_shear(shear_MPa=82e3, poisson=0.28)
    case = replace(benchmark(shift_right), roll="loaded", rail_material=steel, wheel_material=steel)
    # the benchmark's rolls are those at which both wheels carry 10 kN at one height. Its friction of 0.3 takes 11 % of
    # the flange's normal force away at 5.5 and 6 mm: 0.0018; at 0.5 mm its patch is no ellipse: 0.0036
    tolerance = 4e-3 if shift_right == 0.5 else 2e-3 if shift_right > 5.0 else 6e-4
    assert 1e3 * place_wheelset_of_case(case).roll_rad == pytest.approx(-roll_mrad, abs=tolerance)


def test_a_loaded_wheelset_sinks_into_the_sharper_rail():
    case = Case(
        rail="circle:300",
        wheel="cylinder:460",
        inclination_rad=0.0,
        roll="loaded",
        opposite=Opposite(rail="circle:80"),
    )
    placement = place_wheelset_of_case(case)
    left, right = (
        hertz_ellipse(
            0.5 / 460, 0.5 / radius, normal_force_N=case.load_N, contact_modulus_MPa=case.contact_modulus_MPa
        ).approach_mm
        for radius in (300.0, 80.0)
    )
    # flat wheels stay on the crowns, which are 1500 mm apart and as high as each other
    assert right > left
    assert placement.roll_rad == pytest.approx((right - left) / 1500.0, rel=1e-4)
    assert placement.axle_height_mm == pytest.approx(460.0 - 0.5 * (left + right), abs=1e-4)
    mirrored = replace(case, rail="circle:80", opposite=Opposite(rail="circle:300"), side="right")
    assert compute_roll(mirrored, place_case(mirrored)) == pytest.approx(placement.roll_rad, abs=1e-12)
    assert place_wheelset_of_case(replace(case, opposite=Opposite())).roll_rad == pytest.approx(0.0, abs=1e-12)


# The same examples where the flange climbs: shift, and normal force (N) of the right wheel and of the left one.
MANCHESTER_FORCES = (
    *((6.5, 15_440.0, 10_010.0), (7.0, 14_030.0, 10_010.0), (7.5, 13_260.0, 10_010.0), (8.0, 12_720.0, 10_020.0)),
    *((9.0, 11_970.0, 10_020.0), (9.5, 11_680.0, 10_020.0), (10.0, 11_440.0, 10_020.0)),
)


@pytest.mark.parametrize(("shift_right", "right_N", "left_N"), MANCHESTER_FORCES)
def test_roll_of_the_manchester_wheelset_whose_flange_climbs(shift_right, right_N, left_N):
    # friction carries up to 38 % of the wheel load there, so that the roll is found with its own normal forces
    case = replace(benchmark(shift_right), flange_climb=True)
    modulus = combine_moduli_MPa(*[Material.from_shear(shear_MPa=82e3, poisson=0.28)] * 2)
    wheelset, yaw = make_wheelset(case), 2.4e-3 * shift_right
    expected = next(-roll for shift, roll, *_ in MANCHESTER_HEIGHTS if shift == shift_right)

    def height_mm(side, roll, force):
        placement = wheelset.placed(side, -shift_right, roll, yaw)
        touch = placement.first
        hertz = hertz_from_hessian(touch.curvature.hessian, normal_force_N=force, contact_modulus_MPa=modulus)
        return placement.wheel.centre_mm[2] - hertz.approach_mm / math.cos(touch.contact_angle_rad)

    def difference(roll):
        return height_mm("left", roll, left_N) - height_mm("right", roll, right_N)

    guess = 1e-3 * expected * math.cos(yaw)
    roll_rad = brentq(difference, guess - 5e-5, guess + 5e-5, xtol=1e-12)
    # 0.0035 at 6.5 mm, where a micrometre of height is 0.0025 mrad; 0.0016 at most beyond
    assert 1e3 * roll_rad / math.cos(yaw) == pytest.approx(expected, abs=4e-3 if shift_right == 6.5 else 2e-3)


def test_wheels_under_different_loads_sink_by_their_own():
    case = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0, roll="loaded")
    placement = place_wheelset_of_case(replace(case, opposite=Opposite(wheel_load_N=60e3)))
    left, right = (
        hertz_ellipse(
            0.5 / 460, 0.5 / 300, normal_force_N=load, contact_modulus_MPa=case.contact_modulus_MPa
        ).approach_mm
        for load in (100e3, 60e3)
    )
    assert placement.roll_rad == pytest.approx((right - left) / 1500.0, rel=1e-4)
    assert placement.roll_rad < 0.0
    # the same load said again changes nothing
    same = replace(case, opposite=Opposite(wheel_load_N=100e3))
    assert place_wheelset_of_case(same).roll_rad == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("shift", "yaw"), [(5.0, 0.0), (-2.0, 6e-3), (6.0, -4e-3)])
def test_unequal_loads_are_mirrored_too(shift, yaw):
    left = Case(
        lateral_shift_mm=shift, yaw_rad=yaw, load_N=20e3, roll_load_N=80e3, opposite=Opposite(wheel_load_N=50e3)
    )
    right = replace(left, lateral_shift_mm=-shift, yaw_rad=-yaw, side="right")
    left_placement, right_placement = place_case(left), place_case(right)
    assert_same_placement(left_placement, right_placement)
    assert compute_roll(left, left_placement) == pytest.approx(-compute_roll(right, right_placement), abs=1e-13)
    equal = place_case(replace(left, opposite=Opposite()))
    # a roll lifts the left wheel, which sinks more here; 0.017 to 0.019 mrad
    assert compute_roll(left, left_placement) < compute_roll(left, equal) - 1e-5
    assert left.roll_loads_N() == {"left": 80e3, "right": 50e3}
    assert right.roll_loads_N() == {"left": 50e3, "right": 80e3}
    # the wheel that is less loaded has the other roll of the same wheelset
    across = replace(left, side="right", roll_load_N=50e3, opposite=Opposite(wheel_load_N=80e3))
    assert compute_roll(across, place_case(across)) == pytest.approx(compute_roll(left, left_placement), abs=1e-13)


def test_the_roll_is_that_of_the_load_that_is_given_for_it():
    case = Case(lateral_shift_mm=6.0, load_N=20e3, roll_load_N=100e3)
    assert case.roll == "loaded"
    loaded = place_case(Case(lateral_shift_mm=6.0, load_N=100e3, roll="loaded"))
    assert_same_placement(place_case(case), loaded, tolerance=0.0)
    # also for a load along the contact normal, of which no vertical one is known
    assert_same_placement(place_case(replace(case, load_kind="normal")), loaded, tolerance=0.0)


def test_the_loaded_roll_grows_with_the_load_and_begins_at_the_touching_one():
    case = Case(lateral_shift_mm=6.0, roll="touching")
    touching = place_wheelset_of_case(case).roll_rad
    rolls = [place_wheelset_of_case(replace(case, roll="loaded", load_N=load)).roll_rad for load in (1.0, 1e5)]
    assert rolls[0] == pytest.approx(touching, abs=1e-7)
    # the springs give way as F^(2/3), at one and the same contact point
    assert rolls[1] - touching == pytest.approx((rolls[0] - touching) * 1e5 ** (2.0 / 3.0), rel=0.05)
    assert rolls[1] - touching == pytest.approx(-3.6e-5, rel=0.02)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Case(roll="loaded", load_kind="normal"), "vertical wheel loads"),
        (lambda: Case(roll="loaded", roll_rad=1e-4), "roll angle is 0.1 mrad, but the roll is 'loaded'"),
        (lambda: place_case(Case(roll="loaded", lateral_shift_mm=9.0)), "shifts between -49.5 and 6 mm"),
    ],
)
def test_a_loaded_roll_is_refused_where_there_is_none(make, says):
    with pytest.raises(InputError, match=says) as refused:
        make()
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(("shift", "largest_share"), [(5.0, 0.011), (6.0, 0.010)])
def test_one_roll_for_all_loads_moves_peaks_by_little(shift, largest_share):
    """Peaks by springs from 10 to 150 kN with the roll of 50 kN.

    The reference has the roll of each load. A map leaves this difference open.
    """
    off = []
    for load_N in (10e3, 150e3):
        own_roll, shared_roll = (
            compute_hertz_points(case, place_case(case)).shared_p_max_MPa
            for case in (Case(lateral_shift_mm=shift, load_N=load_N, roll_load_N=roll) for roll in (load_N, 50e3))
        )
        off.append(abs(shared_roll / own_roll - 1.0))
    assert 0.8 * largest_share < max(off) < largest_share


@pytest.mark.parametrize("shift", [-5.0, -0.3, 0.0, 2.0, 5.0])
@pytest.mark.parametrize("yaw", [0.0, 6e-3])
def test_the_left_wheel_is_the_right_one_of_the_mirror_image(shift, yaw):
    left = Case(lateral_shift_mm=shift, yaw_rad=yaw, roll="touching")
    right = replace(left, lateral_shift_mm=-shift, yaw_rad=-yaw, side="right")
    left_placement, right_placement = place_case(left), place_case(right)
    assert_same_placement(left_placement, right_placement)
    assert compute_roll(left, left_placement) == pytest.approx(-compute_roll(right, right_placement), abs=1e-13)
    x, s = np.linspace(-10.0, 10.0, 5)[:, None], np.linspace(-4.0, 4.0, 5)[None, :]
    np.testing.assert_allclose(left_placement.gap(x, s), right_placement.gap(x, s), atol=1e-10)
    hertz = [hertz_record(evaluate_hertz(case))["ellipses"][0] for case in (left, right)]
    assert hertz[0].pop("side") == hertz[1].pop("side")
    assert hertz[0] == pytest.approx(hertz[1], rel=1e-10)


@pytest.mark.parametrize("motion", [{"roll_rad": 4e-4}, {"yaw_rad": 8e-3}, {"roll_rad": -1e-3, "yaw_rad": 5e-3}])
def test_a_fixed_roll_is_mirrored_too(motion):
    left = Case(lateral_shift_mm=3.0, **motion)
    right = Case(lateral_shift_mm=-3.0, side="right", **{name: -value for name, value in motion.items()})
    assert_same_placement(place_case(left), place_case(right), tolerance=0.0)


@pytest.mark.parametrize("shift", [-5.5, -2.0, 0.21, 0.22, 4.9, 6.0])
def test_the_axle_has_one_height(shift):
    case = Case(lateral_shift_mm=shift, roll="touching", yaw_rad=3e-3)
    placement = place_wheelset_of_case(case)
    # each wheel's own search, by roots of the slope, against the samples by which the roll is found
    left, right = (side.wheel.centre_mm[2] for side in (placement.left, placement.right))
    assert left == pytest.approx(right, abs=1e-8)
    assert placement.axle_height_mm == left
    assert place_case(case).first == placement.left.first
    # one roll for both
    assert compute_roll(replace(case, side="right"), placement.right) == pytest.approx(placement.roll_rad, abs=1e-15)
    assert compute_roll(case, placement.left) == pytest.approx(placement.roll_rad, abs=1e-15)


@pytest.mark.parametrize("side", slow_but(["left", "right"], 1))
def test_a_case_at_many_shifts_is_as_it_is_at_each(side):
    case = Case(side=side, roll="touching")
    # outermost a flange climbs on either side: the other wheel is placed, which has that roll, the climbing one is not
    shifts = [-9.0, -4.0, -1.0, 0.0, 1.0, 4.0, 9.0]
    placements = place_at_shifts(case, shifts)
    assert list(placements) == shifts
    for shift, placement in placements.items():
        alone = place_or_explain(replace(case, lateral_shift_mm=shift))
        if isinstance(alone, str):
            # without the search for what is possible
            assert alone.startswith(placement)
        else:
            # rolls differ by 1e-13 rad
            assert_same_placement(placement, alone, tolerance=1e-9)
            assert placement.other_climbs == alone.other_climbs
    assert {shift for shift, outcome in placements.items() if isinstance(outcome, str)} == {9.0 * SIDE_SIGN[side]}
    given_rolls = place_at_shifts(Case(roll="given", roll_rad=1e-4), [2.0, 60.0])
    assert_same_placement(
        given_rolls[2.0], place_case(Case(roll="given", roll_rad=1e-4, lateral_shift_mm=2.0)), tolerance=0.0
    )
    assert "lateral shift 60 mm" in given_rolls[60.0]


def test_a_difference_of_diameters_rolls_the_wheelset():
    case = Case(
        rail="circle:300",
        wheel="cylinder:460",
        inclination_rad=0.0,
        roll="touching",
        opposite=Opposite(rolling_radius_mm=459.0),
    )
    placement = place_wheelset_of_case(case)
    assert placement.left.wheel.rolling_radius_mm == 460.0
    assert placement.right.wheel.rolling_radius_mm == 459.0
    # the centre of each circle lies 300 mm and a radius below the axle, 750 mm to its side: by the difference of both
    # distances 1500 sin(roll) is the difference of the radii
    roll = placement.roll_rad
    assert roll == pytest.approx(math.asin(1.0 / 1500.0), rel=1e-9)
    # and the other way round
    mirrored = place_wheelset_of_case(replace(case, side="right"))
    assert mirrored.roll_rad == pytest.approx(-roll, abs=1e-13)


def test_other_profiles_on_the_other_side_are_one_wheelset():
    worn = Opposite(wheel="cylinder:458", rail="54E1")
    left = Case(lateral_shift_mm=1.0, roll="touching", opposite=worn)
    right = Case(
        rail="54E1",
        wheel="cylinder:458",
        lateral_shift_mm=1.0,
        roll="touching",
        side="right",
        opposite=Opposite(rail="60E1", wheel="S1002", rolling_radius_mm=460.0),
    )
    left_placement, right_placement = place_wheelset_of_case(left), place_wheelset_of_case(right)
    assert left_placement.roll_rad == right_placement.roll_rad
    assert left_placement.roll_rad != 0.0
    assert_same_placement(left_placement.right, place_case(right), tolerance=0.0)
    assert_same_placement(place_case(left), right_placement.left, tolerance=0.0)


def test_the_found_roll_stands_in_records_and_rows():
    case = Case(lateral_shift_mm=5.0, roll="touching", side="right")
    placement = place_case(case)
    inputs = case_inputs(case, placement)
    assert (inputs["roll"], inputs["side"]) == ("touching", "right")
    assert inputs["roll_mrad"] == pytest.approx(1e3 * place_wheelset_of_case(case).roll_rad, abs=1e-12)
    row = input_columns(case, placement)
    assert (row["roll_mrad"], row["side"], row["roll"]) == (inputs["roll_mrad"], "right", "touching")
    # not known of a case that failed
    assert input_columns(case)["roll_mrad"] is None
    fixed = Case(roll_rad=4e-4)
    assert case_inputs(fixed, place_case(fixed))["roll_mrad"] == 0.4
    assert input_columns(fixed, place_case(fixed))["roll_mrad"] == 0.4
    assert "side" not in input_columns(fixed)


def test_an_id_tells_wheelsets_apart():
    case = Case(lateral_shift_mm=0.0, load_N=100e3, roll="given")
    variants = (
        Case(),
        Case(roll="given", side="right"),
        Case(roll="touching", opposite=Opposite(rolling_radius_mm=459.0)),
        Case(roll="touching", opposite=Opposite(wheel="S1002")),
        Case(roll="loaded"),
        Case(roll_load_N=8e4),
        Case(roll="loaded", opposite=Opposite(wheel_load_N=8e4)),
        Case(roll="given", flange_climb=True),
    )
    assert len({make_case_id(case_variant) for case_variant in (case, *variants)}) == 9


def test_a_file_on_the_other_side_counts_by_its_content_and_is_kept(tmp_path):
    points = np.column_stack([np.linspace(-60.0, 60.0, 121), np.zeros(121)])
    first_file, second_file = tmp_path / "a" / "flat.txt", tmp_path / "b" / "flat.txt"
    for path in (first_file, second_file):
        path.parent.mkdir()
        np.savetxt(path, points)
    case, moved_case = (Case(roll="touching", opposite=Opposite(wheel=str(path))) for path in (first_file, second_file))
    assert make_case_id(case) == make_case_id(moved_case)
    assert set(digest_input_files(case)) == {"opposite_wheel"}
    np.savetxt(second_file, points * [1.0, 0.0] + [0.0, 1.0])
    assert make_case_id(case) != make_case_id(moved_case)
    copy_profiles(case, tmp_path / "out")
    record = case_inputs(case, place_case(case))
    assert str(tmp_path) not in str(record)
    again = read_stored_case(tmp_path / "out", record)
    assert again.opposite.wheel == str(tmp_path / "out" / "profiles" / "opposite_wheel" / "flat.txt")
    assert place_wheelset_of_case(again).roll_rad == place_wheelset_of_case(case).roll_rad


@pytest.mark.parametrize(
    ("case", "says"),
    [
        (Case(lateral_shift_mm=9.0, roll="touching"), r"left side: the wheel derails.*between -49\.5 and 6 mm"),
        (Case(lateral_shift_mm=-9.0, side="right"), r"right side: the wheel derails.*between -6 and 49\.5 mm"),
        # the other wheel stands on the top of its flange
        (Case(lateral_shift_mm=-52.0), r"right side: the wheel derails.*top of its flange.*between -49\.5 and 6 mm"),
        (Case(roll="touching", track=Track(gauge_mm=1400.0)), "on a gauge 20 to 80 mm wider, or with a back-to-back"),
        (Case(roll="touching", track=Track(gauge_mm=1600.0)), "on a gauge 30 to 80 mm narrower.*larger by as much"),
        (Case(roll="touching", track=Track(gauge_mm=1000.0)), "it fits on no gauge up to 80 mm wider or narrower"),
        (Case(roll="touching", opposite=Opposite(rolling_radius_mm=300.0)), "no roll.*check gauge.*diameters of both"),
        (Case(roll="given", opposite=Opposite(rolling_radius_mm=459.0)), "give roll = 'touching'"),
        (
            Case(rail="circle:300", roll="touching"),
            "S1002 on circle:300 .* no wheelset; give roll = 'given'",
        ),
    ],
)
def test_wheelsets_that_cannot_stand_are_refused_in_one_line(case, says):
    with pytest.raises(InputError, match=says) as refused:
        place_case(case)
    assert "\n" not in str(refused.value)


def test_a_roll_that_nobody_asked_for_follows_the_pair_of_a_derived_case():
    circles = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)
    real = {"rail": "60E1", "wheel": "S1002", "inclination_rad": INCLINATION_40, "lateral_shift_mm": 3.0}
    derived = replace(circles, **real)
    assert (circles.roll, derived.roll) == ("given", "touching")
    assert derived == Case(**real)
    assert make_case_id(derived) == make_case_id(Case(**real))
    # and not the roll of one wheel alone, with another peak
    alone = Case(**real, roll="given")
    peaks = [evaluate_hertz(case).hertz.p0_MPa for case in (derived, alone)]
    assert peaks[1] / peaks[0] - 1.0 > 0.003
    assert replace(derived, rail="circle:300", wheel="cylinder:460", inclination_rad=0.0).roll == "given"
    assert replace(pickle.loads(pickle.dumps(circles)), **real).roll == "touching"
    # what was asked for stays
    assert replace(alone, lateral_shift_mm=1.0).roll == "given"
    assert replace(derived, roll_rad=1e-3).roll == "given"
    assert replace(Case(roll="touching"), load_N=50e3).roll == "touching"


@pytest.mark.parametrize("shift", [-6.5, -7.0, -9.0, -12.0])
def test_a_wheel_is_placed_and_told_where_the_flange_of_the_other_one_climbs(shift):
    left, right = (Case(lateral_shift_mm=SIDE_SIGN[side] * shift, side=side) for side in ("left", "right"))
    placement = place_case(left)
    assert_same_placement(placement, place_case(right), tolerance=1e-12)
    assert placement.first.contact_angle_rad < 0.02
    assert compute_roll(left, placement) == pytest.approx(-compute_roll(right, place_case(right)), abs=1e-15)
    # the roll is that of flanges that may climb, which stands against CONTACT's above
    both_sides = place_wheelset_of_case(replace(left, flange_climb=True))
    assert both_sides.right.climbs
    assert_same_placement(placement, both_sides.left, tolerance=0.0)
    for one_side in (placement, place_case(right)):
        assert not one_side.climbs
        (note,) = (note for note in one_side.notes if "derails" in note)
        assert "the opposite wheel derails" in note
        again = placement_from_record(
            json.loads(json.dumps(placement_record(one_side))), one_side.rail.profile, one_side.wheel.profile
        )
        assert again.notes == one_side.notes
    assert not any("derails" in note for note in place_case(replace(left, lateral_shift_mm=-6.0)).notes)
    # the wheel whose own flange climbs is refused as ever
    with pytest.raises(InputError, match="right side: the wheel derails"):
        place_case(replace(left, side="right"))


def test_a_pair_over_itself_is_symmetric():
    pair = set_up_pair(load_library_profile("60E1"), load_library_profile("S1002"), inclination_rad=INCLINATION_40)
    wheelset = Wheelset.of(pair, pair)
    assert wheelset.symmetric
    assert not Wheelset.of(pair, replace(pair, rolling_radius_mm=459.0)).symmetric
    stand = wheelset.stand(0.0)
    assert abs(stand.roll_rad) < 1e-15


@pytest.mark.parametrize("at", [0.7, 1.2, 1.8, 7.8])
def test_the_smallest_gap_is_that_of_the_parabola_next_to_an_end_too(at):
    """Of ten samples: from the second to the last but one."""
    k = np.arange(10)
    lowest = _refine_first_touch(0.0, k, 5.0 + 0.3 * (k - at) ** 2, 0.02 * k, np.zeros(10), -0.02 * k, 460.0 - 0.1 * k)
    assert lowest.axle_mm == pytest.approx(-5.0, abs=1e-12)
    values = (lowest.y_mm, lowest.wheel_y_mm, lowest.radius_mm)
    assert values == pytest.approx((0.02 * at, -0.02 * at, 460.0 - 0.1 * at), abs=1e-12)
