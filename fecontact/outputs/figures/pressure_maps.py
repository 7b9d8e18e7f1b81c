"""Maps of contact pressures over the rail's surface, with the outlines of both patches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact.grid import ContactGrid
from fecontact.contact.patch import signed_square
from fecontact.contact_theories.approximation import mean_pressure
from fecontact.contact_theories.hertz import HertzContact
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.lobes import LobeJudgement
from fecontact.outputs.style import (
    SIDES,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# Labels of axes over the rail's surface.
ACROSS, ROLLING = f"s across in mm\n{SIDES}", "x (rolling) in mm"
# Colour maps of pressures (lighter where higher) and of signed differences.
_PRESSURE, _DIFFERENCE = "viridis", "RdBu_r"
# A map has room for only three numbers across if it is this many times as tall as wide.
_NARROW = 2.2
# Colours of a pressure map and of a difference map without pressure.
_NO_PRESSURE, _NO_DIFFERENCE = "#440154", "#f7f6f6"


@dataclass(frozen=True, kw_only=True, eq=False)
class PressureFields:
    """Both pressures (nx, ns) in MPa on the nodes of the whole contact, far enough to hold Hertz's ellipse.

    `fe` are bodies that yield if there is a yield stress; `elastic` then are elastic ones, else None.
    """

    grid: ContactGrid
    fe: Floats
    hertz: Floats
    ellipse: HertzContact
    elastic: Floats | None = None

    @classmethod
    def of(cls, load: JudgedLoad) -> PressureFields:
        """The fields of a judged load."""
        hertz, yielded = load.hertz, load.level.yielded
        extents = hertz.extent_x_mm, hertz.extent_y_mm
        elastic = load.fe.even().pressure.covering(*extents)
        fe = elastic if yielded is None else yielded.fe.even().pressure.covering(*extents)
        return cls(
            grid=fe.grid,
            fe=fe.values,
            hertz=mean_pressure(fe.grid, hertz),
            ellipse=hertz,
            elastic=None if yielded is None else elastic.at(fe.grid).values,
        )

    @property
    def peak(self) -> tuple[int, int]:
        """Indices of the highest finite-element pressure."""
        i, j = np.unravel_index(int(np.argmax(self.fe)), self.fe.shape)
        return int(i), int(j)

    def limits_mm(self, *, across: bool) -> tuple[float, float]:
        """Range along s (`across`) or x that shows both patches with some room, less than the whole grid."""
        line = self.grid.s_mm if across else self.grid.x_mm
        pressed = line[np.flatnonzero(np.any(self.fe > 0.0, axis=0 if across else 1))]
        reach = 0.5 * (self.ellipse.extent_y_mm if across else self.ellipse.extent_x_mm)
        low, high = min(float(pressed[0]), -reach), max(float(pressed[-1]), reach)
        room = 0.12 * (high - low)
        return low - room, high + room


def draw_pressure(ax: Axes, load: JudgedLoad, kind: str, fields: PressureFields, *, scale: bool = True) -> None:
    """Draw a map of `finite elements`, `Hertz`, or `Hertz minus finite elements` over the rail's surface into axes.

    The outlines of both patches are drawn on it, with a cross at the first touch point, and the lobes
    of the finite elements are numbered above their centres of pressure, the one with the largest force first. With
    `scale` the colours have theirs beside the map.
    """
    is_difference = kind == "Hertz minus finite elements"
    values = {"finite elements": fields.fe, "Hertz": fields.hertz}.get(kind, fields.hertz - fields.fe)
    top = (float(np.abs(values).max()) or 1.0) if is_difference else float(max(fields.fe.max(), fields.hertz.max()))
    ground = _NO_DIFFERENCE if is_difference else _NO_PRESSURE
    image = ax.imshow(
        values,
        origin="lower",
        interpolation="bilinear",
        cmap=_DIFFERENCE if is_difference else _PRESSURE,
        vmin=-top if is_difference else 0.0,
        vmax=top,
        extent=(*_cell_edges(fields.grid.s_mm), *_cell_edges(fields.grid.x_mm)),
    )
    if is_difference:
        # in grey both ends of the colour map are dark: lines are dashed if the finite elements' pressure is larger
        levels = top * np.array([-0.75, -0.5, -0.25, 0.25, 0.5, 0.75])
        ax.contour(fields.grid.s_mm, fields.grid.x_mm, values, levels=levels, colors="0.25", linewidths=0.6)
    _draw_outlines(ax, fields)
    _draw_lobes(ax, load)
    for colour, width in (("black", 3.0), ("white", 1.4)):
        ax.plot(0.0, 0.0, "+", color=colour, ms=9, mew=width, label="_first touch point")
    # with a given place matplotlib does not look for one in each drawing
    ax.set_title(
        f"{kind}, bodies that yield" if kind == "finite elements" and fields.elastic is not None else kind, y=1.0
    )
    ax.set(xlabel=ACROSS, ylabel=ROLLING, aspect="equal", facecolor=ground)
    (s_low, s_high), (x_low, x_high) = fields.limits_mm(across=True), fields.limits_mm(across=False)
    ax.set(xlim=(s_low, s_high), ylim=(x_low, x_high))
    if x_high - x_low > _NARROW * (s_high - s_low):
        # more numbers would overlap
        ax.locator_params(axis="x", nbins=3)
    if scale:
        bar = ax.figure.colorbar(image, cax=ax.inset_axes((1.03, 0.0, 0.045, 1.0)))
        bar.set_label("difference in MPa" if is_difference else "pressure in MPa")


def _cell_edges(nodes_mm: Floats) -> tuple[float, float]:
    """Outer ends of the cells of the first and the last of equally spaced nodes."""
    half = 0.5 * float(nodes_mm[1] - nodes_mm[0])
    return float(nodes_mm[0]) - half, float(nodes_mm[-1]) + half


def _draw_outlines(ax: Axes, fields: PressureFields) -> None:
    """Edges of both patches, white on black so that they are seen on every colour; the ellipse is dashed."""
    (hx, hs), grid = fields.grid.steps_mm, fields.grid
    x = np.concatenate([[grid.x_mm[0] - hx], grid.x_mm, [grid.x_mm[-1] + hx]])
    s = np.concatenate([[grid.s_mm[0] - hs], grid.s_mm, [grid.s_mm[-1] + hs]])
    square = signed_square(fields.fe)
    ellipse = ellipse_outline(fields.ellipse)
    # drawn twice: with path effects SVG files would differ from one drawing to the next
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


def drawn_lobes(load: JudgedLoad) -> Sequence[LobeJudgement]:
    """Lobes of a contact, none of a single one."""
    return load.lobes if len(load.lobes) > 1 else ()


def _draw_lobes(ax: Axes, load: JudgedLoad) -> None:
    for number, lobe in enumerate(drawn_lobes(load), start=1):
        x, s = lobe.centre_mm
        around = {"fc": "white", "ec": "black", "boxstyle": "circle,pad=0.15", "lw": 0.8}
        # above the centre: the touch point may be there
        ax.annotate(
            str(number),
            (s, x),
            xytext=(0.0, 10.0),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=8,
            weight="bold",
            bbox=around,
        )
