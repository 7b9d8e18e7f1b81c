"""Changes that would decide unresolved positions and their cost, against sums over rows."""

import math
from itertools import cycle

import numpy as np
import pyarrow.parquet
import pytest
from made_fleet import Made, seal, write

from fecontact.features.fleet.answer import evaluate_fleet
from fecontact.features.fleet.open_positions import FILES_SECONDS, SolutionTime, find_solution_time
from fecontact.features.fleet.report import explain_answer, make_report_parts
from fecontact.features.fleet.tables import open_tables
from fecontact.jobs.remaining import format_duration
from fecontact.outputs.tables import Table
from fecontact.runs.cost import STUDY_FILES_S
from fecontact.solving.cost import START_SECONDS
from fecontact.solving.preview import preview_case_to_solve

CAUSES = ("filter", "noise", "accuracy of the screen", "nominal profile")
PLACE = ("wheel", "rail", "shift_mm", "load_kN")


def rows_of(path) -> list[dict]:
    return pyarrow.parquet.read_table(path).to_pylist()


def place_of(row: dict) -> tuple:
    return tuple(row[name] for name in PLACE)


@pytest.fixture
def fleet(fleet) -> Made:
    """A made fleet with a cause of each unresolved position; its first wheel has an exact profile."""
    for path in sorted((fleet.folder / "screen").iterdir()):
        causes, rows = cycle(CAUSES), rows_of(path)
        for row in rows:
            row["open_because"] = next(causes) if row["verdict"] == "OPEN" else None
            for number, column in enumerate(("filter_4_mm", "filter_5_7_mm", "filter_8_mm")):
                decided = row["open_because"] == "filter" and row["shift_mm"] < 6.0 * number - 3.0
                row[column] = "HOLDS" if decided else "OPEN" if row["verdict"] == "OPEN" else row["verdict"]
        write(path, rows)
    profiles = rows_of(fleet.folder / "profiles.parquet")
    profiles[0]["noise_um"] = None
    write(fleet.folder / "profiles.parquet", profiles)
    seal(fleet.folder)
    return fleet


def open_rows(fleet: Made, cause: str) -> list[dict]:
    return [row for row in rows_of(fleet.folder / "screen") if row["open_because"] == cause]


def test_counts_and_times_of_each_cause_are_sums_over_its_positions(fleet, sampled):
    sampled(fleet, 300)
    answer = evaluate_fleet(fleet.folder)
    sample = {place_of(row): row for row in rows_of(fleet.folder / "sample.parquet")}
    total = math.fsum(row["weight"] for row in rows_of(fleet.folder / "screen"))
    # the time of a solved position is a tenth of its load; a failed solution has no time
    times = [
        0.1 * row["load_kN"]
        for cause in CAUSES
        for row in open_rows(fleet, cause)
        if place_of(row) in sample and sample[place_of(row)]["fe_verdict"] != "UNSOLVED"
    ]
    assert len(times) > 20
    assert answer.solution_time == SolutionTime(
        cpu_seconds=pytest.approx(np.mean(times)),
        low=pytest.approx(4.0),
        high=pytest.approx(12.0),
        positions=len(times),
        is_measured=True,
        are_open=True,
    )
    assert sorted(row["value"] for row in answer.open_causes) == sorted(CAUSES)
    for row in answer.open_causes:
        positions = open_rows(fleet, row["value"])
        solved_rows = [sample[place_of(position)] for position in positions if place_of(position) in sample]
        assert 0 < len(solved_rows) < len(positions)
        assert (row["positions"], row["solved"]) == (len(positions), len(solved_rows))
        assert row["share"] == pytest.approx(math.fsum(position["weight"] for position in positions) / total)
        assert row["decided_by_elements"] == sum(
            row_of_sample["fe_verdict"] in ("HOLDS", "FAILS") for row_of_sample in solved_rows
        )
        # the exact wheel cannot be measured again
        assert row["wheels"] == len({position["wheel"] for position in positions} - {"w0"})
        assert row["rails"] == len({position["rail"] for position in positions})
        for column in ("filter_4_mm", "filter_5_7_mm", "filter_8_mm"):
            assert row[f"decided_by_{column}"] == sum(position[column] == "HOLDS" for position in positions)
        left = len(positions) - len(solved_rows)
        assert row["elements_cpu_seconds"] == pytest.approx(left * (np.mean(times) + STUDY_FILES_S[0]))


def test_the_report_says_what_decides_them_and_on_which_basis(fleet, sampled):
    sampled(fleet, 300)
    answer = evaluate_fleet(fleet.folder)
    (sentence,) = (text for text in explain_answer(answer) if text.startswith("What would decide"))
    rows = {row["value"]: row for row in answer.open_causes}
    assert f"What would decide {sum(row['positions'] for row in rows.values())} unresolved positions: " in sentence
    accuracy, noise, by_filter = (rows[name] for name in ("accuracy of the screen", "noise", "filter"))
    minutes = accuracy["elements_cpu_seconds"] / 60.0
    assert 100.0 / 60.0 < minutes < 100.0
    assert (
        f"finite elements at {accuracy['positions']} (about {minutes:.0f} min of CPU time; {accuracy['solved']} are"
        " solved)"
    ) in sentence
    measured = f"{noise['wheels']} wheels and {noise['rails']} rails"
    assert f"less noise, or closer points at {noise['positions']} (measure up to {measured} again)" in sentence
    assert by_filter["decided_by_filter_8_mm"] > by_filter["decided_by_filter_5_7_mm"] > 0
    # 22 files, 120 pairs, three variants of 5 shifts and 15 positions
    screening_s = 22 * 0.35 + 120 * (0.025 + 3 * (5 * 0.006 + 15 * 0.013))
    assert answer.new_screening_s == pytest.approx(screening_s)
    assert (
        f"a declared filter length at {by_filter['positions']} ({by_filter['decided_by_filter_4_mm']} by 4.0 mm,"
        f" {by_filter['decided_by_filter_5_7_mm']} by 5.7 mm, {by_filter['decided_by_filter_8_mm']} by 8.0 mm;"
        f" screening again takes about {format_duration(screening_s)} of CPU time)"
    ) in sentence
    parts = list(make_report_parts(answer, fleet.folder))
    time = answer.solution_time
    assert f"mean of {time.positions} solved unresolved positions of the sample, 4.0 to 12.0 CPU s" in time.words
    assert f"Finite elements take {time.words}." in parts
    (table,) = (
        section for section in parts if isinstance(section, Table) and section.title.startswith("What would decide")
    )
    shown_times = {row.cells[0]: row.cells[-1] for row in table.rows}
    assert shown_times["accuracy of the screen: finite elements"] == f"{minutes:.0f} min"


def test_few_times_of_unresolved_positions_are_not_their_mean(fleet, sampled):
    sampled(fleet, 10)
    sample = {place_of(row): row for row in rows_of(fleet.folder / "sample.parquet")}
    drawn_open = [row for cause in CAUSES for row in open_rows(fleet, cause) if place_of(row) in sample]
    assert 0 < len(drawn_open) < 5
    times = [0.1 * row["load_kN"] for row in sample.values() if row["fe_verdict"] != "UNSOLVED"]
    time = evaluate_fleet(fleet.folder).solution_time
    assert (time.positions, time.are_open, time.is_measured) == (len(times), False, True)
    assert time.cpu_seconds == pytest.approx(np.mean(times))
    assert f"mean of {len(times)} solved positions of the sample" in time.words


def test_without_a_sample_the_time_is_that_of_previews(fleet):
    with open_tables(fleet.folder) as tables:
        time = find_solution_time(tables, fleet.case)
    positions = sorted(place_of(row) for cause in CAUSES for row in open_rows(fleet, cause))
    chosen = [positions[0], positions[round((len(positions) - 1) / 2)], positions[-1]]
    seconds = [preview_case_to_solve(fleet.case(*place)).cpu_seconds - START_SECONDS for place in chosen]
    assert time.cpu_seconds == pytest.approx(np.mean(seconds))
    assert (time.low, time.high, time.positions) == (min(seconds), max(seconds), 3)
    assert "mean estimated from the meshes of 3 unresolved positions" in time.words
    answer = evaluate_fleet(fleet.folder, fleet.case)
    (row,) = (row for row in answer.open_causes if row["value"] == "noise")
    assert row["elements_cpu_seconds"] == pytest.approx(row["positions"] * (time.cpu_seconds + FILES_SECONDS))


def test_an_unknown_time_is_said_to_be_unknown(fleet, sampled):
    answer = evaluate_fleet(fleet.folder)
    assert answer.solution_time is None
    assert {row["elements_cpu_seconds"] for row in answer.open_causes} == {None}
    assert "(CPU time unknown)" in " ".join(explain_answer(answer))
    # a sample of an earlier version has no times
    sampled(fleet, 60)
    with open_tables(fleet.folder) as tables:
        assert find_solution_time(tables, None) is not None
        tables.execute("CREATE TABLE stored AS SELECT * EXCLUDE (fe_cpu_seconds) FROM sample")
        tables.execute("CREATE OR REPLACE VIEW sample AS SELECT * FROM stored")
        assert find_solution_time(tables, None) is None
