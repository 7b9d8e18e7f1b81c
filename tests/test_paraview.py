"""The script that opens results in ParaView.

If ParaView is installed, its pictures of the files are checked too.
"""

import json
import math
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyvista
from kept import keep_as

from fecontact.bodies import Track
from fecontact.case import Case
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.files import write_json
from fecontact.judging.judge import judge_load
from fecontact.outputs.paraview.view import view_script, write_view
from fecontact.outputs.paraview.vtk import write_pvd
from fecontact.outputs.study_files import write_tables
from fecontact.profiles.reading import Reading
from fecontact.solving.solve import CaseResult, solve


@pytest.fixture(scope="module")
def study(elliptic_quick: CaseResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of two shifts: a case, and its copy with a different shift in the name."""
    out = tmp_path_factory.mktemp("a study & more")
    rows = []
    for shift in (-1.0, 2.5):
        case = replace(elliptic_quick.case, lateral_shift_mm=shift)
        load = judge_load(replace(elliptic_quick.load.solved, case=case), elliptic_quick.placement)
        rows.append(keep_as(replace(elliptic_quick, load=load), out / "cases" / f"at{shift:g}"))
    write_tables("two", 2, rows, out / "study")
    write_pvd(out / "study.pvd", [(row["lateral_shift_mm"], out / "cases" / row["id"]) for row in rows])
    return out


def head_constants(script: Path) -> dict:
    """The constants in the head of a script."""
    text = script.read_text("utf-8").partition("# ---")[0]
    lines = [line.partition(" = ") for line in text.splitlines() if " = " in line]
    return {name: json.loads(value) for name, _, value in lines}


def test_the_script_holds_relative_paths_and_one_scale_over_the_series(study, elliptic_quick):
    header = head_constants(write_view(study))
    touch = elliptic_quick.placement.first
    assert (header["FILES"], header["BODIES"]) == (["study.pvd"], ["study_bodies.pvd"])
    assert header["CENTRE_MM"] == pytest.approx([touch.x_mm, touch.y_mm, touch.z_mm], abs=1e-3)
    peak = max(elliptic_quick.comparison.fe.p_max_MPa, elliptic_quick.hertz.p0_MPa)
    stress = max(stress_field.von_mises_MPa for stress_field in elliptic_quick.von_mises.values())
    # the next multiple of one hundred, so that no case exceeds it
    assert 0.0 <= header["PRESSURE_MPA"] - peak < 100.0
    assert 0.0 <= header["VON_MISES_MPA"] - stress < 100.0
    assert header["PRESSURE_MPA"] % 100.0 == 0.0
    assert header["SIZE_MM"] == pytest.approx(elliptic_quick.comparison.fe.extent_x_mm, rel=0.02)
    assert str(study) not in (study / "view.py").read_text("utf-8")


def script_of(folder: Path, row: dict, record: dict) -> dict:
    """Constants of a script for a case with given numbers."""
    folder.mkdir()
    write_json(folder / "result.json", record)
    path = folder / "view.py"
    path.write_text(view_script(["case.vtm"], [row], [folder]), "utf-8")
    return head_constants(path)


@pytest.mark.parametrize(
    ("stress_MPa", "labels"),
    [
        (1510.0, [0.0, 500.0, 1000.0, 1600.0]),
        (1500.0, [0.0, 500.0, 1000.0, 1500.0]),
        (1350.0, [0.0, 500.0, 1000.0, 1400.0]),
        (310.0, [0.0, 100.0, 200.0, 300.0, 400.0]),
    ],
)
def test_labels_of_a_colour_scale_do_not_overlap(tmp_path, stress_MPa, labels):
    row = ROW | {"von_mises_rail_von_mises_MPa": stress_MPa}
    assert script_of(tmp_path / "case", row, RECORD)["VON_MISES_LABELS"] == labels


def test_the_camera_looks_onto_a_gauge_corner_and_the_relief_is_low(tmp_path):
    upright = script_of(tmp_path / "upright", ROW, RECORD)
    # the normal of a surface that rises to the field side by an angle points to the gauge side
    lobes = [LOBE | {"contact_point_number": k, "contact_angle_rad": angle} for k, angle in ((1, 1.0), (None, 0.2))]
    points = [*RECORD["contact_points"], {"x_mm": 0.0, "y_mm": -8.0, "z_mm": -2.0}]
    inclined = script_of(tmp_path / "inclined", ROW, {"contact_points": points, "lobes": lobes})
    assert inclined["CENTRE_MM"] == [0.0, -4.0, -1.0]
    normal = np.array([0.0, -math.sin(0.5), math.cos(0.5)])
    assert np.linalg.norm(inclined["CAMERA"]) == pytest.approx(1.0, abs=1e-3)
    assert normal @ inclined["CAMERA"] == pytest.approx(upright["CAMERA"][2], abs=1e-3)
    assert inclined["CAMERA"][0] == upright["CAMERA"][0]
    # a tenth of the smallest width below the largest pressure, rounded down to 1, 2 or 5
    assert upright["RELIEF_MM_PER_MPA"] == 5e-4
    assert inclined["RELIEF_MM_PER_MPA"] == 2e-4


LOBE = {"hertz": {"extent_x_mm": 9.0, "extent_y_mm": 3.0}}
RECORD = {"contact_points": [{"x_mm": 0.0, "y_mm": 0.0, "z_mm": 0.0, "contact_angle_rad": 0.0}], "lobes": []}
ROW = {
    "fe_p_max_MPa": 1000.0, "hertz_p_max_MPa": 1100.0, "hertz_extent_x_mm": 12.0, "hertz_extent_y_mm": 6.0,
    "von_mises_rail_von_mises_MPa": 600.0,
}  # fmt: skip


def test_the_colours_of_bodies_that_yield_end_at_their_pressure(tmp_path):
    row = ROW | {"fe_p_max_MPa": 2000.0, "plastic_p_max_MPa": 900.0}
    assert script_of(tmp_path / "case", row, RECORD)["PRESSURE_MPA"] == 1100.0


def test_a_single_case_is_opened_as_well_and_a_folder_without_files_is_refused(study, tmp_path, capsys):
    folder = study / "cases" / "at-1"
    assert call(["view", str(folder)]) == 0
    header = head_constants(folder / "view.py")
    assert (header["FILES"], header["BODIES"]) == (["case.vtm"], ["bodies.vtm"])
    assert "paraview --script=" in capsys.readouterr().out
    with pytest.raises(InputError, match="a map stores no meshes"):
        write_view(tmp_path)
    assert call(["view", str(tmp_path)]) == 2
    # cases without a series: the message names the folder to give
    shutil.copytree(folder, tmp_path / "cases" / "one")
    with pytest.raises(InputError, match=re.escape(f"such as {tmp_path / 'cases' / 'one'}")):
        write_view(tmp_path)


@pytest.mark.slow
def test_the_command_that_a_study_names_makes_a_view(tmp_path, capsys):
    """Command of a study at a single shift, with the folder of a case."""
    pair = 'rail = "circle:300"\nwheel = "cylinder:460"\ninclination = "none"\nresolution = "quick"\n'
    (tmp_path / "loads.toml").write_text(pair + "lateral_shift_mm = 0.0\nload_kN = [50.0, 100.0]\n", "utf-8")
    assert call(["run", str(tmp_path / "loads.toml"), "--out", str(tmp_path / "out"), "--workers", "1"]) == 0
    (folder,) = re.findall(r"fecontact view '?([^'\n]+)", capsys.readouterr().out.replace("\n", ""))
    assert folder.startswith(str(tmp_path / "out" / "cases"))
    assert call(["view", folder]) == 0


def test_a_case_that_failed_is_no_part_of_the_view(study, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(study, out)
    document = json.loads((out / "study.json").read_text("utf-8"))
    lost = {"id": "lost", "status": "failed: it derails", "lateral_shift_mm": 9.0}
    write_json(out / "study.json", document | {"rows": [*document["rows"], lost]})
    assert head_constants(write_view(out)) == head_constants(write_view(study))


def pvpython() -> list[str]:
    """The command that runs a script in ParaView; skips where there is none, or no screen and no stand-in."""
    if shutil.which("pvpython") is None:
        pytest.skip("pvpython is not installed (Debian: apt-get install paraview)")
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        if shutil.which("xvfb-run") is None:
            pytest.skip("no screen, and no xvfb-run (Debian: apt-get install xvfb xauth)")
        # ParaView first opens a window and closes it. A server restarts after its last client has left, and refuses
        # clients during that time
        return ["xvfb-run", "-a", "-s", "-screen 0 1280x1024x24 -noreset", "pvpython"]
    return ["pvpython"]


def run_check(study: Path, pictures: Path) -> subprocess.CompletedProcess:
    """Run the check in ParaView on a study."""
    # the environment of this Python must not reach ParaView's Python
    clean = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    command = [*pvpython(), str(Path(__file__).with_name("paraview_check.py")), str(study), str(pictures)]
    # from a different folder: the paths are relative to the script
    return subprocess.run(command, capture_output=True, text=True, timeout=240, cwd=pictures, env=clean, check=False)


@pytest.mark.slow
def test_paraview_reads_integrates_and_shows_the_whole_ellipse(study, tmp_path):
    write_view(study)
    process = run_check(study, tmp_path)
    assert process.returncode == 0, process.stdout + process.stderr[-2000:]
    assert "all as it should be" in process.stdout
    shares = [float(share) for share in re.findall(r"([0-9.]+) % of Hertz's ellipse", process.stdout)]
    assert len(shares) == 4
    assert min(shares) > 99.0
    names = sorted(path.name for path in tmp_path.glob("*.png"))
    assert names.pop() == "study_by_itself.png"
    assert names == [
        f"{name}_{shift}mm_{width}.png"
        for name in ("pressure", "stress")
        for shift in ("+2.50", "-1.00")
        for width in (1000, 1600)
    ]


ROOT = Path(__file__).parents[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rail", "wheel", "inputs"),
    [
        # two patches, whose normals differ by 0.17 rad
        ("60E1", "S1002", {"lateral_shift_mm": 5.0}),
        ("60E1", "S1002", {"lateral_shift_mm": 4.0, "yaw_rad": 0.01}),
        # the patch goes around a corner
        (
            *(str(ROOT / "studies" / "profiles" / name) for name in ("corner_R10.toml", "fillet_R10-2.toml")),
            {
                "inclination_rad": 0.0,
                "roll": "given",
                "load_kind": "normal",
                "wheel_file": Reading(tape_circle_mm=0.0),
                # the middle of the corner of R 10 below the tape circle, with a level top of 50 mm
                "track": Track(rail_crown_y_mm=Track().tape_circle_y_mm + 10.0 * math.sin(math.pi / 4.0) + 25.0),
            },
        ),
    ],
)
def test_paraview_shows_positions_that_are_not_level(tmp_path, rail, wheel, inputs):
    folder, pictures = tmp_path / "case", tmp_path / "pictures"
    pictures.mkdir()
    keep_as(solve(Case(rail=rail, wheel=wheel, resolution="quick", refine="never", **inputs)), folder)
    write_view(folder)
    process = run_check(folder, pictures)
    assert process.returncode == 0, process.stdout + process.stderr[-2000:]


@pytest.mark.slow
def test_an_ellipse_below_the_relief_and_text_that_is_cut_are_faults(study, tmp_path):
    folder, pictures = tmp_path / "hidden", tmp_path / "pictures"
    shutil.copytree(study / "cases" / "at-1", folder)
    pictures.mkdir()
    script = write_view(folder)
    line = pyvista.read(folder / "hertz_ellipse.vtp")
    line.points[:, 2] -= 0.5
    line.save(folder / "hertz_ellipse.vtp")
    surface = pyvista.read(folder / "pressure.vtp")
    surface.point_data["pressure_vector_MPa"] *= 1.01
    surface.save(folder / "pressure.vtp")
    script.write_text(
        script.read_text("utf-8").replace("shown.FontSize, shown.Color = 11", "shown.FontSize, shown.Color = 40")
    )
    process = run_check(folder, pictures)
    assert process.returncode == 1
    shares = [float(share) for share in re.findall(r"([0-9.]+) % of Hertz's ellipse is seen", process.stdout)]
    assert len(shares) == 2
    assert max(shares) < 20.0
    assert process.stdout.count("text touches the border") == 4
    assert re.search(
        r"FAULT case.vtm: pressure: integral of the pressure along the load: \+(0\.99|1\.0)", process.stdout
    )
