"""Style of all pictures and pages: colours, sizes, files, and HTML pages that need no other files.

Colours are from Okabe and Ito (2008), so that verdicts differ in lightness as well as in hue. The meaning of a colour
is also given by a mark, a dash or a word.
"""

from __future__ import annotations

import base64
import threading
from functools import cache
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from fecontact.errors import InputError
from fecontact.files import write_atomically
from fecontact.outputs.parts import Parts, Picture

if TYPE_CHECKING:
    from jinja2 import Template
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend
    from PIL.Image import Image


DPI = 130
# Compression level of at most 9: a higher level takes up to five times as long and saves only some per cent.
_COMPRESSED = 4
# A logarithmic axis has numbers between the decades if its end is less than this many times its beginning.
_NARROW = 300.0


class Colour:
    """Colours with a fixed meaning in all pictures."""

    FE, HERTZ = "#0072b2", "#d55e00"
    # lines of the profiles
    LINES: ClassVar = {"rail": "0.15", "wheel": "#0072b2"}
    # their curvature junctions, and measured points
    RAIL_JUNCTION, WHEEL_JUNCTION, POINTS = "0.35", "0.65", "#d55e00"
    # an expected patch
    EXPECTED = "#f0e442"
    # points of a file that were left out or are doubtful
    PROBLEM = "#cc79a7"


BETWEEN = "between"
"""In place of a verdict, between two loads with different verdicts if no load between them was solved."""
ANSWERS = {"HOLDS": "#56b4e9", "UNRESOLVED": "#f0e442", "FAILS": "#d55e00", "failed": "#c8c8c8", BETWEEN: "#ffffff"}
"""Colours of the verdicts, of cases that could not be solved, and of loads that were not solved."""
ANSWER_WORDS = {
    "HOLDS": "Hertz holds",
    "UNRESOLVED": "unresolved",
    "FAILS": "Hertz fails",
    "failed": "could not be solved",
    BETWEEN: "not solved: between two verdicts",
}
SERIES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000", "#999999")
"""Colours of series; marks differ as well."""
MARKS = "os^DvP*X"
SIDES = "gauge side ←            → field side"


def blank_figure(width: float, height: float) -> Figure:
    """An empty figure of a size in inches."""
    # not by pyplot: a study draws hundreds of figures, and pyplot would keep them all
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=DPI)
    figure.set_layout_engine("constrained", w_pad=0.12, h_pad=0.12)
    return figure


def series_style(number: int) -> dict[str, Any]:
    """Colour and mark of a series by its number."""
    return {"color": SERIES[number % len(SERIES)], "marker": MARKS[number % len(MARKS)]}


def finish(*axes: Axes) -> None:
    """Give axes the grid of all pictures."""
    for ax in axes:
        ax.grid(alpha=0.3)


def legend_beside(ax: Axes, **more: Any) -> Legend:
    """A legend on the right of axes, where it hides nothing."""
    return ax.legend(fontsize=9, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, **more)


def plain_log(ax: Axes, which: str = "xy") -> None:
    """Make axes logarithmic, with numbers such as 0.5 and 20 instead of powers; also between decades if narrow."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    for name in which:
        ax.set(**{f"{name}scale": "log"})
        axis = ax.xaxis if name == "x" else ax.yaxis
        low, high = sorted(axis.get_view_interval())
        narrow = high < _NARROW * low
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if narrow else (1.0,), numticks=12 if narrow else 5))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write a figure as PNG and as SVG with equal names, from the path of either; files are reproducible.

    Raises
    ------
    InputError
        If the path has another ending.
    """
    path = Path(path)
    if path.suffix.lower() not in (".png", ".svg"):
        raise InputError(f"picture {path}: allowed: a name that ends in .png or .svg; both are written")
    as_png, as_svg = (path if path.suffix.lower() == own else path.with_suffix(own) for own in (".png", ".svg"))
    svg = svg_of(figure)
    write_atomically(as_svg, lambda temporary: temporary.write_bytes(svg))
    save_image(figure, as_png)
    return path


def save_image(figure: Figure, path: Path) -> Path:
    """Write a figure as PNG alone, in half of the time."""
    image = image_of(figure)
    write_atomically(path, lambda temporary: image.save(temporary, "PNG", compress_level=_COMPRESSED, dpi=(DPI, DPI)))
    return path


# Settings of matplotlib are global: threads draw one after the other.
_ONE_DRAWING = threading.Lock()


def svg_of(figure: Figure) -> bytes:
    """A figure as SVG."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    content = BytesIO()
    # no version and no date in the files: two runs may differ in the picture only
    unsaid = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    with _ONE_DRAWING:
        _settle(figure)
        with rc_context(
            {"svg.hashsalt": "fecontact", "figure.autolayout": False, "figure.constrained_layout.use": False}
        ):
            FigureCanvasSVG(figure).print_figure(content, dpi=DPI, format="svg", metadata=unsaid)
    return content.getvalue()


def image_of(figure: Figure) -> Image:
    """A figure as pixels, without the alpha channel of matplotlib's files, which is not seen and takes time."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL.Image import fromarray

    # letters that are fitted to pixels look no better, and take a sixth of the time
    with _ONE_DRAWING, rc_context({"text.hinting": "none"}):
        _settle(figure)
        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
    return fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")


def _settle(figure: Figure) -> None:
    """Lay out a figure once and keep the layout, whose last digits differ with each run and get into an SVG."""
    engine = figure.get_layout_engine()
    if engine is None:
        return
    engine.execute(figure)
    # None and not "none": with an engine that does nothing every file would be drawn twice
    figure.set_layout_engine(None)
    for ax in figure.axes:
        x, y, width, height = (round(edge, 6) for edge in ax.get_position(original=True).bounds)
        ax.set_position((x, y, width, height))


# --- HTML pages that need no other files, for screens of any width and for paper.

_FILES = files("fecontact.outputs")
_WEBP_BEGINS = b"RIFF"
_ANSWERS = ("HOLDS", "UNRESOLVED", "FAILS")


def page(title: str, parts: Parts) -> str:
    """A document as a whole page, which is also well-formed XML."""
    style, script = ((_FILES / name).read_text("utf-8") for name in ("style.css", "page.js"))
    return _template().render(
        title=title, parts=list(parts), style=style, script=script, answers=_ANSWERS, picture=_picture
    )


@cache
def _template() -> Template:
    from jinja2 import Environment

    return Environment(autoescape=True).from_string((_FILES / "page.html").read_text("utf-8"))


def _picture(of: Picture) -> str:
    """The source of a picture as part of the page; empty if the picture's file does not exist."""
    content = of.content
    if isinstance(content, Path):
        if not content.is_file():
            return ""
        if content.suffix != ".svg":
            from PIL.Image import open as open_image

            with open_image(content) as image:
                return _source("image/webp", webp_of(image, of.width))
        content = content.read_bytes()
    if isinstance(content, bytes):
        return _source("image/webp" if content.startswith(_WEBP_BEGINS) else "image/svg+xml", content)
    return _source("image/webp", webp_of(content, of.width))


def webp_of(image: Image, width: int) -> bytes:
    """An image of limited width as WEBP, a fifth of the size of a PNG."""
    from PIL.Image import Resampling

    shown = image.convert("RGB")
    if shown.width > width:
        shown = shown.resize((width, round(shown.height * width / shown.width)), Resampling.BICUBIC)
    content = BytesIO()
    # a file that is 3 % smaller would take twice as long
    shown.save(content, "WEBP", quality=82, method=2)
    return content.getvalue()


def _source(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"
