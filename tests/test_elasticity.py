"""The two solver paths: which is taken, and what a factor needs."""

from types import SimpleNamespace

import psutil
import pytest

from fecontact import elasticity
from fecontact.case import Case
from fecontact.elasticity import choose_solver, elastic_body, factor_bytes, pardiso_available
from fecontact.errors import InputError
from fecontact.levels import mesh_case
from fecontact.material import STEEL

needs_pardiso = pytest.mark.skipif(not pardiso_available(), reason="MKL PARDISO is not installed on this platform")


@pytest.fixture
def available(monkeypatch):
    """Sets the memory that seems to be available (bytes)."""
    return lambda size: monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(available=size))


@needs_pardiso
def test_multigrid_is_taken_where_the_factors_do_not_fit(available):
    bodies = [200_000, 300_000]
    both = sum(factor_bytes(count) for count in bodies)
    available(1.3 * both)
    assert choose_solver("auto", bodies) == "pardiso"
    # one factor alone would fit
    available(0.9 * both)
    assert choose_solver("auto", bodies) == "amg"
    assert choose_solver("auto", bodies[:1]) == "pardiso"
    # who asks for it gets it, and is refused where it is known how much it needs
    assert choose_solver("pardiso", bodies) == "pardiso"


def test_without_mkl_multigrid_is_taken(monkeypatch):
    monkeypatch.setattr(elasticity, "pardiso_available", lambda: False)
    assert choose_solver("auto", [1000]) == "amg"
    with pytest.raises(InputError, match="MKL is not installed"):
        choose_solver("pardiso")


@needs_pardiso
@pytest.mark.parametrize("body", ["rail", "wheel"])
def test_estimated_factor_against_the_one_that_is_made(body):
    mesh = mesh_case(Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0, resolution="quick"), body)
    made = elastic_body(mesh, STEEL, "pardiso")
    permanent, factor = (made.solve._pardiso.get_iparm(k) for k in (16, 17))
    made.close()
    # nested dissection depends on the body's shape: 158 to 187 n^(4/3) measured for the factor
    assert factor_bytes(3 * len(mesh.points)) == pytest.approx(1024.0 * (permanent + factor), rel=0.25)
