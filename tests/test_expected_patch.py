"""Where the half-space cannot expect a patch: the end of a line, and corners, are said within seconds."""

import math
import time
from pathlib import Path

import pytest

from fecontact.case import Case, Track
from fecontact.errors import InputError
from fecontact.solving.position import expect_on_half_space

FLAT = """kind = "wheel"
units = "mm"
[[surface]]
type = "line"
from = [-70.0, 0.0]
to = [{end}, 0.0]
"""
# two arcs of R 300 that meet under an angle at y = 2 mm
KINKED = """kind = "rail"
units = "mm"
[[surface]]
type = "arc"
from = {start}
to = {joint}
centre = [0.0, -300.0]
radius = 300.0
[[surface]]
type = "arc"
from = {joint}
to = {end}
centre = {centre}
radius = 300.0
"""


def on_arc(y: float, centre: tuple[float, float] = (0.0, -300.0)) -> list[float]:
    return [y, round(centre[1] + math.sqrt(300.0**2 - (y - centre[0]) ** 2), 9)]


def kinked_rail(path: Path, kink_rad: float) -> str:
    """A rail whose line turns down by an angle at y = 2 mm, and up where it is negative."""
    joint = on_arc(2.0)
    turn = math.asin(2.0 / 300.0) + kink_rad
    centre = (round(joint[0] - 300.0 * math.sin(turn), 9), round(joint[1] - 300.0 * math.cos(turn), 9))
    path.write_text(
        KINKED.format(start=on_arc(-30.0), joint=joint, end=on_arc(30.0, centre), centre=list(centre)), "utf-8"
    )
    return str(path)


def refused_within_seconds(case: Case) -> str:
    start = time.perf_counter()
    with pytest.raises(InputError) as error:
        expect_on_half_space(case)
    # 0.2 s measured; without the check it took a minute and gave a contact that had not converged
    assert time.perf_counter() - start < 10.0
    return str(error.value)


@pytest.mark.parametrize("end", [1.0, 4.0])
def test_a_patch_at_the_end_of_a_wheel_s_line(tmp_path, end):
    wheel = tmp_path / "flat.toml"
    wheel.write_text(FLAT.format(end=end))
    said = refused_within_seconds(Case(rail="circle:300", wheel=str(wheel), inclination_rad=0.0))
    assert "reaches the end of the running surface of wheel flat" in said
    # b is 5.4 mm: where the line is longer than that there is nothing to say
    wheel.write_text(FLAT.format(end=6.5))
    assert expect_on_half_space(Case(rail="circle:300", wheel=str(wheel), inclination_rad=0.0))


def case_on(rail: str) -> Case:
    track = Track(rail_crown_y_mm=Track().tape_circle_y_mm)
    return Case(rail=rail, wheel="cylinder:460", inclination_rad=0.0, track=track)


def test_a_patch_over_a_corner_of_the_rail(tmp_path):
    said = refused_within_seconds(case_on(kinked_rail(tmp_path / "kinked.toml", 0.2)))
    assert "a corner of rail kinked at y = 2.00 mm" in said


@pytest.mark.parametrize("kink_rad", [0.0, 0.003, -0.003])
def test_kinks_of_rounded_data_are_none(tmp_path, kink_rad):
    _, expected = expect_on_half_space(case_on(kinked_rail(tmp_path / "kinked.toml", kink_rad)))
    assert expected.half_space.status == "converged"
    # the patch lies over the kink, and is about as wide as without it
    assert expected.s_low_mm < 2.0 < expected.s_high_mm
    assert expected.s_high_mm - expected.s_low_mm == pytest.approx(10.8, abs=1.5)
