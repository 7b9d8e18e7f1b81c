"""The picture of a wheelset's geometry over its lateral shift."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.case import Case
from fecontact.geometry.contact_functions import ContactFunctions, rolling_radius_difference_mm
from fecontact.outputs.figures.style import SERIES, blank_figure, finish, save_figure
from fecontact.outputs.words.pairs import inclination_words, short_name
from fecontact.profiles.identity import profile_identity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

_LEFT, _RIGHT, _UNROLLED = SERIES[:3]


def functions_figure(case: Case, found: ContactFunctions, path: str | Path) -> Path:
    """Draw rolling-radius difference, touch points, contact angles and equivalent conicity."""
    figure = blank_figure(12.0, 8.0)
    axes = figure.subplots(2, 2)
    placed = [one for one in found.positions.values() if not isinstance(one, str)]
    shifts = np.array([one.shift_mm for one in placed])
    difference = np.array([rolling_radius_difference_mm(one) for one in placed])
    _line(axes[0, 0], shifts, difference, [jump.shift_mm for jump in found.jumps], "black")
    axes[0, 0].set_ylabel("rolling radius, left - right, mm")
    for side, colour in (("left", _LEFT), ("right", _RIGHT)):
        first = [one.left.first if side == "left" else one.right.first for one in placed]
        places, angles = (np.array([getattr(t, name) for t in first]) for name in ("rail_y_mm", "contact_angle_rad"))
        jumps = [jump.shift_mm for jump in found.jumps if jump.side == side]
        _line(axes[0, 1], shifts, places, jumps, colour).set_label(f"{side} rail")
        _line(axes[1, 0], shifts, 1e3 * angles, jumps, colour).set_label(f"{side} wheel")
    axes[0, 1].set_ylabel("first touch point on the rail, mm\n(> 0: field side)")
    axes[1, 0].set_ylabel("contact angle, mrad")
    for ax in (axes[0, 0], axes[0, 1], axes[1, 0]):
        ax.set_xlabel("lateral shift of the wheelset, mm (> 0: to the left)")
    _draw_conicity(axes[1, 1], found)
    finish(*axes.flat)
    axes[0, 1].legend(fontsize=9)
    axes[1, 0].legend(fontsize=9)
    rail, wheel = (short_name(profile_identity(spec)) for spec in (case.rail, case.wheel))
    figure.suptitle(
        f"wheelset {wheel} on {rail}{inclination_words(case.inclination_rad)}, gauge {case.track.gauge_mm:g} mm,"
        f" back to back {case.track.back_to_back_mm:g} mm; dotted: jumps"
    )
    return save_figure(figure, Path(path))


def _line(ax: Axes, x: np.ndarray, y: np.ndarray, jumps: Sequence[float], colour: str) -> Line2D:
    """A line that ends at each jump and begins again behind it; returns its first piece."""
    pieces = np.searchsorted(jumps, x)
    drawn = [ax.plot(x[pieces == piece], y[pieces == piece], ".-", color=colour)[0] for piece in np.unique(pieces)]
    for jump in jumps:
        ax.axvline(jump, color=colour, linestyle=":", linewidth=0.8)
    return drawn[0]


def _draw_conicity(ax: Axes, found: ContactFunctions) -> None:
    amplitudes = [one.amplitude_mm for one in found.conicities]
    ax.plot(amplitudes, [one.unrolled for one in found.conicities], "o-", color=_UNROLLED, label="without roll")
    ax.plot(amplitudes, [one.rolled for one in found.conicities], "s--", color="black", label="with roll")
    ax.set_xlabel("amplitude, mm")
    ax.set_ylabel("equivalent conicity")
    ax.set_ylim(bottom=0.0)
    ax.legend(fontsize=9)
