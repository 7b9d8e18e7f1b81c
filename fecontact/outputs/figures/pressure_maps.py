"""Maps of contact pressures over the rail's surface, with the outlines of both patches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact.grid import ContactGrid
from fecontact.contact.patch import build_signed_square
from fecontact.contact_theories.approximation import average_pressure_over_cells
from fecontact.contact_theories.hertz import HertzContact
from fecontact.judging.judged_load import JudgedLoad
from fecontact.outputs.style import SIDE_LABELS, line_width
from fecontact.outputs.tables import TableRecord

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.image import AxesImage


# Labels of axes over the rail's surface.
ACROSS_LABEL, ROLLING_LABEL = f"s across in mm\n{SIDE_LABELS}", "x (rolling) in mm"
# Colour maps of pressures (lighter for higher pressures) and of signed differences.
_PRESSURE_COLOURS, _DIFFERENCE_COLOURS = "viridis", "RdBu_r"
# A map with a larger ratio of height to width has room for only three numbers across.
_NARROW_MAP_RATIO = 2.2
# Largest number of intervals between the numbers of a colour bar.
_BAR_INTERVALS = 6
# Background colours of a pressure map and of a difference map: the colours of zero.
_ZERO_PRESSURE_COLOUR, _ZERO_DIFFERENCE_COLOUR = "#440154", "#f7f6f6"


@dataclass(frozen=True, kw_only=True, eq=False)
class PressureFields:
    """Pressures in MPa on the nodes of a contact.

    The grid (nx, ns) holds the whole contact and Hertz's ellipse.

    Attributes
    ----------
    grid
        Grid of the nodes.
    fe
        Pressure (nx, ns) of the finite elements; of bodies that yield if there is a yield stress.
    hertz
        Mean Hertz pressure (nx, ns) over the cells of the nodes.
    ellipse
        Hertz's ellipse, at a junction of curvatures with the curvature of the side that decides the verdict.
    elastic
        Pressure (nx, ns) of elastic bodies if there is a yield stress, or else None.
    """

    grid: ContactGrid
    fe: Floats
    hertz: Floats
    ellipse: HertzContact
    elastic: Floats | None = None

    @classmethod
    def of(cls, load: JudgedLoad) -> PressureFields:
        """Pressure fields of a judged load.

        Parameters
        ----------
        load
            Judged load.

        Returns
        -------
        PressureFields
            The fields on a common grid.
        """
        hertz, yielded = load.deciding_ellipse, load.level.yielded
        extents = hertz.extent_x_mm, hertz.extent_y_mm
        elastic = load.fe.even().pressure.covering(*extents)
        fe = elastic if yielded is None else yielded.fe.even().pressure.covering(*extents)
        return cls(
            grid=fe.grid,
            fe=fe.values,
            hertz=average_pressure_over_cells(fe.grid, hertz),
            ellipse=hertz,
            elastic=None if yielded is None else elastic.at(fe.grid).values,
        )

    @property
    def peak(self) -> tuple[int, int]:
        """Indices of the highest finite-element pressure."""
        i, j = np.unravel_index(int(np.argmax(self.fe)), self.fe.shape)
        return int(i), int(j)

    def limits_mm(self, *, across: bool) -> tuple[float, float]:
        """Range that shows both patches with some margin; it is smaller than the whole grid.

        Parameters
        ----------
        across
            Whether the range is along s; along x if not.

        Returns
        -------
        tuple of float
            Lower and upper end in mm.
        """
        coordinates_mm = self.grid.s_mm if across else self.grid.x_mm
        pressed_mm = coordinates_mm[np.flatnonzero(np.any(self.fe > 0.0, axis=0 if across else 1))]
        reach = 0.5 * (self.ellipse.extent_y_mm if across else self.ellipse.extent_x_mm)
        low, high = min(float(pressed_mm[0]), -reach), max(float(pressed_mm[-1]), reach)
        margin = 0.12 * (high - low)
        return low - margin, high + margin


def draw_pressure(
    ax: Axes,
    kind: str,
    fields: PressureFields,
    lobes: Sequence[TableRecord],
    *,
    scale: bool = True,
    image: AxesImage | None = None,
) -> None:
    """Draw a pressure map over the rail's surface into axes.

    The map has the outlines of both patches and a cross at the first contact point. The lobes of the finite elements
    are numbered above their centres of pressure, the lobe with the largest force first.

    Parameters
    ----------
    ax
        Axes to draw into.
    kind
        `finite elements`, `Hertz`, or `Hertz minus finite elements`.
    fields
        Pressure fields of the load.
    lobes
        Records of the lobes of the load; empty for a single lobe.
    scale
        Whether a colour scale is drawn beside the map.
    image
        Image of these axes with its colour scale, from another map of the same kind. It gets the new pressures; None
        makes a new image.
    """
    is_difference = kind == "Hertz minus finite elements"
    values = {"finite elements": fields.fe, "Hertz": fields.hertz}.get(kind, fields.hertz - fields.fe)
    largest = (float(np.abs(values).max()) or 1.0) if is_difference else float(max(fields.fe.max(), fields.hertz.max()))
    background = _ZERO_DIFFERENCE_COLOUR if is_difference else _ZERO_PRESSURE_COLOUR
    limits = -largest if is_difference else 0.0, largest
    extent = *_cell_edges(fields.grid.s_mm), *_cell_edges(fields.grid.x_mm)
    needs_scale = scale and image is None
    if image is None:
        colours = _DIFFERENCE_COLOURS if is_difference else _PRESSURE_COLOURS
        image = ax.imshow(values, origin="lower", interpolation="bilinear", cmap=colours, clim=limits, extent=extent)
    else:
        image.set(data=values, clim=limits, extent=extent)
    if is_difference:
        # in grey both ends of the colour map are dark, so lines are dashed if the finite elements' pressure is larger
        levels = largest * np.array([-0.75, -0.5, -0.25, 0.25, 0.5, 0.75])
        ax.contour(fields.grid.s_mm, fields.grid.x_mm, values, levels=levels, colors="0.25", linewidths=line_width(0.6))
    _draw_outlines(ax, fields)
    _draw_lobes(ax, lobes)
    for colour, width in (("black", 3.0), ("white", 1.4)):
        ax.plot(0.0, 0.0, "+", color=colour, ms=9, mew=line_width(width), label="_first contact point")
    # with a given place matplotlib does not search for a place in each drawing
    ax.set_title(
        f"{kind}, bodies that yield" if kind == "finite elements" and fields.elastic is not None else kind, y=1.0
    )
    ax.set(xlabel=ACROSS_LABEL, ylabel=ROLLING_LABEL, aspect="equal", facecolor=background)
    (s_low, s_high), (x_low, x_high) = fields.limits_mm(across=True), fields.limits_mm(across=False)
    ax.set(xlim=(s_low, s_high), ylim=(x_low, x_high))
    if x_high - x_low > _NARROW_MAP_RATIO * (s_high - s_low):
        # more numbers would overlap
        ax.locator_params(axis="x", nbins=3)
    if needs_scale:
        from matplotlib.ticker import MaxNLocator

        bar = ax.figure.colorbar(image, cax=ax.inset_axes((1.03, 0.0, 0.045, 1.0)), ticks=MaxNLocator(_BAR_INTERVALS))
        bar.set_label("difference in MPa" if is_difference else "pressure in MPa")


def _cell_edges(nodes_mm: Floats) -> tuple[float, float]:
    """Outer ends of the first and last cells of equally spaced nodes, in mm."""
    half = 0.5 * float(nodes_mm[1] - nodes_mm[0])
    return float(nodes_mm[0]) - half, float(nodes_mm[-1]) + half


def _draw_outlines(ax: Axes, fields: PressureFields) -> None:
    """Draw the edges of both patches, white on black for contrast with every colour.

    The ellipse is dashed.
    """
    (hx, hs), grid = fields.grid.steps_mm, fields.grid
    x = np.concatenate([[grid.x_mm[0] - hx], grid.x_mm, [grid.x_mm[-1] + hx]])
    s = np.concatenate([[grid.s_mm[0] - hs], grid.s_mm, [grid.s_mm[-1] + hs]])
    square = build_signed_square(fields.fe)
    ellipse = ellipse_outline(fields.ellipse)
    # drawn twice, since with path effects SVG files would differ from one drawing to the next
    for colour, width, label_prefix in (("black", 2.8, "_"), ("white", 1.4, "")):
        ax.plot(
            *ellipse,
            color=colour,
            lw=line_width(width),
            ls="-" if label_prefix else (0, (4, 2)),
            label=f"{label_prefix}Hertz",
        )
        edge = ax.contour(s, x, square, levels=[0.0], colors=colour, linewidths=line_width(width))
        edge.set(label=f"{label_prefix}finite elements")


def ellipse_outline(hertz: HertzContact) -> tuple[Floats, Floats]:
    """Edge of Hertz's ellipse as a closed line.

    Parameters
    ----------
    hertz
        Hertz's ellipse.

    Returns
    -------
    tuple of Floats
        Coordinates s (n,) and x (n,) in mm, relative to the centre.
    """
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    first, second = hertz.a_mm * np.cos(turn), hertz.b_mm * np.sin(turn)
    c, s = np.cos(hertz.orientation_rad), np.sin(hertz.orientation_rad)
    return first * s + second * c, first * c - second * s


def _draw_lobes(ax: Axes, lobes: Sequence[TableRecord]) -> None:
    """Draw the numbers of the lobes above their centres of pressure.

    The horizontal axis is s and the vertical axis is x, in mm; numbers start at 1 and follow the order of the report.
    """
    for number, lobe in enumerate(lobes, start=1):
        x, s = lobe["centre_mm"]
        box = {"fc": "white", "ec": "black", "boxstyle": "circle,pad=0.15", "lw": 0.8}
        # above the centre, since the contact point may be at the centre
        ax.annotate(
            str(number),
            (s, x),
            xytext=(0.0, 10.0),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize="small",
            weight="bold",
            bbox=box,
        )
