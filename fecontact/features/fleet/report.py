"""The report of a fleet: the answer in a sentence, where Hertz holds, why not, how sure it is; page, pictures, CSV."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.contact_theories.registry import THEORIES
from fecontact.errors import FecontactError
from fecontact.features.fleet.answer import Answer
from fecontact.features.fleet.estimate import Share
from fecontact.features.fleet.sampling import HOLDS, OPEN, UNSOLVED, CaseOf
from fecontact.files import write_text
from fecontact.outputs.case_words import SHIFT
from fecontact.outputs.figures.position import pair_figure
from fecontact.outputs.flat_records import Record
from fecontact.outputs.pair_names import Row, short_name
from fecontact.outputs.parts import Details, Heading, Lead, Part, Picture
from fecontact.outputs.study_report import REPORT, closing
from fecontact.outputs.style import (
    ANSWERS,
    blank_figure,
    finish,
    image_of,
    legend_beside,
    page,
    save_figure,
    series_style,
)
from fecontact.outputs.tables import Column, Item, Table, missing, number, table_of, text, write_csv
from fecontact.outputs.terminal import count
from fecontact.solving.placing import place_case

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LOST = "could not be solved"


def percent(share: float) -> str:
    """A share as a number in percent: whole, but near 0 and 100 as exact as it takes to tell it from them.

    >>> [percent(one) for one in (0.634, 0.0034, 0.9987, 0.0, 1.0)]
    ['63', '0.34', '99.87', '0', '100']
    """
    value = 1e2 * share
    edge = min(value, 100.0 - value)
    if edge >= 1.0 or edge < 5e-7:
        return f"{value:.0f}"
    return f"{value:.{1 - int(np.floor(np.log10(edge)))}f}".rstrip("0")


def interval(share: Share) -> str:
    """A share with its interval, such as 63 % [60, 66]."""
    return f"{percent(share.estimate)} % [{percent(share.low)}, {percent(share.high)}]"


def headline(answer: Answer) -> str:
    """The answer in a sentence."""
    whole, screen = answer.whole, answer.whole.screen
    lost = sum(row["files"] for row in answer.files if row["status"] == "refused")
    files = f"{percent(lost / sum(row['files'] for row in answer.files))} % of the files could not be read"
    if not whole.drawn:
        return (
            f"By the screen alone, Hertz holds in {percent(screen['holds'])} % of the positions, fails in"
            f" {percent(screen['fails'])} %, is open in {percent(screen['open'])} %, and {percent(screen['refused'])} %"
            f" {_LOST}; {files}"
        )
    return (
        f"Hertz holds in {interval(whole.share(HOLDS))} of the positions, is open in {interval(whole.share(OPEN))}, and"
        f" {interval(whole.share(UNSOLVED))} {_LOST}; {files}"
    )


def sentences(answer: Answer) -> Iterator[str]:
    """What stands behind the answer: population, bounds, network, screen."""
    whole, about = answer.whole, answer.about
    yield f"Population: {about.get('population', 'as in fleet.toml')}; {count(whole.positions, 'position')}."
    low, high = (percent(bound) for bound in whole.bounds)
    if whole.drawn:
        yield (
            f"Of these positions {whole.drawn} were drawn and solved by finite elements; intervals are for 95 %."
            f" Whichever way the open and the unsolved ones fall, Hertz holds in {low} to {high} % (limits of both)."
        )
    else:
        yield (
            f"Whichever way the open and the refused ones fall, Hertz holds in {low} to {high} % by the screen. How"
            " right the screen is, a sample by finite elements says: fecontact fleet sample FOLDER"
        )
    if answer.network:
        share = f"{percent(answer.network.low)} to {percent(answer.network.high)} %"
        yield f"For a network of which these wheels and rails are a random sample: {share}."


# --- The page, its pictures and its tables.


def write_report(answer: Answer, folder: Path, case_of: CaseOf | None = None) -> Path:
    """Write `report.html` into a fleet's folder, `answer.csv`, and pictures and tables into `report/`.

    With `case_of` the worst pairs are drawn in section.
    """
    own = folder / "report"
    own.mkdir(exist_ok=True)
    write_csv(answer_rows(answer), folder / "answer.csv")
    for name in ("cells", "causes", "theories", "worst", "strata", "files", "notes"):
        write_csv(getattr(answer, name), own / f"{name}.csv")
    pictures = {"map": map_figure(answer.cells), "groups": groups_figure(answer)}
    for name, figure in pictures.items():
        save_figure(figure, own / f"{name}.png")
    sections: list[Part] = list(_sections(answer.worst, case_of)) if case_of else []
    parts: list[Part] = [
        Heading(f"Fleet {folder.resolve().name}", 1),
        *report_parts(answer, own),
        *([Heading("The worst pairs in section"), *sections] if sections else []),
        *closing((row["value"] for row in answer.theories if row["value"] in THEORIES), laws=False),
    ]
    return write_text(folder / REPORT, page(f"Where Hertz holds: fleet {folder.resolve().name}", parts))


def answer_rows(answer: Answer) -> list[Record]:
    """The answer for the population and for each group, a row each."""
    return [
        {"body": body, "column": column, "value": value, **part.record()}
        for (body, column, value), part in ({("", "", "all"): answer.whole} | dict(answer.groups)).items()
    ]


def report_parts(answer: Answer, pictures: Path) -> Iterator[Part]:
    """The report part by part, as the terminal and the page show it."""
    yield Lead(f"{headline(answer)}.")
    yield from sentences(answer)
    yield Heading("At which shifts and loads")
    yield Picture(
        content=pictures / "map.svg", words="Share of the pairs, by weight, for which Hertz holds by the screen."
    )
    yield _cells_table(answer.cells)
    if answer.groups:
        yield Heading("For which wheels and rails")
        yield Picture(
            content=pictures / "groups.svg",
            words="Share at which Hertz holds; a group counts by its weight, its interval is from its own draws alone.",
        )
        yield table_of("By group, in percent of its weight", _GROUPS, answer_rows(answer))
    yield Heading("Why not, and what instead")
    yield table_of("Why Hertz does not hold by the screen, in percent of all positions", _CAUSES, answer.causes)
    yield table_of("The cheapest theory that holds, in percent of all positions", _NAMED, answer.theories)
    yield Heading("The worst pairs")
    yield table_of("Pairs with the smallest share, and the worst position of each", _WORST, answer.worst)
    yield Heading("How right is the screen?")
    yield from _screen_words(answer)
    yield table_of("Drawn positions by finite elements", _STRATA, answer.strata)
    yield Heading("Files")
    yield table_of("", _FILES, answer.files)
    if answer.notes:
        yield table_of("What was assumed of files that were read", _NOTES, answer.notes)


def _screen_words(answer: Answer) -> Iterator[str]:
    theory = THEORIES[answer.about["theory"]].words
    if not answer.whole.drawn:
        yield f"No position was solved by finite elements: nothing is known of how right {theory} is."
        return
    yield (
        f"Positions were drawn from four strata by what the screen ({theory}) says of them and how surely: near is"
        " open, or a margin of less than two uncertainties. Each position counts by its weight over the probability"
        " with which it was drawn. Limits of a stratum are exact ones, so that none of its draws is not none of it."
    )


def _sections(worst: Sequence[Row], case_of: CaseOf) -> Iterator[Details]:
    """The worst position of each pair in section, or why it cannot be drawn."""
    for row in worst:
        where = f"{row['wheel']} on {row['rail']}, {row['shift_mm']:g} mm, {row['load_kN']:g} kN"
        try:
            placement = place_case(case_of(row["wheel"], row["rail"], row["shift_mm"], row["load_kN"]))
        except FecontactError as error:
            yield Details(where, [str(error)])
        else:
            yield Details(
                where, [Picture(content=image_of(pair_figure(placement)), words=row["cause"] or "", width=900)]
            )


def _percent(heading: str, of: Callable[[Item], float | None], *, rank: int = 0, name: str = "") -> Column:
    """A column of shares, which are from 0 to 1."""
    return text(
        heading,
        lambda row: None if missing(of(row)) else percent(of(row) or 0.0),
        "number",
        none="-",
        rank=rank,
        name=name,
    )


def _limited(heading: str, answer: str) -> Column:
    """A column of shares in percent with their limits, of a record."""

    def cell(row: Item) -> str | None:
        found = [row.get(f"{answer}{part}_percent") for part in ("", "_low", "_high")]
        if any(value is None for value in found):
            return None
        estimate, low, high = (percent((value or 0.0) / 1e2) for value in found)
        return f"{estimate} [{low}, {high}]"

    return text(heading, cell, "number", none="-")


_GROUPS = [
    text("of", lambda row: f"{row['body']} {row['column']}".strip() or "all"),
    text("value", "value"),
    _percent("weight\n%", lambda row: row["weight_percent"] / 1e2),
    _percent("by the\nscreen", lambda row: row["screen_holds_percent"] / 1e2),
    number("drawn", "drawn"),
    _limited("Hertz holds", "holds"),
    text(
        "with open\nas either",
        lambda row: " to ".join(percent(row[f"bound_{end}_percent"] / 1e2) for end in ("low", "high")),
        "number",
    ),
]
_NO_THEORY = {"OPEN": "open which", "none": "none of them"}
_NAMED = [
    text("", lambda row: THEORIES[row["value"]].words if row["value"] in THEORIES else _NO_THEORY[row["value"]]),
    _percent("%", lambda row: row["share"]),
    number("positions", "positions"),
]
_CAUSES = [text("cause", "value", wraps=True), text("screen", "verdicts"), *_NAMED[1:]]
_WORST = [
    text("wheel", lambda row: short_name(row["wheel"])),
    text("rail", lambda row: short_name(row["rail"])),
    _percent("holds\n%", lambda row: row["holds"] or 0.0),
    _percent("open\n%", lambda row: row["open"] or 0.0, rank=1, name="open"),
    number("shift\nmm", "shift_mm"),
    number("load\nkN", "load_kN"),
    number("margin", "margin", "{:.1f}", rank=2, name="margin"),
    text("cause", "cause", wraps=True),
]
_STRATA = [
    text("the screen says", "stratum"),
    number("weight\n%", "weight_percent", "{:.1f}"),
    number("positions", "positions"),
    *(number(name, name) for name in ("drawn", "holds", "fails", "open", "unsolved")),
    number("against\nthe screen", "discordant"),
    _limited("of those that both decide\n%", "discordant"),
]
_FILES = [
    text("", "body"),
    text("", "status"),
    number("files", "files"),
    _percent("%", lambda row: row["share"]),
    text("why", "reason", wraps=True),
    text("remedy", "remedy", wraps=True),
    text("such as", lambda row: row["example"] if row["status"] == "refused" else ""),
]
_NOTES = [
    text("", "body"),
    number("files", "files"),
    text("note", "note", wraps=True),
    text("such as", "example"),
]


def _cells_table(cells: Sequence[Row]) -> Table:
    """Shares over shift and load, with the open ones in brackets."""
    loads = sorted({row["load"] for row in cells})
    by_shift: dict[float, dict[float, str]] = defaultdict(dict)
    for row in cells:
        by_shift[row["shift"]][row["load"]] = _cell_words(row)
    columns = [number("shift\nmm", "shift")]
    columns += [text(f"{load:g}\nkN", f"{load:g}", "number", none="-") for load in loads]
    lines = [{"shift": shift, **{f"{load:g}": words for load, words in own.items()}} for shift, own in by_shift.items()]
    return table_of("Hertz holds, in percent of the pairs by weight (open ones in brackets)", columns, lines)


def _cell_words(row: Row) -> str:
    opened = f" ({percent(row['open'])})" if row["open"] else ""
    return f"{percent(row['holds'] or 0.0)}{opened}"


# --- Pictures.


def map_figure(cells: Sequence[Row]) -> Figure:
    """The share of pairs for which Hertz holds over shift and load, as colours and numbers in percent."""
    from matplotlib.colors import LinearSegmentedColormap

    shifts, loads = (sorted({row[name] for row in cells}) for name in ("shift", "load"))
    shares = np.full((len(loads), len(shifts)), np.nan)
    for row in cells:
        shares[loads.index(row["load"]), shifts.index(row["shift"])] = 1e2 * (row["holds"] or 0.0)
    figure = blank_figure(
        float(np.clip(0.45 * len(shifts) + 2.5, 6.0, 16.0)), float(np.clip(0.5 * len(loads) + 1.6, 3.0, 10.0))
    )
    ax = figure.add_subplot()
    ends = [ANSWERS[one] for one in ("FAILS", "UNRESOLVED", "HOLDS")]
    colours = LinearSegmentedColormap.from_list("share", ends).with_extremes(bad=ANSWERS["failed"])
    image = ax.imshow(shares, cmap=colours, vmin=0.0, vmax=100.0, aspect="auto", origin="lower")
    for (load, shift), share in np.ndenumerate(shares):
        if np.isfinite(share):
            ax.text(shift, load, percent(share / 1e2), ha="center", va="center", fontsize=8)
    ax.set(xticks=range(len(shifts)), xticklabels=[f"{shift:g}" for shift in shifts], xlabel=SHIFT)
    ax.set(yticks=range(len(loads)), yticklabels=[f"{load:g}" for load in loads], ylabel="load in kN")
    figure.colorbar(image, label="pairs for which Hertz holds in %")
    return figure


def groups_figure(answer: Answer) -> Figure:
    """The share at which Hertz holds for each group: by the screen, and by finite elements with its interval."""
    rows = answer_rows(answer)
    figure = blank_figure(8.0, 1.2 + 0.3 * len(rows))
    ax = figure.add_subplot()
    places = np.arange(len(rows))
    holds, undecided = (
        np.array([sum(row[f"screen_{name}_percent"] for name in names) for row in rows])
        for names in (("holds",), ("open", "refused"))
    )
    ax.barh(places, undecided, left=holds, height=0.25, color=ANSWERS["failed"], label="open or refused by it")
    ax.plot(holds, places, ls="none", **series_style(1), label="by the screen")
    solved = [(place, row) for place, row in enumerate(rows) if row["drawn"]]
    if solved:
        middle, low, high = (
            np.array([row[f"holds{end}_percent"] for _, row in solved]) for end in ("", "_low", "_high")
        )
        reach = np.array([middle - low, high - middle])
        style = series_style(0) | {"ls": "none", "capsize": 3.0}
        ax.errorbar(middle, [place for place, _ in solved], xerr=reach, **style, label="by finite elements, 95 %")
    names = [f"{row['body']} {row['column']}: {row['value']}" if row["column"] else "all" for row in rows]
    ax.set(yticks=places, yticklabels=names, xlim=(-2.0, 102.0), xlabel="Hertz holds, in % of the weight")
    ax.invert_yaxis()
    finish(ax)
    legend_beside(ax)
    return figure
