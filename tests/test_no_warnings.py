"""Commands without a mesh on pairs of the library: each arithmetic warning is an error."""

import contextlib
import math
import random
import warnings

import numpy as np
import pytest

import fecontact
from fecontact.case import Case
from fecontact.contact_theories.registry import THEORIES
from fecontact.errors import FecontactError
from fecontact.outputs.alone import table_row
from fecontact.profiles.library import list_names
from fecontact.solving.alone import iterate_table_rows
from fecontact.solving.placing import place_case
from fecontact.solving.wheelset_geometry import geometry

# probability of the most expensive calls
RARELY = {"half_space": 0.25, "place": 0.25, "geometry": 0.1}


def draw_cases(seed: int, count: int) -> list[Case]:
    """Random cases over the range of the inputs."""
    draw = random.Random(seed)
    return [
        Case(
            rail=draw.choice(list_names("rail")),
            wheel=draw.choice(list_names("wheel")),
            inclination_rad=draw.choice([0.0, *(math.atan(1.0 / gradient) for gradient in (20, 25, 30, 35, 40))]),
            lateral_shift_mm=round(draw.uniform(-8.0, 8.0), 2),
            load_N=draw.choice([10e3, 20e3, 60e3, 100e3, 160e3]),
            load_kind=draw.choice(["vertical", "normal"]),
            roll=draw.choice(["touching", "given"]),
            yaw_rad=draw.choice([0.0, 0.0, 5e-3]),
        )
        for _ in range(count)
    ]


def evaluate_all(case: Case, draw: random.Random) -> int:
    """Evaluate all that needs no mesh; returns the number of answers. A position may be refused, but not warn."""
    calls = {
        "hertz": lambda: fecontact.hertz(case),
        "table": lambda: [table_row(line) for line in iterate_table_rows(case, [case.lateral_shift_mm], [case.load_N])],
        "place": lambda: fecontact.place(case),
        "geometry": lambda: geometry(case, [-3.0, 0.0, 3.0]),
        **{name: (lambda name=name: fecontact.theory(case, name)) for name in THEORIES},
    }
    answers = 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name, call in calls.items():
            if draw.random() < RARELY.get(name, 1.0):
                with contextlib.suppress(FecontactError):
                    call()
                    answers += 1
    return answers


@pytest.mark.parametrize(("seed", "count"), [(1, 4), pytest.param(2, 150, marks=pytest.mark.slow)])
def test_no_pair_of_the_library_warns(seed, count):
    draw = random.Random(seed)
    answers = [evaluate_all(case, draw) for case in draw_cases(seed, count)]
    # most pairs can be placed
    assert sum(count_of_case > 0 for count_of_case in answers) > 0.5 * count


def test_a_half_space_below_a_flange_that_runs_along_a_direction_does_not_warn():
    # directions from the rail's side run along the flange of this wheel
    case = Case(rail="A65", wheel="EN15302_H", lateral_shift_mm=-2.1, load_N=20e3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        measures = fecontact.theory(case, "half_space")
    # the flange is far below all directions that the patch needs: the strip method has the same peak
    assert measures["p_max_MPa"] == pytest.approx(fecontact.theory(case, "strip")["p_max_MPa"], rel=0.02)


def test_a_direction_along_the_surface_does_not_meet_it():
    wheel = place_case(Case(rail="60E1", wheel="S1002", lateral_shift_mm=0.0)).wheel
    # a millimetre below the tread, straight up and along the track
    point = wheel.point(0.0, wheel.rolling_radius_mm + 1.0, 0.0)
    directions = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]) @ wheel.axes.T
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        up, along = wheel.distance_along(np.stack([point, point]), directions)
    assert up == pytest.approx(1.0, abs=1e-9)
    assert math.isnan(along)
