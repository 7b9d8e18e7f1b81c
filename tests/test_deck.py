"""Decks for CalculiX: within its columns, and solved by it where it is installed."""

import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fecontact.case import BodySize, Case
from fecontact.cli import call
from fecontact.fe.body_mesh import BodyMesh
from fecontact.outputs.mesh_files import write_mesh
from fecontact.solving.case_meshes import MeshedPair, mesh_pair
from fecontact.solving.solve import solve

SIZE = BodySize(rail_depth_mm=30.0, rim_thickness_mm=30.0, half_length_mm=30.0)
CASE = Case(
    rail="circle:300",
    wheel="cylinder:460",
    inclination_rad=0.0,
    load_N=50e3,
    resolution=(2.0, 1.8),
    size=SIZE,
    refine="never",
)

needs_ccx = pytest.mark.skipif(
    shutil.which("ccx") is None, reason="CalculiX is not installed (Debian: apt-get install calculix-ccx)"
)


@pytest.fixture(scope="module")
def pair() -> MeshedPair:
    return mesh_pair(CASE)


def cards(path: Path) -> Iterator[tuple[str, list[str]]]:
    """Keyword lines of a deck with the data lines below them; comments left out."""
    head, data = "", []
    for line in path.read_text("ascii").splitlines():
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            if head:
                yield head, data
            head, data = line, []
        else:
            data.append(line)
    yield head, data


def run_ccx(path: Path) -> str:
    """Run CalculiX on a deck and return its result file."""
    process = subprocess.run(
        ["ccx", "-i", path.stem], cwd=path.parent, capture_output=True, text=True, env={"OMP_NUM_THREADS": "1"}
    )
    assert "Job finished" in process.stdout, process.stdout[-2000:]
    assert "*ERROR" not in process.stdout
    return path.with_suffix(".dat").read_text()


def vectors(dat: str, title: str) -> np.ndarray:
    """The numbers of the last block of this title, a row a line."""
    block = dat.rpartition(title)[2].split("\n\n")[1]
    return np.array([[float(word) for word in line.split()] for line in block.strip().splitlines()])


def contact_pressures(frd: Path) -> dict[int, float]:
    """Last contact pressures by node of a result file with columns of 12 characters."""
    block = frd.read_text().rpartition(" -4  CONTACT")[2].partition("\n -3")[0]
    lines = [line for line in block.splitlines() if line.startswith(" -1")]
    return {int(line[3:13]): float(line[13 + 3 * 12 : 13 + 4 * 12]) for line in lines}


def test_a_deck_fits_calculix_and_names_every_set_once(pair, tmp_path):
    path = write_mesh(pair, tmp_path / "deck.inp")
    deck_cards = list(cards(path))
    for head, data in deck_cards:
        if not head.startswith("*HEADING"):
            assert all(len(field.strip()) <= 20 for line in data for field in line.split(",")), head
            assert all(len(line.split(",")) <= 16 for line in data), head
    names = [
        re.findall(r"^\*(NODE|ELEMENT|NSET|SURFACE|MATERIAL), .*?(?:NSET|ELSET|NAME)=(\w+)", head)
        for head, _ in deck_cards
    ]
    set_names = [name[0] for name in names if name]
    assert len(set_names) == 28
    assert len(set_names) == len(set(set_names))
    for body in (pair.rail, pair.wheel):
        assert {f"{body.name}_{surface}" for surface in body.surfaces} <= {
            name for kind, name in set_names if kind == "NSET"
        }
    elements = np.array(
        [[int(n) for n in line.split(",")] for head, data in deck_cards if head.startswith("*ELEMENT") for line in data]
    )
    assert np.array_equal(elements[:, 0], np.arange(1, len(pair.rail.hexes) + len(pair.wheel.hexes) + 1))
    np.testing.assert_array_equal(elements[: len(pair.rail.hexes), 1:], pair.rail.hexes + 1)
    np.testing.assert_array_equal(elements[len(pair.rail.hexes) :, 1:], pair.wheel.hexes + len(pair.rail.points) + 1)


def test_a_load_along_the_normal_moves_the_rim_along_it(tmp_path):
    case = Case(lateral_shift_mm=4.0, roll="given", yaw_rad=5e-3, load_kind="normal", resolution=(2.5, 2.0))
    pair = mesh_pair(case)
    deck_cards = dict(cards(write_mesh(pair, tmp_path / "deck.inp")))
    assert np.linalg.norm(pair.direction) == pytest.approx(1.0)
    assert not pair.rail.half
    terms = deck_cards["*EQUATION"][1::2]
    load_point = len(pair.rail.points) + len(pair.wheel.points) + 1
    coefficients = {int(line.split(",")[1]): -float(line.split(",")[5]) for line in terms}
    assert [coefficients.get(axis + 1, 0.0) for axis in range(3)] == pytest.approx(pair.direction, abs=1e-12)
    assert {int(line.split(",")[3]) for line in terms} == {load_point}
    assert deck_cards["*CLOAD"] == [f"{load_point}, 3, -1.000000000e+05"]


@pytest.mark.parametrize("element", ["C3D8", "C3D8I"])
def test_meshio_reads_a_deck_with_all_nodes_elements_and_sets(pair, tmp_path, element):
    import meshio

    deck_mesh = meshio.read(write_mesh(pair, tmp_path / "deck.inp", element=element))
    rail, wheel = pair.rail, pair.wheel
    after = len(rail.points)
    # all of both bodies, and the node that carries the load
    np.testing.assert_allclose(deck_mesh.points[:-1], np.vstack([rail.points, wheel.points]), atol=1e-9)
    assert deck_mesh.point_sets["load_point"].tolist() == [after + len(wheel.points)]
    np.testing.assert_array_equal(deck_mesh.cells[0].data, rail.hexes)
    np.testing.assert_array_equal(deck_mesh.cells[1].data, wheel.hexes + after)
    for mesh, first in ((rail, 0), (wheel, after)):
        np.testing.assert_array_equal(deck_mesh.point_sets[mesh.name], first + np.arange(len(mesh.points)))
        for name, quads in mesh.surfaces.items():
            np.testing.assert_array_equal(deck_mesh.point_sets[f"{mesh.name}_{name}"], np.unique(quads) + first)


def test_meshio_reads_one_body(pair, tmp_path):
    import meshio

    mesh = meshio.read(write_mesh(pair.wheel, tmp_path / "wheel.inp"))
    np.testing.assert_allclose(mesh.points, pair.wheel.points, atol=1e-9)
    np.testing.assert_array_equal(mesh.cells[0].data, pair.wheel.hexes)
    np.testing.assert_array_equal(mesh.point_sets["driven"], np.unique(pair.wheel.surfaces["driven"]))


@pytest.mark.parametrize("ending", ["msh", "vtu"])
def test_both_bodies_in_one_file_keep_their_cells_and_surfaces(pair, tmp_path, ending):
    import meshio

    mesh = meshio.read(write_mesh(pair, tmp_path / f"both.{ending}"))
    hexes = sum(len(block.data) for block in mesh.cells if block.type == "hexahedron")
    assert hexes == len(pair.rail.hexes) + len(pair.wheel.hexes)
    assert len(mesh.points) == len(pair.rail.points) + len(pair.wheel.points)
    names = {f"{body.name}_{surface}" for body in (pair.rail, pair.wheel) for surface in body.surfaces}
    if ending == "msh":
        assert set(mesh.field_data) == names | {"rail", "wheel"}
        assert len(mesh.cell_sets["wheel_contact"]) > 0
    else:
        assert set(mesh.point_data) == names
        top = mesh.points[mesh.point_data["rail_contact"] == 1]
        np.testing.assert_allclose(
            np.sort(top[:, 2]), np.sort(pair.rail.points[np.unique(pair.rail.surfaces["contact"]), 2]), atol=1e-12
        )


def test_the_command_line_writes_both_and_says_that_they_are_half(tmp_path, capsys):
    options = ["--rail", "circle:300", "--wheel", "cylinder:460", "--inclination", "none", "--resolution", "2,1.8"]
    assert call(["mesh", "both", *options, "--element", "C3D8", "--out", str(tmp_path / "deck.inp")]) == 0
    assert "half of the body, x >= 0" in capsys.readouterr().out
    assert "*ELEMENT, TYPE=C3D8, ELSET=wheel" in (tmp_path / "deck.inp").read_text()


def test_a_deck_has_the_elements_of_solve_unless_others_are_asked_for(pair, tmp_path):
    path = tmp_path / "deck.inp"
    for options, kind in (({}, "C3D8"), ({"element": "C3D8I"}, "C3D8I")):
        text = write_mesh(pair, path, **options).read_text("ascii")
        assert set(re.findall(r"TYPE=(C3D8\w*)", text)) == {kind}
        assert text.splitlines()[1].endswith(
            f"elements {kind} {'as' if kind == 'C3D8' else 'instead of C3D8'} in fecontact.solve"
        )


def pressed_area_mm2(mesh: BodyMesh) -> float:
    """Area of the contact surface seen from above, by the diagonals of its quadrilaterals."""
    p = mesh.points[mesh.surfaces["contact"]]
    first, second = p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]
    return float(0.5 * np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum())


@needs_ccx
@pytest.mark.parametrize("element", ["C3D8", "C3D8I"])
def test_calculix_reads_one_body_and_its_reaction_is_the_load(pair, tmp_path, element):
    path = write_mesh(pair.rail, tmp_path / "rail.inp", element=element)
    with path.open("a") as file:
        file.write(
            "*MATERIAL, NAME=steel\n*ELASTIC\n2.1e5, 0.3\n*SOLID SECTION, ELSET=rail, MATERIAL=steel\n"
            "*BOUNDARY\nfixed, 1, 3\nsymmetry, 1, 1\n*STEP\n*STATIC\n*DSLOAD\ncontact, P, 100.\n"
            "*NODE PRINT, NSET=fixed, TOTALS=ONLY\nRF\n*END STEP\n"
        )
    up = vectors(run_ccx(path), "total force (fx,fy,fz)")[0, 2]
    # five digits of the output, and a bilinear face is pressed by its flat projection exactly
    assert up == pytest.approx(100.0 * pressed_area_mm2(pair.rail), rel=1e-5)


@pytest.mark.slow
@needs_ccx
def test_calculix_finds_the_same_pressure_on_the_same_meshes(pair, tmp_path):
    """Mortar contact of CalculiX against ours on identical meshes, node by node."""
    dat = run_ccx(write_mesh(pair, tmp_path / "deck.inp", element="C3D8"))
    up = vectors(dat, "total force (fx,fy,fz)")[0, 2]
    assert up == pytest.approx(0.5 * CASE.load_N, rel=1e-5)
    result = solve(CASE)
    nodal = result.load.level.nodal
    assert nodal.grid.shape == pair.rail.contact_nodes.shape
    pressures = contact_pressures(tmp_path / "deck.frd")
    nodal_pressures = np.vectorize(lambda node: pressures.get(node + 1, 0.0))(pair.rail.contact_nodes)
    inner = nodal.pressure_MPa > 0.5 * nodal.pressure_MPa.max()
    assert np.count_nonzero(inner) == 9
    # 2 %: its C3D8 is the B-bar element, ours has all of its strains; at the rim of the patch the mortars differ
    np.testing.assert_allclose(nodal_pressures[inner], nodal.pressure_MPa[inner], atol=0.02 * nodal.pressure_MPa.max())
    # its surfaces are the meshes' polygons, which lie below arcs by h^2 / 12R in the mean, ours are the true ones
    mean_offset = 2.0**2 / (12.0 * 460.0) + 1.8**2 / (12.0 * 300.0)
    came_down = -vectors(dat, "for set LOAD_POINT")[0, 3]
    assert came_down - mean_offset == pytest.approx(nodal.approach_mm, rel=5e-3)
