"""Maps of contact pressures over the rail's surface, with the outlines of both patches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fecontact.comparison.approximation import mean_pressure
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.patch import signed_square
from fecontact.contact.grid import ContactGrid
from fecontact.outputs.figures.style import ACROSS, DIFFERENCE, PRESSURE, ROLLING, SIDES
from fecontact.theory.hertz import HertzContact

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

# A map that is so much taller than wide has room for three numbers across.
_NARROW = 2.2
# Colours of a pressure map and of a difference where nothing presses.
_NO_PRESSURE, _NO_DIFFERENCE = "#440154", "#f7f6f6"


@dataclass(frozen=True, kw_only=True, eq=False)
class PressureFields:
    """Both pressures (nx, ns) in MPa on the nodes of the whole contact, far enough to hold Hertz's ellipse."""

    grid: ContactGrid
    fe: Floats
    hertz: Floats
    ellipse: HertzContact

    @classmethod
    def of(cls, load: JudgedLoad) -> PressureFields:
        """The fields of a judged load."""
        hertz = load.hertz
        fe = load.fe.pressure.covering(hertz.extent_x_mm, hertz.extent_y_mm)
        return cls(grid=fe.grid, fe=fe.values, hertz=mean_pressure(fe.grid, hertz), ellipse=hertz)

    @property
    def peak(self) -> tuple[int, int]:
        """Indices of the highest finite-element pressure."""
        i, j = np.unravel_index(int(np.argmax(self.fe)), self.fe.shape)
        return int(i), int(j)

    @property
    def top_MPa(self) -> float:
        """The highest pressure of both."""
        return float(max(self.fe.max(), self.hertz.max()))

    def limits_mm(self, *, across: bool) -> tuple[float, float]:
        """Range along s (`across`) or x that shows both patches with some room, and not the whole grid."""
        line = self.grid.s_mm if across else self.grid.x_mm
        pressed = line[np.flatnonzero(np.any(self.fe > 0.0, axis=0 if across else 1))]
        reach = 0.5 * (self.ellipse.extent_y_mm if across else self.ellipse.extent_x_mm)
        low, high = min(float(pressed[0]), -reach), max(float(pressed[-1]), reach)
        room = 0.12 * (high - low)
        return low - room, high + room


def draw_pressure(ax: Axes, load: JudgedLoad, kind: str, fields: PressureFields | None = None) -> None:
    """Draw a map of `finite elements`, `Hertz`, or `finite elements minus Hertz` over the rail's surface into axes.

    The outlines of both patches are drawn on it, with a cross at the first touch point, and the lobes
    of the finite elements are numbered, the highest first.
    """
    fields = fields or PressureFields.of(load)
    is_difference = kind == "finite elements minus Hertz"
    values = {"finite elements": fields.fe, "Hertz": fields.hertz}.get(kind, fields.fe - fields.hertz)
    top = (float(np.abs(values).max()) or 1.0) if is_difference else fields.top_MPa
    ground = _NO_DIFFERENCE if is_difference else _NO_PRESSURE
    image = ax.imshow(
        values,
        origin="lower",
        interpolation="bilinear",
        cmap=DIFFERENCE if is_difference else PRESSURE,
        vmin=-top if is_difference else 0.0,
        vmax=top,
        extent=(*_cell_edges(fields.grid.s_mm), *_cell_edges(fields.grid.x_mm)),
    )
    if is_difference:
        # both ends of the colour map are dark in grey: dashed where Hertz presses more
        levels = top * np.array([-0.75, -0.5, -0.25, 0.25, 0.5, 0.75])
        ax.contour(fields.grid.s_mm, fields.grid.x_mm, values, levels=levels, colors="0.25", linewidths=0.6)
    _draw_outlines(ax, fields)
    _draw_lobes(ax, load, fields)
    for colour, width in (("black", 3.0), ("white", 1.4)):
        ax.plot(0.0, 0.0, "+", color=colour, ms=9, mew=width, label="_first touch point")
    # a place that is given is not looked for in each drawing
    ax.set_title(kind, y=1.0)
    ax.set(xlabel=f"{ACROSS}\n{SIDES}", ylabel=ROLLING, aspect="equal", facecolor=ground)
    (s_low, s_high), (x_low, x_high) = fields.limits_mm(across=True), fields.limits_mm(across=False)
    ax.set(xlim=(s_low, s_high), ylim=(x_low, x_high))
    if x_high - x_low > _NARROW * (s_high - s_low):
        # more numbers would overlap
        ax.locator_params(axis="x", nbins=3)
    bar = ax.figure.colorbar(image, cax=ax.inset_axes((1.03, 0.0, 0.045, 1.0)))
    bar.set_label("difference in MPa" if is_difference else "pressure in MPa")


def _cell_edges(nodes_mm: Floats) -> tuple[float, float]:
    """Where the cells of the first and of the last of equally spaced nodes end."""
    half = 0.5 * float(nodes_mm[1] - nodes_mm[0])
    return float(nodes_mm[0]) - half, float(nodes_mm[-1]) + half


def _draw_outlines(ax: Axes, fields: PressureFields) -> None:
    """Edges of both patches, white on black so that they are seen on every colour: the ellipse is dashed."""
    (hx, hs), grid = fields.grid.steps_mm, fields.grid
    x = np.concatenate([[grid.x_mm[0] - hx], grid.x_mm, [grid.x_mm[-1] + hx]])
    s = np.concatenate([[grid.s_mm[0] - hs], grid.s_mm, [grid.s_mm[-1] + hs]])
    square = signed_square(fields.fe)
    ellipse = ellipse_outline(fields.ellipse)
    # drawn twice and not with path effects, with which SVG files differ from one drawing to the next
    for colour, width, name in (("black", 2.8, "_"), ("white", 1.4, "")):
        ax.plot(*ellipse, color=colour, lw=width, ls="-" if name else (0, (4, 2)), label=f"{name}Hertz")
        edge = ax.contour(s, x, square, levels=[0.0], colors=colour, linewidths=width)
        edge.set(label=f"{name}finite elements")


def ellipse_outline(hertz: HertzContact) -> tuple[Floats, Floats]:
    """Edge of Hertz's ellipse: s and x (n,) in mm, closed."""
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    first, second = hertz.a_mm * np.cos(turn), hertz.b_mm * np.sin(turn)
    c, s = np.cos(hertz.orientation_rad), np.sin(hertz.orientation_rad)
    return first * s + second * c, first * c - second * s


def _draw_lobes(ax: Axes, load: JudgedLoad, fields: PressureFields) -> None:
    lobes = load.comparison.patch.lobes
    if len(lobes) < 2:
        return
    for number, lobe in enumerate(lobes, start=1):
        column = int(np.argmin(np.abs(fields.grid.s_mm - lobe.y_mm)))
        x = float(fields.grid.x_mm[int(np.argmax(fields.fe[:, column]))])
        around = {"fc": "white", "ec": "black", "boxstyle": "circle,pad=0.15", "lw": 0.8}
        ax.text(lobe.y_mm, x, str(number), ha="center", va="center", fontsize=8, weight="bold", bbox=around)
