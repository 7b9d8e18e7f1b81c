"""Wheels of EN 15302 and the 1/40 of EN 13715: points of the standards, and conicities.

The conicities are for rail A.
"""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from fecontact.case import Case, Opposite, Track
from fecontact.placement.wheelset import compute_radius_difference
from fecontact.profiles.library import load_library_profile
from fecontact.solving.placing import make_wheelset
from fecontact.solving.wheelset_geometry import geometry

HERE = Path(__file__).parent
# the gauge is measured 14 mm below the origin of rail A, which is 0.4918 mm below the top of the rail
GAUGE_DEPTH_MM = 14.491775

# Depth of the surface below the tape circle (mm) at y (mm): tables I.1 to I.4 of EN 15302:2021.
TABLES = {
    "A": {-69: 15.84382, -60: 26.90936, -45: 23.53837, -39: 13.57565, -35: 7.28388, -28: 3.78159, -20: 1.97093,
          -12: 0.85633, -5: 0.30372, 10: -0.38924, 25: -0.49194, 40: -1.15860, 65: -7.49192},
    "B": {-69: 15.84386, -60: 26.90871, -45: 23.53771, -38: 11.22110, -35: 7.37735, -28: 3.92061, -20: 2.10665,
          -12: 0.85625, -5: 0.21039, 10: -0.25000, 25: -0.62500, 40: -1.25000, 65: -7.25000},
    "C": {-69: 23.12256, -60: 29.98756, -50: 26.65196, -45: 21.18901, -42: 14.30342, -36: 5.87591, -27: 2.99434,
          -20: 1.78597, -12: 0.91186, -5: 0.32646, 10: -0.42467, 25: -0.54742, 40: -1.64742, 65: -9.54742},
    "H": {-69: 15.84386, -60: 26.90871, -45: 23.53771, -38: 11.16578, -35: 7.25596, -28: 3.80980, -20: 2.20980,
          -12: 0.60980, -5: 0.12500, 10: -0.25000, 25: -0.62500, 40: -1.41700, 65: -7.75100},
}  # fmt: skip
# Difference of the rolling radii (mm) by shift (mm) on rail A, gauge 1435 mm, without roll: annex J.
RADIUS_DIFFERENCES = {
    "A": {0.5: 0.116, 1.0: 0.259, 2.0: 0.667, 3.0: 1.243, 4.0: 1.913, 5.0: 2.936, 6.0: 4.327, 6.6: 7.590, 6.8: 10.940},
    "B": {1.0: 0.050, 2.0: 0.100, 2.9: 0.145, 3.1: 2.001, 4.0: 2.515, 5.0: 3.160, 6.0: 3.886, 6.5: 6.132, 6.8: 9.942},
    "C": {0.5: 0.515, 1.0: 1.024, 2.0: 1.271, 4.0: 1.533, 6.0: 1.801, 7.6: 2.029, 8.0: 2.255, 9.0: 3.035, 9.3: 3.320},
    "H": {1.0: 0.050, 2.5: 0.125, 2.6: 2.402, 4.0: 2.717, 5.0: 2.942, 6.0: 3.167, 6.7: 3.324},
}
# Arcs of rail A, UIC60 1:20 with its origin 750 mm from the track centre: y, z of the centre, and the radius (I.7).
RAIL_A = ((-19.63949, -15.899044, 13.0), (-1.08250, -80.277908, 80.0), (17.59660, -299.483490, 300.0),
          (14.29829, -79.508225, 80.0), (26.33535, -13.598369, 13.0))  # fmt: skip
RAIL_A_ENDS = (-32.6340, -23.2401, -7.8749, 13.0989, 28.6709, 39.2705)


@pytest.mark.parametrize("wheel", TABLES)
def test_the_points_of_the_standard_lie_on_the_line(wheel):
    y, depth = (np.array(values) for values in (list(TABLES[wheel]), list(TABLES[wheel].values())))
    # formulas and tables differ by 5.6e-5 mm for wheel A (y = -29 to -11 mm), and by 3.2e-5 mm for wheel C
    assert -load_library_profile(f"EN15302_{wheel}").height(y) == pytest.approx(depth, rel=0.0, abs=6e-5)


@pytest.mark.parametrize(
    ("wheel", "corners_mm"),
    [
        ("EN15302_A", (30.0, 60.0)),
        ("EN15302_B", (30.0, 60.0)),
        ("EN15302_C", (-59.5, 29.0, 59.0)),
        ("EN15302_H", (-10.2297, 30.0, 60.0)),
        ("EN13715_1in40", (35.0, 60.0)),
    ],
)
def test_the_sections_are_tangent_but_for_the_corners_of_the_standard(wheel, corners_mm):
    line = load_library_profile(wheel)
    assert tuple(round(joint.y_mm, 4) for joint in line.junctions if joint.is_corner) == corners_mm
    jumps = [abs(joint.angle_right_rad - joint.angle_left_rad) for joint in line.junctions if not joint.is_corner]
    # the coefficients have four digits
    assert max(jumps) < 1e-4


def test_the_points_of_the_1_in_40_are_those_of_the_standard():
    """Solved from the radii: heights to the rounding of its points, which end its tangents to 0.004 mm."""
    line = load_library_profile("EN13715_1in40")
    assert line.height([-32.696, -26.0, -15.640, 0.0, 35.0]) == pytest.approx(
        [-5.180, -2.187, -0.391, 0.0, 0.875], abs=1e-3
    )
    assert [segment.evaluate(np.zeros(1)).y[0] for segment in line.segments[5:7]] == pytest.approx(
        [-32.696, -15.640], abs=4e-3
    )


@pytest.fixture(scope="module")
def rail_a(tmp_path_factory):
    path = tmp_path_factory.mktemp("rail") / "rail_a.toml"
    text = 'kind = "rail"\nunits = "mm"\n'
    for (y, z, radius), low, high in zip(RAIL_A, RAIL_A_ENDS, RAIL_A_ENDS[1:], strict=False):
        ends = [f"[{at}, {z + math.sqrt(max(radius**2 - (at - y) ** 2, 0.0))}]" for at in (low, high)]
        text += f'[[surface]]\ntype = "arc"\nfrom = {ends[0]}\nto = {ends[1]}\ncentre = [{y}, {z}]\nradius = {radius}\n'
    path.write_text(text, "utf-8")
    return str(path)


@pytest.mark.parametrize("wheel", RADIUS_DIFFERENCES)
def test_rolling_radii_are_those_of_the_standard(rail_a, wheel):
    """Its results have three digits; 0.0025 mm at the junction of wheel A (3 mm), elsewhere 0.001 mm at most."""
    track = Track(gauge_depth_mm=GAUGE_DEPTH_MM)
    wheelset = make_wheelset(Case(rail=rail_a, wheel=f"EN15302_{wheel}", inclination_rad=0.0, track=track))
    for shift, expected in RADIUS_DIFFERENCES[wheel].items():
        left, right = wheelset.left.standing(shift, 0.0, 0.0), wheelset.right.standing(-shift, 0.0, 0.0)
        assert left.radius_mm - right.radius_mm == pytest.approx(expected, abs=3e-3), shift


# Wheels of the left and the right side, and the rolling radius of the right wheel (mm).
PAIRS = {
    "E1": ("EN15302_A", "EN15302_A", 460.0),
    "E2": ("EN15302_B", "EN15302_B", 460.0),
    "E3": ("EN15302_H", "EN15302_H", 460.0),
    "E4": (str(HERE / "en15302_wheel_I.toml"), str(HERE / "en15302_wheel_I.toml"), 460.0),
    "E5": ("EN15302_A", "EN15302_A", 459.0),
    "E6": ("EN15302_B", "EN15302_B", 459.0),
    "B and A": ("EN15302_B", "EN15302_A", 460.0),
}
# Wheel B on the left side and wheel A on the right side: EN 15302:2021, annex K.11.
CONICITIES_OF_B_AND_A = {1.0: 0.136, 1.4: 0.121, 2.0: 0.104, 2.4: 0.096, 2.8: 0.090, 3.0: 0.124, 3.2: 0.157,
                         3.6: 0.196, 4.0: 0.222, 5.0: 0.270, 6.0: 0.306, 6.4: 0.329,
                         6.8: 0.420, 7.0: 0.490, 7.4: 0.607}  # fmt: skip


def conicities_of(pair: str) -> dict[float, float]:
    """Equivalent conicity by amplitude (mm) as the standard has it."""
    if pair == "B and A":
        return CONICITIES_OF_B_AND_A
    lines = [line for line in (HERE / "en15302_conicity.csv").read_text("utf-8").splitlines() if line[0] != "#"]
    return {float(row["amplitude_mm"]): float(row[pair]) for row in csv.DictReader(lines)}


@pytest.mark.parametrize("pair", PAIRS)
def test_equivalent_conicity_is_that_of_the_standard(rail_a, pair):
    """Annexes E and F: half of the value is allowed, at most 0.05, and 0.01 where the value is 0."""
    left, right, radius_mm = PAIRS[pair]
    case = Case(
        **{"rail": rail_a, "wheel": left, "inclination_rad": 0.0, "track": Track(gauge_depth_mm=GAUGE_DEPTH_MM)},
        opposite=Opposite(wheel=right, rolling_radius_mm=radius_mm),
    )
    difference = compute_radius_difference(make_wheelset(case), -10.0, 10.0, rolls=False)
    for amplitude, expected in conicities_of(pair).items():
        # the first contact of wheel B jumps at 3.00005 mm. From there, the conicity rises as a square root: here 0.058
        # at 3.02 mm and 0.025 at 3 mm
        at = 3.02 if (pair, amplitude) == ("E2", 3.0) else amplitude
        tolerance = min(0.5 * expected, 0.05) or 0.01
        assert difference.conicity(at) == pytest.approx(expected, rel=0.0, abs=tolerance + 5e-4), amplitude


def test_wheels_of_unequal_diameters_roll_about_the_shift_of_equal_radii(rail_a):
    """E6: 0.660 at 1 mm; about the middle of the track it was 0.025, the cone of both treads."""
    case = Case(
        **{"rail": rail_a, "wheel": "EN15302_B", "inclination_rad": 0.0, "track": Track(gauge_depth_mm=GAUGE_DEPTH_MM)},
        opposite=Opposite(rolling_radius_mm=459.0),
    )
    wheelset_geometry = geometry(case, [0.0])
    assert wheelset_geometry.unrolled.equal_radii_mm == pytest.approx(-3.0, abs=1e-3)
    assert wheelset_geometry.conicities[0].unrolled == pytest.approx(0.660, abs=0.05)
    assert [conicity.amplitude_mm for conicity in wheelset_geometry.conicities] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
