"""Profiles that are told by their radii, such as `circle:300`, and which lines are those of a wheelset on a track."""

from __future__ import annotations

import re

CIRCLE, ARCS, CYLINDER = "circle:", "arcs:", "cylinder:"
# DIN 536-1, form A: symmetric heads without a gauge face
_CRANE_RAIL = re.compile(r"A\d{2,3}", re.IGNORECASE)


def is_short_form(spec: str) -> bool:
    """Whether a text gives a profile by its radii, such as `circle:300`: neither a name nor a file."""
    return spec.lower().startswith((CIRCLE, ARCS, CYLINDER))


def has_no_gauge_face(spec: str) -> bool:
    """Whether a rail is given by its radii alone: it has no gauge face, its crown lies under the tape circle."""
    return spec.lower().startswith((CIRCLE, ARCS))


def makes_a_wheelset(rail: str, wheel: str) -> bool:
    """Whether rail and wheel may be those of a wheelset on its track.

    A line that is given by its radii (`circle:300`, `arcs:300/80@2.5`, `cylinder:460`) is a body for a test: it has
    neither gauge face nor flange that would say how a wheelset stands. Nor has the wheelset of a crane.
    """
    return not (is_short_form(rail) or is_short_form(wheel) or is_crane_rail(rail))


def is_crane_rail(rail: str) -> bool:
    """Whether a rail is one of the library's crane rails."""
    return _CRANE_RAIL.fullmatch(rail) is not None
