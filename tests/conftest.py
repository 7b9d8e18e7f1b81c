"""What several test files share: solved cases, and how hypothesis runs."""

import pytest
from hypothesis import settings

from fecontact.case import Case
from fecontact.solving.solve import CaseResult, solve

# An example that takes longer than usual says that the machine is busy, not that the code is wrong.
settings.register_profile("fecontact", deadline=None)
settings.load_profile("fecontact")


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
