"""On which standard pairs, at which shifts, up to which load may Hertz be used?

First series: wheels S1002 and EN13715_1in40 on nine running rails of EN 13674-1, inclined at 1:20, 1:30 and 1:40 and
upright: 72 pairs, each at -8 to 8 mm by 0.5 under 25, 50, 75, 100 and 125 kN, new profiles on 1435 mm, the left wheel
of a wheelset that rolls until both wheels touch. A fleet (`fecontact fleet`) for each inclination: all 11,880 positions
are screened by the strip method, and 75 of each fleet are drawn and solved by finite elements at `quick`, not refined.

Second series, 58 more pairs at -8 to 8 mm by 1 under equal loads, with 50 drawn positions in all: the same wheels on
the other eight heads of EN 13674-1 at 1:20, 1:30 and 1:40; LMA, LMB10 and S1002 (in China also called S1002CN and LMB)
on CHN60 and 60N at 1:40, with 1353 mm between the backs of the wheels, as in China; and the APTA wheels on 60E1 1:40.
The rails of North America are not in the library, and its wheels have a different distance between their backs, which
was not found: these four pairs show the wheels, and no railway has them. The other seven rails of EN 13674-1 have the
head of a rail with rows (`EQUAL_HEADS`). Upright rails, which are in switches, are left out of the second series.
Wheels with a higher flange have the tread and the root of the flange of 28 mm, and so its rows. The reference wheels of
EN 15302, cones, the profiles of the Manchester benchmark and crane rails are left out, because no pair of a railway has
them.

Reference of the screen: those finite elements. Expected: Hertz holds outside a band of shifts about first touch at the
crown's junctions, which widens with the load; where both decide, the screen agrees with the elements in 95 % and more,
and Hertz's peak is off by the same within 2 % where the screen is sure.

`python studies/20_atlas.py --screen` screens the fleets and solves the sample (30 CPU minutes for the first series, 5
for the second; `--series more` is the second alone), goes on where it was stopped, and writes the figures,
`atlas/positions.csv` and `atlas/more_positions.csv` (a row a pair, with a letter for each load at each shift: H holds,
F fails, O open, R or N no contact) and `atlas/sample.csv` and `atlas/more_sample.csv` (a row a drawn position). The
second series has the cheapest theory too, as letters of `THEORY_LETTERS`. `fecontact run` of this file solves the
samples alone.

Found in the first series: by the screen Hertz holds in 60 % of the positions, fails in 27 % and is unresolved in 1.4 %;
in 11 % the flange climbs. Of 300 drawn positions, 33 have a flange that climbs. Screen and elements agree in all 259
positions that both decide. Of 8 positions that the screen leaves unresolved, elements decide 6; in 2 of them Hertz
holds. By the sample Hertz holds in 60 % [59, 62]. The deviation of Hertz's peak by the screen is within 0.5 % of the
deviation by elements in 232 of 250 positions where the screen is sure, and within 1.4 % in 249. In the last position,
46E1 upright at 6 mm, 50 kN, Hertz's peak is 59 % too low by elements and 56 % too low by strips: there are two narrow
lobes, in which the peak of strips is 7 % below the peak of elements (`STRIPS_ARE_OFF`). On 60E2 1:40 at 6.5 mm, 25 kN,
in the root of the flange, strips and elements differ by 5 %, and the screen leaves the position unresolved. More
positions may be drawn later (`DRAWN`); earlier draws still count.

Found in the second series: by the screen Hertz holds in 58 % of the positions, fails in 28 % and is unresolved in 2.8
%; in 11 % the flange climbs. Such positions are not drawn. Screen and elements agree in all 46 positions that both
decide. At one position the elements are refused, because their meshes are too soft or too stiff. By the sample Hertz
holds in 63 % [51, 73] of the contacts. The deviation of Hertz's peak by the screen is within 0.5 % of the deviation by
elements in 36 of 39 positions where the screen is sure, and within 1.2 % in all.

Of 1536 contacts at which Hertz is not known to hold inside its range, the cheapest theory that is known to hold inside
its range is `analyn` in 131, `equivalent_ellipse` in 121, `kpec` in 119, `multi_hertz` in 56 and `stripes` in 1; at the
other 1108 it is the strip method itself, the theory of the screen. By elements the named theory holds in 47 of 49 drawn
positions. It fails at one, S1002 on 54E2 1:20 at 5 mm, 100 kN, where strips put the load of two patches into wrong
places, and is unresolved at another, APTA320 at 3 mm, 75 kN.
"""

import argparse
import csv
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.bodies import Track
from fecontact.case import Case
from fecontact.features.fleet.checking import open_fleet
from fecontact.features.fleet.estimate import Share, Stratum, estimate_share
from fecontact.features.fleet.report import format_interval
from fecontact.features.fleet.running import run_fleet
from fecontact.features.fleet.sampling import FAILS, HOLDS, OPEN, UNSOLVED, draw_sample, solve_sample
from fecontact.features.fleet.screening_rows import NO_CONTACT, REFUSED
from fecontact.features.fleet.tables import POSITION_COLUMNS, STRATA, open_tables, query_rows
from fecontact.files import write_text
from fecontact.inputs.texts import parse_inclination
from fecontact.jobs.engine import RunSettings
from fecontact.outputs.case_words import SHIFT_LABEL
from fecontact.outputs.style import blank_figure, save_figure
from fecontact.outputs.tables import write_csv
from fecontact.regression.checks import Check

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

ATLAS = Path(__file__).parent / "atlas"
FIGURE = Path(__file__).parent / "figures" / "atlas.png"
MORE_FIGURE = FIGURE.with_name("atlas_more.png")
WHEELS = ("S1002", "EN13715_1in40")
RAILS = ("46E1", "49E1", "50E6", "54E1", "54E4", "55E1", "56E1", "60E1", "60E2")
INCLINATIONS = {"1in20": "1:20", "1in30": "1:30", "1in40": "1:40", "upright": "0"}
# Different seeds, so that the draws of the fleets are independent.
SEEDS = {"1in40": 1, "1in20": 2, "1in30": 3, "upright": 4}
SHIFTS_MM = tuple(0.5 * k for k in range(-16, 17))
LOADS_KN = (25.0, 50.0, 75.0, 100.0, 125.0)
DRAWN = 75
# In `positions.csv`, R is a position at which the wheel has no contact: it was screened before both were distinguished.
LETTERS = {HOLDS: "H", FAILS: "F", OPEN: "O", REFUSED: "R", NO_CONTACT: "N"}
NOT_PLACED = "RN"
# Theories in the order of their cost; the strip method, the reference of the screen, is the last.
THEORY_LETTERS = {
    **{"hertz": "H", "multi_hertz": "M", "equivalent_ellipse": "E", "kik_piotrowski": "P"},
    **{"stripes": "S", "analyn": "A", "kpec": "K", "strip": "T"},
}
NO_THEORY = "N"
# Rails whose head differs by at most 1 um from the head of another rail, which has their rows.
EQUAL_HEADS = {
    **{"46E2": "55E1", "49E5": "54E4", "50E1": "50E6", "50E2": "60E1", "50E4": "54E1", "50E5": "49E2"},
    "54E3": "49E1",
}
MORE_RAILS = ("46E3", "46E4", "49E2", "50E3", "52E1", "54E2", "54E5", "54E6")
MORE_INCLINATIONS = ("1in20", "1in30", "1in40")
MORE_SHIFTS_MM = tuple(float(k) for k in range(-8, 9))
CHINESE_WHEELS, CHINESE_RAILS, CHINESE_BACK_TO_BACK_MM = ("LMA", "LMB10", "S1002"), ("CHN60", "60N"), 1353.0
AMERICAN_WHEELS, AMERICAN_RAIL = ("APTA220", "APTA240", "APTA320", "APTA340"), "60E1"
# Positions at which Hertz holds, fails, and is near its limits by the screen.
QUICK = (
    ("1in40", "EN13715_1in40", "46E1", 4.5, 75.0),
    ("1in40", "S1002", "50E6", 2.5, 25.0),
    ("1in40", "S1002", "60E1", 3.0, 100.0),
)
# Largest difference between Hertz's peak deviations by the screen and by finite elements, where the screen is sure.
PEAK_PERCENT = 2.0
# The only position of 250 with a larger difference (see above); its verdicts are compared like all others.
STRIPS_ARE_OFF = ("upright", "S1002", "46E1", 6.0, 50.0)
LEAST_AGREED_PERCENT = 95.0
_SAMPLE_COLUMNS = "inclusion_probability, fe_verdict, fe_p_max_percent"
_BACK_TO_BACK_MM = Track().back_to_back_mm
_FLEET = """theory = "strip"

[wheels]
files = {wheels}

[rails]
files = {rails}

[shifts_mm]
values = {shifts}

[loads_kN]
values = {loads}

[case]
inclination = "{inclination}"
refine = "never"
"""
_TRACK = """
[case.track]
back_to_back_mm = {back_to_back_mm}
"""


@dataclass(frozen=True, kw_only=True)
class AtlasFleet:
    """Pairs that are screened together, and their draws.

    `inclination` is a key of `INCLINATIONS`.
    """

    wheels: tuple[str, ...]
    rails: tuple[str, ...]
    inclination: str
    shifts_mm: tuple[float, ...]
    seed: int
    draws: int
    back_to_back_mm: float = _BACK_TO_BACK_MM

    @property
    def file_text(self) -> str:
        """Text of the fleet file."""
        lists = {"wheels": self.wheels, "rails": self.rails, "shifts": self.shifts_mm, "loads": LOADS_KN}
        texts = {name: repr(list(values)).replace("'", '"') for name, values in lists.items()}
        text = _FLEET.format(**texts, inclination=INCLINATIONS[self.inclination])
        if self.back_to_back_mm == _BACK_TO_BACK_MM:
            return text
        return text + _TRACK.format(back_to_back_mm=self.back_to_back_mm)

    @property
    def pairs(self) -> Iterator[tuple[str, str, str]]:
        """Wheel, inclination and rail of each pair."""
        for wheel, rail in product(self.wheels, self.rails):
            yield wheel, self.inclination, rail


def _make_more_fleets() -> dict[str, AtlasFleet]:
    """Fleets of the second series by their names."""
    chinese = AtlasFleet(
        wheels=CHINESE_WHEELS,
        rails=CHINESE_RAILS,
        inclination="1in40",
        shifts_mm=MORE_SHIFTS_MM,
        seed=5,
        draws=12,
        back_to_back_mm=CHINESE_BACK_TO_BACK_MM,
    )
    american = AtlasFleet(
        wheels=AMERICAN_WHEELS,
        rails=(AMERICAN_RAIL,),
        inclination="1in40",
        shifts_mm=MORE_SHIFTS_MM,
        seed=9,
        draws=6,
    )
    european = {
        f"more_{slope}": AtlasFleet(
            wheels=WHEELS, rails=MORE_RAILS, inclination=slope, shifts_mm=MORE_SHIFTS_MM, seed=seed, draws=draws
        )
        for slope, seed, draws in (("1in40", 6, 12), ("1in20", 7, 10), ("1in30", 8, 10))
    }
    return {"china": chinese, **european, "apta": american}


FLEETS = {
    slope: AtlasFleet(
        wheels=WHEELS, rails=RAILS, inclination=slope, shifts_mm=SHIFTS_MM, seed=SEEDS[slope], draws=DRAWN
    )
    for slope in INCLINATIONS
}
MORE_FLEETS = _make_more_fleets()
SERIES = {"first": FLEETS, "more": MORE_FLEETS}
"""Fleets of each series of the atlas by their names."""
POSITIONS = {"first": ATLAS / "positions.csv", "more": ATLAS / "more_positions.csv"}
SAMPLES = {"first": ATLAS / "sample.csv", "more": ATLAS / "more_sample.csv"}


# --- The sample, as a study.


@dataclass(frozen=True, kw_only=True)
class DrawnPosition:
    """A drawn position with its place, screen verdict, weight and finite-element verdict.

    The second series has the cheapest theory by the screen, and the verdict on this theory by finite elements.
    """

    inclination: str
    wheel: str
    rail: str
    shift_mm: float
    load_kN: float
    verdict: str
    p_max_percent: float
    stratum: str
    weight: float
    inclusion_probability: float
    fe_verdict: str
    fe_p_max_percent: float
    back_to_back_mm: float = _BACK_TO_BACK_MM
    cheapest_theory: str = ""
    fe_theory_verdict: str = ""

    @property
    def place(self) -> tuple[str, str, str, float, float]:
        """Inclination, wheel, rail, shift (mm) and load (kN)."""
        return self.inclination, self.wheel, self.rail, self.shift_mm, self.load_kN

    @property
    def case(self) -> Case:
        """The position as a case for finite elements."""
        return Case(
            wheel=self.wheel,
            rail=self.rail,
            inclination_rad=parse_inclination(INCLINATIONS[self.inclination]),
            lateral_shift_mm=self.shift_mm,
            load_N=1e3 * self.load_kN,
            track=Track(back_to_back_mm=self.back_to_back_mm),
            refine="never",
        )


def sample(series: str = "first") -> list[DrawnPosition]:
    """All drawn positions of a series with their finite-element verdicts."""
    kinds = DrawnPosition.__annotations__
    with SAMPLES[series].open(encoding="utf-8", newline="") as file:
        return [
            DrawnPosition(
                **{name: float(text or "nan") if kinds[name] is float else text for name, text in row.items()}
            )
            for row in csv.DictReader(file)
        ]


def cases(quick: bool = False) -> list[Case]:
    """All drawn positions in which the wheel stands.

    In quick size, three of them.
    """
    positions = [position for series in SERIES for position in sample(series)]
    cases_by_place = {position.place: position.case for position in positions if position.stratum != "refused"}
    return [case for place, case in cases_by_place.items() if not quick or place in QUICK]


def match_rows(rows: Iterable[Mapping[str, Any]]) -> Iterator[tuple[DrawnPosition, Mapping[str, Any]]]:
    """Converged rows with their drawn positions."""
    by_place = {
        _place(
            position.wheel, position.rail, position.case.inclination_rad, position.shift_mm, position.load_kN
        ): position
        for series in SERIES
        for position in sample(series)
    }
    for row in rows:
        if row["status"] == "converged":
            numbers = (float(row[name]) for name in ("inclination_rad", "lateral_shift_mm", "load_kN"))
            yield by_place[_place(str(row["wheel"]), str(row["rail"]), *numbers)], row


def _place(wheel: str, rail: str, *numbers: float) -> tuple[str | float, ...]:
    return wheel, rail, *(round(number, 6) for number in numbers)


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Checks of the screen's Hertz peaks and verdicts against finite elements.

    Peaks are compared where the screen is sure, verdicts where both decide.
    """
    matched_rows = list(match_rows(rows))
    verdict_pairs = decided_verdicts(matched_rows)
    agreed = Check(
        quantity="part of the verdicts that are the same",
        case=f"{len(verdict_pairs)} positions that both decide",
        reference="finite elements",
        kind="invariant",
        value=float(np.mean([screen == elements for screen, elements in verdict_pairs])),
        expected=1.0,
        limit_percent=100.0 - LEAST_AGREED_PERCENT,
    )
    return [agreed] + [
        Check(
            quantity="Hertz's peak off by finite elements minus by the screen, %",
            case=f"{position.wheel} on {position.rail} {position.inclination}, {position.shift_mm:g} mm,"
            f" {position.load_kN:g} kN",
            reference="finite elements",
            kind="invariant",
            value=float(row["hertz_deviation_p_max_percent"]) - position.p_max_percent,
            expected=None,
            limit_percent=PEAK_PERCENT,
            uncertainty_percent=float(row["hertz_uncertainty_p_max_percent"]),
            explanation="the screen has strips, whose uncertainty is not stated",
        )
        for position, row in matched_rows
        if position.stratum.startswith("surely") and position.place != STRIPS_ARE_OFF
    ]


def decided_verdicts(matched_rows: Iterable[tuple[DrawnPosition, Mapping[str, Any]]]) -> list[tuple[str, str]]:
    """Verdicts of the screen and of finite elements where both decide."""
    verdict_pairs = [(position.verdict, str(row["verdict_answer"])) for position, row in matched_rows]
    return [pair for pair in verdict_pairs if {*pair} <= {HOLDS, FAILS}]


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Agreement of screen and finite elements, and the share in which Hertz holds."""
    verdict_pairs = decided_verdicts(match_rows(rows))
    agreed = sum(screen == elements for screen, elements in verdict_pairs)
    shares = {series: (len(sample(series)), format_interval(share(series))) for series in SERIES}
    return (
        f"Screen and finite elements agree in {agreed} of {len(verdict_pairs)} positions that both decide. By all"
        f" {shares['first'][0]} drawn positions Hertz holds in {shares['first'][1]} of the first series of the atlas,"
        f" by {shares['more'][0]} in {shares['more'][1]} of the second series."
    )


def share(series: str = "first") -> Share:
    """Share of a series in which Hertz holds, by finite elements, with its interval."""
    drawn_positions = sample(series)
    return estimate_share(
        [
            _stratum(name, drawn_positions)
            for name in STRATA
            if any(position.stratum == name for position in drawn_positions)
        ],
        {HOLDS},
    )


def _stratum(name: str, drawn_positions: Sequence[DrawnPosition]) -> Stratum:
    """A stratum of all fleets of a series together.

    The weight of each drawn position is divided by its inclusion probability.
    """
    stratum_positions = [position for position in drawn_positions if position.stratum == name]
    weights, inclusion = (
        np.array([getattr(position, column) for position in stratum_positions])
        for column in ("weight", "inclusion_probability")
    )
    stands_for = float(np.sum(weights / inclusion))
    return Stratum(
        name=name,
        weight=stands_for,
        positions=round(float(np.sum(1.0 / inclusion))),
        guess=0.5,
        answers=np.array([position.fe_verdict for position in stratum_positions]),
        weights=weights,
        inclusion=inclusion,
    )


# --- The atlas: for each pair and shift a letter for each load.


def atlas(series: str = "first", column: str = "at") -> dict[tuple[str, str, str], dict[float, str]]:
    """Letters by load at each shift, by wheel, inclination and rail.

    The columns are `at` of the verdicts, and in the second series `theory at` of the cheapest theories.
    """
    shifts_mm = MORE_SHIFTS_MM if series == "more" else SHIFTS_MM
    with POSITIONS[series].open(encoding="utf-8", newline="") as file:
        return {
            (row["wheel"], row["inclination"], row["rail"]): {
                shift: row[f"{column} {shift:g} mm"] for shift in shifts_mm
            }
            for row in csv.DictReader(file)
        }


def count_letters(series: str, column: str = "at") -> Counter[str]:
    """Number of positions of a series by letter."""
    return Counter("".join("".join(letters.values()) for letters in atlas(series, column).values()))


def count_theories() -> Counter[str]:
    """Number of contacts of the second series by cheapest theory, without Hertz."""
    counts = count_letters("more", "theory at")
    return Counter({name: counts[letter] for name, letter in THEORY_LETTERS.items() if name != "hertz"})


def holds_up_to_kN(letters: str) -> float:
    """Largest load up to which Hertz holds at every tested load.

    The load is 0 if Hertz does not hold at the smallest load.
    """
    count = len(letters) - len(letters.lstrip("H"))
    return LOADS_KN[count - 1] if count else 0.0


def ranges(shifts_mm: Sequence[float], step_mm: float = 0.5) -> str:
    """Shifts in words, with consecutive shifts as a range.

    >>> ranges([-8.0, -7.5, -7.0, 3.0])
    '-8 to -7, 3'
    """
    runs: list[list[float]] = []
    for shift in shifts_mm:
        if runs and shift - runs[-1][-1] == step_mm:
            runs[-1].append(shift)
        else:
            runs.append([shift])
    return ", ".join(f"{run[0]:g} to {run[-1]:g}" if len(run) > 1 else f"{run[0]:g}" for run in runs) or "-"


def table(load_kN: float) -> str:
    """Markdown table of the shifts at which Hertz holds up to a load."""
    return _make_table(load_kN, "first", product(WHEELS, RAILS), tuple(INCLINATIONS), 0.5)


def more_table(load_kN: float) -> str:
    """Table of the second series, as of `table`."""
    pairs = dict.fromkeys((wheel, rail) for fleet in MORE_FLEETS.values() for wheel, _, rail in fleet.pairs)
    return _make_table(load_kN, "more", sorted(pairs, key=_sort_key), MORE_INCLINATIONS, 1.0)


def _sort_key(pair: tuple[str, str]) -> tuple[bool, bool, int, str]:
    """Order of the pairs of the second series: European, Chinese, American."""
    wheel, rail = pair
    wheels = (*WHEELS, *CHINESE_WHEELS, *AMERICAN_WHEELS)
    return wheel in AMERICAN_WHEELS, rail in CHINESE_RAILS, wheels.index(wheel), rail


def _make_table(
    load_kN: float, series: str, pairs: Iterable[tuple[str, str]], slopes: Sequence[str], step_mm: float
) -> str:
    """Markdown table with a row for each pair of wheel and rail; a cell is empty if the pair was not screened."""
    letters_by_pair = atlas(series)
    lines = [f"| wheel, rail | {' | '.join(slopes)} |", f"|---|{'---|' * len(slopes)}"]
    for wheel, rail in pairs:
        cells = [
            ranges(
                [shift for shift, letters in letters_by_shift.items() if holds_up_to_kN(letters) >= load_kN], step_mm
            )
            if (letters_by_shift := letters_by_pair.get((wheel, slope, rail)))
            else ""
            for slope in slopes
        ]
        lines.append(f"| {wheel}, {rail} | {' | '.join(cells)} |")
    return "\n".join(lines)


PairKey = tuple[str, str, str]
"""Wheel, inclination and rail."""


def figure(path: Path) -> Path:
    """Largest load up to which Hertz holds over the shift, a row per pair."""
    panels = {wheel: [(wheel, slope, rail) for slope, rail in product(INCLINATIONS, RAILS)] for wheel in WHEELS}
    drawing = blank_figure(14.0, 11.5)
    axes = list(drawing.subplots(1, len(panels), sharey=True))
    for ax, (wheel, pairs) in zip(axes, panels.items(), strict=True):
        image = _draw_panel(ax, "first", pairs)
        _separate_rows(ax, len(RAILS), len(pairs))
        ax.set_xlabel(SHIFT_LABEL, fontsize=12)
        ax.set_title(wheel, fontsize=13)
    _label_pairs(axes[0], [(rail, slope) for _, slope, rail in panels[WHEELS[0]]])
    _add_load_bar(drawing, image, axes)
    drawing.suptitle(
        "Wheel load in kN up to which Hertz holds, over the lateral shift, on 72 standard pairs", fontsize=15
    )
    return save_figure(drawing, path)


def more_figure(path: Path) -> Path:
    """Figure of the second series, as of `figure`."""
    european = list(product(MORE_INCLINATIONS, MORE_RAILS))
    further_pairs = [pair for name in ("china", "apta") for pair in MORE_FLEETS[name].pairs]
    drawing = blank_figure(16.0, 9.0)
    axes = list(drawing.subplots(1, 3, width_ratios=(1.0, 1.0, 1.0)))
    for ax, wheel in zip(axes, WHEELS, strict=False):
        image = _draw_panel(ax, "more", [(wheel, slope, rail) for slope, rail in european])
        _separate_rows(ax, len(MORE_RAILS), len(european))
        ax.set_title(wheel, fontsize=13)
        _label_pairs(ax, [(rail, slope) for slope, rail in european])
    # the label is as wide as a panel
    axes[1].set_xlabel(SHIFT_LABEL, fontsize=12)
    _draw_panel(axes[2], "more", further_pairs)
    axes[2].set_title("pairs of China, and APTA wheels", fontsize=13)
    _label_pairs(axes[2], [(f"{wheel}, {rail}", slope) for wheel, slope, rail in further_pairs])
    _add_load_bar(drawing, image, axes)
    drawing.suptitle("Wheel load in kN up to which Hertz holds, over the lateral shift, on 58 more pairs", fontsize=15)
    return save_figure(drawing, path)


def _draw_panel(ax: "Axes", series: str, pairs: Sequence[PairKey]) -> "AxesImage":
    """Draw the loads up to which Hertz holds, a row per pair."""
    from matplotlib import colormaps
    from matplotlib.colors import BoundaryNorm, ListedColormap

    letters_by_pair = atlas(series)
    letters = [letters_by_pair[pair] for pair in pairs]
    count = len(LOADS_KN) + 1
    colours = ListedColormap(colormaps["cividis"](np.linspace(0.0, 1.0, count))).with_extremes(bad="#d9d9d9")
    norm = BoundaryNorm(np.arange(count + 1) - 0.5, count)
    load_counts = [
        [np.nan if {*cell} & {*NOT_PLACED} else len(cell) - len(cell.lstrip("H")) for cell in pair_letters.values()]
        for pair_letters in letters
    ]
    shifts_mm = list(letters[0])
    half_step = 0.5 * (shifts_mm[1] - shifts_mm[0])
    extent = (shifts_mm[0] - half_step, shifts_mm[-1] + half_step, len(pairs) - 0.5, -0.5)
    image = ax.imshow(load_counts, cmap=colours, norm=norm, aspect="auto", extent=extent, interpolation="none")
    for marked_letters, mark, colour in (("O", ".", "#d55e00"), (NOT_PLACED, "x", "#606060")):
        places = [
            (shift, k)
            for k, pair_letters in enumerate(letters)
            for shift, cell in pair_letters.items()
            if {*cell} & {*marked_letters}
        ]
        ax.plot([shift for shift, _ in places], [k for _, k in places], mark, color=colour, ms=5)
    ax.set_xlim(*extent[:2])
    ax.set_ylim(*extent[2:])
    return image


def _separate_rows(ax: "Axes", rows_per_inclination: int, rows: int) -> None:
    """Draw a line between the rows of two inclinations."""
    places = np.arange(rows_per_inclination, rows, rows_per_inclination) - 0.5
    ax.hlines(places, *ax.get_xlim(), color="#ffffff", lw=2.5)


def _label_pairs(ax: "Axes", pairs: Sequence[tuple[str, str]]) -> None:
    """Label the rows with names and inclinations."""
    slopes = {name: "upright" if text == "0" else text for name, text in INCLINATIONS.items()}
    ax.set_yticks(range(len(pairs)), [f"{name} {slopes[slope]}" for name, slope in pairs], fontsize=11)


def _add_load_bar(drawing: "Figure", image: "AxesImage", axes: Sequence["Axes"]) -> None:
    """Add the scale of the loads."""
    ticks = range(len(LOADS_KN) + 1)
    bar = drawing.colorbar(image, ax=axes, location="bottom", shrink=0.6, aspect=40, pad=0.02, ticks=ticks)
    bar.set_ticklabels(["not at 25", *(f"{load:g}" for load in LOADS_KN[:-1]), "125 or more"], fontsize=12)
    bar.set_label("kN; dot: open at one of the loads or more; cross: its flange climbs", fontsize=12)


# --- Making it.


def make(out: Path, workers: int, series: str) -> None:
    """Screen the fleets of a series and solve their samples.

    Finished results are reused.
    """
    settings = RunSettings(workers=workers)
    for name, fleet in SERIES[series].items():
        folder = out / name
        run_fleet(write_text(out / f"{name}.toml", fleet.file_text), folder, settings=settings)
        solve_sample(folder, draw_sample(folder, fleet.draws, fleet.seed), open_fleet(folder).case, settings)


def collect(out: Path, series: str) -> None:
    """Write the results of the fleets of a series to `atlas/` and draw its figure."""
    pairs: list[dict[str, Any]] = []
    positions: list[dict[str, Any]] = []
    for name, fleet in SERIES[series].items():
        with open_tables(out / name) as tables:
            pairs += _pair_rows(fleet, query_rows(tables, "SELECT * FROM screened"), series)
            positions += _sample_rows(fleet, tables, out / name, series)
    write_csv(pairs, POSITIONS[series])
    write_csv(positions, SAMPLES[series])
    print(figure(FIGURE) if series == "first" else more_figure(MORE_FIGURE))
    for load in (50.0, 100.0):
        text = table(load) if series == "first" else more_table(load)
        print(f"Shifts in mm at which Hertz holds up to {load:g} kN:\n{text}")


def _pair_rows(fleet: AtlasFleet, screened: Sequence[Mapping[str, Any]], series: str) -> Iterator[dict[str, Any]]:
    """Rows of pairs, with the letters of the loads at each shift.

    The second series has the letters of the cheapest theories too.
    """
    letters, theory_letters = (
        {
            tuple(row[name] for name in ("wheel", "rail", "shift_mm", "load_kN")): letter_by_text.get(row[column])
            for row in screened
        }
        for column, letter_by_text in (("verdict", LETTERS), ("cheapest_theory", THEORY_LETTERS | {None: NO_THEORY}))
    )
    columns = {"at": letters} | ({"theory at": theory_letters} if series == "more" else {})
    for wheel, slope, rail in fleet.pairs:
        words = {
            f"{column} {shift:g} mm": "".join(by_position[wheel, rail, shift, load] for load in LOADS_KN)
            for column, by_position in columns.items()
            for shift in fleet.shifts_mm
        }
        yield {"wheel": wheel, "inclination": slope, "rail": rail, **words}


def _sample_rows(
    fleet: AtlasFleet, tables: "DuckDBPyConnection", folder: Path, series: str
) -> Iterator[dict[str, Any]]:
    """Rows of the drawn positions.

    The second series has the cheapest theory and its verdict by finite elements too.

    All positions of a fleet have the same weight. It is 1 here, so that fleets of different sizes can be joined.
    """
    more_names = ("back_to_back_mm", "cheapest_theory", "fe_theory_verdict")
    names = ", ".join(name for name in DrawnPosition.__annotations__ if name not in ("inclination", *more_names))
    rows = query_rows(
        tables,
        f"SELECT {names}, cheapest_theory, fe_case FROM screen JOIN (SELECT {POSITION_COLUMNS}, fe_case,"
        f" {_SAMPLE_COLUMNS} FROM sample) USING ({POSITION_COLUMNS}) ORDER BY ALL",
    )
    (contact_row,) = query_rows(tables, "SELECT count(*) AS contacts FROM screen")
    with (folder / "sample" / "study.csv").open(encoding="utf-8", newline="") as file:
        study_rows = {row["id"]: row for row in csv.DictReader(file)}
    for row in rows:
        theory, study_row = row.pop("cheapest_theory"), study_rows[row.pop("fe_case")]
        theory_verdict = "" if row["fe_verdict"] == UNSOLVED else study_row[f"{theory}_verdict_answer"]
        more_values = (fleet.back_to_back_mm, theory, theory_verdict)
        yield {
            "inclination": fleet.inclination,
            **row,
            "weight": round(row["weight"] * contact_row["contacts"], 9),
            **(dict(zip(more_names, more_values, strict=True)) if series == "more" else {}),
        }


def main() -> None:
    from fecontact.cli import run_script

    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--screen", action="store_true")
    parser.add_argument("--series", choices=tuple(SERIES))
    parser.add_argument("--out", type=Path, default=Path("out/20_atlas"))
    parser.add_argument("--workers", type=int, default=2)
    options, _ = parser.parse_known_args()
    if not options.screen:
        run_script(__file__)
        return
    for series in SERIES if options.series is None else (options.series,):
        make(options.out, options.workers, series)
        collect(options.out, series)


if __name__ == "__main__":
    main()
