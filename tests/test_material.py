"""Elastic constants: closed relations between them, and the refusal of impossible values."""

from __future__ import annotations

import dataclasses
import math

import pytest

from fecontact.bodies import STEEL, Material, combine_moduli_MPa
from fecontact.errors import ConvergenceError, FecontactError, InputError


def test_contact_modulus_of_equal_steel_bodies() -> None:
    # By hand: E / (2 (1 - nu^2)) = 210000 / 1.82; the tolerance is rounding.
    assert combine_moduli_MPa(STEEL, STEEL) == pytest.approx(210_000.0 / 1.82, rel=1e-15)


def test_contact_modulus_of_unlike_bodies_is_symmetric_and_tends_to_the_softer() -> None:
    rubber = Material(young_MPa=5.0, poisson=0.49)
    assert combine_moduli_MPa(STEEL, rubber) == combine_moduli_MPa(rubber, STEEL)
    # Steel adds the part 5 / 210000 = 2.4e-5 (times 1.2 for nu) to the compliance, so 3e-5 bounds the difference.
    softer_alone = 5.0 / (1.0 - 0.49**2)
    assert combine_moduli_MPa(STEEL, rubber) == pytest.approx(softer_alone, rel=3e-5)
    assert combine_moduli_MPa(STEEL, rubber) < softer_alone


def test_from_shear_uses_the_isotropic_relation() -> None:
    # The constants of CONTACT's conformal example: 2 * 82000 * 1.28; the tolerance is rounding.
    steel = Material.from_shear(shear_MPa=82_000.0, poisson=0.28, yield_MPa=480.0)
    assert steel.young_MPa == pytest.approx(209_920.0, rel=1e-15)
    assert steel.shear_MPa == pytest.approx(82_000.0, rel=1e-15)
    assert steel.yield_MPa == 480.0


def test_material_is_a_frozen_value() -> None:
    assert Material(young_MPa=210_000.0, poisson=0.3) == STEEL
    with pytest.raises(dataclasses.FrozenInstanceError):
        STEEL.young_MPa = 1.0  # type: ignore[misc]


@pytest.mark.parametrize("young", [0.0, -1.0, math.inf, math.nan])
def test_bad_young_modulus_is_refused(young: float) -> None:
    with pytest.raises(InputError, match=r"Young's modulus is .* MPa; allowed: finite and > 0; give it in MPa"):
        Material(young_MPa=young, poisson=0.3)


@pytest.mark.parametrize("poisson", [-1.0, 0.5, 0.7, math.inf, math.nan])
def test_bad_poisson_ratio_is_refused(poisson: float) -> None:
    with pytest.raises(InputError, match=r"Poisson's ratio is .*allowed: -1 < nu < 0.5"):
        Material(young_MPa=1.0, poisson=poisson)
    with pytest.raises(InputError, match="Poisson's ratio"):
        Material.from_shear(shear_MPa=1.0, poisson=poisson)


@pytest.mark.parametrize("bad", [0.0, -5.0, math.nan])
def test_bad_yield_stress_and_shear_modulus_are_refused(bad: float) -> None:
    with pytest.raises(InputError, match=r"yield stress is .* MPa; allowed"):
        Material(young_MPa=1.0, poisson=0.3, yield_MPa=bad)
    with pytest.raises(InputError, match=r"shear modulus is .* MPa; allowed"):
        Material.from_shear(shear_MPa=bad, poisson=0.3)


def test_errors_carry_the_exit_codes_of_the_command_line() -> None:
    assert (InputError.exit_code, ConvergenceError.exit_code) == (2, 3)
    assert issubclass(InputError, FecontactError)
    assert issubclass(InputError, ValueError)
    assert issubclass(ConvergenceError, FecontactError)
