"""A rail with a corner on its head, of any angle."""

import math
from pathlib import Path

from fecontact.case import Case, Track

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


def arc_point(y: float, centre: tuple[float, float] = (0.0, -300.0)) -> list[float]:
    return [y, round(centre[1] + math.sqrt(300.0**2 - (y - centre[0]) ** 2), 9)]


def kinked_rail(path: Path, kink_rad: float) -> str:
    """Rail that turns down by an angle at y = 2 mm; up if the angle is negative."""
    joint = arc_point(2.0)
    turn = math.asin(2.0 / 300.0) + kink_rad
    centre = (round(joint[0] - 300.0 * math.sin(turn), 9), round(joint[1] - 300.0 * math.cos(turn), 9))
    path.write_text(
        KINKED.format(start=arc_point(-30.0), joint=joint, end=arc_point(30.0, centre), centre=list(centre)), "utf-8"
    )
    return str(path)


def case_on(rail: str) -> Case:
    track = Track(rail_crown_y_mm=Track().tape_circle_y_mm)
    return Case(rail=rail, wheel="cylinder:460", inclination_rad=0.0, track=track)
