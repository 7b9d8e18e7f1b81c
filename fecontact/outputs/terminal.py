"""Output on the terminal: tables and lines in order, and pages of the guide."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from rich.console import Console, JustifyMethod
    from rich.table import Table as RichTable

    from fecontact.outputs.parts import Part
    from fecontact.outputs.tables import Table


Lines: TypeAlias = "Iterator[Table | str]"
"""Tables and lines in the order in which they are printed."""

# Width of a table that goes to a file or a pipe: as wide as it is, so that nothing is left out or broken.
_PLAIN_WIDTH = 10_000


def answer(record: object, lines: Callable[[Any], Iterable[Part]], *, json: bool, **files: Path | None) -> None:
    """Print a record as lines, or as JSON and nothing else; then name the written files with their kinds."""
    from fecontact.files import json_text

    if json:
        print(json_text(record))
    else:
        show(lines(record))
    for what, path in files.items():
        if path is not None:
            print(f"{what}: {path}", file=sys.stderr if json else sys.stdout)


def show(parts: Iterable[Part], console: Console | None = None, *, long: bool = False) -> None:
    """Print the parts of a document on standard output, or on a console; details only with `long`.

    Pictures and other parts without words are left out.
    """
    from fecontact.outputs.parts import Details, Heading, Items, Lead, Picture, Terms

    console = console or _standard_console()
    for part in parts:
        match part:
            case Details():
                show(part.parts if long else (), console, long=long)
            case Items():
                show(notes(part.lines), console)
            case Heading() | Lead():
                _say(console, part.text)
            case Terms() | Picture() | "":
                pass
            case str():
                _say(console, part)
            case _ if part.rows:
                _print_table(console, part)


def notes(texts: Iterable[str]) -> Iterator[str]:
    """Notes beside the numbers, as lines."""
    return (f"note: {text}" for text in texts)


def _standard_console() -> Console:
    """Standard output: as wide as the terminal; elsewhere of any width, and without colours unless they are forced."""
    from rich.console import Console

    if sys.stdout.isatty():
        return Console(highlight=False)
    return Console(width=_PLAIN_WIDTH, highlight=False)


def _say(console: Console, text: str) -> None:
    # not as markup: profile names and notes may have brackets
    console.print(text, markup=False, soft_wrap=not console.is_terminal)


def _print_table(console: Console, table: Table) -> None:
    """Print the first form of a table that has room, or the last form, and name the columns that are left out."""
    from rich.measure import Measurement

    unbounded = console.options.update(max_width=_PLAIN_WIDTH)
    for narrower, without in table.narrower():
        shown, left_out = _rendered(console, narrower), without
        if Measurement.get(console, unbounded, shown).maximum - _slack(narrower) <= console.width:
            break
    console.print(shown)
    if left_out:
        _say(console, f"no room for: {', '.join(left_out)}")


def _slack(table: Table) -> int:
    """Characters by which a table becomes narrower if texts take several lines."""
    wrapped = [[row.cells[n] for row in table.rows] for n, column in enumerate(table.columns) if column.wraps]
    return sum(
        max(map(len, texts)) - max((len(word) for text in texts for word in text.split()), default=0)
        for texts in wrapped
        if texts
    )


def _rendered(console: Console, table: Table) -> RichTable:
    """A table for the terminal, with rules, and with less space between columns on a narrow terminal."""
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    made = RichTable(
        title=Text(table.title) if table.title else None,
        title_justify="left",
        title_style="bold",
        box=box.SIMPLE_HEAD if console.is_terminal else None,
        # the box has a space between columns as well
        padding=(0, 1) if not console.is_terminal or console.width >= table.roomy_width else (0, 1, 0, 0),
        pad_edge=False,
    )
    for column in table.columns:
        justify: JustifyMethod = "right" if column.kind == "number" else "left"
        made.add_column(column.heading, justify=justify, no_wrap=not column.wraps, overflow="fold")
    for row in table.rows:
        # as text and not as markup: names of profiles may have brackets
        made.add_row(*map(Text, row.cells), style=_STYLES[row.tone])
    return made


_STYLES = {"plain": "", "fails": "red", "open": "yellow", "dim": "dim"}


# --- The guide on the terminal: list of pages, and a single page.


def print_titles(titles: Mapping[str, str]) -> None:
    """Print the topics with the titles of their pages."""
    width = max(map(len, titles))
    for topic, title in titles.items():
        print(f"  {topic:{width}}  {title}")
    print("One of them: fecontact guide TOPIC")


def print_page(text: str, without_links: Callable[[str], str]) -> None:
    """Print a page in Markdown: laid out on a terminal, without its links, and unchanged into a file or a pipe."""
    from rich.console import Console

    console = Console()
    if not console.is_terminal:
        print(text, end="")
        return
    from rich.markdown import Markdown

    console.print(Markdown(without_links(text), hyperlinks=False))


def count(number: int, what: str) -> str:
    """A number and what it is of, which ends in s but for one."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
