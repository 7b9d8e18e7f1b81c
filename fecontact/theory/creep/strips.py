"""Any pressure field in strips along the rolling direction, and the ellipse that stands for it in the flexibilities."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fecontact.material import RollingPair
from fecontact.theory.creep.contact import Creepages, Motion, RollingEllipse
from fecontact.theory.creep.fastsim import Strips

Floats = NDArray[np.float64]
STRIPS = 80
"""Strips over a pressure field."""


def pressure_strips(
    x_mm: Floats, y_mm: Floats, pressure_MPa: Floats, pair: RollingPair, *, strips: int = STRIPS
) -> tuple[Strips, ...]:
    """Separate patches of a pressure on a uniform grid, each in strips and with its own ellipse.

    The ellipse has the second moments of the patch's pressure, sqrt(5 <x^2>) and sqrt(5 <y^2>) about its centre, scaled
    to the true area; of a Hertz pressure it is Hertz's. A strip reaches over sqrt(4 <x^2>) to each side of its middle.
    Lobes of one patch have one ellipse: against the rolling half-space, one each was worse.

    Parameters
    ----------
    x_mm (nx,), y_mm (ny,)
        Nodes along the rolling direction and across.
    pressure_MPa (nx, ny)
        Pressure on them.
    strips
        Neighbouring nodes across are put together until there are fewer than twice as many.

    Notes
    -----
    After Kik and Piotrowski (1996), who march over the true patch in strips. Range of validity: each strip has one
    stretch in contact, as on prismatic rails.
    """
    width = float(y_mm[1] - y_mm[0])
    group = max(1, y_mm.size // strips)
    kept = y_mm.size + -y_mm.size % group
    padded = np.pad(pressure_MPa, ((0, 0), (0, kept - y_mm.size))).reshape(x_mm.size, -1, group).mean(axis=2)
    middles = y_mm[0] + width * (group * np.arange(kept // group) + 0.5 * (group - 1))
    # a strip of one node has no length
    here = np.count_nonzero(padded > 0.0, axis=0) > 1
    starts = np.flatnonzero(here & ~np.append(False, here[:-1]))
    ends = np.flatnonzero(here & ~np.append(here[1:], False)) + 1
    own = [slice(int(low), int(high)) for low, high in zip(starts, ends, strict=True)]
    return tuple(_piece(x_mm, middles[one], padded[:, one], group * width, pair) for one in own)


def _piece(x: Floats, y: Floats, p: Floats, width: float, pair: RollingPair) -> Strips:
    total = p.sum(axis=0)
    force = float(x[1] - x[0]) * total
    load = float(width * force.sum())
    middle = x @ p / total
    half = 2.0 * np.sqrt(np.maximum(x**2 @ p / total - middle**2, 0.0))
    share = force / force.sum()
    centre_x, centre_y = float(middle @ share), float(y @ share)
    a = math.sqrt(5.0 * float((x**2 @ p / total) @ share - centre_x**2))
    # pressure that is constant over a strip's width adds to the moment across
    b = math.sqrt(5.0 * (float((y - centre_y) ** 2 @ share) + width**2 / 12.0))
    scale = math.sqrt(2.0 * width * float(half.sum()) / (math.pi * a * b))
    return Strips(
        contact=RollingEllipse.of(pair, a_mm=scale * a, b_mm=scale * b, normal_force_N=load),
        centre_x_mm=centre_x,
        centre_y_mm=centre_y,
        y_mm=y,
        width_mm=np.full(y.size, width),
        middle_x_mm=middle,
        half_length_mm=half,
        force_N_per_mm=force,
    )


def mean_creepages(pieces: Sequence[Strips], creepages: Motion) -> Creepages:
    """Creepages of the centre of all patches together; over curved surfaces their mean over the load."""
    parts = ((one.force_N_per_mm * one.width_mm, one.middle_x_mm, one.y_mm) for one in pieces)
    force, middle, y = (np.concatenate(each) for each in zip(*parts, strict=True))
    return creepages.mean(middle, y, force / force.sum())


def one_ellipse(pieces: Sequence[Strips]) -> tuple[RollingEllipse, float, float]:
    """The ellipse of second moments of all patches together, scaled to their area, and its centre (mm)."""
    y = np.concatenate([piece.y_mm for piece in pieces])
    force = np.concatenate([piece.force_N_per_mm * piece.width_mm for piece in pieces])
    middle = np.concatenate([piece.middle_x_mm for piece in pieces])
    half = np.concatenate([piece.half_length_mm for piece in pieces])
    width = np.concatenate([piece.width_mm for piece in pieces])
    share = force / force.sum()
    centre_x, centre_y = float(middle @ share), float(y @ share)
    a = math.sqrt(5.0 * float((half**2 / 4.0 + (middle - centre_x) ** 2) @ share))
    b = math.sqrt(5.0 * float(((y - centre_y) ** 2 + width**2 / 12.0) @ share))
    scale = math.sqrt(2.0 * float(half @ width) / (math.pi * a * b))
    contact = replace(pieces[0].contact, a_mm=scale * a, b_mm=scale * b, normal_force_N=float(force.sum()))
    return contact, centre_x, centre_y
