"""Theories without finite elements: the list, and a single theory at a position.

No gmsh is needed.
"""

import json
import math
import subprocess
import sys
from dataclasses import replace

import pytest

import fecontact
from fecontact.case import Case, Track
from fecontact.cli import call
from fecontact.contact_theories.registry import THEORIES, LoadedPlacement
from fecontact.errors import InputError
from fecontact.outputs.alone import table_row
from fecontact.solving.alone import evaluate_loaded_theory, evaluate_theory, iterate_table_rows
from fecontact.solving.hertz_alone import evaluate_hertz
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

# crossed cylinders: the gap is a parabola to 1e-4 over the patch
ELLIPTIC = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)
MEASURES = ("p_max_MPa", "area_mm2", "a_mm", "b_mm", "approach_mm", "normal_force_N")


def printed(capsys, *words):
    code = call(list(words))
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_the_list_has_all_theories_with_what_differs_from_their_sources(capsys):
    code, text, _ = printed(capsys, "theories")
    assert code == 0
    for name, theory in THEORIES.items():
        assert f"  {name}: {theory.words}; {theory.cost}" in " ".join(text.split("\n")), name
        assert all((theory.words, theory.cost, theory.source, theory.range)), name
    code, text, _ = printed(capsys, "theories", "--json")
    listed = json.loads(text)
    assert listed == fecontact.theories()
    assert list(listed["pressure"]) == list(THEORIES)
    assert "was not found" in listed["pressure"]["stripes"]["differs"]


# what each claims for constant curvature: 0.3 % (strips and steps), of KP its own closed form at a/b 1.3
@pytest.mark.parametrize("name", [name for name in THEORIES if name != "kik_piotrowski"])
def test_every_theory_that_is_exact_for_an_ellipse_is_hertz_there(name):
    hertz = fecontact.hertz(ELLIPTIC)["ellipses"][0]
    record = fecontact.theory(ELLIPTIC, name)
    assert (record["status"], record["problem"], record["solutions"]) == ("solved", None, 1)
    # strips and nodes end between two others: their areas
    areas = {"half_space": 0.01, "strip": 0.005}
    for measure in MEASURES:
        tolerance = areas.get(name, 0.003) if measure == "area_mm2" else 0.003
        assert record[measure] == pytest.approx(hertz[measure], rel=tolerance), measure


def test_a_vertical_load_is_more_along_the_normal_and_a_normal_load_is_not():
    # gauge corner, 17 degrees
    case = Case(lateral_shift_mm=5.75, roll="touching", load_N=50e3)
    vertical = evaluate_theory(case, "strip")
    cosine = float(vertical.placement.first.normal[2])
    assert cosine < 0.99
    assert vertical.normal_force_N == pytest.approx(50e3 / cosine, rel=1e-12)
    # strips carry it along the normal at first touch; their sweeps end at 0.1 %
    assert vertical.contact.normal_force_N == pytest.approx(vertical.normal_force_N, rel=5e-3)
    normal = evaluate_theory(replace(case, load_kind="normal"), "strip")
    assert normal.normal_force_N == pytest.approx(50e3, rel=1e-12)
    assert fecontact.hertz(case)["normal_force_N"] == pytest.approx(vertical.normal_force_N, rel=1e-12)


def test_the_strips_follow_the_half_space_where_hertz_does_not():
    """Two lobes that have grown together, and two patches at 17 and 7 degrees.

    The theories divide the force between the two patches differently.
    """
    for shift, force in ((0.25, 0.002), (5.0, 0.035)):
        case = Case(lateral_shift_mm=shift, roll="touching", load_N=50e3)
        strips, exact = (fecontact.theory(case, name) for name in ("strip", "half_space"))
        hertz = fecontact.theory(case, "hertz")
        assert strips["status"] == exact["status"] == "solved"
        assert len(strips["patches"]) == len(exact["patches"])
        # what carries the load at another angle counts along the normal at first touch
        assert exact["normal_force_N"] == pytest.approx(strips["normal_force_N"], rel=force)
        for name, tolerance in (("p_max_MPa", 0.01), ("area_mm2", 0.04), ("a_mm", 0.05), ("b_mm", 0.01)):
            assert strips[name] == pytest.approx(exact[name], rel=tolerance), (shift, name)
        assert abs(hertz["p_max_MPa"] / exact["p_max_MPa"] - 1.0) > 0.1


def test_a_theory_that_is_out_of_its_range_says_so(capsys):
    options = ("--shift", "5", "--roll", "touching", "--load-kn", "50")
    code, text, _ = printed(capsys, "theory", "hertz", *options)
    assert code == 3
    assert "status: out of range" in text
    assert "2 contact points are closed at the approach of the ellipse, which covers only one of them" in text
    # under a load that closes one of them it is in its range
    assert printed(capsys, "theory", "hertz", *options[:-1], "0.05")[0] == 0
    code, text, _ = printed(capsys, "theory", "multi_hertz", *options)
    assert code == 0
    assert "all" in text
    code, text, _ = printed(capsys, "theory", "multi_hertz", *options[:-1], "0.05")
    assert code == 0
    assert "not defined here; Hertz is shown" in text
    code, text, _ = printed(capsys, "theory", "kpec", *options, "--json")
    record = json.loads(text)
    assert (code, record["status"]) == (3, "out of range")
    assert any("separate regions" in note for note in record["notes"])


def test_a_theory_without_a_contact_says_why(monkeypatch, capsys):
    entry = replace(THEORIES["analyn"], approximate=lambda _: "the line is too short")
    monkeypatch.setitem(THEORIES, "analyn", entry)
    code, text, _ = printed(capsys, "theory", "analyn", "--rail", "circle:300", "--wheel", "cylinder:460", "--json")
    record = json.loads(text)
    assert (code, record["status"], record["problem"]) == (3, "no contact", "the line is too short")
    assert "p_max_MPa" not in record
    code, text, _ = printed(capsys, "theory", "analyn", "--rail", "circle:300", "--wheel", "cylinder:460")
    assert (code, text.splitlines()) == (3, ["status: no contact", "the line is too short"])


def test_several_approaches_are_counted(monkeypatch):
    placement = evaluate_theory(ELLIPTIC, "hertz").placement
    loaded = LoadedPlacement(placement=placement, case=ELLIPTIC, normal_force_N=1e5)

    def several(loaded_case):
        approximation = THEORIES["hertz"].approximate(loaded_case)
        return replace(approximation, solutions=2, status="several solutions")

    monkeypatch.setitem(THEORIES, "kpec", replace(THEORIES["kpec"], approximate=several))
    record = evaluate_loaded_theory(loaded, "kpec")
    assert (record.status, record.contact.solutions) == ("several solutions", 2)


def test_bad_input(capsys):
    code, _, error = printed(capsys, "theory", "hertzz")
    assert (code, "allowed: hertz, hertz_gauge" in error) == (2, True)
    code, _, error = printed(capsys, "theory", "strip", "--shift", "40")
    assert code == 2
    with pytest.raises(InputError, match="allowed: hertz"):
        fecontact.theory(ELLIPTIC, "conry")


def test_no_finite_element_is_imported():
    heavy = ["vtk", "pyvista", "gmsh", "matplotlib", "skfem", "pyamg", "pypardiso"]
    code = (
        "import sys; from fecontact.cli import call; call(['theory', 'strip', '--shift', '4', '--json']);"
        f"print([name for name in {heavy!r} if name in sys.modules], file=sys.stderr)"
    )
    completed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert completed.stderr.strip().splitlines()[-1] == "[]"
    assert json.loads(completed.stdout)["status"] == "solved"


# the ellipse of R 300 on R 460 reaches 6.2 mm across under 150 kN, and 8.6 mm under 400 kN
@pytest.mark.parametrize(("half_width_mm", "loads"), [(8.0, {150e3: True, 400e3: False})])
@pytest.mark.parametrize("narrow", ["rail", "wheel"])
def test_an_ellipse_beyond_the_end_of_a_profile_is_said_by_all_that_show_it(half_width_mm, loads, narrow, tmp_path):
    if narrow == "rail":
        z = math.sqrt(300.0**2 - half_width_mm**2) - 300.0
        ends = f"from = [-{half_width_mm}, {z}]\nto = [{half_width_mm}, {z}]\ncentre = [0.0, -300.0]\nradius = 300.0"
        arc = f'[[surface]]\ntype = "arc"\n{ends}\n'
    else:
        arc = f'[[surface]]\ntype = "line"\nfrom = [-{half_width_mm}, 0.0]\nto = [{half_width_mm}, 0.0]\n'
    path = tmp_path / "narrow.toml"
    path.write_text(f'kind = "{narrow}"\nunits = "mm"\ncertainty = "exact"\nsource = "test"\n{arc}')
    pair = {"rail": "circle:300", "wheel": "cylinder:460"} | {narrow: str(path)}
    for load_N, fits in loads.items():
        case = Case(**pair, inclination_rad=0.0, load_N=load_N, track=Track(rail_crown_y_mm=750.0))
        record = fecontact.hertz(case)
        assert bool(record["notes"]) is not fits
        alone = fecontact.theory(case, "hertz")
        assert alone["status"] == ("solved" if fits else "out of range")
        assert fecontact.theory(case, "strip")["status"] == alone["status"]
        (row,) = map(table_row, iterate_table_rows(case, [0.0], [load_N]))
        assert bool(row["hertz_notes"]) is not fits
        said = [*record["notes"], *alone["notes"], *filter(None, [row["hertz_notes"]])]
        assert all("reaches 8.6 mm across" in note and "ends 8.0 mm from the contact point" in note for note in said)
        if not fits:
            with pytest.raises(InputError, match="reaches the end of the running surface"):
                expect_on_half_space(case, place_case(case))


def test_springs_beyond_the_end_of_a_profile_are_out_of_their_range():
    case = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)
    (point,) = evaluate_hertz(case).points.points
    assert (point.whole_note, point.shared_note) == ("", "")
    (point,) = (points := evaluate_hertz(replace(case, load_N=1e9)).points).points
    assert point.shared_note == point.whole_note == points.notes[0] == points.shared_notes[0]
    assert "rail circle:300 ends 36.1 mm from the contact point" in point.shared_note
