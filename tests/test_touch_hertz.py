"""Hertz at all contact points.

The contact points share the load like springs side by side; a junction has two sides.
"""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fecontact.bodies import STEEL, combine_moduli_MPa
from fecontact.case import Case
from fecontact.contact_theories.hertz import hertz_ellipse, hertz_spring_force_N, multi_hertz_approach_mm
from fecontact.errors import InputError
from fecontact.profiles.resolve import resolve_rail
from fecontact.solving.hertz import compute_hertz_points
from fecontact.solving.placing import place_case
from fecontact.solving.solve import solve

MODULUS = combine_moduli_MPa(STEEL, STEEL)


# --- springs side by side -----------------------------------------------------------------------------------------


def test_equal_springs_share_equally():
    # n springs in parallel are one n times as stiff
    single_mm = multi_hertz_approach_mm([1e6], load_N=25e3, gap_mm=[0.0], closing=[1.0])
    four = multi_hertz_approach_mm([1e6] * 4, load_N=100e3, gap_mm=[0.0] * 4, closing=[1.0] * 4)
    assert single_mm == pytest.approx((25e3 / 1e6) ** (2 / 3), rel=1e-12)
    assert four == pytest.approx(single_mm, rel=1e-12)


def test_a_far_point_carries_nothing():
    near = multi_hertz_approach_mm([1e6], load_N=1e5, gap_mm=[0.0], closing=[1.0])
    both_mm = multi_hertz_approach_mm([1e6, 5e6], load_N=1e5, gap_mm=[0.0, 1.001 * near], closing=[1.0, 1.0])
    assert both_mm == pytest.approx(near, rel=1e-12)
    reached = multi_hertz_approach_mm([1e6, 5e6], load_N=1e5, gap_mm=[0.0, 0.9 * near], closing=[1.0, 1.0])
    assert reached < near


@given(
    st.lists(
        st.tuples(st.floats(1e5, 1e7), st.floats(0.0, 0.2), st.floats(0.3, 1.0)),
        min_size=1,
        max_size=5,
    ),
    st.floats(1.0, 1e6),
)
def test_the_springs_carry_the_load(springs, load):
    k, g, c = (np.array(v) for v in zip(*springs, strict=True))
    g[0] = 0.0
    approach = multi_hertz_approach_mm(k, load_N=load, gap_mm=g, closing=c)
    force = np.array([float(hertz_spring_force_N(1.0, a)) for a in c * approach - g]) * k
    # the root is found to a part in 1e14 of the approach, which a gap next to it magnifies
    assert float(c @ force) == pytest.approx(load, rel=1e-6)


# --- positions ----------------------------------------------------------------------------------------------------


def test_two_contact_points_share_the_load():
    case = Case(lateral_shift_mm=0.0)
    placement = place_case(case)
    direction = placement.load_direction(normal=False)
    points = compute_hertz_points(case, placement)
    assert [(p.contact_point_number, p.side) for p in points.points] == [(0, "both"), (1, "both")]
    shares = [p.shared for p in points.points]
    vertical = [
        s.normal_force_N * float(t.normal @ direction) for s, t in zip(shares, placement.contact_points, strict=True)
    ]
    assert sum(vertical) == pytest.approx(case.load_N, rel=1e-9)
    # one rigid approach: each ellipse's own approach is what its gap leaves of it
    for share, touch in zip(shares, placement.contact_points, strict=True):
        own_closing_mm = (
            points.shared_approach_mm * float(touch.normal @ direction) - touch.vertical_gap_mm * touch.normal[2]
        )
        assert share.approach_mm == pytest.approx(own_closing_mm, rel=1e-9)
    assert points.shared_p_max_MPa == max(s.p0_MPa for s in shares)
    # 10.6 mm apart, half widths 9.9 and 2.3 mm
    assert points.overlapping
    alone = [p.whole for p in points.points]
    assert all(s.p0_MPa < w.p0_MPa for s, w in zip(shares, alone, strict=True))


def test_a_single_touch_point_has_the_whole_load():
    case = Case(lateral_shift_mm=0.0, rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)
    points = compute_hertz_points(case, place_case(case))
    exact = hertz_ellipse(0.5 / 460, 0.5 / 300, normal_force_N=100e3, contact_modulus_MPa=MODULUS)
    (only,) = points.points
    assert only.whole.p0_MPa == pytest.approx(exact.p0_MPa, rel=1e-9)
    assert only.shared.p0_MPa == pytest.approx(exact.p0_MPa, rel=1e-9)
    assert points.shared_approach_mm == pytest.approx(exact.approach_mm, rel=1e-9)
    assert not points.overlapping


# --- two tangent arcs -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("distance", [-6.0, -0.5, 0.0, 0.5, 6.0])
def test_two_arcs_meet_at_the_distance_from_first_touch(distance):
    case = Case(rail=f"arcs:80/13@{distance:g}", wheel="cylinder:460", inclination_rad=0.0)
    placement = place_case(case)
    (junction,) = placement.rail.profile.junctions
    assert not junction.is_corner
    assert (junction.curvature_left_per_mm, junction.curvature_right_per_mm) == pytest.approx((1 / 13, 1 / 80))
    origin = float(placement.rail.profile.arc_length(placement.first.rail_u))
    junction_mm = float(placement.rail.profile.arc_length(placement.rail.profile.locate(junction.y_mm)))
    # the contact point is a root found to 1e-9 mm or so of a minimum
    assert origin - junction_mm == pytest.approx(distance, abs=1e-5)
    assert placement.first.at_junction == (distance == 0.0)
    radius = {True: 80.0, False: 13.0}[distance > 0.0]
    if distance:
        assert 1.0 / placement.first.curvature.rail_per_mm == pytest.approx(radius, rel=1e-9)


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("arcs:300/80", "arcs:300/80@2.5"),
        ("arcs:a/80@1", "arcs:300/80@2.5"),
        ("arcs:-300/80@1", "-300"),
        ("arcs:300/80@nan", "nan"),
        ("arcs:80/13@-15", "-15"),
    ],
)
def test_bad_arcs_are_refused(spec, said):
    with pytest.raises(InputError, match=said.replace("+", r"\+")):
        resolve_rail(spec)


@pytest.mark.slow
def test_junction_is_judged_with_both_curvatures():
    """Touch exactly at a junction R 300 / R 80.

    The truth lies between both ellipses, and neither holds.
    """
    result = solve(
        Case(
            rail="arcs:300/80@0",
            wheel="cylinder:460",
            inclination_rad=0.0,
            resolution="quick",
            refine="never",
        )
    )
    assert list(result.load.sides) == ["gauge", "field"]
    gauge, field = result.load.sides.values()
    assert (result.load.judgements["hertz_gauge"], result.load.judgements["hertz"]) == (gauge, field)
    for side, radius in ((gauge, 80.0), (field, 300.0)):
        exact = hertz_ellipse(
            0.5 / 460, 0.5 / radius, normal_force_N=result.normal_force_N, contact_modulus_MPa=MODULUS
        )
        assert side.hertz.p0_MPa == pytest.approx(exact.p0_MPa, rel=1e-9)
        assert side.deviation["p_max_MPa"] == pytest.approx(exact.p0_MPa / result.comparison.fe.p_max_MPa - 1.0)
        assert side.verdict.answer == "FAILS"
    assert field.deviation["p_max_MPa"] < -0.2 < 0.15 < gauge.deviation["p_max_MPa"]
    assert dict(result.comparison.deviation) == dict(field.deviation)
    assert result.verdict.answer == "FAILS"
    assert result.verdict.cause == "curvature undefined at the contact point"
    assert any("gauge side Hertz FAILS" in warning and "field side" in warning for warning in result.load.warnings)
    assert math.isclose(result.load.geometry.junction_distance_mm, 0.0, abs_tol=1e-5)
