"""ParaView files: both bodies, the contact, one collection a case and one a study.

The files open in ParaView as they are: a case by its `case.vtm` (blocks `rail`, `wheel`, `contact`, `hertz_ellipse`), a
study by its `.pvd`, whose time is the lateral shift. Half models are written whole, mirrored at their plane.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from fecontact import __version__
from fecontact.errors import InputError
from fecontact.fe.body import ElasticBody
from fecontact.fe.stress import nodal_stress, von_mises
from fecontact.files import write_text
from fecontact.outputs.paraview.contact import contact_surface, ellipse_line
from fecontact.outputs.records.results import load_row
from fecontact.outputs.words.verdicts import case_annotation
from fecontact.solving.solve import CaseResult

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

COLLECTION = "case.vtm"
_BODIES = (("rail", "rail.vtu"), ("wheel", "wheel.vtu"))
_CONTACT = (("contact", "contact.vtp"), ("hertz_ellipse", "hertz_ellipse.vtp"))
_BLOCKS = (*_BODIES, *_CONTACT)
_STRESSES = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")
# Signs of XX YY ZZ XY YZ XZ, and of x y z, under a mirror at x = 0.
_MIRRORED_STRESS = np.array([1.0, 1.0, 1.0, -1.0, 1.0, -1.0])
_MIRRORED_VECTOR = np.array([-1.0, 1.0, 1.0])


def write_case_vtk(result: CaseResult, folder: str | Path) -> Path:
    """Write a file for each block, and `case.vtm`, which names them; returns the last one.

    Arrays on the bodies: `displacement_mm`, `stress_MPa` (XX YY ZZ XY YZ XZ) and `von_mises_MPa` at the nodes. The
    wheel's displacement has the rigid approach in it (elastic displacement minus approach times direction), so that
    warping both bodies by it makes them meet: the rail's base stays, the wheel's driven surface comes down.

    Where a body has yielded also `equivalent_plastic_strain`, `von_mises_plastic_MPa` and `imprint_mm` (displacement
    that stays when the load is gone); the other arrays are those of elastic bodies.

    Arrays on `contact` and `hertz_ellipse`: see `contact_surface` and `ellipse_line`.

    Field data: `TimeValue` (the lateral shift), `lateral_shift_mm`, `load_kN`, `hertz_p0_MPa`, `hertz_a_mm`,
    `hertz_b_mm`, and on `contact` every column of the case's row in a study, texts as well, the program's `version`,
    and an `annotation`: the case and its verdict in three lines.

    Raises
    ------
    InputError
        If the result was read back from a folder, without its meshes.
    """
    folder, bodies = Path(folder), result.bodies
    if bodies is None:
        raise InputError(f"{folder}: a result that was read back has no meshes; they are beside it, or solve it again")
    coupled, displacement = bodies.coupled, bodies.displacement_mm
    meshes = {
        "rail": _body(coupled.rail, displacement["rail"], np.zeros(3)),
        "wheel": _body(coupled.wheel, displacement["wheel"], -_approach_mm(result)),
    }
    for name, body in (("rail", coupled.rail), ("wheel", coupled.wheel)):
        for array, values in bodies.yielded.get(name, {}).items():
            meshes[name].point_data[array] = _of_whole(body, values).astype(np.float32)
    for name, file in _BODIES:
        _add_numbers(meshes[name], result)
        write_text(folder / file, _xml_text(meshes[name], Path(file).suffix))
    return write_contact_vtk(result, folder)


def write_contact_vtk(result: CaseResult, folder: str | Path) -> Path:
    """Write what changes when a case is judged, beside bodies that were written before; returns `case.vtm`."""
    folder = Path(folder)
    meshes = {"contact": contact_surface(result), "hertz_ellipse": ellipse_line(result)}
    for name, file in _CONTACT:
        _add_numbers(meshes[name], result)
        if name == "contact":
            # meshio cannot read a .vtu with texts in its field data, and the bodies are what other programs read
            _add_row(meshes[name], result)
        write_text(folder / file, _xml_text(meshes[name], Path(file).suffix))
    return write_text(folder / COLLECTION, _collection_text())


def _add_row(surface: Any, result: CaseResult) -> None:
    row = {**load_row(result.load, result.placement), "version": __version__, "annotation": case_annotation(result)}
    for name, value in row.items():
        if isinstance(value, str) or value is None:
            surface.field_data[name] = [_ascii(value or "")]
        else:
            surface.field_data[name] = np.array([float(value)])


def _ascii(text: str) -> str:
    # VTK's fonts have no other characters, and names of profiles may have any
    return text.replace("±", "+-").encode("ascii", "replace").decode("ascii")


def _xml_text(mesh: Any, suffix: str) -> str:
    """A mesh as the text of a VTK XML file.

    VTK's own writing to a file ends the whole process, without a message, where the disk is full.
    """
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

    writer = {".vtu": vtkXMLUnstructuredGridWriter, ".vtp": vtkXMLPolyDataWriter}[suffix]()
    writer.SetInputData(mesh)
    writer.SetDataModeToBinary()
    writer.WriteToOutputStringOn()
    writer.Write()
    return str(writer.GetOutputString())


def write_pvd(path: str | Path, entries: Iterable[tuple[float, str | Path]]) -> Path:
    """Write a collection over time: one case a time.

    Parameters
    ----------
    entries
        Time (the lateral shift in mm) and folder of each case, in the order in which they are to be listed.

    Raises
    ------
    InputError
        If two times are equal (ParaView would merge them) or a case has not been written (ParaView would show
        nothing, without a message).
    """
    path = Path(path)
    cases = [(float(time), Path(folder) / COLLECTION) for time, folder in entries]
    times = [time for time, _ in cases]
    if repeated := sorted({time for time in times if times.count(time) > 1}):
        raise InputError(
            f"{path}: the times {', '.join(f'{time:g}' for time in repeated)} occur more than once, and ParaView merges"
            " equal times; write one collection for each load"
        )
    for _, collection in cases:
        for file in (collection, *(collection.with_name(name) for _, name in _BLOCKS)):
            if not file.is_file():
                raise InputError(f"{path}: {file} does not exist; write the case before the collection")
    lines = [
        f'    <DataSet timestep="{time!r}" part="0" file={quoteattr(_relative(file, path.parent))}/>'
        for time, file in cases
    ]
    return write_text(path, _xml("Collection", "0.1", ["  <Collection>", *lines, "  </Collection>"]))


def _relative(file: Path, folder: Path) -> str:
    return Path(os.path.relpath(file, folder)).as_posix()


def _collection_text() -> str:
    blocks = [
        f'    <DataSet index="{index}" name="{name}" file="{file}"/>' for index, (name, file) in enumerate(_BLOCKS)
    ]
    return _xml("vtkMultiBlockDataSet", "1.0", ["  <vtkMultiBlockDataSet>", *blocks, "  </vtkMultiBlockDataSet>"])


def _xml(kind: str, version: str, lines: list[str]) -> str:
    head = f'<VTKFile type="{kind}" version="{version}" byte_order="LittleEndian">'
    return "\n".join(['<?xml version="1.0"?>', head, *lines, "</VTKFile>", ""])


def _approach_mm(result: CaseResult) -> Floats:
    """Rigid approach (3,) of the wheel to the rail, as a vector that points away from the rail."""
    placement = result.placement
    direction = placement.load_direction(normal=result.case.load_kind == "normal")
    # that of the elements' own nodes, as the displacements are; it is the part along the contact normal
    approach = result.load.level.nodal.approach_mm
    return np.asarray(approach / float(direction @ placement.first.normal) * direction)


def _add_numbers(mesh: Any, result: CaseResult) -> None:
    numbers = {
        "TimeValue": result.case.lateral_shift_mm,
        "lateral_shift_mm": result.case.lateral_shift_mm,
        "load_kN": result.case.load_N / 1e3,
        "hertz_p0_MPa": result.hertz.p0_MPa,
        "hertz_a_mm": result.hertz.a_mm,
        "hertz_b_mm": result.hertz.b_mm,
    }
    for name, value in numbers.items():
        mesh.field_data[name] = np.array([value])


def _body(body: ElasticBody, displacement: Floats, rigid: Floats) -> Any:
    """A body as a pyvista grid, mirrored if it is half."""
    import pyvista

    stress = nodal_stress(body, displacement)
    whole = _Mirror.of_body(body) if body.mesh.half else None
    points, hexes = body.mesh.points, body.mesh.hexes
    if whole is not None:
        points, displacement = (whole.extended(values, _MIRRORED_VECTOR) for values in (points, displacement))
        # on the plane itself both halves meet: their mean has none of the shear that changes sign
        stress[whole.plane] *= 0.5 * (1.0 + _MIRRORED_STRESS)
        stress = whole.extended(stress, _MIRRORED_STRESS)
        # the mirror turns cells inside out; exchanging the two layers turns them back
        hexes = np.concatenate([hexes, whole.image[hexes[:, [4, 5, 6, 7, 0, 1, 2, 3]]]])
    grid = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: hexes}, points)
    grid.point_data["displacement_mm"] = displacement + rigid
    # stresses are known to a few per cent: single precision halves the file
    grid.point_data["stress_MPa"] = stress.astype(np.float32)
    grid.point_data["von_mises_MPa"] = von_mises(stress).astype(np.float32)
    for array, names in (("displacement_mm", "XYZ"), ("stress_MPa", _STRESSES)):
        for number, name in enumerate(names):
            grid.GetPointData().GetArray(array).SetComponentName(number, name)
    return grid


def _of_whole(body: ElasticBody, values: Floats) -> Floats:
    """Scalars (n,) or vectors (n, 3) at the nodes of a body, followed by those of its mirror image."""
    if not body.mesh.half:
        return values
    columns = values.reshape(len(values), -1)
    signs = _MIRRORED_VECTOR if columns.shape[1] == 3 else np.ones(1)
    return _Mirror.of_body(body).extended(columns, signs).reshape(-1, *values.shape[1:])


@dataclass(frozen=True, kw_only=True, eq=False)
class _Mirror:
    """How nodes continue behind the plane of symmetry: those on the `plane` stay, the `copied` ones get images.

    `image` (n,) is the node behind the plane that belongs to each node.
    """

    plane: Integers
    copied: Integers
    image: Integers

    @classmethod
    def of_body(cls, body: ElasticBody) -> _Mirror:
        points = body.mesh.points
        on_plane = np.unique(body.mesh.surfaces["symmetry"])
        assert float(np.abs(points[on_plane, 0]).max()) < 1e-6, f"{body.mesh.name}: its plane of symmetry is not x = 0"
        copied = np.setdiff1d(np.arange(len(points)), on_plane)
        image = np.arange(len(points))
        image[copied] = len(points) + np.arange(copied.size)
        return cls(plane=on_plane, copied=copied, image=image)

    def extended(self, values: Floats, signs: Floats) -> Floats:
        """Values (n, c) at the nodes, followed by those at the images."""
        return np.concatenate([values, values[self.copied] * signs])
