"""Report of a fleet: the answer in a sentence, where Hertz holds, the reasons and the uncertainty; page, pictures,
CSV.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.contact_theories.registry import THEORIES
from fecontact.errors import FecontactError
from fecontact.features.fleet.answer import FleetAnswer
from fecontact.features.fleet.estimate import Share, count_needed_draws
from fecontact.features.fleet.open_positions import ACCURACY, describe_open_causes
from fecontact.features.fleet.sampling import HOLDS, OPEN, UNSOLVED, CaseOf
from fecontact.features.fleet.sealed_folder import (
    ANSWER,
    REPORT_FOLDER,
    describe_unscreened,
    refuse_links,
    write_answer_record,
)
from fecontact.features.fleet.table_columns import READ, SUSPICIOUS, UNUSED
from fecontact.files import write_text
from fecontact.inputs.texts import count_text
from fecontact.jobs.remaining import format_duration
from fecontact.judging.lines import OPEN_CAUSES
from fecontact.outputs.case_words import SHIFT_LABEL
from fecontact.outputs.figures.position import pair_figure
from fecontact.outputs.flat_records import Record
from fecontact.outputs.pair_names import RowMapping, short_name
from fecontact.outputs.parts import Details, Heading, Lead, Part, Picture
from fecontact.outputs.study_report import REPORT_FILE, closing_parts
from fecontact.outputs.style import (
    ANSWER_COLOURS,
    add_grid,
    add_legend_beside,
    blank_figure,
    render_image,
    render_page,
    save_figure,
    series_style,
)
from fecontact.outputs.tables import (
    Column,
    Table,
    TableRecord,
    is_missing,
    make_table,
    number_column,
    text_column,
    write_csv,
)
from fecontact.solving.placing import place_case

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_UNSOLVED_TEXT = "could not be solved"
# Half-widths of the interval for which the report states the number of solutions.
_HALF_WIDTHS = (0.05, 0.02, 0.01)


def format_percent(share: float) -> str:
    """Format a share as a number in percent.

    The number is whole, but near 0 and 100 it has the digits that distinguish it from 0 and 100.

    Parameters
    ----------
    share
        Share from 0 to 1.

    Returns
    -------
    str
        Number without the sign of percent.

    Examples
    --------
    >>> from fecontact.features.fleet.report import format_percent
    >>> [format_percent(share) for share in (0.634, 0.0034, 0.9987, 0.0, 1.0)]
    ['63', '0.34', '99.87', '0', '100']
    """
    value = 1e2 * share
    edge = min(value, 100.0 - value)
    if edge >= 1.0 or edge < 5e-7:
        return f"{value:.0f}"
    return f"{value:.{1 - int(np.floor(np.log10(edge)))}f}".rstrip("0")


def format_interval(share: Share) -> str:
    """A share with its interval, such as 63 % [60, 66]."""
    return f"{format_percent(share.estimate)} % [{format_percent(share.low)}, {format_percent(share.high)}]"


def format_shift(shift_mm: float) -> str:
    """Format a lateral shift in mm with up to two decimals.

    Parameters
    ----------
    shift_mm
        Lateral shift in mm.

    Returns
    -------
    str
        Number without its unit.

    Examples
    --------
    >>> from fecontact.features.fleet.report import format_shift
    >>> [format_shift(shift_mm) for shift_mm in (-3.84465, 0.0, 2.5, -0.001)]
    ['-3.84', '0', '2.5', '0']
    """
    return f"{shift_mm:z.2f}".rstrip("0").rstrip(".")


def write_headline(answer: FleetAnswer) -> str:
    """Answer in a sentence.

    Parameters
    ----------
    answer
        Answer for a fleet.

    Returns
    -------
    str
        Shares of the contacts at which Hertz holds, is unresolved or could not be solved, share of positions that are
        not contacts, and share of unreadable files.
    """
    return "; ".join(filter(None, (_describe_shares(answer), _describe_left_out(answer))))


def _describe_shares(answer: FleetAnswer) -> str:
    """Shares of the contacts at which Hertz holds, is unresolved or could not be solved."""
    population, screen = answer.whole, answer.whole.screen
    if _has_no_screened_pair(answer):
        text = describe_unscreened(answer.about["unscreened_pairs"], answer.about["pairs"])
        return f"{text[0].upper()}{text[1:]}"
    if not population.drawn:
        return (
            f"By the screen alone, Hertz holds in {format_percent(screen['holds'])} % of the positions and fails in"
            f" {format_percent(screen['fails'])} %; {format_percent(screen['open'])} % are unresolved and"
            f" {format_percent(screen['refused'])} % {_UNSOLVED_TEXT}"
        )
    return (
        f"Hertz holds in {format_interval(population.share(HOLDS))} of the positions;"
        f" {format_interval(population.share(OPEN))} are unresolved and {format_interval(population.share(UNSOLVED))}"
        f" {_UNSOLVED_TEXT}"
    )


def _has_no_screened_pair(answer: FleetAnswer) -> bool:
    unscreened, pairs = (answer.about.get(name, 0) for name in ("unscreened_pairs", "pairs"))
    return unscreened == pairs != 0 and not answer.whole.drawn


def _describe_left_out(answer: FleetAnswer) -> str:
    """Positions, files and pairs that the shares leave out; empty if no pair was screened."""
    if _has_no_screened_pair(answer):
        return ""
    population, unscreened = answer.whole, answer.about.get("unscreened_pairs", 0)
    counts: dict[str, int] = defaultdict(int)
    for row in answer.files:
        counts[row["status"]] += row["files"]
    suspicious_files, used_files = counts[SUSPICIOUS], sum(counts.values()) - counts[UNUSED]
    unread_share = 1.0 - (counts[READ] + suspicious_files) / used_files
    files = f"{format_percent(unread_share)} % of the files could not be read"
    if counts[UNUSED]:
        files += f"; {count_text(counts[UNUSED], 'file')} in no pair {'is' if counts[UNUSED] == 1 else 'are'} left out"
    if suspicious_files:
        files += (
            f"; {count_text(suspicious_files, 'suspicious file')} and"
            f" {format_percent(answer.about.get('suspicious_share', 0.0))} % of the pairs, by weight, are left out"
        )
    if unusable_pairs := answer.about.get("unusable_pairs"):
        files += f"; {unusable_pairs}"
    if unscreened:
        files += f"; {describe_unscreened(unscreened, answer.about['pairs'])}"
    if population.no_contact:
        files = (
            f"in {format_percent(population.no_contact)} % of all positions the wheel cannot stand on the rail: they"
            f" are not contacts and are left out; {files}"
        )
    return files


def explain_answer(answer: FleetAnswer) -> Iterator[str]:
    """Yield sentences on the basis of the answer: population, bounds, network, screening.

    Parameters
    ----------
    answer
        Answer for a fleet.

    Returns
    -------
    iterator of str
        Sentences.
    """
    population, about = answer.whole, answer.about
    yield f"Population: {about.get('population', 'as in fleet.toml')}; {count_text(population.positions, 'position')}."
    if about.get("filter_mm") is not None:
        yield f"Measured profiles have the declared filter of {about['filter_mm']:g} mm; no other filter was judged."
    if answer.filters:
        shares = ", ".join(
            f"{format_percent(row['holds'] or 0.0)} % with {row['filter_mm']:.1f} mm" for row in answer.filters
        )
        unknown = max(row["unknown"] or 0.0 for row in answer.filters)
        exception = f"; in {format_percent(unknown)} %, where noise decides the filter, this is unknown" * (
            unknown > 0.0
        )
        yield f"If one filter were declared, Hertz would hold by the screen in {shares}{exception}."
    low, high = (format_percent(bound) for bound in population.bounds)
    if population.drawn:
        yield (
            f"{population.drawn} of these positions were drawn and solved by finite elements; intervals are for 95 %."
            f" For any verdict of the unresolved and unsolved positions, Hertz holds in {low} to {high} %"
            " (interval limits included)."
        )
    else:
        yield (
            f"For any verdict of the unresolved and refused positions, Hertz holds in {low} to {high} % by the screen."
            " The accuracy of the screen is unknown; measure it with finite elements: fecontact fleet sample FOLDER"
        )
    draws_texts = [
        f"{count_needed_draws(population.strata, HOLDS, half_width)} for ± {100.0 * half_width:g}"
        for half_width in _HALF_WIDTHS
    ]
    yield (
        "Positions to solve by finite elements in all, for the interval in percentage points, about:"
        f" {', '.join(draws_texts)}."
        " `fecontact fleet sample FOLDER --finite-elements NUMBER` keeps earlier draws and prints the time before it"
        " solves."
    )
    if answer.open_causes:
        yield describe_open_causes(answer.open_causes, answer.new_screening_s)
    if answer.network:
        share = f"{format_percent(answer.network.low)} to {format_percent(answer.network.high)} %"
        yield f"If these wheels and rails are a random sample of a network, Hertz holds in {share} of its positions."


def write_report(
    answer: FleetAnswer, folder: Path, case_of: CaseOf | None = None, suspicious: Iterable[Part] = ()
) -> Path:
    """Write `report.html` and `answer.csv` into a fleet's folder, and pictures and tables into `report/`.

    Parameters
    ----------
    answer
        Answer for the fleet.
    folder
        Folder of the fleet.
    case_of
        Function that makes the case of a position; with it the worst pairs are drawn in section.
    suspicious
        Section of the suspicious files.

    Returns
    -------
    Path
        The page.
    """
    refuse_links(folder)
    report_folder = folder / REPORT_FOLDER
    report_folder.mkdir(exist_ok=True)
    files = [write_csv(make_answer_rows(answer), folder / ANSWER)]
    for name in (
        *("cells", "causes", "open_causes", "filters", "theories", "refusals"),
        *("worst", "strata", "files", "notes"),
    ):
        files.append(write_csv(getattr(answer, name), report_folder / f"{name}.csv"))
    pictures = {"map": draw_map(answer.cells), "groups": draw_groups(answer)}
    for name, figure in pictures.items():
        picture = save_figure(figure, report_folder / f"{name}.png")
        files += [picture, picture.with_suffix(".svg")]
    sections: list[Part] = list(_draw_worst_sections(answer.worst, case_of)) if case_of else []
    parts: list[Part] = [
        *make_report_parts(answer, report_folder, f"Fleet {folder.resolve().name}"),
        *suspicious,
        *([Heading("Cross-sections of the worst pairs"), *sections] if sections else []),
        *closing_parts((row["value"] for row in answer.theories if row["value"] in THEORIES), laws=False),
    ]
    page = write_text(folder / REPORT_FILE, render_page(f"Where Hertz holds: fleet {folder.resolve().name}", parts))
    write_answer_record(folder, write_headline(answer), answer.about, [*files, page])
    return page


def make_answer_rows(answer: FleetAnswer) -> list[Record]:
    """Rows of the answer for the population and for each group.

    Parameters
    ----------
    answer
        Answer for a fleet.

    Returns
    -------
    list of dict
        Body, column and value of the group, and its shares in percent.
    """
    return [
        {"body": body, "column": column, "value": value, **subpopulation.record()}
        for (body, column, value), subpopulation in ({("", "", "all"): answer.whole} | dict(answer.groups)).items()
    ]


def make_report_parts(answer: FleetAnswer, pictures: Path, name: str = "") -> Iterator[Part]:
    """Yield the parts of the report for the terminal and the page.

    Parameters
    ----------
    answer
        Answer for a fleet.
    pictures
        Folder of the pictures.
    name
        Name of the fleet for the page; empty for the terminal.

    Returns
    -------
    iterator
        Sentences, headings, pictures and tables.
    """
    left_out = _describe_left_out(answer)
    yield Lead(_describe_shares(answer), subject="; ".join(filter(None, (name, left_out and f"{left_out}."))))
    yield from explain_answer(answer)
    yield Heading("Shifts and loads at which Hertz holds")
    yield Picture(content=pictures / "map.svg", words="Share of the pairs, by weight, for which Hertz holds (screen).")
    yield _make_cells_table(answer.cells)
    if answer.groups:
        yield Heading("Wheels and rails for which Hertz holds")
        yield Picture(
            content=pictures / "groups.svg",
            words="Share of the weight for which Hertz holds; the interval of a group uses only its draws.",
        )
        yield make_table("Groups, in % of their weight", _GROUP_COLUMNS, make_answer_rows(answer))
    yield Heading("Causes, and theories in place of Hertz")
    yield make_table("Why Hertz does not hold (screen), in % of all contacts", _CAUSE_COLUMNS, answer.causes)
    if answer.open_causes:
        title = "What would decide the unresolved contacts, in % of all contacts"
        yield make_table(title, _OPEN_CAUSE_COLUMNS, answer.open_causes)
        yield (
            "Finite elements are judged on the same profile variants as the screen: they decide some of the positions"
            " that the accuracy of the screen leaves unresolved, and fewer of the others."
        )
        if answer.solution_time:
            yield f"Finite elements take {answer.solution_time.words}."
    if answer.filters:
        yield make_table("Shares if one filter were declared (screen), in %", _FILTER_COLUMNS, answer.filters)
    yield make_table("Cheapest theory known to hold, in % of all contacts", _THEORY_COLUMNS, answer.theories)
    if answer.refusals:
        yield Heading("Positions without an answer")
        yield (
            "NO CONTACT: the wheel derails or falls between the rails, so that the position does not belong to the"
            " population. REFUSED: the position belongs to the population, and its answer is unknown."
        )
        yield make_table("Kinds of reasons, in % of all positions", _REFUSAL_COLUMNS, answer.refusals)
    yield Heading("Worst pairs")
    yield make_table(
        "Pairs with the smallest share of Hertz, each with its worst position", _WORST_PAIR_COLUMNS, answer.worst
    )
    yield Heading("How accurate is the screen?")
    yield from _describe_screening(answer)
    yield make_table("Drawn positions, solved by finite elements", _STRATUM_COLUMNS, answer.strata)
    yield Heading("Files")
    yield make_table("", _FILE_COLUMNS, answer.files)
    if answer.notes:
        yield make_table("Assumptions of the readers of files", _NOTE_COLUMNS, answer.notes)


def _describe_screening(answer: FleetAnswer) -> Iterator[str]:
    """Yield sentences on the agreement of the screening with the finite elements."""
    theory = THEORIES[answer.about["theory"]].words
    if not answer.whole.drawn:
        yield f"The accuracy of the screen ({theory}) is unknown, because no position was solved by finite elements."
        return
    yield (
        f"Positions were drawn from four strata by the verdict of the screen ({theory}) and its margin. A position is"
        " near if it is unresolved, or if its margin is less than two uncertainties. Each position counts with its"
        " weight divided by its probability of being drawn. Limits of a stratum are exact. Without a contradiction, the"
        " upper limit is above zero unless all positions of the stratum were drawn."
    )


def _draw_worst_sections(worst: Sequence[RowMapping], case_of: CaseOf) -> Iterator[Details]:
    """Yield the worst position of each pair in section.

    If it cannot be drawn, the reason is given.
    """
    for row in worst:
        position_text = _describe_position(row)
        try:
            placement = place_case(case_of(row["wheel"], row["rail"], row["shift_mm"], row["load_kN"]))
        except FecontactError as error:
            yield Details(position_text, [str(error)])
        else:
            yield Details(
                position_text,
                [Picture(content=render_image(pair_figure(placement)), words=row["cause"] or "", width=900)],
            )


def _describe_position(row: TableRecord) -> str:
    """Pair, shift and load of a position in words."""
    return f"{row['wheel']} on {row['rail']}, {format_shift(row['shift_mm'])} mm, {row['load_kN']:g} kN"


def _make_percent_column(
    heading: str, share_of_row: Callable[[TableRecord], float | None], *, rank: int = 0, name: str = ""
) -> Column:
    """A column of shares, which are from 0 to 1."""
    return text_column(
        heading,
        lambda row: None if is_missing(share_of_row(row)) else format_percent(share_of_row(row) or 0.0),
        "number",
        none="-",
        rank=rank,
        name=name,
    )


def _make_interval_column(heading: str, answer: str) -> Column:
    """A column of shares in percent with their limits, from the keys of a record.

    The keys are `answer` with the endings `_percent`, `_low_percent` and `_high_percent`. A cell without one of them is
    shown as "-".
    """

    def cell(row: TableRecord) -> str | None:
        values = [row.get(f"{answer}{end}_percent") for end in ("", "_low", "_high")]
        if any(value is None for value in values):
            return None
        estimate, low, high = (format_percent((value or 0.0) / 1e2) for value in values)
        return f"{estimate} [{low}, {high}]"

    return text_column(heading, cell, "number", none="-")


_COLUMN_WORDS = {
    "flange_height_mm": "flange height Sh, mm",
    "flange_thickness_mm": "flange thickness Sd, mm",
    "flange_qr_mm": "qR, mm",
    "wear_mm": "wear depth, mm",
    "noise_um": "noise, um",
    "nominal": "nominal profile",
    "rolling_radius_mm": "rolling radius, mm",
}


def _describe_group(row: TableRecord) -> str:
    """Body and property of a group in words."""
    return f"{row['body']}: {_COLUMN_WORDS.get(row['column'], row['column'])}" if row["column"] else "all"


_GROUP_COLUMNS = [
    text_column("group", _describe_group),
    text_column("value", "value"),
    _make_percent_column("weight\n%", lambda row: row["weight_percent"] / 1e2),
    _make_percent_column("screen\n%", lambda row: row["screen_holds_percent"] / 1e2),
    number_column("drawn", "drawn"),
    _make_interval_column("Hertz holds\n%", "holds"),
    text_column(
        "unresolved holds\nor fails %",
        lambda row: " to ".join(format_percent(row[f"bound_{end}_percent"] / 1e2) for end in ("low", "high")),
        "number",
    ),
]
_WORDS_WITHOUT_THEORY = {"OPEN": "unresolved", "none": "none"}
_THEORY_COLUMNS = [
    text_column(
        "",
        lambda row: THEORIES[row["value"]].words if row["value"] in THEORIES else _WORDS_WITHOUT_THEORY[row["value"]],
    ),
    _make_percent_column("%", lambda row: row["share"]),
    number_column("positions", "positions"),
]
_CAUSE_COLUMNS = [text_column("cause", "value", wraps=True), text_column("screen", "verdicts"), *_THEORY_COLUMNS[1:]]


def _format_cpu_time(row: TableRecord) -> str | None:
    """CPU time of finite elements at the positions of a cause that are not solved."""
    seconds = row["elements_cpu_seconds"]
    return None if is_missing(seconds) else format_duration(seconds)


_OPEN_CAUSE_WORDS = {name: f"{name}: {words}" for name, words in OPEN_CAUSES.items()}
_OPEN_CAUSE_WORDS[ACCURACY] = f"{ACCURACY}: finite elements"
_OPEN_CAUSE_COLUMNS = [
    text_column("decided by", lambda row: _OPEN_CAUSE_WORDS.get(row["value"], row["value"]), wraps=True),
    *_THEORY_COLUMNS[1:],
    number_column("wheels", "wheels"),
    number_column("rails", "rails"),
    number_column("solved", "solved"),
    number_column("decided\nby elements", "decided_by_elements"),
    text_column("elements at the\nothers, CPU time", _format_cpu_time, "number", none="-"),
]
_FILTER_COLUMNS = [
    number_column("filter\nmm", "filter_mm", "{:.1f}"),
    _make_percent_column("holds\n%", lambda row: row["holds"] or 0.0),
    _make_percent_column("fails\n%", lambda row: row["fails"] or 0.0),
    _make_percent_column("unresolved\n%", lambda row: row["open"] or 0.0),
    _make_percent_column("refused\n%", lambda row: row["refused"] or 0.0),
    _make_percent_column("unknown\n%", lambda row: row["unknown"] or 0.0),
]
_REFUSAL_COLUMNS = [
    text_column("screen", "verdict"),
    text_column("reason", "kind", wraps=True),
    *_THEORY_COLUMNS[1:],
    text_column("example", _describe_position, wraps=True),
    text_column("remedy", "remedy", wraps=True),
]
_WORST_PAIR_COLUMNS = [
    text_column("wheel", lambda row: short_name(row["wheel"])),
    text_column("rail", lambda row: short_name(row["rail"])),
    _make_percent_column("holds\n%", lambda row: row["holds"] or 0.0),
    _make_percent_column("unresolved\n%", lambda row: row["open"] or 0.0, rank=1, name="open"),
    text_column("shift\nmm", lambda row: format_shift(row["shift_mm"]), "number"),
    number_column("load\nkN", "load_kN"),
    number_column("margin", "margin", "{:.1f}", rank=2, name="margin"),
    text_column("cause", "cause", wraps=True),
]
_STRATUM_COLUMNS = [
    text_column("screen", "stratum"),
    number_column("weight\n%", "weight_percent", "{:.1f}"),
    number_column("positions", "positions"),
    number_column("drawn", "drawn"),
    number_column("holds", "holds"),
    number_column("fails", "fails"),
    number_column("unresolved", "open"),
    number_column("unsolved", "unsolved"),
    number_column("contradict\nthe screen", "discordant"),
    _make_interval_column("of decided\npositions %", "discordant"),
]
_FILE_COLUMNS = [
    text_column("", "body"),
    text_column("", "status"),
    number_column("files", "files"),
    _make_percent_column("%", lambda row: row["share"]),
    text_column("reason", "reason", wraps=True),
    text_column("remedy", "remedy", wraps=True),
    text_column("example", lambda row: "" if row["status"] == READ else row["example"]),
]
_NOTE_COLUMNS = [
    text_column("", "body"),
    number_column("files", "files"),
    text_column("note of the example", "note", wraps=True),
    text_column("example", "example"),
]


def _make_cells_table(cells: Sequence[RowMapping]) -> Table:
    """Table of shares over shift and load, with unresolved shares in brackets."""
    loads = sorted({row["load"] for row in cells})
    by_shift: dict[float, dict[float, str]] = defaultdict(dict)
    for row in cells:
        by_shift[row["shift"]][row["load"]] = _format_cell(row)
    columns = [text_column("shift\nmm", lambda row: format_shift(row["shift"]), "number")]
    columns += [text_column(f"{load:g}\nkN", f"{load:g}", "number", none="-") for load in loads]
    table_rows = [
        {"shift": shift, **{f"{load:g}": text_of_load for load, text_of_load in texts.items()}}
        for shift, texts in by_shift.items()
    ]
    return make_table("Pairs for which Hertz holds, in % by weight (unresolved pairs in brackets)", columns, table_rows)


def _format_cell(row: RowMapping) -> str:
    """Text of a cell: the share that holds, with the unresolved share in brackets."""
    opened = f" ({format_percent(row['open'])})" if row["open"] else ""
    return f"{format_percent(row['holds'] or 0.0)}{opened}"


def draw_map(cells: Sequence[RowMapping]) -> Figure:
    """Draw the share of pairs for which Hertz holds over shift and load.

    Shares are colours and numbers in percent.

    Parameters
    ----------
    cells
        Rows with `shift` (mm), `load` (kN) and the share `holds` from 0 to 1.

    Returns
    -------
    Figure
        Map of the shares.
    """
    from matplotlib.colors import LinearSegmentedColormap

    shifts, loads = (sorted({row[name] for row in cells}) for name in ("shift", "load"))
    shares = np.full((len(loads), len(shifts)), np.nan)
    for row in cells:
        shares[loads.index(row["load"]), shifts.index(row["shift"])] = 1e2 * (row["holds"] or 0.0)
    figure = blank_figure(
        float(np.clip(0.45 * len(shifts) + 2.5, 6.0, 16.0)), float(np.clip(0.5 * len(loads) + 1.6, 3.0, 10.0))
    )
    ax = figure.add_subplot()
    end_colours = [ANSWER_COLOURS[answer] for answer in ("FAILS", "UNRESOLVED", "HOLDS")]
    colours = LinearSegmentedColormap.from_list("share", end_colours).with_extremes(bad=ANSWER_COLOURS["failed"])
    image = ax.imshow(shares, cmap=colours, vmin=0.0, vmax=100.0, aspect="auto", origin="lower")
    for (load, shift), share in np.ndenumerate(shares):
        if np.isfinite(share):
            ax.text(shift, load, format_percent(share / 1e2), ha="center", va="center", fontsize=8)
    ax.set(xticks=range(len(shifts)), xticklabels=[format_shift(shift) for shift in shifts], xlabel=SHIFT_LABEL)
    ax.set(yticks=range(len(loads)), yticklabels=[f"{load:g}" for load in loads], ylabel="load in kN")
    figure.colorbar(image, label="pairs for which Hertz holds in %")
    return figure


def draw_groups(answer: FleetAnswer) -> Figure:
    """Draw the share at which Hertz holds for each group.

    The shares are by the screening, and by finite elements with their intervals for 95 %.

    Parameters
    ----------
    answer
        Answer for a fleet.

    Returns
    -------
    Figure
        Shares of the groups in percent.
    """
    rows = make_answer_rows(answer)
    figure = blank_figure(8.0, 1.2 + 0.3 * len(rows))
    ax = figure.add_subplot()
    positions = np.arange(len(rows))
    holds, unknown = (
        np.array([sum(row[f"screen_{name}_percent"] for name in names) for row in rows])
        for names in (("holds",), ("open", "refused"))
    )
    ax.barh(positions, unknown, left=holds, height=0.25, color=ANSWER_COLOURS["failed"], label="unresolved or refused")
    ax.plot(holds, positions, ls="none", **series_style(1), label="screen")
    solved_rows = [(position, row) for position, row in enumerate(rows) if row["drawn"]]
    if solved_rows:
        middle, low, high = (
            np.array([row[f"holds{end}_percent"] for _, row in solved_rows]) for end in ("", "_low", "_high")
        )
        reach = np.array([middle - low, high - middle])
        style = series_style(0) | {"ls": "none", "capsize": 3.0}
        ax.errorbar(
            middle,
            [position for position, _ in solved_rows],
            xerr=reach,
            **style,
            label="finite elements, 95 % interval",
        )
    names = [f"{_describe_group(row)}: {row['value']}" if row["column"] else "all" for row in rows]
    ax.set(yticks=positions, yticklabels=names, xlim=(-2.0, 102.0), xlabel="Hertz holds, in % of the weight")
    ax.invert_yaxis()
    add_grid(ax)
    add_legend_beside(ax)
    return figure
