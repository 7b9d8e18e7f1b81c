"""The report of a fleet, against independent sums over its positions."""

import csv
import math
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pyarrow.parquet
import pytest
from made_fleet import LOADS_KN, SHIFTS_MM, made_fleet, seal, write

from fecontact.errors import InputError
from fecontact.features.fleet.answer import choose_limits, evaluate_fleet
from fecontact.features.fleet.estimate import estimate_share
from fecontact.features.fleet.report import (
    format_interval,
    format_percent,
    make_answer_rows,
    make_report_parts,
    write_headline,
    write_report,
)
from fecontact.files import read_json
from fecontact.outputs.tables import Table


def rows_of(folder) -> list[dict]:
    return pyarrow.parquet.read_table(folder).to_pylist()


def share(rows, verdict: str) -> float:
    return math.fsum(row["weight"] for row in rows if row["verdict"] == verdict) / math.fsum(
        row["weight"] for row in rows
    )


def test_shares_by_the_screen_are_sums_of_weights(fleet):
    rows, answer = rows_of(fleet.folder / "screen"), evaluate_fleet(fleet.folder)
    assert answer.whole.positions == len(rows) == 1800
    assert answer.whole.weight == pytest.approx(1.0)
    for name, verdict in (("holds", "HOLDS"), ("fails", "FAILS"), ("open", "OPEN"), ("refused", "REFUSED")):
        assert answer.whole.screen[name] == pytest.approx(share(rows, verdict))
    assert len(answer.cells) == len(SHIFTS_MM) * len(LOADS_KN)
    for cell in answer.cells:
        cell_rows = [row for row in rows if (row["shift_mm"], row["load_kN"]) == (cell["shift"], cell["load"])]
        assert (cell["holds"] or 0.0) == pytest.approx(share(cell_rows, "HOLDS"))
    low, high = answer.whole.bounds
    assert high - low == pytest.approx(share(rows, "OPEN") + share(rows, "REFUSED"))
    assert "By the screen alone" in write_headline(answer)


def test_groups_are_sums_over_their_profiles(fleet):
    answer, rows = evaluate_fleet(fleet.folder), rows_of(fleet.folder / "screen")
    lines = {row["name"]: row["line"] for row in rows_of(fleet.folder / "profiles.parquet") if row["body"] == "rail"}
    for line in ("line A", "line B"):
        group = answer.groups["rail", "line", line]
        line_rows = [row for row in rows if lines[row["rail"]] == line]
        assert group.weight == pytest.approx(sum(row["weight"] for row in line_rows))
        assert group.screen["holds"] == pytest.approx(share(line_rows, "HOLDS"))
    # what all have alike, names, and what no profile of a body has make no groups
    assert {key[:2] for key in answer.groups} == {
        ("wheel", "wear_mm"),
        ("wheel", "mileage_km"),
        ("rail", "wear_mm"),
        ("rail", "line"),
    }
    wear = [group for key, group in answer.groups.items() if key[:2] == ("wheel", "wear_mm")]
    # twelve wheels in four classes, with 150 positions for each wheel; round limits move wheels between classes
    assert len(wear) == 4
    assert min(group.positions for group in wear) >= 150
    assert sum(group.positions for group in wear) == 1800
    assert sum(group.weight for group in wear) == pytest.approx(1.0)


def test_classes_have_the_profiles_between_their_round_limits(fleet):
    answer = evaluate_fleet(fleet.folder)
    wheels = [row for row in rows_of(fleet.folder / "profiles.parquet") if row["body"] == "wheel"]
    for column in ("wear_mm", "mileage_km"):
        classes = {
            value: group for (body, name, value), group in answer.groups.items() if (body, name) == ("wheel", column)
        }
        assert len(classes) == 4
        for value, group in classes.items():
            limits = [float(number) for number in re.findall(r"[\d.]+", value)]
            low = -math.inf if value.startswith("up to") else limits[0]
            high = math.inf if value.startswith("above") else limits[-1]
            names = {row["name"] for row in wheels if row["status"] == "read" and low < row[column] <= high}
            assert group.positions == 150 * len(names) > 0
            # limits are round: at most three digits
            assert all(len(f"{limit:g}".replace(".", "").strip("0")) <= 3 for limit in limits)


@pytest.mark.parametrize(
    ("values", "limits"),
    [
        # quartiles 2.75, 5.5, 8.25 of 1 to 10, in steps of 0.5
        (np.arange(1.0, 11.0), [3.0, 5.5, 8.0]),
        # an outlier does not make the limits coarse
        (np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 1e9, 2.5]), [2.8, 5.5, 8.2]),
        # six mileages make three classes, not six
        (np.array([10e3, 20e3, 30e3, 40e3, 50e3, 60e3]), [25e3, 45e3]),
        (np.array([1.0, 2.0, 3.0]), []),
        (np.full(20, 7.0), []),
        (np.array([]), []),
    ],
)
def test_limits_of_classes_are_round_quantiles(values, limits):
    chosen = choose_limits(values)
    assert len(chosen) == len(limits)
    if limits:
        step = 0.1 * np.ptp(np.quantile(values, [0.1, 0.9]))
        assert chosen == pytest.approx(limits, abs=step)


def test_the_sample_covers_the_truth(fleet, sampled):
    sampled(fleet, 300)
    answer = evaluate_fleet(fleet.folder)
    estimate = answer.whole.share("HOLDS")
    assert answer.whole.drawn == 300
    assert estimate.low < fleet.share < estimate.high
    assert estimate.high - estimate.low < 0.09
    low, high = answer.whole.bounds
    assert low == estimate.low
    undecided = math.fsum(fleet.weights[key] for key, verdict in fleet.truth.items() if verdict in ("OPEN", "UNSOLVED"))
    assert estimate.high < high < fleet.share + undecided + 0.06
    for line in ("line A", "line B"):
        share = answer.groups["rail", "line", line].share("HOLDS")
        assert share.high - share.low > estimate.high - estimate.low
    # the network is less known than these profiles
    assert answer.network.low < estimate.low < estimate.high < answer.network.high
    assert write_headline(answer).startswith(f"Hertz holds in {format_interval(estimate)} of the positions; ")


@pytest.mark.slow
def test_many_samples_cover_the_truth(fleet, sampled):
    covers = []
    for seed in range(20):
        for name in ("sample.parquet", "sample.json"):
            (fleet.folder / name).unlink(missing_ok=True)
        sampled(fleet, 100, seed)
        share = evaluate_fleet(fleet.folder).whole.share("HOLDS")
        covers.append(share.low <= fleet.share <= share.high)
    # 17 or more of 20 with a probability of 98.4 %, if 95 % are covered
    assert sum(covers) >= 17


def test_discordance_is_counted_by_stratum(fleet, sampled):
    sampled(fleet, 300)
    sample = rows_of(fleet.folder / "sample.parquet")
    said = {
        (row["wheel"], row["rail"], row["shift_mm"], row["load_kN"]): row["verdict"]
        for row in rows_of(fleet.folder / "screen")
    }
    strata = {row["stratum"]: row for row in evaluate_fleet(fleet.folder).strata}
    for name, row in strata.items():
        stratum_rows = [draw_row for draw_row in sample if draw_row["stratum"] == name]
        pairs = [
            (
                said[draw_row["wheel"], draw_row["rail"], draw_row["shift_mm"], draw_row["load_kN"]],
                draw_row["fe_verdict"],
            )
            for draw_row in stratum_rows
        ]
        assert row["drawn"] == len(stratum_rows)
        assert row["discordant"] == sum(pair in {("HOLDS", "FAILS"), ("FAILS", "HOLDS")} for pair in pairs)
    # none of the sure ones was at odds, which is not none of all
    assert strata["surely holds"]["discordant"] == 0
    assert strata["surely holds"]["discordant_high_percent"] > 1e2 * 3.0 / strata["surely holds"]["drawn"]


def test_a_screen_that_changed_is_not_judged_by_an_old_sample(fleet, sampled):
    sampled(fleet, 60)
    path = fleet.folder / "screen" / "part-0.parquet"
    rows = rows_of(path)
    write(path, [row | {"verdict": "FAILS", "margin": -5.0} for row in rows])
    seal(fleet.folder)
    with pytest.raises(InputError, match="since the draw, the screen verdict or the weight changed at"):
        evaluate_fleet(fleet.folder)


def test_an_empty_part_is_told(tmp_path):
    # a fleet that the screen refuses altogether has no margins and no worst pairs
    fleet_made = made_fleet(tmp_path / "one", wheels=2, rails=2, parts=1)
    path = fleet_made.folder / "screen" / "part-0.parquet"
    write(path, [row | {"verdict": "REFUSED", "margin": None} for row in rows_of(path)])
    seal(fleet_made.folder)
    answer = evaluate_fleet(fleet_made.folder)
    assert (answer.network, answer.worst, answer.theories) == (None, [], [])
    assert answer.causes == []
    assert [(row["verdict"], row["kind"]) for row in answer.refusals] == [
        ("REFUSED", "no reason given"),
        ("REFUSED", "the wheel does not run on the rail"),
    ]
    assert sum(row["share"] for row in answer.refusals) == pytest.approx(1.0)
    assert answer.whole.bounds == (0.0, pytest.approx(1.0))
    write_report(answer, fleet_made.folder)


def test_percent_tells_near_0_and_100_from_them():
    assert [format_percent(share) for share in (0.0, 1.0, 0.5, 0.011, 0.0004, 0.99996)] == [
        "0",
        "100",
        "50",
        "1",
        "0.04",
        "99.996",
    ]


def test_report_has_its_parts_and_files(fleet, sampled):
    sampled(fleet, 120)
    answer = evaluate_fleet(fleet.folder)
    assert len(answer.worst) == 20
    answer = replace(answer, worst=answer.worst[:3])
    page = write_report(answer, fleet.folder, fleet.case)
    text = page.read_text("utf-8")
    page_root = ElementTree.fromstring(text.removeprefix("<!DOCTYPE html>\n"))
    (headline,) = ("".join(heading.itertext()) for heading in page_root.iter("h1"))
    subject = next("".join(line.itertext()) for line in page_root.iter("p") if line.get("class") == "subject")
    assert headline.startswith("Hertz holds in ")
    assert (
        f"{headline}; {subject}"
        == f"{headline}; Fleet {fleet.folder.name}; {write_headline(answer)[len(headline) + 2 :]}."
    )
    assert text.count("<img") == 2 + len(answer.worst)
    for name in ("map.png", "map.svg", "groups.png", "cells.csv", "strata.csv", "worst.csv", "causes.csv"):
        assert (fleet.folder / "report" / name).is_file()
    with (fleet.folder / "answer.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 1 + len(answer.groups)
    assert float(rows[0]["holds_percent"]) == pytest.approx(
        1e2 * estimate_share(answer.whole.strata, {"HOLDS"}).estimate
    )
    tables = [section for section in make_report_parts(answer, fleet.folder) if isinstance(section, Table)]
    assert all(len(row.cells) == len(table.columns) for table in tables for row in table.rows)
    assert len(make_answer_rows(answer)) == len(rows)
    assert read_json(fleet.folder / "fleet.json")["population"] in text


def test_shifts_that_were_drawn_at_random_are_rounded(fleet):
    path = fleet.folder / "screen"
    rows, random = rows_of(path), np.random.default_rng(1)
    for file in path.iterdir():
        file.unlink()
    write(path / "part-0.parquet", [row | {"shift_mm": float(random.uniform(-8.0, 8.0))} for row in rows])
    seal(fleet.folder)
    answer = evaluate_fleet(fleet.folder)
    assert {cell["shift"] for cell in answer.cells} <= set(np.arange(-8.0, 8.5, 0.5))
    assert math.fsum(cell["weight"] for cell in answer.cells) == pytest.approx(1.0)


def test_shifts_and_loads_that_go_together_are_rounded(fleet):
    path = fleet.folder / "screen"
    rows = rows_of(path)
    for file in path.iterdir():
        file.unlink()
    # seven of them, each of its own shift and its own load
    places = [{"shift_mm": 1.1 * k - 3.0, "load_kN": 52.3 + 1.7 * k} for k in range(7)]
    moved_rows = [row | places[number % 7] for number, row in enumerate(rows)]
    write(path / "part-0.parquet", moved_rows)
    seal(fleet.folder)
    answer = evaluate_fleet(fleet.folder)
    expected = {(0.5 * round(2.0 * place["shift_mm"]), 10.0 * round(0.1 * place["load_kN"])) for place in places}
    assert {(cell["shift"], cell["load"]) for cell in answer.cells} == expected
    assert math.fsum(cell["weight"] for cell in answer.cells) == pytest.approx(1.0)
