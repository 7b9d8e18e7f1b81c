"""Comparison of numbers in the README and the guide with data of the repository."""

import csv
from itertools import groupby
from pathlib import Path

import pytest
from test_documents import TEXTS

ROOT = Path(__file__).parents[1]
GUIDE = "fecontact/guide"


def rows_of(path: str) -> list[dict[str, str]]:
    with (ROOT / path).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def text_of_page(page: str) -> str:
    """A page with single blanks in place of line breaks."""
    return " ".join(TEXTS[page].split())


class Map:
    """The README's map, from its stored loads."""

    def __init__(self) -> None:
        rows = sorted(
            rows_of("studies/figures/map.csv"), key=lambda row: (float(row["lateral_shift_mm"]), float(row["load_kN"]))
        )
        self.by_shift = {
            shift: list(rows_at_shift)
            for shift, rows_at_shift in groupby(rows, key=lambda row: float(row["lateral_shift_mm"]))
        }
        self.cells = [row for row in rows if row["status"] != "tried for the limit"]

    def shifts_with_verdict(self, verdict: str) -> list[float]:
        """Shifts with this verdict at all loads."""
        return [shift for shift, rows in self.by_shift.items() if {row["verdict"] for row in rows} == {verdict}]

    def limits_kN(self) -> dict[float, float]:
        """Largest load (kN) at which Hertz holds, by shift.

        Shifts without such a load are left out.
        """
        limits = {}
        for shift, rows in self.by_shift.items():
            verdicts = [row["verdict"] for row in rows]
            if verdicts[0] == "HOLDS" and {*verdicts} != {"HOLDS"}:
                end = next(at for at, verdict in enumerate(verdicts) if verdict != "HOLDS")
                assert "HOLDS" not in verdicts[end:], shift
                limits[shift] = float(rows[end - 1]["load_kN"])
        return limits

    def numbers(self, shifts: list[float], column: str) -> list[float]:
        return [float(row[column]) for row in self.cells if float(row["lateral_shift_mm"]) in shifts]


@pytest.fixture(scope="module")
def load_map() -> Map:
    return Map()


def list_numbers(numbers) -> str:
    *first, last = (f"{number:g}" for number in numbers)
    return f"{', '.join(first)} and {last}"


def test_the_map_has_all_its_cells(load_map):
    loads = [10.0, 20.0, 50.0, 80.0, 100.0, 125.0, 150.0]
    assert [*load_map.by_shift] == [-6.0 + 0.5 * step for step in range(25)]
    assert sorted(float(row["load_kN"]) for row in load_map.cells) == sorted(loads * 25)
    assert {row["status"] for row in load_map.cells} == {"converged"}
    kinds = {*load_map.shifts_with_verdict("HOLDS"), *load_map.shifts_with_verdict("FAILS"), *load_map.limits_kN()}
    assert kinds == {*load_map.by_shift}


@pytest.mark.parametrize("page", ["README.md", f"{GUIDE}/maps.md"])
def test_where_hertz_holds_and_fails_at_all_loads(page, load_map):
    holds, fails = load_map.shifts_with_verdict("HOLDS"), load_map.shifts_with_verdict("FAILS")
    assert holds == [*(-6.0 + 0.5 * step for step in range(9)), 4.0]
    assert "From -6 to -2 mm and at 4 mm Hertz holds at all loads." in text_of_page(page)
    assert fails == [0.0, 0.5, 1.0, 5.0]
    off = load_map.numbers([0.0, 0.5, 1.0], "p_max_percent")
    text = "From 0 to 1 mm, where two parts of the head carry the wheel, it fails at all loads, with a peak"
    numbers = f"up to {-min(off):.0f} % too low and {max(off):.0f} % too high"
    assert text in text_of_page(page)
    assert numbers in text_of_page(page)
    off = load_map.numbers([5.0], "p_max_percent")
    separate = load_map.numbers([5.0], "separate_load_percent")
    assert separate[0] == max(separate)
    assert (
        f"At 5 mm it fails at all loads too, with a peak that is {min(off):.0f} to {max(off):.0f} % too high: a second"
        f" patch takes {separate[0]:.0f} % of the load at 10 kN"
    ) in text_of_page(page)


def test_the_readme_has_the_range_of_the_load_limits(load_map):
    limits = load_map.limits_kN().values()
    text = f"At the other shifts it holds up to a load limit, {min(limits):.0f} to {max(limits):.0f} kN"
    assert text in text_of_page("README.md")


def test_the_guide_has_each_load_limit(load_map):
    limits, text = load_map.limits_kN(), text_of_page(f"{GUIDE}/maps.md")
    for shifts in ([-1.5, -1.0, -0.5], [1.5, 2.0, 2.5, 3.0, 3.5, 4.5], [5.5, 6.0]):
        ends = list_numbers(float(f"{limits.pop(shift):.3g}") for shift in shifts)
        assert f"t {list_numbers(shifts)} mm it holds up to {ends} kN" in text, ends
    assert limits == {}
    unresolved = [row for row in load_map.cells if row["verdict"] == "UNRESOLVED"]
    assert len(unresolved) == 2
    assert f"Two of the {len(load_map.cells)} cells are unresolved" in text


def test_the_case_of_the_page_on_results_is_that_of_the_baseline():
    (row,) = (
        row for row in rows_of("studies/baselines/20_atlas.csv") if row["id"] == "60E1_S1002_+3.00mm_100kN_d57239c3"
    )
    value = {
        name: float(row[name])
        for name in row
        if row[name] and name.startswith(("fe_", "hertz_")) and name.endswith(("MPa", "mm2", "percent"))
    }
    lines = [" ".join(line.split()) for line in TEXTS[f"{GUIDE}/results.md"].splitlines()]
    area = f"{value['hertz_deviation_area_percent']:+.2f} %", f"{value['hertz_uncertainty_area_percent']:.2f} %"
    assert (
        f"Hertz FAILS; furthest beyond its limit: area {area[0]} ± {area[1]} (limit ±10 %);"
        f" cause: {row['verdict_cause']}"
    ) in lines
    peak = f"{value['hertz_deviation_p_max_percent']:+.2f} %", f"{value['hertz_uncertainty_p_max_percent']:.2f} %"
    for name, measure, off, limit, answer in (
        ("peak pressure (MPa)", "p_max_MPa", peak, 5, "HOLDS"),
        ("area (mm²)", "area_mm2", area, 10, "FAILS"),
    ):
        numbers = [f"{value[f'{method}_{measure}']:.5g}" for method in ("fe", "hertz")]
        assert f"{name} {' '.join([*numbers, *off])} ±{limit} % {answer}" in lines
