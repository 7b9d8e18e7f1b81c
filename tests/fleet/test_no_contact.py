"""Positions of a fleet at which the wheel cannot stand, and reasons of refusals."""

import math
import pickle
import re

import pytest
from made_fleet import seal, write
from pyarrow.parquet import read_table

from fecontact import Case
from fecontact.errors import ConvergenceError, InputError
from fecontact.features.fleet.answer import evaluate_fleet
from fecontact.features.fleet.reading import StoredProfile
from fecontact.features.fleet.report import make_answer_rows, make_report_parts, write_headline, write_report
from fecontact.features.fleet.sampling import draw_sample
from fecontact.features.fleet.screening import ScreeningPair, make_refusal_columns
from fecontact.outputs.tables import Table
from fecontact.placement.problems import PlacementError, PositionProblem
from fecontact.placement.wheel_on_rail import place
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.reading import Reading
from fecontact.solving.placing import place_at_shifts, place_case, place_or_explain


def rows_of(folder) -> list[dict]:
    return read_table(folder).to_pylist()


def derail(folder, is_derailed) -> list[dict]:
    """Write a fleet again without contact at some positions; returns all rows."""
    rows = []
    for path in sorted((folder / "screen").iterdir()):
        part_rows = rows_of(path)
        for row in part_rows:
            if is_derailed(row):
                row |= {"verdict": "NO CONTACT", "margin": None, "cause": None, "cheapest_theory": None}
                row["reason"] = f"lateral shift {row['shift_mm']:g} mm: the wheel derails"
            row["reason_kind"] = "the wheel derails" if row["verdict"] == "NO CONTACT" else row["reason"]
            row["remedy"] = "smaller shifts"
        write(path, part_rows)
        rows += part_rows
    seal(folder)
    return rows


@pytest.fixture
def derailed(fleet):
    """A fleet without contacts at 6 mm, and for some wheels at 3 mm."""
    return fleet, derail(
        fleet.folder,
        lambda row: row["shift_mm"] == 6.0 or (row["shift_mm"] == 3.0 and row["wheel"] in ("w1", "w2", "w3")),
    )


def test_positions_without_contact_are_not_in_the_population(derailed):
    fleet, rows = derailed
    answer = evaluate_fleet(fleet.folder)
    contacts = [row for row in rows if row["verdict"] != "NO CONTACT"]
    total = math.fsum(row["weight"] for row in contacts)
    assert 0.7 < total < 0.8
    assert answer.whole.positions == len(contacts)
    assert answer.whole.weight == pytest.approx(1.0)
    assert answer.whole.no_contact == pytest.approx(1.0 - total)
    for name, verdict in (("holds", "HOLDS"), ("fails", "FAILS"), ("open", "OPEN"), ("refused", "REFUSED")):
        share = math.fsum(row["weight"] for row in contacts if row["verdict"] == verdict) / total
        assert answer.whole.screen[name] == pytest.approx(share)
    assert sum(answer.whole.screen.values()) == pytest.approx(1.0)
    # they are not among the unknown answers either
    low, high = answer.whole.bounds
    assert high - low == pytest.approx(answer.whole.screen["open"] + answer.whole.screen["refused"])
    assert {cell["shift"] for cell in answer.cells} == {-6.0, -3.0, 0.0, 3.0}
    percent = f"in {100.0 * (1.0 - total):.0f} % of all positions the wheel cannot stand on the rail"
    assert percent in write_headline(answer)
    assert percent in write_report(answer, fleet.folder).read_text("utf-8")
    assert make_answer_rows(answer)[0]["no_contact_percent"] == pytest.approx(100.0 * (1.0 - total))


def test_groups_state_their_positions_without_contact(derailed):
    fleet, rows = derailed
    lines = {row["name"]: row["line"] for row in rows_of(fleet.folder / "profiles.parquet") if row["body"] == "rail"}
    line_rows = [row for row in rows if lines[row["rail"]] == "line A"]
    left_out = math.fsum(row["weight"] for row in line_rows if row["verdict"] == "NO CONTACT")
    group = evaluate_fleet(fleet.folder).groups["rail", "line", "line A"]
    assert group.no_contact == pytest.approx(left_out / math.fsum(row["weight"] for row in line_rows))


def test_the_sample_has_contacts_only_and_covers_their_share(derailed, sampled):
    fleet, rows = derailed
    sample = sampled(fleet, 300)
    assert {row["shift_mm"] for row in sample.rows} == {-6.0, -3.0, 0.0, 3.0}
    contacts = {
        (row["wheel"], row["rail"], row["shift_mm"], row["load_kN"]) for row in rows if row["verdict"] != "NO CONTACT"
    }
    total = math.fsum(fleet.weights[key] for key in contacts)
    truth = math.fsum(fleet.weights[key] for key in contacts if fleet.truth[key] == "HOLDS") / total
    share = evaluate_fleet(fleet.folder).whole.share("HOLDS")
    assert share.low < truth < share.high
    assert share.high - share.low < 0.1


def test_reasons_are_grouped_without_their_numbers(derailed):
    fleet, rows = derailed
    answer = evaluate_fleet(fleet.folder)
    kinds = [(row["verdict"], row["kind"]) for row in answer.refusals]
    assert kinds == [("NO CONTACT", "the wheel derails"), ("REFUSED", "the wheel does not run on the rail")]
    for row, verdict in zip(answer.refusals, ("NO CONTACT", "REFUSED"), strict=True):
        kind_rows = [position for position in rows if position["verdict"] == verdict]
        assert row["positions"] == len(kind_rows)
        assert row["share"] == pytest.approx(math.fsum(position["weight"] for position in kind_rows))
        assert any(all(position[name] == row[name] for name in ("wheel", "rail", "shift_mm")) for position in kind_rows)
        assert row["remedy"] == "smaller shifts"
    tables = [table for table in make_report_parts(answer, fleet.folder) if isinstance(table, Table)]
    assert sum("Kinds of reasons" in table.title for table in tables) == 1


def test_a_fleet_without_any_contact_is_refused(fleet):
    derail(fleet.folder, lambda row: True)
    for ask in (evaluate_fleet, lambda folder: draw_sample(folder, 10)):
        with pytest.raises(InputError, match="no position is a contact"):
            ask(fleet.folder)


def test_tables_without_the_new_columns_are_read(fleet):
    answer = evaluate_fleet(fleet.folder)
    assert answer.whole.no_contact == 0.0
    assert [row["kind"] for row in answer.refusals] == ["the wheel does not run on the rail"]
    assert "cannot stand" not in write_headline(answer)


def screen(wheel: str, shifts, loads=(60.0, 100.0), **inputs) -> list[dict]:
    """Rows of a pair of the library on 60E1."""
    stored = {
        body: StoredProfile(body=body, spec=spec, reading=Reading(), folder=None, labels=())
        for body, spec in (("wheel", wheel), ("rail", "60E1"))
    }
    case = Case(wheel=wheel, rail="60E1", **inputs)
    positions = tuple((shift, load) for shift in shifts for load in loads)
    return ScreeningPair(**stored, case=case, positions=positions, theory="strip").rows()


@pytest.mark.parametrize("roll", ["touching", "given"])
def test_a_screen_distinguishes_derailed_wheels_from_missing_profiles(roll):
    rows = screen("S1002", (0.0, 9.0, 12.0, 20.0, 60.0), roll=roll)
    assert {row["verdict"] for row in rows if row["shift_mm"] == 0.0} <= {"HOLDS", "FAILS", "OPEN"}
    derailed = [row for row in rows if row["shift_mm"] > 0.0]
    assert {row["verdict"] for row in derailed} == {"NO CONTACT"}
    kinds = {row["reason_kind"] for row in derailed}
    assert len({row["reason"] for row in derailed}) == 4
    assert len(kinds) <= 2
    assert not any(re.search(r"\d", kind) for kind in kinds)
    assert all(row["remedy"] for row in derailed)
    # a flange that may climb is in contact, until its top is on the rail
    climbing = screen("S1002", (9.0, 60.0), roll="touching", flange_climb=True)
    assert [row["verdict"] for row in climbing[2:]] == ["NO CONTACT"] * 2
    assert "NO CONTACT" not in {row["verdict"] for row in climbing[:2]}


def test_the_end_of_a_profile_is_unknown():
    # a cylinder ends at 50 mm: whether a longer wheel stands there is unknown
    rows = screen("cylinder:460", (56.0, 60.0), roll="touching")
    assert {row["verdict"] for row in rows} == {"REFUSED"}
    assert {row["reason_kind"] for row in rows} == {
        "the wheel leaves the rail: the contact point is at the end of a running surface"
    }


def test_placement_errors_have_the_kind_of_their_problem():
    rail, wheel = load_library_profile("60E1"), load_library_profile("S1002")
    with pytest.raises(PlacementError) as caught:
        place(rail, wheel, inclination_rad=0.025, lateral_shift_mm=12.0)
    problem = caught.value.problem
    assert problem.is_derailed
    assert str(caught.value) == str(problem)
    assert problem.kind == "the wheel derails: the contact point is beyond the steepest place of its flange"
    # jobs return errors through other processes
    copied = pickle.loads(pickle.dumps(caught.value)).problem
    assert (str(copied), copied.kind, copied.remedy, copied.is_derailed) == (
        str(problem),
        problem.kind,
        problem.remedy,
        True,
    )
    with pytest.raises(PlacementError):
        place_case(Case(lateral_shift_mm=12.0))
    # on the corner of its tread it falls between the rails
    corner = place_at_shifts(Case(), [-60.0])[-60.0]
    assert "corner of its tread" in corner.kind
    assert corner.is_derailed
    alone = place_or_explain(Case(lateral_shift_mm=-60.0))
    assert (alone.kind, alone.is_derailed) == (corner.kind, True)


@pytest.mark.parametrize("error", [InputError, ConvergenceError])
def test_other_errors_have_a_kind_without_numbers(error):
    kinds = {
        make_refusal_columns(error(f"after {count} steps the residual is {value:g} N; allowed: 1e-6; reduce the load"))[
            "reason_kind"
        ]
        for count, value in ((30, 1.5), (7, -2e-3), (100, 4.0))
    }
    assert kinds == {"after ... steps the residual is ... N"}
    row = make_refusal_columns("it failed")
    assert (row["verdict"], row["reason"], row["reason_kind"], row["remedy"]) == (
        "REFUSED",
        "it failed",
        "it failed",
        "",
    )
    assert PositionProblem.explain(PositionProblem("a", "b")).kind == "b"
