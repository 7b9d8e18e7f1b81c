"""Dimensions that are refused: of the track, of the cuts through bodies, and of elements on a small patch."""

from dataclasses import fields, replace
from types import SimpleNamespace

import pytest

import fecontact
from fecontact.bodies import BodySize, Track
from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.solving.meshes import _check_element_size
from fecontact.solving.placing import place_case

ROUND = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0, resolution="quick", refine="never")


@pytest.mark.parametrize(("kind", "largest_mm"), [(Track, 1e5), (BodySize, 1e4)])
def test_every_dimension_has_a_largest_value(kind, largest_mm):
    assert len(fields(kind)) > 2
    for dimension in fields(kind):
        assert getattr(kind(**{dimension.name: largest_mm}), dimension.name) == largest_mm
        for too_large_mm in (1.001 * largest_mm, 1e19):
            with pytest.raises(InputError, match=rf"is \S+ mm; allowed: at most {largest_mm:g} mm; \w+"):
                kind(**{dimension.name: too_large_mm})


def test_the_rim_ends_before_the_axle():
    """Cuts through a wheel of a radius of 460 mm."""
    for name, allowed_mm, refused_mm in (("rim_thickness_mm", 400.0, 460.0), ("half_length_mm", 460.0, 1450.0)):
        assert getattr(BodySize(**{name: allowed_mm}).at_radius(460.0), name) == allowed_mm
        with pytest.raises(InputError, match=rf"\({name}\) is {refused_mm:g} mm; allowed: at most .* radius 460 mm"):
            BodySize(**{name: refused_mm}).at_radius(460.0)
    # the defaults fit a wheel of any radius
    for radius_mm in (1.0, 50.0):
        small = BodySize().at_radius(radius_mm)
        assert small.rim_thickness_mm < radius_mm
        assert small.half_length_mm < 3.0 * radius_mm


@pytest.mark.parametrize("roll", ["given", "touching"])
@pytest.mark.parametrize("track", [Track(rail_crown_y_mm=1e4), Track(rail_crown_y_mm=1.0), Track(gauge_mm=1e5)])
def test_a_rail_far_from_the_wheel_is_refused(roll, track):
    with pytest.raises(InputError, match=r"wheel is not above (the|its) rail; .*track") as refused:
        place_case(Case(track=track, roll=roll))
    assert "\n" not in str(refused.value)


def level_with(a_mm: float, b_mm: float, monkeypatch) -> SimpleNamespace:
    """Mesh level with elements of 1 mm by 2 mm and a given patch."""
    monkeypatch.setattr("fecontact.solving.meshes.read_patch", lambda rung: SimpleNamespace(a_mm=a_mm, b_mm=b_mm))
    return SimpleNamespace(on_elements=SimpleNamespace(grid=SimpleNamespace(steps_mm=(1.0, 2.0))))


def test_elements_may_be_four_times_as_long_as_a_semi_axis(monkeypatch):
    _check_element_size(ROUND, level_with(0.25, 0.5, monkeypatch))


@pytest.mark.parametrize(
    ("a_mm", "b_mm", "words"),
    [
        (0.24, 9.0, "0.24 elements of 1 mm per semi-axis along x"),
        (9.0, 0.48, "0.24 elements of 2 mm per semi-axis across"),
        (0.0, 9.0, "0 elements of 1 mm per semi-axis along x"),
    ],
)
def test_elements_that_are_too_coarse_for_the_patch_are_refused(a_mm, b_mm, words, monkeypatch):
    level = level_with(a_mm, b_mm, monkeypatch)
    with pytest.raises(InputError, match=f"too coarse for this patch: .* {words}; allowed: at least 0.25") as refused:
        _check_element_size(ROUND, level)
    assert "Poisson" not in str(refused.value)
    stiff = replace(ROUND, rail_material=replace(ROUND.rail_material, poisson=0.4999))
    with pytest.raises(InputError, match=r"or a Poisson's ratio of at most 0\.49"):
        _check_element_size(stiff, level)


def test_a_load_of_1_newton_needs_smaller_elements():
    with pytest.raises(InputError, match="the elements are too coarse for this patch"):
        fecontact.solve(replace(ROUND, load_N=1.0, resolution=(1.6, 1.3)))
