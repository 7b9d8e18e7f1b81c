"""Solved cases that several test files look at."""

import pytest

from fecontact.case import Case
from fecontact.solving.solve import CaseResult, solve


@pytest.fixture(scope="session")
def elliptic_quick() -> CaseResult:
    """A cylinder on a cylinder at quick resolution: Hertz holds, in a half model of a few thousand elements."""
    return solve(
        Case(
            rail="circle:300",
            wheel="cylinder:460",
            inclination_rad=0.0,
            resolution="quick",
            refine_degrees_of_freedom=0,
        )
    )
