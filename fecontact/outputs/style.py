"""Style of all pictures and pages: colours, sizes, files and self-contained HTML pages.

Colours are from Okabe and Ito (2008), so that verdicts differ in lightness as well as in hue. A mark, a dash or a word
gives the meaning of each colour too.
"""

from __future__ import annotations

import base64
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from fecontact.files import require_ending, write_atomically
from fecontact.inputs.texts import escape_invisible
from fecontact.outputs.parts import Parts, Picture

if TYPE_CHECKING:
    from jinja2 import Template
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Tick
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend
    from matplotlib.text import Text
    from matplotlib.ticker import Formatter
    from PIL.Image import Image


DPI = 130
MM_PER_INCH = 25.4
PICTURE_ENDINGS = (".png", ".svg")
"""Endings of a picture; both files are written."""
# Compression level of PNG, of at most 9. Level 4 takes a fifth longer and saves 2 %, level 6 takes 1.5 times as long
# and saves 5 %.
_PNG_COMPRESSION = 3
# A logarithmic axis has numbers between the decades if the ratio of its end to its beginning is below this.
_NARROW_RANGE_RATIO = 300.0


class Colour:
    """Colours with a fixed meaning in all pictures."""

    FE, HERTZ = "#0072b2", "#d55e00"
    # profiles
    LINES: ClassVar = {"rail": "0.15", "wheel": "#0072b2"}
    # curvature junctions of the profiles, and measured points
    RAIL_JUNCTION, WHEEL_JUNCTION, POINTS = "0.35", "0.65", "#d55e00"
    # an expected patch
    EXPECTED = "#f0e442"
    # points of a file that were left out or are doubtful
    PROBLEM = "#cc79a7"


BETWEEN_VERDICTS = "between"
"""Replaces a verdict between two loads with different verdicts if no load between them was solved."""
ANSWER_COLOURS = {
    "HOLDS": "#56b4e9",
    "UNRESOLVED": "#f0e442",
    "FAILS": "#d55e00",
    "failed": "#c8c8c8",
    BETWEEN_VERDICTS: "#ffffff",
}
"""Colours of the verdicts, of cases that could not be solved, and of loads that were not solved."""
ANSWER_WORDS = {
    "HOLDS": "Hertz holds",
    "UNRESOLVED": "unresolved",
    "FAILS": "Hertz fails",
    "failed": "could not be solved",
    BETWEEN_VERDICTS: "not solved: between two verdicts",
}
SERIES_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000", "#999999")
"""Colours of series. Series have different marks as well."""
# one mark more than colours, so that a ninth series, such as a measure of a user, differs from the first
SERIES_MARKS = "os^DvP*Xp"
SIDE_LABELS = "gauge side ←            → field side"


def blank_figure(width: float, height: float) -> Figure:
    """Make an empty figure.

    Parameters
    ----------
    width, height
        Size in inches.

    Returns
    -------
    Figure
        Figure with a constrained layout.
    """
    # without pyplot: a study draws hundreds of figures, and pyplot would keep all of them in memory
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=DPI)
    figure.set_layout_engine("constrained", w_pad=0.12, h_pad=0.12)
    return figure


def line_width(points: float) -> float:
    """Width of a line that follows matplotlib's width of lines.

    Parameters
    ----------
    points
        Width in points at matplotlib's default of 1.5 (`lines.linewidth`).

    Returns
    -------
    float
        Width in points.
    """
    from matplotlib import rcParams, rcParamsDefault

    return points * float(rcParams["lines.linewidth"]) / float(rcParamsDefault["lines.linewidth"])


def series_style(number: int) -> dict[str, Any]:
    """Colour and mark of a series by its number."""
    return {"color": SERIES_COLOURS[number % len(SERIES_COLOURS)], "marker": SERIES_MARKS[number % len(SERIES_MARKS)]}


def add_grid(*axes: Axes) -> None:
    """Give axes the grid of all pictures.

    Parameters
    ----------
    *axes
        Axes that get the grid.
    """
    for ax in axes:
        ax.grid(alpha=0.3)


def empty_axes(ax: Axes) -> None:
    """Remove lines, areas, texts and the legend from axes; images, ticks and labels stay.

    Parameters
    ----------
    ax
        Axes that are drawn again. Their limits follow the data again.
    """
    for artist in (*ax.lines, *ax.collections, *ax.patches, *ax.texts):
        artist.remove()
    # bars are patches, which are also in a container for the legend
    ax.containers.clear()
    if (legend := ax.get_legend()) is not None:
        legend.remove()
    ax.relim()
    ax.autoscale()


def add_legend_beside(ax: Axes, **options: Any) -> Legend:
    """Add a legend on the right of axes, where it hides nothing."""
    return ax.legend(fontsize="small", loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, **options)


def set_plain_log_scale(ax: Axes, axis_names: str = "xy") -> None:
    """Make axes logarithmic, with numbers such as 0.5 and 20 instead of powers.

    A narrow axis has numbers between the decades too.

    Parameters
    ----------
    ax
        Axes to change.
    axis_names
        Letters of the axes, `x`, `y` or both.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    for axis_name in axis_names:
        ax.set(**{f"{axis_name}scale": "log"})
        axis = ax.xaxis if axis_name == "x" else ax.yaxis
        low, high = sorted(axis.get_view_interval())
        is_narrow = high < _NARROW_RANGE_RATIO * low
        axis.set_major_locator(
            LogLocator(subs=(1.0, 2.0, 5.0) if is_narrow else (1.0,), numticks=12 if is_narrow else 5)
        )
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write a figure as PNG and as SVG with equal names.

    The files are reproducible: equal figures give equal files.

    Parameters
    ----------
    figure
        Figure to write.
    path
        Path of either file.

    Returns
    -------
    Path
        The given path.

    Raises
    ------
    InputError
        If the path has another ending.
    """
    path = Path(path)
    require_ending(path, PICTURE_ENDINGS, "picture")
    as_png, as_svg = (path if path.suffix.lower() == suffix else path.with_suffix(suffix) for suffix in PICTURE_ENDINGS)
    svg = render_svg(figure)
    write_atomically(as_svg, lambda temporary: temporary.write_bytes(svg))
    save_image(figure, as_png)
    return path


def save_image(figure: Figure, path: Path) -> Path:
    """Write a figure as PNG alone, in half of the time of both files.

    Parameters
    ----------
    figure
        Figure to write; its layout is fixed by this.
    path
        File to write.

    Returns
    -------
    Path
        The written file.
    """
    image = render_image(figure)
    write_atomically(
        path, lambda temporary: image.save(temporary, "PNG", compress_level=_PNG_COMPRESSION, dpi=(DPI, DPI))
    )
    return path


# Settings of matplotlib are global, so threads draw one after the other.
_DRAWING_LOCK = threading.Lock()


def render_svg(figure: Figure) -> bytes:
    """Render a figure as SVG.

    Parameters
    ----------
    figure
        Figure to render; its layout is fixed by this.

    Returns
    -------
    bytes
        Content of an SVG file.
    """
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    content = BytesIO()
    # the files have no version and no date, so that two runs differ only if the picture differs
    no_metadata = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    with _DRAWING_LOCK:
        _fix_layout(figure)
        with rc_context(
            {"svg.hashsalt": "fecontact", "figure.autolayout": False, "figure.constrained_layout.use": False}
        ):
            FigureCanvasSVG(figure).print_figure(content, dpi=DPI, format="svg", metadata=no_metadata)
    return content.getvalue()


def render_image(figure: Figure) -> Image:
    """Render a figure as pixels.

    The image has no alpha channel: matplotlib's files have one, but it is invisible and takes time.

    Parameters
    ----------
    figure
        Figure to render; its layout is fixed by this.

    Returns
    -------
    Image
        Image in the mode RGB.
    """
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL.Image import fromarray

    # letters fitted to pixels do not look better, and take a sixth of the time
    with _DRAWING_LOCK, rc_context({"text.hinting": "none"}):
        _fix_layout(figure)
        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
    return fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")


def show_text_literally(artist: Artist) -> None:
    """Draw the texts of a figure or axes without mathematics and control characters.

    A text can have the name of a file or of a column, in which `$` is a letter like others. Numbers of axes stay as
    their formatters write them.

    Parameters
    ----------
    artist
        Figure or axes whose texts are complete.
    """
    from matplotlib.axes import Axes
    from matplotlib.text import Text

    numbers: set[Any] = set()
    for ax in artist.findobj(Axes):
        for axis in (ax.xaxis, ax.yaxis):
            # This makes the ticks that matplotlib would make only when it draws, and no texts yet.
            major_ticks = axis.get_major_ticks(len(axis.get_majorticklocs()))
            minor_ticks = axis.get_minor_ticks(len(axis.get_minorticklocs()))
            if not _escape_tick_labels(axis.get_major_formatter(), axis.set_major_formatter):
                numbers |= {axis.get_offset_text(), *_list_labels(major_ticks)}
            if not _escape_tick_labels(axis.get_minor_formatter(), axis.set_minor_formatter):
                numbers |= _list_labels(minor_ticks)
    for text in artist.findobj(Text):
        if not isinstance(text, Text) or text in numbers:
            continue
        text.set_parse_math(False)
        if (content := escape_invisible(text.get_text())) != text.get_text():
            text.set_text(content)


def _list_labels(ticks: Sequence[Tick]) -> set[Text]:
    return {label for tick in ticks for label in (tick.label1, tick.label2)}


def _escape_tick_labels(formatter: Formatter, set_formatter: Callable[[Formatter], object]) -> bool:
    """Escape control characters in labels of an axis that are given texts.

    Parameters
    ----------
    formatter
        Complete formatter. It writes the labels again whenever matplotlib draws.
    set_formatter
        Function that replaces the formatter of the axis.

    Returns
    -------
    bool
        Whether the labels are given texts; otherwise they are numbers, which stay as they are.
    """
    from matplotlib.category import StrCategoryFormatter
    from matplotlib.ticker import FixedFormatter, FuncFormatter

    if not isinstance(formatter, FixedFormatter | FuncFormatter | StrCategoryFormatter):
        return False
    # Files of two kinds are made from one figure, and axes can share a formatter.
    if not isinstance(getattr(formatter, "func", None), _EscapedLabels):
        escaped = FuncFormatter(_EscapedLabels(formatter))
        escaped.set_offset_string(formatter.get_offset())
        set_formatter(escaped)
    return True


@dataclass(frozen=True)
class _EscapedLabels:
    """Function that gives the labels of a formatter without control characters."""

    formatter: Formatter

    def __call__(self, value: float, position: int | None = None) -> str:
        return escape_invisible(self.formatter(value, position))


def _fix_layout(figure: Figure) -> None:
    """Lay out a figure once and fix the layout.

    Each run of the layout engine gives other last digits, which would get into an SVG.
    """
    show_text_literally(figure)
    engine = figure.get_layout_engine()
    if engine is None:
        return
    engine.execute(figure)
    # None and not "none": matplotlib draws every file twice if there is an engine, even if the engine does nothing
    figure.set_layout_engine(None)
    for ax in figure.axes:
        x, y, width, height = (round(edge, 6) for edge in ax.get_position(original=True).bounds)
        ax.set_position((x, y, width, height))


# --- Self-contained HTML pages, for screens of any width and for paper.

_FILES = files("fecontact.outputs")
_WEBP_SIGNATURE = b"RIFF"
_ANSWERS = ("HOLDS", "UNRESOLVED", "FAILS")


def render_page(title: str, parts: Parts) -> str:
    """Render a document as a complete HTML page, which is also well-formed XML.

    Parameters
    ----------
    title
        Title of the page.
    parts
        Parts of the document in order.

    Returns
    -------
    str
        Text of the page; it needs no other files.
    """
    style, script = ((_FILES / name).read_text("utf-8") for name in ("style.css", "page.js"))
    page = _page_template().render(
        title=title, parts=list(parts), style=style, script=script, answers=_ANSWERS, picture=_picture_source
    )
    # XML has no control characters, also not as references
    return escape_invisible(page)


@cache
def _page_template() -> Template:
    from jinja2 import Environment

    return Environment(autoescape=True).from_string((_FILES / "page.html").read_text("utf-8"))


def _picture_source(picture: Picture) -> str:
    """Data URI of a picture; empty if the picture's file does not exist.

    SVG stays SVG. Other files and images become WebP at the width of the picture in pixels.
    """
    content = picture.content
    if isinstance(content, Path):
        if not content.is_file():
            return ""
        if content.suffix != ".svg":
            from PIL.Image import open as open_image

            with open_image(content) as image:
                return _data_uri("image/webp", encode_webp(image, picture.width))
        content = content.read_bytes()
    if isinstance(content, bytes):
        return _data_uri("image/webp" if content.startswith(_WEBP_SIGNATURE) else "image/svg+xml", content)
    return _data_uri("image/webp", encode_webp(content, picture.width))


def encode_webp(image: Image, width: int) -> bytes:
    """Encode an image of limited width as WEBP.

    A WEBP has a fifth of the size of a PNG.

    Parameters
    ----------
    image
        Image of any mode.
    width
        Largest width in pixels; wider images are made smaller.

    Returns
    -------
    bytes
        Content of a WEBP file.
    """
    from PIL.Image import Resampling

    rgb_image = image.convert("RGB")
    if rgb_image.width > width:
        rgb_image = rgb_image.resize((width, round(rgb_image.height * width / rgb_image.width)), Resampling.BICUBIC)
    content = BytesIO()
    # another method gives files that are 3 % smaller and takes twice as long
    rgb_image.save(content, "WEBP", quality=82, method=2)
    return content.getvalue()


def _data_uri(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"
