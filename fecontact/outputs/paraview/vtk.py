"""ParaView files: both bodies, the contact, and a collection for each case and study.

A case is opened in ParaView by its `case.vtm` (blocks `pressure`, `hertz_ellipse`, `rail`). ParaView colours it by the
pressure, the only point array that all blocks have and that is active in each of them. The wheel, which would hide the
contact, is in `bodies.vtm` (`rail`, `wheel`, `elements`). A study is opened by its `.pvd`, with the lateral shift as
time. Half models are written as complete models, mirrored at their plane of symmetry.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from fecontact import __version__
from fecontact.arrays import Floats, Integers
from fecontact.errors import InputError
from fecontact.fe.body_mesh import BodyMesh
from fecontact.fe.stress import von_mises
from fecontact.files import write_text
from fecontact.inputs.texts import escape_invisible
from fecontact.outputs.paraview.contact_surface import PRESSURE, contact_surface, ellipse_lines, find_node_pressure
from fecontact.outputs.paraview.datasets import add_array, add_text, build_hexahedra, format_xml
from fecontact.outputs.records.results import result_record
from fecontact.outputs.verdict_words import case_annotation
from fecontact.solving.solve import CaseResult

# --- ParaView files: both bodies, the contact, a collection for each case and study.

COLLECTION, BODIES_COLLECTION = "case.vtm", "bodies.vtm"
"""Collections of the contact on the rail, and of the bodies."""
_BODIES_ENDING = "_bodies.pvd"
_BODIES = (("rail", "rail.vtu"), ("wheel", "wheel.vtu"))
_CONTACT = (("pressure", "pressure.vtp"), ("elements", "elements.vtp"), ("hertz_ellipse", "hertz_ellipse.vtp"))
_ALL_FILES = (*_BODIES, *_CONTACT)
_BLOCKS = {
    COLLECTION: ("pressure", "hertz_ellipse", "rail"),
    BODIES_COLLECTION: ("rail", "wheel", "elements"),
}
_STRESSES = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")
# Signs of the stresses XX YY ZZ XY YZ XZ, and of vectors x y z, after mirroring at x = 0.
_MIRRORED_STRESS = np.array([1.0, 1.0, 1.0, -1.0, 1.0, -1.0])
_MIRRORED_VECTOR = np.array([-1.0, 1.0, 1.0])


def write_case_vtk(result: CaseResult, folder: str | Path) -> Path:
    """Write a file for each block, and `case.vtm`, which names the files.

    Arrays on the bodies: `displacement_mm`, `stress_MPa` (XX YY ZZ XY YZ XZ) and `von_mises_MPa` at the nodes; on the
    rail also `contact_pressure_MPa` of the judged contact, which is zero outside the contact. The
    wheel's displacement contains the rigid approach (elastic displacement minus approach times direction), so that the
    warped bodies touch: the base of the rail stays, the driven surface of the wheel comes down.

    A body that has yielded also has `equivalent_plastic_strain`, `von_mises_plastic_MPa` and `imprint_mm` (displacement
    that remains without load). The other arrays are for elastic bodies.

    Arrays on `pressure` (the judged contact on its finer nodes) and `elements` (the contact on the elements' own nodes,
    to which displacements and stresses belong): see `contact_surface`. Lines: see `ellipse_lines`.

    Field data, on `pressure` alone: `TimeValue` and `lateral_shift_mm`, `load_kN`, `normal_force_N`, `hertz_p0_MPa`,
    `hertz_a_mm`, `hertz_b_mm`, the unit vectors `contact_normal` and `load_direction` out of the rail, the program's
    `version`, and an `annotation`: the case and its verdict in lines. Every other number of the case is in its
    `row.json`.

    Parameters
    ----------
    result
        Result of a case, with its meshes.
    folder
        Folder for the files.

    Returns
    -------
    Path
        The file `case.vtm`.

    Raises
    ------
    InputError
        If the result was read back from a folder, without its meshes.
    """
    folder, bodies = Path(folder), result.bodies
    if bodies is None:
        raise InputError(
            f"{folder}: a stored result has no meshes; use the files in its folder, or solve the case again"
        )
    for (name, file), body, rigid_motion_mm in zip(
        _BODIES, (bodies.coupled.rail, bodies.coupled.wheel), (np.zeros(3), -_approach_mm(result)), strict=True
    ):
        grid = _body_grid(body.mesh, bodies.displacement_mm[name], rigid_motion_mm, bodies.stress_MPa[name])
        for array, values in bodies.yielded.get(name, {}).items():
            add_array(grid.GetPointData(), array, _mirror_values(body.mesh, values).astype(np.float32))
        if name == "rail":
            pressure = find_node_pressure(result, body.mesh)
            add_array(grid.GetPointData(), PRESSURE, _mirror_values(body.mesh, pressure).astype(np.float32))
        # ParaView colours a collection by an active array of its blocks
        grid.GetPointData().SetActiveScalars(PRESSURE if name == "rail" else "von_mises_MPa")
        write_text(folder / file, format_xml(grid))
    return write_contact_vtk(result, folder)


def write_contact_vtk(result: CaseResult, folder: str | Path) -> Path:
    """Write the files that change if a case is judged again.

    Parameters
    ----------
    result
        Result of a case.
    folder
        Folder of the bodies' files.

    Returns
    -------
    Path
        The file `case.vtm`.
    """
    folder = Path(folder)
    level = result.load.level
    fe_yielded, elements_yielded = (
        (None, None) if level.yielded is None else (level.yielded.fe, level.yielded.nodal.even())
    )
    meshes = {
        "pressure": contact_surface(result, level.fe, fe_yielded),
        "elements": contact_surface(result, level.on_elements, elements_yielded),
        "hertz_ellipse": ellipse_lines(result),
    }
    _add_field_data(meshes["pressure"], result)
    for name, file in _CONTACT:
        write_text(folder / file, format_xml(meshes[name]))
    for collection, blocks in _BLOCKS.items():
        write_text(folder / collection, _collection_text(blocks))
    return folder / COLLECTION


def _to_ascii(text: str) -> str:
    r"""Text for VTK's fonts, which have ASCII only.

    Names of profiles may have any character. VTK takes a text with two `$` for mathematics and a text with `|` for a
    table, and draws `\$` and `\|` as `$` and `|`.
    """
    ascii_text = escape_invisible(text).replace("±", "+-").encode("ascii", "replace").decode("ascii")
    return re.sub(r"[$|]", r"\\\g<0>", ascii_text)


def write_pvd(path: str | Path, entries: Iterable[tuple[float, str | Path]]) -> Path:
    """Write collections over time, with a case at each time: the contact, and the bodies beside it.

    Parameters
    ----------
    path
        File of the collection.
    entries
        Time (the lateral shift in mm) and folder of each case, in the order of the list.

    Returns
    -------
    Path
        The written file.

    Raises
    ------
    InputError
        If two times are equal (ParaView would merge them) or a case has not been written (ParaView would show nothing,
        without a message).
    """
    path = Path(path)
    cases = [(float(time), Path(folder)) for time, folder in entries]
    times = [time for time, _ in cases]
    if repeated := sorted({time for time in times if times.count(time) > 1}):
        raise InputError(
            f"{path}: the times {', '.join(f'{time:g}' for time in repeated)} occur more than once, but ParaView merges"
            " equal times; write one collection per load"
        )
    for _, folder in cases:
        for name in (*_BLOCKS, *(name for _, name in _ALL_FILES)):
            if not (folder / name).is_file():
                raise InputError(f"{path}: {folder / name} does not exist; write the case before the collection")
    _write_series(path.with_name(name_bodies(path.name)), cases, BODIES_COLLECTION)
    return _write_series(path, cases, COLLECTION)


def name_bodies(collection: str) -> str:
    """Name of the collection of the bodies that belongs to a collection of the contact."""
    return BODIES_COLLECTION if collection == COLLECTION else collection.removesuffix(".pvd") + _BODIES_ENDING


def list_series(out: Path) -> list[str]:
    """Names of the series of a study, without the series of its bodies."""
    return sorted(path.name for path in out.glob("study*.pvd") if not path.name.endswith(_BODIES_ENDING))


def _write_series(path: Path, cases: Sequence[tuple[float, Path]], collection: str) -> Path:
    """Write a collection of the cases over time."""
    paths = [(time, Path(os.path.relpath(folder / collection, path.parent)).as_posix()) for time, folder in cases]
    lines = [f'    <DataSet timestep="{time!r}" part="0" file={quoteattr(file)}/>' for time, file in paths]
    return write_text(path, _xml("Collection", "0.1", ["  <Collection>", *lines, "  </Collection>"]))


def _collection_text(names: Sequence[str]) -> str:
    files = dict(_ALL_FILES)
    blocks = [f'    <DataSet index="{index}" name="{name}" file="{files[name]}"/>' for index, name in enumerate(names)]
    return _xml("vtkMultiBlockDataSet", "1.0", ["  <vtkMultiBlockDataSet>", *blocks, "  </vtkMultiBlockDataSet>"])


def _xml(kind: str, version: str, lines: list[str]) -> str:
    head = f'<VTKFile type="{kind}" version="{version}" byte_order="LittleEndian">'
    return "\n".join(['<?xml version="1.0"?>', head, *lines, "</VTKFile>", ""])


def _approach_mm(result: CaseResult) -> Floats:
    """Rigid approach (3,) of the wheel to the rail, in mm in the track frame.

    The vector has the direction of the load, away from the rail. Its component along the contact normal is the approach
    on the elements' nodes, to which the displacements belong.
    """
    placement = result.placement
    direction = placement.load_direction(normal=result.case.load_kind == "normal")
    # approach on the elements' nodes, to which the displacements belong; it is the component along the contact normal
    approach = result.load.level.nodal.approach_mm
    return np.asarray(approach / float(direction @ placement.first.normal) * direction)


def _add_field_data(mesh: Any, result: CaseResult) -> None:
    """Add shift, load, force, ellipse, directions, version and annotation to a mesh.

    Numbers are in the units of their names; `TimeValue` is the lateral shift in mm. Texts are reduced to ASCII.
    """
    numbers = {
        "TimeValue": result.case.lateral_shift_mm,
        "lateral_shift_mm": result.case.lateral_shift_mm,
        "load_kN": result.case.load_N / 1e3,
        "normal_force_N": result.normal_force_N,
        "hertz_p0_MPa": result.load.deciding_ellipse.p0_MPa,
        "hertz_a_mm": result.load.deciding_ellipse.a_mm,
        "hertz_b_mm": result.load.deciding_ellipse.b_mm,
        "contact_normal": result.placement.first.normal,
        "load_direction": result.placement.load_direction(normal=result.case.load_kind == "normal"),
    }
    for name, value in numbers.items():
        add_array(mesh.GetFieldData(), name, np.array(value, dtype=float).reshape(1, -1))
    for name, text in (("version", __version__), ("annotation", case_annotation(result_record(result)))):
        add_text(mesh, name, _to_ascii(text))


def _body_grid(mesh: BodyMesh, displacement: Floats, rigid_motion_mm: Floats, stress: Floats) -> Any:
    """Body as a VTK grid, mirrored if it is half.

    Parameters
    ----------
    mesh
        Mesh of the body with n nodes, in mm.
    displacement
        Elastic displacements (n, 3) in mm.
    rigid_motion_mm
        Rigid displacement (3,), which is added.
    stress
        Stress (n, 6) in MPa at the nodes.

    Returns
    -------
    vtkUnstructuredGrid
        Undeformed hexahedra with `displacement_mm`, `stress_MPa` and `von_mises_MPa`, stresses in single precision.
    """
    mirror = _Mirror.build(mesh) if mesh.half else None
    points, hexes = mesh.points, mesh.hexes
    if mirror is not None:
        points, displacement = (mirror.extend(values, _MIRRORED_VECTOR) for values in (points, displacement))
        # both halves meet on the plane, where shear stresses that change sign have a mean of zero
        stress = stress.copy()
        stress[mirror.plane] *= 0.5 * (1.0 + _MIRRORED_STRESS)
        stress = mirror.extend(stress, _MIRRORED_STRESS)
        # the mirror turns cells inside out, and the exchange of both layers turns them back
        hexes = np.concatenate([hexes, mirror.image[hexes[:, [4, 5, 6, 7, 0, 1, 2, 3]]]])
    grid = build_hexahedra(points, hexes)
    point_data = grid.GetPointData()
    add_array(point_data, "displacement_mm", displacement + rigid_motion_mm, "XYZ")
    # stresses have errors of a few per cent, so single precision suffices and halves the file
    add_array(point_data, "stress_MPa", stress.astype(np.float32), _STRESSES)
    add_array(point_data, "von_mises_MPa", von_mises(stress).astype(np.float32))
    return grid


def _mirror_values(mesh: BodyMesh, values: Floats) -> Floats:
    """Values at the nodes of a body, followed by the values of its mirror image.

    The values are scalars (n,) or vectors (n, 3); the mirror changes the sign of the x component of vectors. Values of
    a body that is not half are returned unchanged.
    """
    if not mesh.half:
        return values
    columns = values.reshape(len(values), -1)
    signs = _MIRRORED_VECTOR if columns.shape[1] == 3 else np.ones(1)
    return _Mirror.build(mesh).extend(columns, signs).reshape(-1, *values.shape[1:])


@dataclass(frozen=True, kw_only=True, eq=False)
class _Mirror:
    """Mirror images of nodes.

    Attributes
    ----------
    plane
        Numbers of the nodes on the plane of symmetry, which have no images.
    copied
        Numbers of the other nodes, which have images.
    image
        Number (n,) of the image of each node; for nodes on the plane the number of the node.
    """

    plane: Integers
    copied: Integers
    image: Integers

    @classmethod
    def build(cls, mesh: BodyMesh) -> _Mirror:
        """Mirror images for a half model with the plane of symmetry x = 0.

        Parameters
        ----------
        mesh
            Mesh of the half model.

        Returns
        -------
        _Mirror
            Numbers of the nodes and of their images.
        """
        points = mesh.points
        on_plane = np.unique(mesh.surfaces["symmetry"])
        assert float(np.abs(points[on_plane, 0]).max()) < 1e-6, f"{mesh.name}: its plane of symmetry is not x = 0"
        copied = np.setdiff1d(np.arange(len(points)), on_plane)
        image = np.arange(len(points))
        image[copied] = len(points) + np.arange(copied.size)
        return cls(plane=on_plane, copied=copied, image=image)

    def extend(self, values: Floats, signs: Floats) -> Floats:
        """Append the values at the images to the values (n, c) at the nodes."""
        return np.concatenate([values, values[self.copied] * signs])
