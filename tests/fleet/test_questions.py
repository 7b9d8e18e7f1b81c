"""The five questions of the guide, asked of a fleet and answered by sums over its rows."""

import math
import re
from collections import defaultdict
from pathlib import Path

import duckdb
import pyarrow.parquet
import pytest
from made_fleet import made_fleet

GUIDE = Path(__file__).parents[2] / "fecontact" / "guide" / "fleet.md"
QUESTIONS = re.findall(r"^([^\n]*\?)\n\n```sql\n(.*?)```", GUIDE.read_text("utf-8"), re.MULTILINE | re.DOTALL)


@pytest.fixture
def answered_fleet(tmp_path, monkeypatch, sampled):
    """The result of each question, and the rows of the fleet."""
    fleet_made = made_fleet(tmp_path / "out" / "fleet")
    sampled(fleet_made, 200)
    monkeypatch.chdir(tmp_path)
    screen = pyarrow.parquet.read_table(fleet_made.folder / "screen").to_pylist()
    profiles = pyarrow.parquet.read_table(fleet_made.folder / "profiles.parquet").to_pylist()
    return [duckdb.sql(sql).fetchall() for _, sql in QUESTIONS], screen, profiles, fleet_made


def test_five_questions_are_answered_right(answered_fleet):
    (lines, wheels, loads, peaks, against), screen, profiles, fleet_made = answered_fleet
    profiles_by_name = {(profile["body"], profile["name"]): profile for profile in profiles}

    def percent(verdict, rows) -> float:
        return 1e2 * math.fsum(row["weight"] for row in rows if row["verdict"] == verdict)

    def group_rows(key_of) -> dict:
        rows_by_key = defaultdict(list)
        for row in screen:
            rows_by_key[key_of(row)].append(row)
        return rows_by_key

    def whole(rows) -> float:
        return math.fsum(row["weight"] for row in rows)

    of_line = group_rows(lambda row: profiles_by_name["rail", row["rail"]]["line"])
    assert {line: share for line, share in lines} == {
        line: pytest.approx(percent("HOLDS", rows) / whole(rows)) for line, rows in of_line.items()
    }
    of_wheel = group_rows(lambda row: row["wheel"])
    failing = {wheel: percent("FAILS", rows) / whole(rows) for wheel, rows in of_wheel.items()}
    worst = sorted(failing, key=lambda wheel: -failing[wheel])[:10]
    assert wheels == [
        (profile, profiles_by_name["wheel", profile]["mileage_km"], pytest.approx(failing[profile]))
        for profile in worst
    ]
    of_cell = group_rows(lambda row: (row["shift_mm"], row["load_kN"]))
    half = [cell for cell, rows in of_cell.items() if percent("HOLDS", rows) >= 50.0 * whole(rows)]
    shifts = sorted({row["shift_mm"] for row in screen})
    assert loads == [
        (profile, max((load for shift, load in half if shift == profile), default=None)) for profile in shifts
    ]
    high = [row for row in screen if row["hertz_p_max_MPa"] > 1500.0]
    assert 0 < len(high) < len(screen)
    for verdict, share, off in peaks:
        rows = [row for row in high if row["verdict"] == verdict]
        assert share == pytest.approx(percent(verdict, rows))
        assert off == pytest.approx(math.fsum(row["p_max_percent"] for row in rows) / len(rows))
    sample = pyarrow.parquet.read_table(fleet_made.folder / "sample.parquet").to_pylist()
    said = {(row["wheel"], row["rail"], row["shift_mm"], row["load_kN"]): row for row in screen}
    wrong = [
        key
        for row in sample
        if (said[key := (row["wheel"], row["rail"], row["shift_mm"], row["load_kN"])]["verdict"], row["fe_verdict"])
        in {("HOLDS", "FAILS"), ("FAILS", "HOLDS")}
    ]
    assert {row[:4] for row in against} == set(wrong)
    assert len(against) == len(wrong) > 0


def test_there_are_five():
    assert len(QUESTIONS) == 5
