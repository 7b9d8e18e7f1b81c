"""Written files, read back by independent readers: pyvista, meshio, csv, json."""

import csv
import io
import json
import math
import re
import subprocess
import sys
import warnings
from dataclasses import fields, replace
from itertools import combinations, pairwise
from pathlib import Path
from typing import get_args

import meshio
import numpy as np
import PIL.Image
import pytest
import pyvista
from rich.console import Console
from scipy.interpolate import LinearNDInterpolator

from fecontact.bodies import Material
from fecontact.case import BodySize, Case, Criteria, Opposite, Track, make_case_record, read_case_record
from fecontact.cli import call
from fecontact.contact.grid import Field, Rung
from fecontact.contact_theories.approximation import TheoryContact
from fecontact.contact_theories.registry import HERTZ, HERTZ_GAUGE, THEORIES
from fecontact.criteria import Creep
from fecontact.errors import CONVERGED, UNUSABLE_STATUSES, InputError
from fecontact.fe.body_mesh import BodyMesh, mesh_volume
from fecontact.fe.stress import nodal_stress, von_mises
from fecontact.files import format_json, write_atomically, write_json, write_text
from fecontact.judging.judge import judge_load
from fecontact.judging.solved_load import Status
from fecontact.outputs import tables
from fecontact.outputs.case_parts import case_parts
from fecontact.outputs.cases import ReportedCase, lobes_table, solver_table
from fecontact.outputs.figures.case import case_inches, draw_case, write_case_figure
from fecontact.outputs.figures.pressure_maps import PressureFields
from fecontact.outputs.figures.study import draw_study
from fecontact.outputs.hertz_terminal import hertz_lines
from fecontact.outputs.mesh_files import write_mesh
from fecontact.outputs.paraview.contact_surface import contact_surface
from fecontact.outputs.paraview.vtk import write_case_vtk, write_contact_vtk, write_pvd
from fecontact.outputs.parts import Items
from fecontact.outputs.profiles import draw_profile, library_lines, library_record, profile_lines
from fecontact.outputs.records.results import (
    ROW_SCHEMA,
    case_inputs,
    case_row,
    hertz_record,
    read_row,
    result_record,
    write_row,
)
from fecontact.outputs.records.stored import (
    placement_from_record,
    placement_record,
    read_arrays,
    solved_from_record,
    solved_record,
    write_arrays,
)
from fecontact.outputs.series import split_into_series
from fecontact.outputs.study_files import _write_collections, study_figures
from fecontact.outputs.study_report import parts_of_rows
from fecontact.outputs.style import (
    DPI,
    SERIES_COLOURS,
    blank_figure,
    render_image,
    render_svg,
    save_image,
    series_style,
)
from fecontact.outputs.terminal import print_parts
from fecontact.outputs.theory_records import judged_theories
from fecontact.outputs.words import MEASURE_WORDS, criteria_text
from fecontact.placement.irregularity import Irregularity
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.reading import Reading
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.solving.hertz_alone import evaluate_hertz
from fecontact.solving.placing import place_case
from fecontact.solving.solve import CaseResult

MEASURES = ["p_max_MPa", "area_mm2", "a_mm", "b_mm", "extent_x_mm", "extent_y_mm", "approach_mm"]
MISFITS = ["centre_over_b", "valley", "separate_load", "misplaced_load"]


@pytest.fixture(scope="module")
def record(elliptic_quick: CaseResult) -> dict:
    return result_record(elliptic_quick)


@pytest.fixture(scope="module")
def elliptic_row(elliptic_quick: CaseResult) -> dict:
    return case_row(elliptic_quick)


def change_fe(result: CaseResult, **changes) -> CaseResult:
    """A result with another contact of the finite elements, read as before."""
    finest, *coarser = result.load.solved.levels
    levels = (replace(finest, fe=replace(finest.fe, **changes)), *coarser)
    return replace(result, load=replace(result.load, solved=replace(result.load.solved, levels=levels)))


def change_hertz(result: CaseResult, **changes) -> CaseResult:
    """A result with another ellipse, compared as before."""
    judgement = result.load.judgements[HERTZ]
    changed = replace(judgement, approximation=TheoryContact.of(replace(judgement.hertz, **changes)))
    return replace(result, load=replace(result.load, judgements={**result.load.judgements, HERTZ: changed}))


def mesh_of(result: CaseResult, name: str) -> BodyMesh:
    return getattr(result.bodies.coupled, name).mesh


@pytest.fixture(scope="module")
def vtk_folder(elliptic_quick: CaseResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("case folder & more")
    write_case_vtk(elliptic_quick, folder)
    return folder


def size_of_png(path: Path) -> tuple[int, int]:
    head = path.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    return int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")


# Files


def test_a_failing_writer_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "result.json"
    write_text(path, "old")

    def half(temporary: Path) -> None:
        temporary.write_text("ha")
        raise RuntimeError("disk full")

    with pytest.raises(RuntimeError, match="disk full"):
        write_atomically(path, half)
    with pytest.raises(FileNotFoundError):
        write_atomically(tmp_path / "never.txt", lambda temporary: None)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["result.json"]


def test_a_writer_works_in_the_same_folder_with_the_same_ending_and_replaces(tmp_path):
    path = tmp_path / "new" / "case.vtu"
    temporaries: list[Path] = []
    for text in ("first", "second"):
        write_atomically(path, lambda temporary, text=text: (temporaries.append(temporary), temporary.write_text(text)))
    assert path.read_text() == "second"
    assert {p.parent for p in temporaries} == {path.parent}
    assert {p.suffix for p in temporaries} == {".vtu"}
    assert path not in temporaries


def test_json_has_null_for_nan_and_plain_numbers_for_numpy_and_keeps_the_order(tmp_path):
    value = {
        "z": math.nan,
        "a": [np.inf, np.float64(1.5), np.int64(2), np.bool_(True)],
        "m": {"array": np.array([[1.0, np.nan]]), "pair": (1, "µ"), "none": None, "path": Path("a/b")},
    }
    write_json(tmp_path / "v.json", value)
    stored = json.loads((tmp_path / "v.json").read_text("utf-8"))
    assert stored == {
        "z": None,
        "a": [None, 1.5, 2, True],
        "m": {"array": [[1.0, None]], "pair": [1, "µ"], "none": None, "path": "a/b"},
    }
    assert list(stored) == ["z", "a", "m"]
    assert (tmp_path / "v.json").read_text("utf-8").endswith("}\n")


# Records


CASES = [
    Case(),
    Case(
        rail="circle:300",
        wheel="cylinder:460",
        inclination_rad=0.0,
        lateral_shift_mm=-2.5,
        roll_rad=1e-3,
        yaw_rad=-2e-3,
        side="right",
        opposite=Opposite(rail="54E1", wheel="cylinder:459", rolling_radius_mm=458.0),
        load_N=87_654.321,
        load_kind="normal",
        rail_material=Material(young_MPa=206e3, poisson=0.28, yield_MPa=520.0),
        wheel_material=Material(young_MPa=212e3, poisson=0.29),
        rolling_radius_mm=425.0,
        track=Track(gauge_mm=1432.0, rail_crown_y_mm=750.0),
        size=BodySize(rail_depth_mm=40.0, half_length_mm=50.0),
        resolution=(0.7, 0.4),
        solver="amg",
        criteria=Criteria(p_max=0.03, centre=0.2, judged_by=("strength", "patch", "valley")),
        rail_file=Reading(units="m", mirror=True),
        wheel_file=Reading(filter_mm=12.0),
        creep=Creep(friction=0.35, xi=1e-3, spin_per_mm=-1e-4),
        refine="never",
        rail_irregularity=Irregularity(kind="sine", wavelength_mm=60.0, amplitude_mm=0.02, phase_rad=0.3),
        wheel_irregularity=Irregularity(
            kind="table", points_mm=((0.0, 0.0), (40.0, 0.01), (80.0, 0.0), (120.0, 0.02), (160.0, 0.0))
        ),
        distance_mm=33.0,
    ),
    # instead of a roll
    Case(roll="touching"),
    Case(roll="loaded", roll_load_N=80e3, opposite=Opposite(wheel_load_N=60e3), flange_climb=True),
]


@pytest.mark.parametrize("case", CASES, ids=["defaults", "nothing default", "wheelset", "loaded wheelset"])
def test_a_case_survives_json(case):
    assert read_case_record(json.loads(format_json(make_case_record(case)))) == case


def test_these_cases_differ_from_the_defaults_in_every_field():
    # `library` is resolved to None when rail and wheel are found in it
    names_of_fields = [field.name for field in fields(Case) if field.name != "library"]
    assert all(any(getattr(CASES[0], name) != getattr(case, name) for case in CASES) for name in names_of_fields)


@pytest.mark.parametrize(
    "change",
    [
        {"wheel_load": 1.0},
        {"load_N": "100"},
        {"load_N": -1.0},
        {"track": {"gage_mm": 1435.0}},
        {"element_size_mm": [1.0]},
    ],
    ids=lambda change: str(change),
)
def test_a_wrong_case_record_is_refused(change):
    with pytest.raises(InputError):
        read_case_record(make_case_record(Case()) | change)


def test_a_result_record_is_plain_and_has_the_inputs(record, elliptic_quick):
    # a quarter of an element more than the size of `quick`, and a mesh that is 1.5 times coarser
    assert record["solver"]["elements_per_semi_axis"] == pytest.approx([4.25, 4.25 / 1.5])
    assert record["solver"]["elements_per_semi_axis_of_narrowest_lobe"] == record["solver"]["elements_per_semi_axis"]
    # a single ellipse carries the load: theories with several ellipses do not apply
    assert list(record["theories"]) == list(THEORIES)
    assert {name for name, theory in record["theories"].items() if theory is None} == {"hertz_gauge", "multi_hertz"}
    # the uncertainty of the approach cannot be found with meshes
    measures = [name for name in (*MEASURES, *MISFITS) if name != "approach_mm"]
    assert list(record["theories"]["hertz"]["uncertainty"]) == measures
    # json_text refuses values that are not plain; infinity (no junction on this head) becomes null
    plain = json.loads(format_json(record), parse_constant=pytest.fail)
    assert plain["geometry"].pop("junction_distance_mm") is None
    assert plain["fe"] == record["fe"]
    # besides the inputs, the record has the actual roll
    inputs = dict(record["case"])
    assert inputs.pop("roll_mrad") == 0.0
    assert read_case_record(inputs) == elliptic_quick.case
    assert record["versions"]["numpy"] == np.__version__


def test_a_stored_result_says_the_same_to_the_last_bit(record, elliptic_row, elliptic_quick, tmp_path):
    """Fields and placement are stored, and everything is read from them again."""
    result, arrays = elliptic_quick, {}
    case = result.case
    stored = json.loads(
        format_json(
            {"load": solved_record(result.load.solved, arrays), "placement": placement_record(result.placement)}
        )
    )
    placement = placement_from_record(stored["placement"], resolve_rail(case.rail), resolve_wheel(case.wheel).profile)
    stored_load = solved_from_record(stored["load"], read_arrays(write_arrays(tmp_path / "fields.npz", arrays)), case)
    for level, solved_level in zip(stored_load.levels, result.load.solved.levels, strict=True):
        for name in ("nodal", "fe"):
            assert_same_rung(getattr(level, name), getattr(solved_level, name))
    for name in ("half_space", "quadratic"):
        assert_same_rung(getattr(stored_load, name), getattr(result.load.solved, name))
    again = replace(result, load=judge_load(stored_load, placement), placement=placement, bodies=None)
    assert format_json(result_record(again)) == format_json(record)
    assert case_row(again) == elliptic_row


def assert_same_rung(stored: Rung, solved: Rung) -> None:
    """Check that a stored rung is equal to the solved rung, bit by bit."""
    for f in fields(Rung):
        if f.name not in ("grid", "pressure_MPa", "gap_mm"):
            assert getattr(stored, f.name) == getattr(solved, f.name)
            assert type(getattr(stored, f.name)) is type(getattr(solved, f.name))
    assert stored.grid.half == solved.grid.half
    for name in ("x_mm", "s_mm"):
        assert getattr(stored.grid, name).tobytes() == getattr(solved.grid, name).tobytes()
    assert stored.pressure_MPa.tobytes() == solved.pressure_MPa.tobytes()
    assert stored.gap_mm.tobytes() == solved.gap_mm.tobytes()
    assert stored.pressure_MPa.shape == solved.pressure_MPa.shape


def test_results_name_a_profile_s_file_and_not_its_folder(tmp_path):
    path = tmp_path / "secret" / "head.txt"
    path.parent.mkdir()
    path.write_text("0 0\n")
    inputs = case_inputs(Case(rail=str(path)))
    assert inputs["rail"].startswith("head.txt@")
    assert inputs["wheel"] == "S1002"
    assert "secret" not in format_json(inputs)
    before = inputs["rail"]
    path.write_text("0 1\n")
    assert case_inputs(Case(rail=str(path)))["rail"] != before


def test_a_row_comes_back_with_what_json_does_not_have(elliptic_row, tmp_path):
    row = {"id": "x", **elliptic_row, "fe_a_mm": math.nan, "low": -math.inf}
    assert row["geometry_junction_distance_mm"] == math.inf
    stored = read_row(write_row(tmp_path / "row.json", row))
    assert math.isnan(stored.pop("fe_a_mm"))
    assert stored == {key: value for key, value in row.items() if key != "fe_a_mm"}
    assert list(stored) == [key for key in row if key != "fe_a_mm"]
    # plain JSON, for readers that do not accept NaN
    text = (tmp_path / "row.json").read_text("utf-8")
    assert json.loads(text, parse_constant=pytest.fail)["versions"]["numpy"] == np.__version__
    write_text(tmp_path / "row.json", text.replace(ROW_SCHEMA, "fecontact/row/0"))
    with pytest.raises(InputError, match="solve the case again"):
        read_row(tmp_path / "row.json")


def test_a_result_record_says_what_hertz_says(record):
    """Johnson (1985), section 4.2: two cylinders across each other, 100 kN, E 210 GPa, nu 0.3."""
    theory = record["theories"]["hertz"]
    assert theory["p_max_MPa"] == pytest.approx(1237.559, abs=1e-3)
    assert theory["a_mm"] == pytest.approx(7.16168, abs=1e-5)
    assert theory["b_mm"] == pytest.approx(5.38717, abs=1e-5)
    for name in MEASURES:
        fe, hertz = record["fe"][name], theory[name]
        assert theory["deviation"][name] == pytest.approx((hertz - fe) / fe, abs=1e-12)
    (curvature,) = record["contact_points"][0]["curvatures"]
    assert curvature["rail_radius_mm"] == pytest.approx(300.0)
    assert curvature["wheel_rolling_radius_mm"] == pytest.approx(460.0)
    assert curvature["wheel_lateral_radius_mm"] is None


def test_a_record_has_both_curvatures_at_a_junction(elliptic_quick):
    touch = elliptic_quick.placement.first
    gauge = replace(touch.curvatures[0], rail_per_mm=1.0 / 80.0)
    placement = replace(
        elliptic_quick.placement, contact_points=(replace(touch, curvatures=(gauge, touch.curvatures[0])),)
    )
    (written,) = result_record(replace(elliptic_quick, placement=placement))["contact_points"]
    assert written["at_junction"]
    assert [(c["side"], round(c["rail_radius_mm"])) for c in written["curvatures"]] == [("gauge", 80), ("field", 300)]


def test_a_row_is_flat_and_in_the_units_of_its_keys(record, elliptic_row):
    assert list(elliptic_row)[:5] == ["status", "rail", "wheel", "lateral_shift_mm", "load_kN"]
    assert not any(isinstance(value, dict | list | tuple) for value in elliptic_row.values())
    assert elliptic_row["load_kN"] == 100.0
    assert elliptic_row["verdict_warnings"] == "; ".join(record["verdict"]["warnings"])
    assert elliptic_row["verdict_failing"] == ""
    assert "hertz_uncertainty_approach_percent" not in elliptic_row
    assert elliptic_row["fe_lobes"] == 1
    assert elliptic_row["seconds"] == pytest.approx(sum(record["solver"]["seconds"].values()))


def test_hertz_alone_names_every_touch_point_of_a_position():
    """60E1 and S1002 at 0 mm: contact points on both sides of the R80 junction.

    They touch at 0.2 mm; the second place, beyond the junction, is 8.5 um higher.
    """
    record = hertz_record(evaluate_hertz(Case(lateral_shift_mm=0.0)))
    assert json.loads(format_json(record))["schema"] == "fecontact/hertz/2"
    assert [e["contact_point_number"] for e in record["ellipses"]] == [0, 1]
    for e, touch in zip(record["ellipses"], record["contact_points"], strict=True):
        assert e["normal_force_N"] == pytest.approx(100e3 / math.cos(touch["contact_angle_rad"]))
        assert e["p_max_MPa"] == pytest.approx(1.5 * e["normal_force_N"] / (math.pi * e["a_mm"] * e["b_mm"]))
    assert record["normal_force_N"] == record["ellipses"][0]["normal_force_N"]


# ParaView files

# Rounding errors of single precision, 6e-8, after a few operations.
SINGLE_PRECISION = 2e-7


def test_a_collection_has_its_blocks_by_name(vtk_folder):
    assert sorted(p.name for p in vtk_folder.iterdir()) == [
        *("bodies.vtm", "case.vtm", "elements.vtp", "hertz_ellipse.vtp", "pressure.vtp", "rail.vtu", "wheel.vtu")
    ]
    contact, bodies_collection = (pyvista.read(vtk_folder / name) for name in ("case.vtm", "bodies.vtm"))
    on_rail, around = ["pressure", "hertz_ellipse", "rail"], ["rail", "wheel", "elements"]
    assert (contact.keys(), bodies_collection.keys()) == (on_rail, around)
    # ParaView colours a file by a point array that is active in all its blocks
    assert {contact[name].point_data.active_scalars_name for name in on_rail} == {"contact_pressure_MPa"}
    assert all(contact[name].cell_data.active_scalars_name in (None, "lobe") for name in on_rail)
    blocks = {name: contact[name] for name in on_rail} | {name: bodies_collection[name] for name in around}
    bodies = {"displacement_mm": 3, "stress_MPa": 6, "von_mises_MPa": 1}
    surface = dict.fromkeys(
        ("contact_pressure_MPa", "hertz_pressure_MPa", "hertz_minus_fe_MPa", "gap_mm", "in_contact"), 1
    )
    surface |= {"pressure_squared_MPa2": 1, "pressure_vector_MPa": 3}
    pressure = {"contact_pressure_MPa": 1}
    line = pressure | {"pressure_vector_MPa": 3}
    arrays = {
        "rail": bodies | pressure, "wheel": bodies, "pressure": surface, "elements": surface, "hertz_ellipse": line,
    }  # fmt: skip
    for name, names_of_arrays in arrays.items():
        point_data = blocks[name].point_data
        assert {k: 1 if point_data[k].ndim == 1 else point_data[k].shape[1] for k in point_data} == names_of_arrays
        assert list(blocks[name].cell_data) == ["lobe"] * (name == "hertz_ellipse")
        # the lines have no pressure, so that ParaView draws them in its colour of missing values
        missing = "contact_pressure_MPa" if name == "hertz_ellipse" else ""
        assert all(np.all(np.isfinite(point_data[k])) != (k == missing) for k in point_data)
    assert blocks["pressure"].point_data["in_contact"].dtype == np.uint8


def test_field_data_are_few_and_on_the_pressure_alone(vtk_folder, elliptic_quick):
    hertz = elliptic_quick.hertz
    numbers = {
        "TimeValue": 0.0,
        "lateral_shift_mm": 0.0,
        "load_kN": 100.0,
        "normal_force_N": elliptic_quick.normal_force_N,
        "hertz_p0_MPa": hertz.p0_MPa,
        "hertz_a_mm": hertz.a_mm,
        "hertz_b_mm": hertz.b_mm,
    }
    for file in ("rail.vtu", "wheel.vtu", "elements.vtp", "hertz_ellipse.vtp"):
        assert not pyvista.read(vtk_folder / file).field_data.keys()
    field_data = pyvista.read(vtk_folder / "pressure.vtp").field_data
    assert set(field_data.keys()) == {*numbers, "contact_normal", "load_direction", "version", "annotation"}
    np.testing.assert_array_equal(field_data["contact_normal"], [elliptic_quick.placement.first.normal])
    np.testing.assert_array_equal(field_data["load_direction"], [[0.0, 0.0, 1.0]])
    assert {name: float(field_data[name][0]) for name in numbers} == pytest.approx(numbers)
    annotation = next(iter(field_data["annotation"]))
    # largest number of letters that fit beside ParaView's panels in a window of 1000 pixels
    assert max(map(len, annotation.splitlines())) <= 40
    said = " ".join(annotation.split())
    assert said.startswith(
        "rail circle:300, wheel cylinder:460; shift +0.00 mm; vertical load 100 kN Hertz HOLDS: near"
    )
    assert " +- 0." in said
    # meshio ends the process if it reads a text, so reading is the test
    assert set(meshio.read(vtk_folder / "wheel.vtu").point_data) == {"displacement_mm", "stress_MPa", "von_mises_MPa"}


def test_the_nodes_of_the_rail_have_the_pressure_of_the_contact_above_them(vtk_folder, elliptic_quick):
    rail, surface = (pyvista.read(vtk_folder / name) for name in ("rail.vtu", "pressure.vtp"))
    values = rail.point_data["contact_pressure_MPa"]
    loaded = np.flatnonzero(values)
    # Hertz's theory is exact here; nodes of the elements are coarse, and the pressures are means over cells
    ellipse, first = elliptic_quick.hertz, elliptic_quick.placement.first
    x, y, z = (rail.points[loaded] - np.array([first.x_mm, first.y_mm, first.z_mm])).T
    expected = ellipse.p0_MPa * np.sqrt(np.maximum(0.0, 1.0 - (x / ellipse.a_mm) ** 2 - (y / ellipse.b_mm) ** 2))
    assert np.abs(values[loaded] - expected).max() < 0.12 * ellipse.p0_MPa
    inner = expected > 0.5 * ellipse.p0_MPa
    assert np.abs(values[loaded][inner] / expected[inner] - 1.0).max() < 0.01
    assert len(loaded) > 50
    # nodes below the surface have none
    assert z.min() > -0.2
    assert values.max() <= surface.point_data["contact_pressure_MPa"].max() * (1.0 + 1e-6)


def test_paraview_shows_the_judged_contact(vtk_folder, elliptic_quick):
    """Blocks: `pressure` on the nodes of the verdict, `elements` on the nodes of the displacements."""
    level = elliptic_quick.load.level
    for name, rung in (("pressure", level.fe), ("elements", level.nodal)):
        nx, ns = rung.grid.shape
        surface = pyvista.read(vtk_folder / f"{name}.vtp")
        pressure = surface.point_data["contact_pressure_MPa"].reshape(2 * nx - 1, -1)
        assert pressure.shape[1] >= ns
        assert float(pressure.max()) == pytest.approx(float(rung.pressure_MPa.max()), rel=SINGLE_PRECISION)
    assert level.fe.grid.steps_mm[0] < 0.5 * level.nodal.grid.steps_mm[0]


def test_components_have_names_and_are_those_of_a_known_stress(elliptic_quick, tmp_path):
    """Stress of a uniform strain with six different components, by Hooke's law.

    In the file, each component is under its name.
    """
    bodies = elliptic_quick.bodies
    body = bodies.coupled.rail
    strain = 1e-4 * np.array([[1.0, 0.7, 0.3], [0.7, -2.0, 0.5], [0.3, 0.5, 4.0]])
    displacement = body.mesh.points @ strain
    full_body = replace(body, mesh=replace(body.mesh, half=False))
    strained = replace(
        bodies,
        coupled=replace(bodies.coupled, rail=full_body),
        displacement_mm=bodies.displacement_mm | {"rail": displacement},
    )
    write_case_vtk(replace(elliptic_quick, bodies=strained), tmp_path)
    grid = pyvista.read(tmp_path / "rail.vtu")
    stress = grid.GetPointData().GetArray("stress_MPa")
    young, poisson = elliptic_quick.case.rail_material.young_MPa, elliptic_quick.case.rail_material.poisson
    lame, shear = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    expected = lame * np.trace(strain) * np.eye(3) + 2 * shear * strain
    values = grid.point_data["stress_MPa"]
    for number, (name, i, j) in enumerate(
        [("XX", 0, 0), ("YY", 1, 1), ("ZZ", 2, 2), ("XY", 0, 1), ("YZ", 1, 2), ("XZ", 0, 2)]
    ):
        assert stress.GetComponentName(number) == name
        # single precision
        np.testing.assert_allclose(values[:, number], expected[i, j], rtol=1e-5)
    motion = grid.GetPointData().GetArray("displacement_mm")
    assert [motion.GetComponentName(k) for k in range(3)] == ["X", "Y", "Z"]


def test_the_contact_lies_above_the_rail_by_a_hair_and_the_line_on_its_relief(vtk_folder, elliptic_quick):
    placement, surface = elliptic_quick.placement, pyvista.read(vtk_folder / "pressure.vtp")
    np.testing.assert_allclose(height_mm(placement, surface.points), 1e-3, atol=1e-7)
    line = pyvista.read(vtk_folder / "hertz_ellipse.vtp")
    assert (line.n_cells, line.n_points) == (180, 181)
    # the line follows the ellipse in x and s
    hertz, (x, s) = elliptic_quick.hertz, placement.project(np.asarray(line.points, dtype=float)).T
    np.testing.assert_allclose((x / hertz.a_mm) ** 2 + (s / hertz.b_mm) ** 2, 1.0, rtol=1e-6)
    np.testing.assert_allclose(height_mm(placement, line.points), 0.05, atol=1e-6)
    # a ray from above meets the line before the relief, if both are warped by 1 mm per 1000 MPa
    warped = surface.warp_by_vector("pressure_vector_MPa", factor=1e-3).triangulate()
    for point in line.warp_by_vector("pressure_vector_MPa", factor=1e-3).points[::5]:
        ends = point[None, :] + np.array([[0.0, 0.0, 5.0], [0.0, 0.0, -5.0]])
        hit, _ = warped.ray_trace(*ends, first_point=True)
        assert hit.size == 0 or hit[2] < point[2] - 0.02


def height_mm(placement, points):
    """Heights of points above the rail, along its normals."""
    points = np.asarray(points, dtype=float)
    on_rail, normals = placement.surface(*placement.project(points).T)
    return np.einsum("nd,nd->n", points - on_rail, normals)


def test_the_vector_is_the_pressure_along_the_normal(vtk_folder, elliptic_quick):
    for file in ("pressure.vtp", "elements.vtp"):
        surface = pyvista.read(vtk_folder / file)
        vector, pressure = surface.point_data["pressure_vector_MPa"], surface.point_data["contact_pressure_MPa"]
        _, normals = elliptic_quick.placement.surface(*elliptic_quick.placement.project(surface.points).T)
        np.testing.assert_allclose(vector, pressure[:, None] * normals, atol=1e-6 * pressure.max())


def test_the_square_falls_to_zero_at_the_edge_of_the_patch(vtk_folder, elliptic_quick):
    """The sphere has an exact ellipse: its edge from the square, and its pressure between the nodes."""
    surface, hertz = pyvista.read(vtk_folder / "pressure.vtp"), elliptic_quick.hertz
    edge = surface.contour([0.0], scalars="pressure_squared_MPa2")
    x, s = elliptic_quick.placement.project(np.asarray(edge.points, dtype=float)).T
    # at most 0.14 steps of the nodes; the outermost loaded nodes lie up to a step inside the edge
    fraction_of_radius = np.hypot(x / hertz.a_mm, s / hertz.b_mm)
    step = max(elliptic_quick.load.fe.grid.steps_mm) / min(hertz.a_mm, hertz.b_mm)
    np.testing.assert_allclose(fraction_of_radius, 1.0, atol=0.2 * step)
    patch = surface.clip_scalar(scalars="pressure_squared_MPa2", value=0.0, invert=False)
    assert patch.area == pytest.approx(elliptic_quick.comparison.fe.area_mm2, rel=0.02)
    squares = surface.point_data["pressure_squared_MPa2"]
    pressure = surface.point_data["contact_pressure_MPa"]
    np.testing.assert_allclose(np.sqrt(np.maximum(squares, 0.0)), pressure, rtol=SINGLE_PRECISION)


def surface_on_elements(result):
    return pyvista.wrap(contact_surface(result, result.load.level.on_elements))


def test_the_contact_covers_an_ellipse_that_is_larger_than_what_was_solved(elliptic_quick):
    """An ellipse that is not cut off: its integral is the force."""
    large = change_hertz(elliptic_quick, b_mm=3.0 * elliptic_quick.hertz.b_mm, p0_MPa=elliptic_quick.hertz.p0_MPa / 3.0)
    surface = surface_on_elements(large)
    solved_surface = surface_on_elements(elliptic_quick)
    assert surface.n_points > solved_surface.n_points
    point_data = surface.point_data
    cell = np.prod(elliptic_quick.load.level.nodal.grid.steps_mm)
    # 0.5 %: the cells are flat, and the surface turns by 3 degrees up to the end of this ellipse
    assert cell * point_data["hertz_pressure_MPa"].sum() == pytest.approx(elliptic_quick.normal_force_N, rel=5e-3)
    is_outside = np.isnan(point_data["gap_mm"])
    assert is_outside.sum() == surface.n_points - solved_surface.n_points
    assert not point_data["contact_pressure_MPa"][is_outside].any()
    assert point_data["hertz_pressure_MPa"][is_outside].any()


def test_the_contact_ends_where_the_rail_does(elliptic_quick):
    profile = elliptic_quick.placement.rail.profile
    wide = change_hertz(elliptic_quick, b_mm=1.5 * profile.length_mm)
    surface = surface_on_elements(wide)
    assert np.all(np.isfinite(surface.points))
    low, high = profile.y_range_mm
    assert np.ptp(surface.points[:, 1]) == pytest.approx(
        high - low, abs=2 * max(elliptic_quick.load.level.nodal.grid.steps_mm)
    )


@pytest.mark.parametrize("file", ["pressure.vtp", "elements.vtp"])
@pytest.mark.parametrize("name", ["contact_pressure_MPa", "hertz_pressure_MPa"])
def test_both_pressures_integrate_to_the_force(vtk_folder, elliptic_quick, name, file):
    """0.1 %: the facets are chords of the rail, which loses (h/R)^2/24, far less than that."""
    surface = pyvista.read(vtk_folder / file)
    corners = surface.points[surface.regular_faces]
    area = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal = elliptic_quick.placement.first.normal
    assert np.all(area @ normal > 0.0)
    mean = surface.point_data[name][surface.regular_faces].mean(axis=1)
    assert float(mean @ (area @ normal)) == pytest.approx(elliptic_quick.normal_force_N, rel=1e-3)


def test_the_other_arrays_belong_to_the_same_points(vtk_folder, elliptic_quick):
    surface = pyvista.read(vtk_folder / "elements.vtp")
    point_data = surface.point_data
    x, s = elliptic_quick.placement.project(np.asarray(surface.points)).T
    at_nodes = elliptic_quick.hertz.pressure_MPa(x, s)
    # away from the edge, the mean over a cell differs by at least (h/a)^2, where h/a is 1/4.25
    inside = at_nodes > 0.6 * at_nodes.max()
    assert inside.sum() > 30
    np.testing.assert_allclose(point_data["hertz_pressure_MPa"][inside], at_nodes[inside], rtol=0.055)
    difference = point_data["hertz_pressure_MPa"] - point_data["contact_pressure_MPa"]
    largest_MPa = float(point_data["hertz_pressure_MPa"].max())
    np.testing.assert_allclose(point_data["hertz_minus_fe_MPa"], difference, atol=SINGLE_PRECISION * largest_MPa)
    np.testing.assert_array_equal(point_data["in_contact"], point_data["contact_pressure_MPa"] > 0.0)
    assert float(np.abs(point_data["gap_mm"][point_data["in_contact"] == 1]).max()) < 1e-6


def test_a_half_surface_is_whole_and_symmetric(vtk_folder, elliptic_quick):
    nx, ns = elliptic_quick.load.level.nodal.grid.shape
    surface = pyvista.read(vtk_folder / "elements.vtp")
    points = surface.points.reshape(2 * nx - 1, ns, 3)
    np.testing.assert_allclose(points, points[::-1] * [-1.0, 1.0, 1.0], atol=1e-12)
    assert np.all(np.diff(points[:, 0, 0]) > 0.0)
    pressure = surface.point_data["contact_pressure_MPa"].reshape(2 * nx - 1, ns)
    np.testing.assert_array_equal(pressure, pressure[::-1])
    nodal_MPa = elliptic_quick.load.level.nodal.pressure_MPa
    np.testing.assert_allclose(pressure[nx - 1 :], nodal_MPa, rtol=SINGLE_PRECISION)


@pytest.mark.parametrize("name", ["rail", "wheel"])
def test_a_half_body_is_mirrored_whole(vtk_folder, elliptic_quick, name):
    mesh = mesh_of(elliptic_quick, name)
    body = pyvista.read(vtk_folder / f"{name}.vtu")
    assert body.n_cells == 2 * len(mesh.hexes)
    assert body.n_points == 2 * len(mesh.points) - np.unique(mesh.surfaces["symmetry"]).size
    full_mesh = replace(mesh, points=np.asarray(body.points), hexes=body.cells.reshape(-1, 9)[:, 1:])
    assert mesh_volume(full_mesh) == pytest.approx(2.0 * mesh.volume_mm3, rel=1e-9)
    assert float(body.compute_cell_sizes().cell_data["Volume"].min()) > 0.0
    # a single shell: both halves share the nodes of the plane of symmetry
    assert body.extract_surface(algorithm="dataset_surface").n_open_edges == 0
    assert body.connectivity().cell_data["RegionId"].max() == 0


@pytest.mark.parametrize("name", ["rail", "wheel"])
def test_the_whole_body_has_the_stress_of_its_own_displacement(vtk_folder, elliptic_quick, name):
    """Recovered anew from the written displacements of both halves; single precision leaves about 1e-7 of the peak."""
    body = getattr(elliptic_quick.bodies.coupled, name)
    written = pyvista.read(vtk_folder / f"{name}.vtu")
    mesh = replace(body.mesh, points=np.asarray(written.points), hexes=written.cells.reshape(-1, 9)[:, 1:], half=False)
    stress = nodal_stress(replace(body, mesh=mesh), np.asarray(written.point_data["displacement_mm"]))
    tolerance = 1e-6 * float(np.abs(stress).max())
    np.testing.assert_allclose(written.point_data["stress_MPa"], stress, atol=tolerance)
    np.testing.assert_allclose(written.point_data["von_mises_MPa"], von_mises(stress), atol=tolerance)


def test_warping_both_bodies_makes_them_meet(vtk_folder, elliptic_quick):
    """Gap of the warped bodies, from the written displacements alone: small compared with the approach.

    Limit 1 %: this gap is at nodes and between straight facets, the gap of the solver is a mean around each node.
    """
    result = elliptic_quick
    # displacements, nodes and approach all belong to the elements
    nodal = result.load.level.nodal
    rail, wheel = (pyvista.read(vtk_folder / f"{name}.vtu") for name in ("rail", "wheel"))
    u_rail = rail.point_data["displacement_mm"][mesh_of(result, "rail").contact_nodes]
    nodes = np.unique(mesh_of(result, "wheel").surfaces["contact"])
    u_wheel = LinearNDInterpolator(
        result.placement.project(wheel.points[nodes]), wheel.point_data["displacement_mm"][nodes]
    )
    x, s = nodal.grid.x_mm[:, None], nodal.grid.s_mm[None, :]
    _, normals = result.placement.surface(x, s)
    gap = result.placement.gap(x, s) + np.einsum("xsd,xsd->xs", u_wheel(*np.broadcast_arrays(x, s)) - u_rail, normals)
    core = nodal.pressure_MPa > 0.3 * nodal.pressure_MPa.max()
    assert float(np.abs(gap[core]).max()) < 0.01 * nodal.approach_mm
    assert float(gap.min()) > -0.01 * nodal.approach_mm
    # fixed below and driven above: the ends of the warped bodies are rigid
    fixed = rail.point_data["displacement_mm"][np.unique(mesh_of(result, "rail").surfaces["fixed"])]
    assert float(np.abs(fixed).max()) == 0
    driven = wheel.point_data["displacement_mm"][np.unique(mesh_of(result, "wheel").surfaces["driven"])]
    np.testing.assert_allclose(driven, [[0.0, 0.0, -nodal.approach_mm]] * len(driven), atol=1e-12)


def test_a_surface_that_is_not_half_is_not_mirrored(elliptic_quick):
    nodal = elliptic_quick.load.level.nodal
    gap = Field(grid=nodal.grid, values=nodal.gap_mm).whole()
    full_rung = replace(nodal, grid=gap.grid, gap_mm=gap.values, pressure_MPa=nodal.pressure.whole().values)
    finest, *coarser = elliptic_quick.load.solved.levels
    solved_load = replace(elliptic_quick.load.solved, levels=(replace(finest, nodal=full_rung), *coarser))
    full_result = replace(elliptic_quick, load=replace(elliptic_quick.load, solved=solved_load))
    surface, half = surface_on_elements(full_result), surface_on_elements(elliptic_quick)
    np.testing.assert_array_equal(surface.points, half.points)
    np.testing.assert_array_equal(surface.point_data["gap_mm"], half.point_data["gap_mm"])


def test_the_contact_alone_is_the_file_of_the_whole(vtk_folder, elliptic_quick, tmp_path):
    """Of a result that was read back there are no meshes: its contact is written anew, beside the old bodies."""
    stored = replace(elliptic_quick, bodies=None)
    for number, result in enumerate((elliptic_quick, stored)):
        folder = write_contact_vtk(result, tmp_path / str(number)).parent
        assert sorted(p.name for p in folder.iterdir()) == [
            *("bodies.vtm", "case.vtm", "elements.vtp", "hertz_ellipse.vtp", "pressure.vtp")
        ]
        for file in folder.iterdir():
            assert file.read_bytes() == (vtk_folder / file.name).read_bytes()
    with pytest.raises(InputError, match="no meshes"):
        write_case_vtk(stored, tmp_path / "whole")
    assert not (tmp_path / "whole").exists()
    changed = change_hertz(elliptic_quick, p0_MPa=1.0)
    write_contact_vtk(changed, tmp_path)
    assert (tmp_path / "pressure.vtp").read_bytes() != (vtk_folder / "pressure.vtp").read_bytes()


def test_a_study_collection_lists_existing_files_at_its_times(elliptic_quick, tmp_path):
    folders = [tmp_path / "cases" / name for name in ("a b", "c&d")]
    for folder in folders:
        write_case_vtk(elliptic_quick, folder)
    write_pvd(tmp_path / "study.pvd", [(-2.0, folders[0]), (1.5, folders[1])])
    reader = pyvista.get_reader(tmp_path / "study.pvd")
    assert reader.time_values == [-2.0, 1.5]
    assert [dataset.path for dataset in reader.datasets] == ["cases/a b/case.vtm", "cases/c&d/case.vtm"]
    reader.set_active_time_value(1.5)
    assert reader.read()[0].keys() == ["pressure", "hertz_ellipse", "rail"]
    bodies = pyvista.get_reader(tmp_path / "study_bodies.pvd")
    assert [dataset.path for dataset in bodies.datasets] == ["cases/a b/bodies.vtm", "cases/c&d/bodies.vtm"]
    assert bodies.read()[0].keys() == ["rail", "wheel", "elements"]
    # after the whole folder is moved, the collection still opens
    folder_moved = tmp_path.rename(tmp_path.with_name("moved"))
    assert pyvista.get_reader(folder_moved / "study.pvd").read()[0]["rail"].n_cells > 0


def test_a_study_collection_refuses_what_paraview_would_swallow(vtk_folder, tmp_path):
    with pytest.raises(InputError, match=r"times 0\.5 occur more than once"):
        write_pvd(tmp_path / "study.pvd", [(0.5, vtk_folder), (1.0, vtk_folder), (0.5, vtk_folder)])
    with pytest.raises(InputError, match="does not exist"):
        write_pvd(tmp_path / "study.pvd", [(0.5, tmp_path / "nowhere")])
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="no limit of file sizes")
def test_a_disk_that_refuses_a_file_is_an_error_with_its_name(elliptic_quick, tmp_path):
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        # VTK itself ends the process when it writes this
        with pytest.raises(OSError, match=r"rail\.vtu"):
            write_case_vtk(elliptic_quick, tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.iterdir()) == []


# Meshes


@pytest.fixture(scope="module", params=["rail", "wheel"])
def body_mesh(request: pytest.FixtureRequest, elliptic_quick: CaseResult) -> BodyMesh:
    return mesh_of(elliptic_quick, request.param)


def volume_of(file_mesh: meshio.Mesh, mesh: BodyMesh) -> float:
    return mesh_volume(replace(mesh, points=file_mesh.points, hexes=file_mesh.get_cells_type("hexahedron")))


def test_msh_keeps_the_volume_and_every_surface_as_physical_groups(body_mesh, tmp_path):
    file_mesh = meshio.read(write_mesh(body_mesh, tmp_path / "body.msh"))
    assert (tmp_path / "body.msh").read_bytes().startswith(b"$MeshFormat\n4.1 0 8\n")
    assert {name: int(group[1]) for name, group in file_mesh.field_data.items()} == {
        body_mesh.name: 3,
        **dict.fromkeys(body_mesh.surfaces, 2),
    }
    assert volume_of(file_mesh, body_mesh) == pytest.approx(body_mesh.volume_mm3, rel=1e-9)
    for name, quads in body_mesh.surfaces.items():
        blocks = [file_mesh.cells[i].data[c] for i, c in enumerate(file_mesh.cell_sets[name]) if len(c)]
        # the reader sorts the nodes by entity: compare places, not node numbers
        assert len(blocks) == 1
        np.testing.assert_allclose(file_mesh.points[blocks[0]], body_mesh.points[quads], atol=1e-12)


def test_inp_keeps_node_sets_the_element_set_and_element_faces(body_mesh, tmp_path):
    path = write_mesh(body_mesh, tmp_path / "body.inp")
    file_mesh = meshio.read(path)
    assert [block.type for block in file_mesh.cells] == ["hexahedron"]
    assert volume_of(file_mesh, body_mesh) == pytest.approx(body_mesh.volume_mm3, rel=1e-9)
    np.testing.assert_array_equal(file_mesh.cell_sets[body_mesh.name][0], np.arange(len(body_mesh.hexes)))
    assert {k: set(v) for k, v in file_mesh.point_sets.items()} == {
        body_mesh.name: set(range(len(body_mesh.points))),
        **{k: set(np.unique(q)) for k, q in body_mesh.surfaces.items()},
    }
    # CalculiX manual, *ELEMENT: nodes of the faces of an eight-node brick
    faces = {"S1": (1, 2, 3, 4), "S2": (5, 8, 7, 6), "S3": (1, 5, 6, 2), "S4": (2, 6, 7, 3), "S5": (3, 7, 8, 4), "S6": (4, 8, 5, 1)}  # fmt: skip  # noqa: E501
    blocks = path.read_text().split("*SURFACE, NAME=")[1:]
    assert len(blocks) == len(body_mesh.surfaces)
    for block in blocks:
        head, *lines = block.splitlines()
        pairs = [line.split(", ") for line in lines]
        quads = [[body_mesh.hexes[int(e) - 1][n - 1] for n in faces[face]] for e, face in pairs]
        expected = body_mesh.surfaces[head.split(",")[0]]
        np.testing.assert_array_equal(np.sort(quads, axis=1), np.sort(expected, axis=1))


def test_vtu_keeps_surfaces_as_cells_and_flags(body_mesh, tmp_path):
    file_mesh = meshio.read(write_mesh(body_mesh, tmp_path / "body.vtu"))
    assert list(file_mesh.point_data) == list(body_mesh.surfaces)
    assert volume_of(file_mesh, body_mesh) == pytest.approx(body_mesh.volume_mm3, rel=1e-9)
    ids = np.concatenate(
        [file_mesh.cell_data["surface_id"][i] for i, b in enumerate(file_mesh.cells) if b.type == "quad"]
    )
    for number, (name, quads) in enumerate(body_mesh.surfaces.items(), start=1):
        np.testing.assert_array_equal(file_mesh.get_cells_type("quad")[ids == number], quads)
        np.testing.assert_array_equal(np.flatnonzero(file_mesh.point_data[name]), np.unique(quads))


@pytest.mark.parametrize("name", ["body.stl", "body", "body.msh.gz"])
def test_an_unknown_mesh_format_is_refused_with_those_that_exist(body_mesh, tmp_path, name):
    with pytest.raises(InputError, match=r"allowed: \.msh, \.inp, \.vtu;"):
        write_mesh(body_mesh, tmp_path / name)
    assert not list(tmp_path.iterdir())


# Tables


def failed_row(record: dict) -> dict:
    """Row of a failed case."""
    return {
        "id": "lost",
        "status": "failed: the wheel [left] the rail",
        "rail": "circle:300",
        "wheel": "cylinder:460",
        "lateral_shift_mm": 30.0,
        "load_kN": 100.0,
    }


@pytest.mark.parametrize("lost_first", [False, True])
def test_csv_has_a_column_for_every_key_in_a_stable_order(record, elliptic_row, tmp_path, lost_first):
    good = {"id": "good", **elliptic_row, "fe_a_mm": math.nan}
    rows = [failed_row(record), good] if lost_first else [good, failed_row(record)]
    with tables.write_csv(rows, tmp_path / "study.csv").open(newline="") as file:
        rows_of_file = list(csv.DictReader(file))
    assert list(rows_of_file[0]) == list(good)
    by_id = {row["id"]: row for row in rows_of_file}
    assert float(by_id["good"]["fe_p_max_MPa"]) == record["fe"]["p_max_MPa"]
    assert by_id["good"]["fe_a_mm"] == ""
    assert by_id["lost"]["fe_p_max_MPa"] == ""
    assert by_id["lost"]["status"] == "failed: the wheel [left] the rail"


def table_text(rows: list[dict], width: int) -> list[str]:
    text = io.StringIO()
    print_parts(parts_of_rows(rows), Console(file=text, width=width, no_color=True))
    return text.getvalue().splitlines()


def wide_rows(record: dict, elliptic_row: dict) -> list[dict]:
    """Rows with the longest possible cells, and a row of each unusable kind."""
    wide = {
        "lateral_shift_mm": -12.25,
        "load_kN": 112.5,
        "seconds": 1234.0,
        "solver_meshes": 4,
        "verdict_answer": "FAILS",
    }
    wide |= {"hertz_deviation_p_max_percent": -43.21, "hertz_deviation_area_percent": 143.2, "verdict_measure": "b_mm"}
    wide |= {
        "verdict_failing": "; ".join(Criteria().limits),
        "centre_over_b": -1.234,
        "hertz_deviation_valley_percent": 100.0,
    }
    good = {"id": "good", **elliptic_row}
    bad = [good | {"status": status} for status in ("not converged", "patch at the edge of the fine mesh")]
    return [good, good | wide, *bad, failed_row(record)]


@pytest.mark.parametrize("width", [160, 120, 100, 80])
def test_the_table_fits_its_width_and_names_what_it_has_no_room_for(record, elliptic_row, width):
    lines = table_text(wide_rows(record, elliptic_row), width)
    table_lines = [line for line in lines if not line.startswith(("no room", "+", "-12.25 mm"))]
    assert max(len(line.rstrip()) for line in table_lines) <= width
    assert "…" not in "".join(lines)
    (left_out,) = [line for line in lines if line.startswith("no room for: ")] or ["no room for: "]
    assert (
        left_out.removeprefix("no room for: ").split(", ")
        == {
            160: [""],
            120: ["cheapest theory", "separate", "time"],
            100: ["cheapest theory", "separate", "time", "meshes", "± of p_max", "a"],
            80: [
                *("cheapest theory", "separate", "time", "meshes", "± of p_max", "a"),
                *("p_max in MPa", "valley", "centre"),
            ],
        }[width]
    )
    heads = "".join(lines[1:3])
    # each measure that may decide has a column if there is room
    assert width < 160 or all(
        words.short[:5] in heads for name, words in MEASURE_WORDS.items() if name in Criteria().limits
    )
    assert ("valley" in heads, "centre" in heads, "time" in heads) == (width > 80, width > 80, width > 120)
    assert all(head in heads for head in ("shift", "load", "area", "mispl.", "verdict", "fails by"))


def test_every_status_of_what_must_not_be_used_has_a_word_that_a_table_has_room_for():
    assert {CONVERGED, *UNUSABLE_STATUSES} == set(get_args(Status))
    assert all(len(status.short) <= 12 for status in UNUSABLE_STATUSES.values())


def test_a_row_of_the_table_says_the_verdict_or_why_there_is_none(record, elliptic_row):
    lines = table_text(wide_rows(record, elliptic_row), 120)
    good, failing, *bad = (" ".join(line.split()) for line in lines[3:8])
    assert good.startswith(f"+0.00 100 {record['fe']['p_max_MPa']:.0f} ")
    assert good.endswith(" HOLDS 2")
    # the deciding measure comes first; measures without room are counted
    assert failing.endswith(" FAILS b p_max area a +4 4")
    assert [row.split(" ", 2)[2] for row in bad][2].endswith("no result -")
    assert "not conv." in bad[0]
    assert "at mesh edge" in bad[1]
    assert not any("HOLDS" in row for row in bad)
    reasons = [line for line in lines if ": " in line and line.startswith("+")]
    assert reasons == [
        "+0.00 mm, 100 kN: not converged",
        "+0.00 mm, 100 kN: patch at the edge of the fine mesh",
        "+30.00 mm, 100 kN: failed: the wheel [left] the rail",
    ]


def test_the_list_of_failing_measures_has_the_room_that_there_is(elliptic_row):
    row = elliptic_row | {
        "verdict_answer": "FAILS",
        "verdict_measure": "valley",
        "verdict_failing": "p_max_MPa; b_mm; valley",
    }
    assert table_text([row], 120)[3].split()[-5:-2] == ["valley", "p_max", "b"]
    everything = row | {"verdict_failing": "; ".join(Criteria().limits)}
    assert table_text([everything], 200)[3].split()[-11:-3] == [
        *("valley", "p_max", "area", "a", "b", "centre", "separate", "misplaced")
    ]
    # without colours and without a terminal, the text has no escape codes
    assert "\x1b" not in "".join(table_text([everything], 120))


def print_case(record: dict, width: int = 120, *, long: bool = True) -> list[str]:
    text = io.StringIO()
    print_parts(case_parts(record), Console(file=text, width=width, no_color=True), long=long)
    return [" ".join(line.split()) for line in text.getvalue().splitlines()]


def test_notes_on_the_profiles_are_details(elliptic_quick):
    """Notes on the solution stay below the verdict, notes on the files follow with --long."""
    notes = ["rail: smoothed from 512 points", "wheel: assumed: mm", "only the running surface is given"]
    record = result_record(elliptic_quick) | {"warnings": notes, "pair_geometry": "geometry of a on b"}
    short, full = print_case(record, long=False), print_case(record, long=True)
    assert short[0] == full[0] == "geometry of a on b"
    assert [line for line in short if line.startswith("note: ")] == [f"note: {notes[2]}"]
    assert {f"note: {note}" for note in notes} <= set(full)
    (details,) = [block for block in case_parts(record) if getattr(block, "summary", "") == "Notes on the profiles"]
    assert details.parts == [Items(notes[:2])]


@pytest.mark.slow
def test_a_measured_profile_has_a_line_above_its_verdict_and_its_notes_with_long(tmp_path, capsys):
    assert call(["profiles", "--examples", str(tmp_path / "worn")]) == 0
    command = ["solve", "--wheel", str(tmp_path / "worn" / "wheel.csv"), "--shift", "3", "--refine", "never"]
    count = 0
    for options, is_long in (([], False), (["--long"], True)):
        capsys.readouterr()
        assert call([*command, *options]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert lines[0].startswith("geometry of wheel.csv")
        assert lines[2].startswith("Hertz ")
        notes = [line for line in lines if line.startswith(("note: wheel: ", "note: rail: "))]
        if is_long:
            assert len(notes) == count
        else:
            assert notes == []
            (count,) = (
                int(number) for number in re.findall(r"^--long prints all results and (\d+) notes on", lines[-1])
            )
            assert count > 3


def judged_record(result: CaseResult, criteria: Criteria, **changes) -> dict:
    """The record of a result by other criteria; its case may be changed as well."""
    case = replace(result.case, criteria=criteria, **changes)
    load = judge_load(replace(result.load.solved, case=case), result.placement)
    return result_record(replace(result, load=load))


@pytest.fixture(scope="module")
def flattened_result(elliptic_quick: CaseResult) -> CaseResult:
    """A flatter and displaced pressure with equal force: Hertz deviates in peak and centre."""

    def flat_rung(rung: Rung) -> Rung:
        assert not rung.pressure_MPa[:, -6:].any()
        pressure = np.roll(rung.pressure_MPa, 6, axis=1) ** 0.25
        scale = rung.pressure.whole().values.sum() / Field(grid=rung.grid, values=pressure).whole().values.sum()
        return replace(rung, pressure_MPa=scale * pressure)

    solved_load = elliptic_quick.load.solved
    levels = tuple(
        replace(
            level,
            # the contact on the elements' nodes is changed in the same way
            nodal=flat_rung(level.fe),
            fe=flat_rung(level.fe),
            otherwise=level.otherwise and flat_rung(level.otherwise),
        )
        for level in solved_load.levels
    )
    return replace(elliptic_quick, load=judge_load(replace(solved_load, levels=levels), elliptic_quick.placement))


JUDGED = {
    "peak pressure (MPa)": ("p_max_MPa", "±5", "%"),
    "area (mm²)": ("area_mm2", "±10", "%"),
    "half-width a along x (mm)": ("a_mm", "±10", "%"),
    "half-width b across (mm)": ("b_mm", "±10", "%"),
    "centre of pressure across (b)": ("centre_over_b", "±0.15", "b"),
    "valley between lobes (% of the peak)": ("valley", "<", "10", "%"),
    "load on separate patches (%)": ("separate_load", "<", "0.1", "%"),
    "misplaced load (%)": ("misplaced_load", "<", "10", "%"),
}


def test_a_case_prints_every_measure_with_its_limit_and_answer(record):
    lines, hertz = print_case(record, long=False), record["theories"][HERTZ]
    start = next(number for number, line in enumerate(lines) if line.startswith("measure"))
    cells = {line.rpartition(")")[0] + ")": line.rpartition(")")[2].split() for line in lines[start + 1 : start + 9]}
    assert list(cells) == list(JUDGED)
    for title, (name, *limit) in JUDGED.items():
        fe, of_hertz, off, unit, uncertainty, same_unit, *rest = cells[title]
        factor = 1.0 if unit == "b" else 100.0
        assert unit == same_unit
        assert float(off) == pytest.approx(factor * hertz["deviation"][name], abs=0.006)
        assert float(uncertainty) == pytest.approx(factor * hertz["uncertainty"][name], abs=0.006)
        assert rest == [*limit, "HOLDS"]
        if name in hertz:
            assert float(fe) == pytest.approx(record["fe"][name], rel=1e-4)
            assert float(of_hertz) == pytest.approx(hertz[name], rel=1e-4)
        else:
            assert (float(fe), of_hertz) == (float(off), "0")


def test_the_answer_of_a_case_is_short_and_all_of_it_is_long(record):
    lines, everything = print_case(record, long=False), print_case(record)
    assert len(lines) <= 25
    assert re.fullmatch(
        # both deviations are 1.3 % of their limits
        r"Hertz HOLDS; nearest to its limit: (peak pressure -|misplaced load )0\.\d\d % ± 0\.\d\d % \(limit .* %\)",
        lines[0],
    )
    assert not [line for line in lines if line.startswith(("also", "unresolved", "to decide"))]
    assert everything[: len(lines) - 1] == lines[:-1]
    assert "decided on 2 meshes of 4.2 and 2.8 elements per semi-axis, not refined" in everything
    misfit, off = (100.0 * record["elements"][name] for name in ("misfit", "compliance_error"))
    assert (
        f"on the nodes of the elements {misfit:.1f} % of the load is at a different place; their compliance"
        f" differs from a half-space by {off:+.1f} %"
    ) in everything
    numbers = {line.split()[0]: line.split()[-1] for line in everything if len(line.split()) == 2}
    assert float(numbers["hertz_stiffness_GN_per_m15"]) == pytest.approx(
        record["theories"][HERTZ]["stiffness_GN_per_m15"], rel=1e-5
    )
    # each theory has its name in both texts
    for theory in judged_theories(record):
        assert [line for line in lines if THEORIES[theory].words in line], theory


def test_a_case_that_fails_names_all_measures_that_fail(flattened_result):
    record = result_record(flattened_result)
    assert record["verdict"]["answer"] == "FAILS"
    assert record["verdict"]["failing"] == ["p_max_MPa", "centre_over_b", "misplaced_load"]
    lines = print_case(record, long=False)
    assert lines[0].startswith("Hertz FAILS; furthest beyond its limit: peak pressure +")
    assert lines[0].endswith(f"; cause: {record['verdict']['cause']}")
    assert lines[1] == "also failing: centre of pressure across, misplaced load"
    assert len([line for line in lines if line.endswith(" FAILS")]) == 3


def test_an_open_case_says_what_would_decide_it(elliptic_quick):
    strict = Criteria(p_max=0.0034)
    record = judged_record(elliptic_quick, strict)
    lines = print_case(record)
    assert lines[0].startswith("Hertz UNRESOLVED; least certain: peak pressure -0.")
    assert "unresolved on 2 meshes of 4.2 and 2.8 elements per semi-axis, not refined" in lines
    assert "to decide, use --resolution standard or fine, or --refine verdict" in lines
    # finer meshes were allowed, so the resolution is not the remedy
    refinable = print_case(judged_record(elliptic_quick, strict, refine="verdict"))
    assert "to decide, use --resolution standard or fine" in refinable
    finest = print_case(judged_record(elliptic_quick, strict, resolution="fine", refine="verdict"))
    sizes = ",".join(f"{size_mm:.3g}" for size_mm in record["solver"]["element_size_mm"].values())
    assert [line for line in finest if line.startswith(f"to decide, use --resolution with sizes below {sizes}")]
    # meshes do not remove the uncertainty of the profiles
    of_profile = {"uncertainty_of_profile": {"p_max_MPa": 0.004}, "verdict": record["verdict"] | {"cause": "profile"}}
    noisy = print_case(record | of_profile)
    assert [line for line in noisy if "the deviation differs by 0.40 %" in line]
    assert not [line for line in noisy if line.startswith("to decide")]


def test_a_case_that_did_not_converge_is_not_called_decided(elliptic_quick):
    load = change_fe(elliptic_quick, status="not converged").load
    record = result_record(replace(elliptic_quick, load=judge_load(load.solved, elliptic_quick.placement)))
    lines = print_case(record)
    remedy = "try a lateral shift that differs by 0.2 mm, or a different load"
    assert f"do not use this result: not converged; {remedy}" in lines
    assert not [line for line in lines if line.startswith(("decided", "to decide"))]


def test_the_worse_side_of_a_junction_is_shown_and_both_at_length(record):
    changed = json.loads(format_json(record))
    gauge = json.loads(format_json(changed["theories"][HERTZ]))
    gauge["verdict"] |= {"answer": "FAILS", "measure": "area_mm2", "failing": ["area_mm2"]}
    gauge["verdict"]["each"]["area_mm2"], gauge["deviation"]["area_mm2"] = "FAILS", -0.5
    changed["theories"][HERTZ_GAUGE] = gauge
    changed["verdict"] |= gauge["verdict"] | {"side": "gauge", "cause": "some cause"}
    lines = print_case(changed, long=False)
    assert lines[0].startswith("Hertz FAILS; furthest beyond its limit: area -50.00 %")
    assert ", with the curvature of the gauge side" in lines[0]
    areas = [line for line in lines if line.startswith("area")]
    assert [("-50.00 %" in area, area.rpartition(" ")[2]) for area in areas] == [(True, "FAILS")]
    everything = print_case(changed)
    for side, answer in (("gauge", "FAILS"), ("field", "HOLDS")):
        start = everything.index(f"Hertz and finite elements, with the curvature of the {side} side")
        assert next(line for line in everything[start:] if line.startswith("area")).endswith(answer)


def test_measures_that_nobody_asks_for_are_shown_at_length_and_not_judged(elliptic_quick):
    record = judged_record(elliptic_quick, Criteria(judged_by=("strength",)))
    assert not [line for line in print_case(record, long=False) if line.startswith("area (")]
    area = next(line for line in print_case(record) if line.startswith("area ("))
    assert area.endswith(" % not judged")


def test_a_record_its_table_and_its_report_have_the_balance_of_both_bodies(elliptic_quick):
    """Balance of the force and of the moment on the curved surfaces, as solved."""
    load = elliptic_quick.load
    # measured 1.5e-16 and 2.3e-11
    assert 0.0 <= load.level.force_balance < 1e-14
    assert 0.0 < load.level.moment_balance < 1e-10
    planted = replace(load.level, force_balance=3e-5, moment_balance=7e-4)
    solved_load = replace(load.solved, levels=(planted, *load.solved.levels[1:]))
    result = replace(elliptic_quick, load=judge_load(solved_load, elliptic_quick.placement))
    record = result_record(result)
    assert record["solver"]["force_balance"] == 3e-5
    assert record["solver"]["moment_balance"] == 7e-4
    assert any("of the forces on both bodies 3e-05, of their moments 7e-04" in line for line in print_case(record))
    table = solver_table([ReportedCase(row=case_row(result), record=record)])
    headings = [column.heading for column in table.columns]
    cells = dict(zip(headings, table.rows[0].cells, strict=True))
    assert (cells["force balance"], cells["moment balance"]) == ("3e-05", "7e-04")


@pytest.mark.parametrize("width", [80, 120])
def test_every_table_fits_a_terminal(record, elliptic_row, width):
    """A terminal draws lines and spaces, which a pipe does not get."""
    text = io.StringIO()
    console = Console(file=text, width=width, no_color=True, force_terminal=True)
    print_parts(parts_of_rows([elliptic_row | {"hertz_deviation_p_max_percent": -43.21}]), console)
    print_parts(case_parts(record), console, long=True)
    print_parts(hertz_lines(hertz_record(evaluate_hertz(Case(lateral_shift_mm=0.0)))), console)
    print_parts(profile_lines(load_library_profile("60E1"), []), console)
    plain = re.sub(r"\x1b\[[0-9;]*m", "", text.getvalue())
    assert "…" not in plain
    assert max(len(line.rstrip()) for line in plain.splitlines()) <= width
    # no number is cut in two
    assert all(number in plain for number in ("-10.425", "-43.2", "1722.6"))


def test_hertz_and_profiles_print_their_numbers(capsys):
    print_parts(hertz_lines(hertz_record(evaluate_hertz(Case(lateral_shift_mm=0.0)))))
    print_parts(library_lines(library_record()))
    print_parts(profile_lines(load_library_profile("60E1"), []))
    text = capsys.readouterr().out
    for number in ("straight", "-10.425", "1722.", "S1002", "-26.0265"):
        assert number in text
    # if the output is not a terminal, texts are not broken
    lines = [line.rstrip() for line in text.splitlines()]
    assert all(
        any(line.endswith(profile["source"].partition(";")[0]) for line in lines) for profile in library_record()
    )


def test_every_measure_has_words_and_every_limit_its_unit():
    assert list(MEASURE_WORDS) == [*MEASURES, *MISFITS]
    assert criteria_text(Criteria()) == (
        "p_max ±5 %, area ±10 %, a ±10 %, b ±10 %, centre ±0.15 b, valley < 10 %, separate < 0.1 %, misplaced < 10 %"
    )
    # users choose measures by these short names
    chosen = Criteria(judged_by=tuple(MEASURE_WORDS[name].short for name in Criteria().limits))
    assert chosen.limits == Criteria().limits
    assert criteria_text(Criteria(judged_by=("valley", "a"), a=1.25e-3)) == "a ±0.125 %, valley < 10 %"


# Figures


@pytest.mark.slow
def test_a_case_figure_is_the_same_png_and_svg_twice_and_not_blank(elliptic_quick, tmp_path):
    first, second = (write_case_figure(elliptic_quick, tmp_path / f"{k}.png") for k in (1, 2))
    assert first.read_bytes() == second.read_bytes()
    assert size_of_png(first)[0] > 1500
    assert b"Software" not in first.read_bytes()
    pixels = np.asarray(pyvista.read(first).active_scalars)
    # a blank or one-coloured map would not use the whole colour scale
    assert len(np.unique(pixels[:, :3], axis=0)) > 500
    svg = first.with_suffix(".svg").read_bytes()
    assert svg == second.with_suffix(".svg").read_bytes()
    assert svg.startswith(b"<?xml")
    assert b"http://" not in svg.replace(b"http://www.w3.org", b"")


def test_a_picture_of_a_case_is_the_same_after_pictures_of_others(elliptic_quick, flattened_result):
    pressure = elliptic_quick.load.fe.pressure
    two = change_fe(elliptic_quick, pressure_MPa=np.where(np.abs(pressure.grid.s_mm) < 0.5, 0.2, 1.0) * pressure.values)
    results = {
        "two lobes": replace(two, load=judge_load(two.load.solved, two.placement)),
        "flat": flattened_result,
        "tall": change_hertz(elliptic_quick, a_mm=40.0, b_mm=5.5),
        "yields": elliptic_quick,
        "without contributions": elliptic_quick,
        "wide": change_hertz(elliptic_quick, b_mm=40.0),
    }
    cases = {}
    for name, result in results.items():
        record, fields = result_record(result), PressureFields.of(result.load)
        if name == "yields":
            fields = replace(fields, elastic=1.1 * fields.fe)
        if name == "without contributions":
            record |= {"uncertainty_budget": {}}
        cases[name] = record, result.placement, fields
    pictures = {}
    for name, case in cases.items():
        figure = blank_figure(*case_inches(case[-1]))
        draw_case(figure, *case)
        pictures[name] = render_svg(figure)
    assert len(set(pictures.values())) == len(cases)
    figure = blank_figure(1.0, 1.0)
    for name in [*cases, "two lobes"]:
        figure.set_size_inches(*case_inches(cases[name][-1]))
        draw_case(figure, *cases[name])
        assert render_svg(figure) == pictures[name], name


def test_a_case_figure_is_drawn_anew_for_other_settings_of_matplotlib_alone(elliptic_quick, tmp_path, monkeypatch):
    from matplotlib import rc_context

    new_figures = []
    monkeypatch.setattr(
        "fecontact.outputs.figures.case.blank_figure",
        lambda *inches: new_figures.append(inches) or blank_figure(*inches),
    )

    def draw() -> tuple[bytes, int]:
        path = write_case_figure(elliptic_quick, tmp_path / "case.png", svg=False)
        return path.read_bytes(), len(new_figures)

    small, count = draw()
    with rc_context({"xtick.labelsize": 14.0}):
        large, _ = draw()
        assert draw() == (large, count + 1)
    assert large != small
    assert draw() == (small, count + 2)
    # a figure that fails is not used again
    with monkeypatch.context() as patch:
        patch.setattr("fecontact.outputs.figures.case.save_image", raise_full_disk)
        with pytest.raises(OSError, match="full"):
            draw()
    assert draw() == (small, count + 3)


def raise_full_disk(*arguments: object) -> None:
    raise OSError("the disk is full")


def test_a_png_has_the_pixels_of_its_figure_and_the_resolution_of_all_pictures(tmp_path):
    figure = blank_figure(2.0, 1.0)
    figure.add_subplot().plot([0.0, 1.0])
    pixels = np.asarray(render_image(figure))
    with PIL.Image.open(save_image(figure, tmp_path / "picture.png")) as image:
        image.load()
        assert image.mode == "RGB"
        assert np.array_equal(np.asarray(image), pixels)
        assert image.info["dpi"] == pytest.approx((DPI, DPI), abs=0.01)


def test_figures_hold_for_a_patch_larger_than_the_grid_and_for_two_sides(elliptic_quick, tmp_path):
    large = change_hertz(elliptic_quick, a_mm=30.0, b_mm=20.0, orientation_rad=0.1)
    write_case_figure(large, tmp_path / "large.png")
    assert size_of_png(tmp_path / "large.png")[0] > 1500


def draw_study_axes(monkeypatch, rows: list[dict], rail=None, criteria=None) -> list:
    from fecontact.outputs.figures import study as module

    figures = []
    monkeypatch.setattr(module, "save_figure", lambda figure, path: figures.append(figure))
    draw_study(rows, "unused.png", rail, criteria)
    return figures[0].axes


def test_a_study_figure_never_connects_bad_rows(record, elliptic_row, monkeypatch):
    base = {"id": "x", **elliptic_row, "rail": "60E1"}
    rows = [base | {"lateral_shift_mm": float(k), "contact_rail_y_mm": -4.0 * k} for k in range(4)]
    rows[1]["status"] = "not converged"
    peak, _, touch = draw_study_axes(
        monkeypatch, [*rows, failed_row(record) | {"rail": "60E1"}], load_library_profile("60E1")
    )
    lines = [line for line in peak.get_lines() if line.get_linestyle() != "None"]
    assert len(lines) == 2
    good = next(line for line in lines if np.isfinite(line.get_ydata()).any())
    assert [bool(np.isfinite(y)) for y in good.get_ydata()] == [True, False, True, True, False]
    crosses = [line for line in peak.get_lines() if line.get_marker() == "x" and len(line.get_xdata())]
    assert {float(x) for line in crosses for x in line.get_xdata()} == {1.0, 30.0}
    levels = {round(float(line.get_ydata()[0]), 3) for line in touch.get_lines() if line.get_linestyle() == "-."}
    assert levels == {-10.228}


def test_a_study_figure_knows_no_junctions_without_the_rail(elliptic_row, monkeypatch):
    _, _, touch = draw_study_axes(monkeypatch, [{"id": "x", **elliptic_row, "rail": "60E1"}])
    assert not [line for line in touch.get_lines() if line.get_linestyle() == "-."]


def test_figures_of_a_study_draw_the_rail_and_the_limits_they_are_given(elliptic_row, monkeypatch, tmp_path):
    calls = []
    monkeypatch.setattr("fecontact.outputs.figures.study.draw_study", lambda *arguments: calls.append(arguments))
    monkeypatch.setattr("fecontact.outputs.paraview.vtk.write_pvd", lambda path, cases: path)
    rail, rows, criteria = load_library_profile("60E1"), [{"id": "x", **elliptic_row}], Criteria(p_max=0.03)
    assert study_figures(rows, tmp_path, rail, criteria) == ("study.pvd",)
    assert calls == [(rows, tmp_path / "study.png", rail, criteria)]


def test_a_study_figure_has_a_line_for_each_load(elliptic_row, monkeypatch):
    base = {"id": "x", **elliptic_row}
    rows = [base | {"lateral_shift_mm": s, "load_kN": f} for s in (0.0, 1.0) for f in (60.0, 100.0)]
    peak, deviation, _ = draw_study_axes(monkeypatch, rows, criteria=Criteria(p_max=0.02, area=0.3))
    legends = [[text.get_text() for text in axes.get_legend().get_texts()] for axes in (peak, deviation)]
    assert legends == [["60 kN", "100 kN", "finite elements", "Hertz"], ["peak pressure", "area"]]
    # a row of verdicts for each load, one above the other
    verdicts = [line for line in peak.get_lines() if line.get_label() == "_HOLDS"]
    heights = [line.get_transform().transform((0.0, 1.0))[1] for line in verdicts]
    assert len(verdicts) == 2
    assert heights[1] - heights[0] == pytest.approx(12.0 / 72.0 * peak.figure.dpi)
    # the bands are the limits, only of the judged measures
    assert [abs(band.get_y()) for band in deviation.patches] == pytest.approx([30.0, 2.0])
    assert deviation.get_ylabel() == "deviation of Hertz in %\n(limits: p_max ±2 %, area ±30 %)"
    _, strength, _ = draw_study_axes(monkeypatch, rows, criteria=Criteria(judged_by=("strength",)))
    assert strength.get_ylabel().endswith("(limits: p_max ±5 %)")
    assert len(strength.patches) == 1
    _, unknown, _ = draw_study_axes(monkeypatch, rows)
    assert (unknown.get_ylabel(), len(unknown.patches)) == ("deviation of Hertz in %", 0)


def test_one_series_is_drawn_in_parts_of_its_limits(elliptic_row, monkeypatch):
    criteria = Criteria(p_max=0.04, centre=0.5, judged_by=("strength", "centre", "valley"))
    rows = [elliptic_row | {"lateral_shift_mm": float(k), "verdict_answer": "HOLDS"} for k in range(4)]
    for row, p_max, centre, valley in zip(
        rows, (-2.0, 8.0, 1.0, 4.0), (0.1, -0.2, 0.0, 1.5), (0, 5, 0, 20), strict=True
    ):
        row |= {
            "hertz_deviation_p_max_percent": p_max,
            "hertz_deviation_centre_over_b": centre,
            "hertz_deviation_valley_percent": float(valley),
        }
    rows[1]["verdict_answer"], rows[2]["status"], rows[3]["verdict_answer"] = "FAILS", "not converged", "UNRESOLVED"
    peak, off, _ = draw_study_axes(monkeypatch, rows, criteria=criteria)
    lines = {line.get_label(): line for line in off.get_lines() if not line.get_label().startswith("_")}
    assert list(lines) == ["p_max", "centre", "valley"]
    nan = math.nan
    assert lines["p_max"].get_ydata() == pytest.approx([0.5, 2.0, nan, 1.0], nan_ok=True)
    assert lines["centre"].get_ydata() == pytest.approx([0.2, 0.4, nan, 3.0], nan_ok=True)
    assert lines["valley"].get_ydata() == pytest.approx([0.0, 0.5, nan, 2.0], nan_ok=True)
    # a row that must not be used has no verdict
    marks = {line.get_label(): list(line.get_xdata()) for line in peak.get_lines()}
    assert [marks[f"_{answer}"] for answer in ("HOLDS", "UNRESOLVED", "FAILS")] == [[0.0], [3.0], [1.0]]
    assert off.get_ylim()[1] > 3.0


def draw_case_figure(result: CaseResult):
    from matplotlib.figure import Figure

    fields = PressureFields.of(result.load)
    figure = Figure(figsize=case_inches(fields))
    draw_case(figure, result_record(result), result.placement, fields)
    return figure


def case_axes(result: CaseResult) -> list:
    return draw_case_figure(result).axes


def test_the_words_of_a_case_figure_have_the_verdict_and_every_answer(flattened_result):
    texts = [text.get_text() for text in draw_case_figure(flattened_result).texts]
    verdict = flattened_result.verdict
    assert " Hertz FAILS " in texts
    (reason,) = [text for text in texts if text.startswith("furthest beyond its limit: peak pressure ")]
    off, uncertainty = (
        1e2 * measures["p_max_MPa"] for measures in (flattened_result.load.deviation, flattened_result.load.uncertainty)
    )
    assert f"{off:+.2f} % ± {uncertainty:.2f} % (limit ±5 %); cause: {verdict.cause}" in reason
    (text,) = [text for text in texts if "status: converged" in text]
    lines = [line.split() for line in text.splitlines()]
    judged_lines = {line[0]: line for line in lines if line and line[-1] in ("HOLDS", "UNRESOLVED", "FAILS")}
    assert {name: line[-1] for name, line in judged_lines.items()} == {
        MEASURE_WORDS[name].short: answer for name, answer in verdict.each.items()
    }
    assert judged_lines["p_max"][-3:-1] == ["±5", "%"]
    assert judged_lines["centre"][-3:-1] == ["±0.15", "b"]
    # sizes of meshes are in the report
    assert "elements " not in text.replace("finite elements", "")
    # in this font and size, 60 characters reach the right edge of the picture
    assert max(len(line) for line in text.splitlines()) <= 60


def test_the_difference_in_a_case_figure_has_the_sign_of_its_verdict(flattened_result):
    images = {ax.get_title(): ax.images[0].get_array() for ax in case_axes(flattened_result) if ax.images}
    fe, hertz, difference = (images[name] for name in ("finite elements", "Hertz", "Hertz minus finite elements"))
    # Hertz's peak is higher than any pressure of the finite elements
    assert flattened_result.load.deviation["p_max_MPa"] > 0.3
    assert difference.ravel()[hertz.argmax()] > hertz.max() - fe.max() > 0.0


def test_a_case_figure_has_the_junctions_of_the_rail_on_its_maps(elliptic_quick):
    """Pressure drawn on a different pair: 60E1's arcs of 300 and 80 mm meet 2.35 mm from the contact point at 3 mm."""
    on_60e1 = replace(elliptic_quick, placement=place_case(Case(lateral_shift_mm=3.0, roll="given")))
    maps = [ax for ax in case_axes(on_60e1) if ax.get_title().startswith(("finite elements", "Hertz"))]
    assert len(maps) == 3
    for ax in maps:
        lines = [line.get_xdata()[0] for line in ax.get_lines() if line.get_label() == "_rail junction"]
        assert [at for at in lines if 0.0 < at < 5.0] == [pytest.approx(2.35, abs=0.01)]


@pytest.mark.parametrize("has_junction", [True, False])
def test_the_words_of_a_case_figure_tell_of_junctions_where_there_is_one(elliptic_quick, has_junction):
    on_60e1 = replace(elliptic_quick, placement=place_case(Case(lateral_shift_mm=3.0, roll="given")))
    texts = [text.get_text() for text in draw_case_figure(on_60e1 if has_junction else elliptic_quick).texts]
    assert any("solid: finite elements, dashed: Hertz" in text for text in texts)
    assert any("dotted: rail junction" in text for text in texts) == has_junction


def test_a_case_figure_has_both_outlines_where_the_numbers_have_them(elliptic_quick):
    maps = [ax for ax in case_axes(elliptic_quick) if ax.get_title() in ("finite elements", "Hertz")]
    assert len(maps) == 2
    hertz, fe = elliptic_quick.hertz, elliptic_quick.comparison.fe
    for ax in maps:
        (ellipse,) = [line for line in ax.get_lines() if line.get_label() == "Hertz"]
        s, x = ellipse.get_data()
        assert (np.ptp(s), np.ptp(x)) == pytest.approx((hertz.extent_y_mm, hertz.extent_x_mm), rel=1e-3)
        (patch,) = [c for c in ax.collections if c.get_label() == "finite elements"]
        edge = np.vstack([path.vertices for path in patch.get_paths()])
        # the extent in the measures is the mean of two such outlines, which are half a node apart at each end
        step = max(elliptic_quick.grid.steps_mm)
        assert np.ptp(edge[:, 0]) == pytest.approx(fe.extent_y_mm, abs=step)
        assert np.ptp(edge[:, 1]) == pytest.approx(fe.extent_x_mm, abs=step)


@pytest.mark.parametrize(("a_mm", "b_mm"), [(5.5, 5.5), (30.0, 6.0), (6.0, 40.0), (40.0, 5.5)])
def test_nothing_in_a_case_figure_hides_another_thing_or_is_cut_off(elliptic_quick, a_mm, b_mm):
    """With pressures of five digits and a sign, the widest that there are."""
    from matplotlib.transforms import Bbox

    result = change_hertz(elliptic_quick, a_mm=a_mm, b_mm=b_mm)
    load = result.load
    fe = replace(load.fe.pressure, values=20.0 * load.fe.pressure.values)
    fields = PressureFields(grid=fe.grid, fe=fe.values, hertz=0.0 * fe.values, ellipse=load.hertz)
    figure = blank_figure(*case_inches(fields))
    draw_case(figure, result_record(replace(result, load=load)), result.placement, fields)
    figure.draw_without_rendering()
    artists = [*figure.axes, *figure.texts]
    boxes = {str(artist): artist.get_tightbbox() for artist in artists}
    picture = Bbox([[0.0, 0.0], figure.canvas.get_width_height()])
    for name, box in boxes.items():
        assert picture.x0 <= box.x0 < box.x1 <= picture.x1, name
        assert picture.y0 <= box.y0 < box.y1 <= picture.y1, name
    for first, second in combinations(boxes, 2):
        assert not boxes[first].overlaps(boxes[second]), (first, second)


def test_lobes_are_numbered_where_they_are_and_no_patch_leaves_a_third_empty(elliptic_quick):
    # two lobes side by side: the pressure with a reduced middle
    pressure = elliptic_quick.load.fe.pressure
    middle = np.abs(pressure.grid.s_mm) < 0.5
    two = change_fe(elliptic_quick, pressure_MPa=np.where(middle, 0.2, 1.0) * pressure.values)
    two = replace(two, load=judge_load(two.load.solved, two.placement))
    (fe,) = [ax for ax in case_axes(two) if ax.get_title() == "finite elements"]
    lobes = two.load.lobes
    assert len(lobes) == 2
    assert [(t.get_text(), t.xy) for t in fe.texts] == [
        (str(k), pytest.approx(lobe.centre_mm[::-1])) for k, lobe in enumerate(lobes, start=1)
    ]
    # the text beside the picture and the table on the terminal have the same places and forces
    figure = blank_figure(15.0, 9.0)
    draw_case(figure, result_record(two), two.placement, PressureFields.of(two.load))
    labels = re.findall(r"lobe (\d), centre at rail y (\S+) mm: (\S+) MPa, (\S+) kN", figure.texts[-1].get_text())
    table = lobes_table(result_record(two))
    places = {column.heading.replace("\n", " "): n for n, column in enumerate(table.columns)}
    in_table = [
        tuple(row.cells[places[name]] for name in ("centre rail y mm", "p_max FE MPa", "force kN"))
        for row in table.rows
    ]
    assert [label[1:] for label in labels] == in_table
    # a wide patch has flat maps and a flat picture
    heights = [case_inches(PressureFields.of(change_hertz(elliptic_quick, b_mm=b).load))[1] for b in (3.0, 11.0, 40.0)]
    assert heights == sorted(heights, reverse=True)
    # of it 0.9 inches are the contributions to the uncertainty
    assert heights[-1] < 8.4


def luminance(colour: str) -> float:
    """Relative luminance (WCAG 2, from IEC 61966-2-1)."""
    from matplotlib.colors import to_rgb

    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_series_of_a_picture_have_different_styles():
    styles = {tuple(series_style(number).values()) for number in range(3 * len(SERIES_COLOURS))}
    assert len(styles) == 3 * len(SERIES_COLOURS)


def test_verdicts_are_told_apart_in_grey():
    from fecontact.outputs.figures.study import ANSWER_MARKS
    from fecontact.outputs.style import ANSWER_COLOURS

    levels = sorted(luminance(ANSWER_COLOURS[answer]) for answer in ("HOLDS", "UNRESOLVED", "FAILS"))
    # relative steps (Weber) above 40 %: many times the smallest step that the eye can distinguish (2 %)
    assert all(light / dark > 1.4 for dark, light in pairwise(levels))
    assert len(set(ANSWER_MARKS.values())) == len(ANSWER_MARKS)
    assert len(set(SERIES_COLOURS)) == len(SERIES_COLOURS)


def test_error_bars_of_a_study_are_its_uncertainties(elliptic_row, monkeypatch):
    criteria = Criteria(p_max=0.04, judged_by=("p_max",))
    rows = [elliptic_row | {"lateral_shift_mm": float(k), "hertz_uncertainty_p_max_percent": 2.0 * k} for k in range(3)]
    peak, off, _ = draw_study_axes(monkeypatch, rows, criteria=criteria)

    def lengths(ax) -> list[float]:
        (bars,) = [c for c in ax.collections if hasattr(c, "get_segments")]
        return [float(np.ptp(segment[:, 1])) for segment in bars.get_segments()]

    fe = elliptic_row["fe_p_max_MPa"]
    assert lengths(peak) == pytest.approx([0.0, 0.04 * fe, 0.08 * fe])
    # relative to the limit of 4 %
    assert lengths(off) == pytest.approx([0.0, 1.0, 2.0])


def test_no_line_joins_places_between_which_the_contact_jumps(elliptic_row, monkeypatch):
    rows = [elliptic_row | {"lateral_shift_mm": float(k), "hertz_b_mm": 3.0} for k in range(4)]
    for row, place in zip(rows, (0.0, 2.9, -0.2, -0.3), strict=True):
        row["contact_rail_y_mm"] = place
    peak, _, touch = draw_study_axes(monkeypatch, rows)
    (line,) = [line for line in peak.get_lines() if line.get_label() == "finite elements"]
    shifts = line.get_xdata()
    assert shifts == pytest.approx([0.0, 1.0, math.nan, 2.0, 3.0], nan_ok=True)
    assert touch.get_title(loc="left") == "curves are interrupted where the contact point jumps"


def test_no_line_joins_different_pairs(elliptic_row, monkeypatch):
    pairs = [("a", "w"), ("a", "w"), ("b", "w"), ("b", "v")]
    loads = (50.0, 100.0, 100.0, 100.0)
    rows = [
        elliptic_row | {"id": str(number), "rail": rail, "wheel": wheel, "load_kN": load_kN}
        for number, ((rail, wheel), load_kN) in enumerate(zip(pairs, loads, strict=True))
    ]
    # the contact points of different pairs are no jump
    rows[2]["contact_rail_y_mm"] = 40.0
    peak, _, touch = draw_study_axes(monkeypatch, rows)
    (line,) = [line for line in peak.get_lines() if line.get_label() == "finite elements"]
    assert list(line.get_xdata()) == pytest.approx([0.0, 1.0, math.nan, 2.0, math.nan, 3.0], nan_ok=True)
    assert touch.get_title(loc="left") == ""
    assert touch.get_xlabel() == "rail, load, wheel at a lateral shift of +0.00 mm"


def test_a_study_says_what_varies_in_its_table_and_on_its_axis(elliptic_row, monkeypatch):
    rows = [
        elliptic_row | {"id": name, "resolution": name, "varied": f"resolution {name}"} for name in ("quick", "fine")
    ]
    text = io.StringIO()
    for table_part in parts_of_rows(rows):
        print_parts([table_part], Console(file=text, width=200))
    printed = text.getvalue()
    assert all(f" resolution {name} " in printed for name in ("quick", "fine"))
    peak, _, touch = draw_study_axes(monkeypatch, rows)
    # side by side in their order; by shift, all would be at the same place
    assert [tick.get_text() for tick in touch.get_xticklabels()] == ["quick", "fine"]
    assert touch.get_xlabel() == "resolution at a lateral shift of +0.00 mm"
    (line,) = [line for line in peak.get_lines() if line.get_label() == "finite elements"]
    assert list(line.get_xdata()) == [0.0, 1.0]
    moduli = [elliptic_row | {"id": str(number), "varied": f"young_MPa {number}"} for number in (200000, 210000)]
    assert [one_series.label for one_series in split_into_series(moduli)] == ["young_MPa 200000", "young_MPa 210000"]


def test_study_and_profile_figures_are_pngs(record, elliptic_row, tmp_path):
    draw_study([{"id": "x", **elliptic_row}, failed_row(record)], tmp_path / "study.png", criteria=Criteria())
    draw_profile(load_library_profile("S1002"), tmp_path / "profile.png")
    assert min(size_of_png(tmp_path / "study.png") + size_of_png(tmp_path / "profile.png")) > 900
    with pytest.raises(InputError, match="no rows"):
        draw_study([], tmp_path / "none.png")


# Weight


def test_importing_the_writers_loads_no_plotting_and_no_vtk():
    names = ("records.results", "records.stored", "paraview.vtk", "figures.case", "figures.study")
    names += ("case_parts", "study_report", "study_files", "cases", "words", "tables", "mesh_files", "decks")
    modules = ", ".join(f"fecontact.outputs.{name}" for name in names)
    check = f"import sys, {modules}; print(*sorted({{'vtk', 'vtkmodules', 'pyvista', 'meshio', 'matplotlib', 'gmsh', 'rich'}} & set(sys.modules)))"  # noqa: E501
    process = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True)
    assert process.stdout.strip() == ""


def rows_with(*rows):
    # the id follows from the inputs: equal cases have equal ids
    base = {"rail": "60E1", "wheel": "S1002", "load_kN": 100.0, "inclination_rad": 0.025, "yaw_mrad": 0.0}
    base |= {"roll_mrad": 0.0, "resolution": "quick", "lateral_shift_mm": 0.0}
    return [base | row | {"id": str(sorted((base | row).items()))} for row in rows]


@pytest.mark.parametrize(
    ("rows", "names"),
    [
        (rows_with({}), ["study"]),
        (rows_with({}, {}), ["study"]),
        (rows_with({}, {"lateral_shift_mm": 1.0}), ["study"]),
        # Manchester: the roll follows from the shift
        (rows_with({}, {"lateral_shift_mm": 1.0, "roll_mrad": 0.1}), ["study"]),
        (
            rows_with({}, {"load_kN": 50.0}, {"lateral_shift_mm": 1.0}, {"lateral_shift_mm": 1.0, "load_kN": 50.0}),
            ["study_100kN", "study_50kN"],
        ),
        (
            [
                row
                for shift in (0.0, 1.0)
                for row in rows_with(
                    {"lateral_shift_mm": shift},
                    {"lateral_shift_mm": shift, "inclination_rad": 0.05},
                    {"lateral_shift_mm": shift, "rail": "80@2.toml@0123abcd"},
                )
            ],
            ["study_60E1_inclination0.025rad", "study_60E1_inclination0.05rad", "study_80@2"],
        ),
        (
            [
                row
                for shift in (0.0, 1.0)
                for row in rows_with({"lateral_shift_mm": shift}, {"lateral_shift_mm": shift, "resolution": [0.5, 0.4]})
            ],
            ["study_quick", "study_-0.5-0.4-"],
        ),
        # single cases: their study has no series
        (rows_with({"rail": "circle:300"}, {"rail": "circle:80"}), ["study_circle-300", "study_circle-80"]),
    ],
)
def test_cases_are_put_together_by_what_they_have_in_common(rows, names):
    unique = list({row["id"]: row for row in rows}.values())
    all_series = split_into_series(unique)
    assert [f"study{one_series.file_suffix}" for one_series in all_series] == names
    assert sum(len(one_series.rows) for one_series in all_series) == len(unique)
    for one_series in all_series:
        shifts = [row["lateral_shift_mm"] for row in one_series.rows]
        assert shifts == sorted(set(shifts))


def test_a_series_is_named_by_what_others_do_not_share():
    rows = rows_with({"rail": "worn.toml@0123abcd"}, {"rail": "arcs:300/80@-2"}, {"load_kN": 50.0}, {"load_kN": None})
    del rows[-1]["load_kN"]
    assert [one_series.label for one_series in split_into_series(rows)] == [
        "worn",
        "arcs:300/80@-2",
        "60E1, 50 kN",
        "60E1, no load_kN",
    ]


def test_series_of_the_same_name_do_not_overwrite_each_other(monkeypatch, tmp_path):
    monkeypatch.setattr("fecontact.outputs.paraview.vtk.write_pvd", lambda path, cases: path)
    rails = [f"worn.toml@0123456{end}" for end in "abc"]
    rows = [row for rail in rails for row in rows_with({"rail": rail}, {"rail": rail, "lateral_shift_mm": 1.0})]
    assert _write_collections(rows, tmp_path) == ("study_worn.pvd", "study_worn.2.pvd", "study_worn.3.pvd")


def test_more_series_than_colours_are_drawn_without_names(elliptic_row, tmp_path):
    rows = [elliptic_row | {"rail": f"arcs:300/80@{k}"} for k in range(40)]
    # matplotlib warns if a legend leaves no room for the axes; here a warning is an error
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        draw_study(rows, tmp_path / "study.png")
    assert size_of_png(tmp_path / "study.png")[1] < 2000
