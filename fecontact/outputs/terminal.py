"""Output on the terminal: tables and lines in order, and pages of the guide."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from fecontact.inputs.texts import escape_invisible, quote_path

if TYPE_CHECKING:
    from rich.console import Console, JustifyMethod
    from rich.table import Table as RichTable

    from fecontact.outputs.parts import Part
    from fecontact.outputs.tables import Table


OutputLines: TypeAlias = "Iterator[Table | str]"
"""Tables and lines in the order in which they are printed."""

# Width of a table that goes to a file or a pipe. It is not limited, so that nothing is left out or broken.
_UNLIMITED_WIDTH = 10_000


def print_answer(record: object, lines: Callable[[Any], Iterable[Part]], *, json: bool, **files: Path | None) -> None:
    """Print a record as lines or as JSON, then the written files.

    Parameters
    ----------
    record
        Record to print.
    lines
        Function from the record to parts of a document.
    json
        Whether to print JSON and nothing else on standard output.
    files
        Written files by kind; None for a file that was not written.
    """
    from fecontact.files import format_json

    if json:
        print(format_json(record))
    else:
        print_parts(lines(record))
    for file_kind, path in files.items():
        if path is not None:
            print(f"{file_kind}: {quote_path(path)}", file=sys.stderr if json else sys.stdout)


def print_parts(parts: Iterable[Part], console: Console | None = None, *, long: bool = False) -> None:
    """Print the parts of a document on standard output or on a console.

    Pictures and other parts without words are left out.

    Parameters
    ----------
    parts
        Parts of a document.
    console
        Console; None for standard output.
    long
        Whether details are printed.
    """
    from fecontact.outputs.parts import Details, Heading, Items, Lead, Picture, Terms

    console = console or _standard_console()
    for part in parts:
        match part:
            case Details():
                print_parts(part.parts if long else (), console, long=long)
            case Items():
                print_parts(note_lines(part.lines), console)
            case Heading():
                _print_line(console, part.text)
            case Lead():
                _print_line(console, "; ".join(filter(None, (part.text, part.subject))))
            case Terms() | Picture() | "":
                pass
            case str():
                _print_line(console, part)
            case _ if part.rows:
                _print_table(console, part)


def note_lines(texts: Iterable[str]) -> Iterator[str]:
    """Notes as lines for the terminal."""
    return (f"note: {text}" for text in texts)


def _standard_console() -> Console:
    """Console for standard output, as wide as the terminal.

    A file or a pipe has an unlimited width, and no colours unless they are forced.
    """
    from rich.console import Console

    if sys.stdout.isatty():
        return Console(highlight=False)
    return Console(width=_UNLIMITED_WIDTH, highlight=False)


def _print_line(console: Console, text: str) -> None:
    # not as markup, since profile names and notes may have brackets
    console.print(escape_invisible(text), markup=False, soft_wrap=not console.is_terminal)


def _print_table(console: Console, table: Table) -> None:
    """Print the first form of a table that has room, or the last form.

    Columns that are left out are named in a line below the table.
    """
    from rich.measure import Measurement

    unbounded = console.options.update(max_width=_UNLIMITED_WIDTH)
    for narrower_table, omitted in table.narrower_forms():
        rendered, omitted_names = _render_table(console, narrower_table), omitted
        if Measurement.get(console, unbounded, rendered).maximum - _wrapping_gain(narrower_table) <= console.width:
            break
    console.print(rendered)
    if omitted_names:
        _print_line(console, f"no room for: {', '.join(omitted_names)}")


def _wrapping_gain(table: Table) -> int:
    """Characters saved in the width of a table if texts take several lines."""
    wrapped_columns = [
        [row.cells[column_index] for row in table.rows]
        for column_index, column in enumerate(table.columns)
        if column.wraps
    ]
    return sum(
        max(map(len, texts)) - max((len(word) for text in texts for word in text.split()), default=0)
        for texts in wrapped_columns
        if texts
    )


def _render_table(console: Console, table: Table) -> RichTable:
    """Table for the terminal, with rules.

    Columns are closer together on a narrow terminal.
    """
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    rich_table = RichTable(
        title=Text(escape_invisible(table.title)) if table.title else None,
        title_justify="left",
        title_style="bold",
        box=box.SIMPLE_HEAD if console.is_terminal else None,
        # the box has a space between columns too
        padding=(0, 1) if not console.is_terminal or console.width >= table.roomy_width else (0, 1, 0, 0),
        pad_edge=False,
    )
    for column in table.columns:
        justify: JustifyMethod = "right" if column.kind == "number" else "left"
        rich_table.add_column(
            Text(escape_invisible(column.heading)), justify=justify, no_wrap=not column.wraps, overflow="fold"
        )
    for row in table.rows:
        # as text and not as markup, since names of profiles may have brackets
        rich_table.add_row(*(Text(escape_invisible(cell)) for cell in row.cells), style=_TONE_STYLES[row.tone])
    return rich_table


_TONE_STYLES = {"plain": "", "fails": "red", "open": "yellow", "dim": "dim"}


# --- The guide on the terminal: list of pages, and a single page.


def print_titles(titles: Mapping[str, str]) -> None:
    """Print the topics of the guide with the titles of their pages.

    Parameters
    ----------
    titles
        Title by topic.
    """
    width = max(map(len, titles))
    for topic, title in titles.items():
        print(f"  {topic:{width}}  {title}")
    print("To read a page: fecontact guide TOPIC")


def print_page(text: str, without_links: Callable[[str], str]) -> None:
    """Print a page in Markdown.

    On a terminal the page is laid out and has no links. In a file or a pipe it is unchanged.

    Parameters
    ----------
    text
        Text of the page in Markdown.
    without_links
        Function that removes the links of a text.
    """
    from rich.console import Console

    console = Console()
    if not console.is_terminal:
        print(text, end="")
        return
    from rich.markdown import Markdown

    console.print(Markdown(without_links(text), hyperlinks=False))
