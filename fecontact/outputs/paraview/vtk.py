"""ParaView files: both bodies, the contact, a collection for each case and study, and `view.py` that opens them.

A case is opened in ParaView by its `case.vtm` (blocks `rail`, `wheel`, `pressure`, `elements`, `hertz_ellipse`), a
study by its `.pvd`, whose time is the lateral shift. Half models are written whole, mirrored at their plane of
symmetry.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from fecontact import __version__
from fecontact.arrays import Floats, Integers
from fecontact.contact.grid import ContactGrid, Field, Rung
from fecontact.contact_theories.approximation import mean_pressure
from fecontact.contact_theories.hertz import HertzContact
from fecontact.errors import InputError
from fecontact.fe.body_mesh import BodyMesh
from fecontact.fe.stress import von_mises
from fecontact.files import read_json, write_text
from fecontact.outputs.figures.case import ellipse_outline
from fecontact.outputs.pair_names import Row
from fecontact.outputs.records.results import read_row
from fecontact.outputs.verdict_words import case_annotation
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.solve import CaseResult

# --- The contact for ParaView: pressures on the rail's surface, and Hertz's ellipses as lines on them.

LIFT_MM = 1e-3
"""Height of the contact above the rail, along the normals: in one surface both would flicker."""
RELIEF_MM_PER_MPA = 1e-3
"""Height of the pressure relief: equal for all cases, to compare them, and flat, so that it hides no line."""
LINE_LIFT_MM = 0.05
"""Height of the ellipses above the relief: ParaView draws it of flat triangles."""


def contact_surface(result: CaseResult, contact: Rung, yielded: Rung | None = None) -> Any:
    """A contact on the rail's surface as a pyvista mesh of quadrilaterals with normals out of the rail.

    It lies `LIFT_MM` above the rail and holds the contact and Hertz's ellipse, as far as the rail's surface reaches.
    Arrays: `contact_pressure_MPa`, `hertz_pressure_MPa`, `gap_mm` (deformed; NaN beyond the nodes of the solution,
    where only Hertz has a pressure), `in_contact` (0 or 1), and with `yielded` the `plastic_pressure_MPa` of bodies
    that yield. `hertz_minus_fe_MPa`, as the verdict's deviations, and `pressure_relief_mm`, a vector along the normal
    to warp by, are of the pressure of bodies that yield, else of elastic ones. Pressures are means over the cells of
    the nodes: they integrate to the force along the contact normal.
    """
    import pyvista

    fields, grid = _fields(result, contact, yielded)
    points, normals = result.placement.surface(grid.x_mm[:, None], grid.s_mm[None, :])
    # a rail's surface ends with its profile, also if Hertz's ellipse reaches further
    there = np.isfinite(points[0, :, 1])
    points, normals = points[:, there], normals[:, there]
    index = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    surface = pyvista.PolyData.from_regular_faces((points + LIFT_MM * normals).reshape(-1, 3), quads)
    for name, values in fields.items():
        surface.point_data[name] = values[:, there].ravel()
    heights = RELIEF_MM_PER_MPA * _shown_pressure(fields)[:, there]
    surface.point_data["pressure_relief_mm"] = (heights[..., None] * normals).reshape(-1, 3)
    return surface


_ROUNDING = 1e-6


def _fields(result: CaseResult, contact: Rung, yielded: Rung | None) -> tuple[dict[str, NDArray[Any]], ContactGrid]:
    """Fields (nx, ns) on the whole contact, far enough for Hertz's ellipse and for both contacts."""
    extents = result.hertz.extent_x_mm, result.hertz.extent_y_mm
    grid = contact.pressure.covering(*extents).grid
    if yielded is not None:
        # bodies that yield may touch where elastic ones do not
        reach = (2.0 * float(np.abs(line).max()) for line in (grid.x_mm, grid.s_mm))
        grid = yielded.pressure.covering(*reach).grid

    def on_grid(rung: Rung, values: Floats) -> Floats:
        return Field(grid=rung.grid, values=values).covering(*extents).at(grid).values

    pressure, hertz = on_grid(contact, contact.pressure_MPa), mean_pressure(grid, result.hertz)
    inside = on_grid(contact, np.ones(contact.grid.shape)) > 1.0 - _ROUNDING
    fields: dict[str, NDArray[Any]] = {
        "contact_pressure_MPa": pressure,
        "hertz_pressure_MPa": hertz,
        "gap_mm": np.where(inside, on_grid(contact, contact.gap_mm), np.nan),
        # not Boolean: ParaView's readers take Boolean arrays for field data
        "in_contact": (pressure > 0.0).astype(np.uint8),
    }
    if yielded is not None:
        fields["plastic_pressure_MPa"] = on_grid(yielded, yielded.pressure_MPa)
    return fields | {"hertz_minus_fe_MPa": hertz - _shown_pressure(fields)}, grid


def _shown_pressure(fields: Mapping[str, NDArray[Any]]) -> Floats:
    return np.asarray(fields.get("plastic_pressure_MPa", fields["contact_pressure_MPa"]))


def ellipse_lines(result: CaseResult) -> Any:
    """Edges of Hertz's ellipses as lines of pyvista, `LINE_LIFT_MM` above the relief of the judged pressure.

    Cell array `lobe`: 0 is the ellipse at the first touch point under the whole load; 1, 2, ... are ellipses of lobes
    and separate patches under their own forces.
    """
    import pyvista

    level, lobes = result.load.level, result.load.lobes
    fields, grid = _fields(result, level.fe, None if level.yielded is None else level.yielded.fe)
    relief = RegularGridInterpolator(
        (grid.x_mm, grid.s_mm), RELIEF_MM_PER_MPA * _shown_pressure(fields), bounds_error=False, fill_value=0.0
    )
    lines = [_line(result.placement, relief, result.hertz, 0.0, 0.0)]
    for lobe in lobes if len(lobes) > 1 else ():
        if lobe.hertz is not None and lobe.touch is not None:
            x_mm = lobe.touch.x_mm - result.placement.first.x_mm
            lines.append(_line(result.placement, relief, lobe.hertz, x_mm, result.placement.arc_mm(lobe.touch)))
    for number, line in enumerate(lines):
        line.cell_data["lobe"] = np.full(line.n_cells, number, dtype=np.uint8)
    return pyvista.merge(lines, merge_points=False)


def _line(placement: Placement, relief: RegularGridInterpolator, hertz: HertzContact, x_mm: float, s_mm: float) -> Any:
    """The edge of an ellipse about a point, as far as the rail's surface reaches."""
    import pyvista

    s, x = (places + middle for places, middle in zip(ellipse_outline(hertz), (s_mm, x_mm), strict=True))
    points, normals = placement.surface(x, s)
    there = np.isfinite(points[:, 1])
    index = np.cumsum(there) - 1
    pairs = [(index[k], index[k + 1]) for k in range(len(s) - 1) if there[k] and there[k + 1]]
    heights = LIFT_MM + LINE_LIFT_MM + relief(np.stack([x, s], axis=-1))
    cells = np.array([(2, *pair) for pair in pairs], dtype=np.int64).ravel()
    return pyvista.PolyData((points + heights[:, None] * normals)[there], lines=cells)


# --- ParaView files: both bodies, the contact, a collection for each case and study.

COLLECTION = "case.vtm"
_BODIES = (("rail", "rail.vtu"), ("wheel", "wheel.vtu"))
_CONTACT = (("pressure", "pressure.vtp"), ("elements", "elements.vtp"), ("hertz_ellipse", "hertz_ellipse.vtp"))
_BLOCKS = (*_BODIES, *_CONTACT)
_STRESSES = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")
# Signs of XX YY ZZ XY YZ XZ, and of x y z, when mirrored at x = 0.
_MIRRORED_STRESS = np.array([1.0, 1.0, 1.0, -1.0, 1.0, -1.0])
_MIRRORED_VECTOR = np.array([-1.0, 1.0, 1.0])


def write_case_vtk(result: CaseResult, folder: str | Path) -> Path:
    """Write a file for each block, and `case.vtm`, which names the files; returns `case.vtm`.

    Arrays on the bodies: `displacement_mm`, `stress_MPa` (XX YY ZZ XY YZ XZ) and `von_mises_MPa` at the nodes. The
    wheel's displacement contains the rigid approach (elastic displacement minus approach times direction), so that the
    warped bodies meet: the rail's base stays, the wheel's driven surface comes down.

    A body that has yielded also has `equivalent_plastic_strain`, `von_mises_plastic_MPa` and `imprint_mm` (displacement
    that remains without load); the other arrays are for elastic bodies.

    Arrays on `pressure` (the judged contact on its finer nodes) and `elements` (the contact on the elements' own nodes,
    which displacements and stresses belong to): see `contact_surface`. Lines: see `ellipse_lines`.

    Field data, on `pressure` alone: `TimeValue` and `lateral_shift_mm`, `load_kN`, `normal_force_N`, `hertz_p0_MPa`,
    `hertz_a_mm`, `hertz_b_mm`, the program's `version`, and an `annotation`: the case and its verdict in lines. Every
    other number of the case is in its `row.json`.

    Raises
    ------
    InputError
        If the result was read back from a folder, without its meshes.
    """
    folder, bodies = Path(folder), result.bodies
    if bodies is None:
        raise InputError(f"{folder}: a result that was read back has no meshes; they are beside it, or solve it again")
    for (name, file), body, rigid in zip(
        _BODIES, (bodies.coupled.rail, bodies.coupled.wheel), (np.zeros(3), -_approach_mm(result)), strict=True
    ):
        written = _body(body.mesh, bodies.displacement_mm[name], rigid, bodies.stress_MPa[name])
        for array, values in bodies.yielded.get(name, {}).items():
            written.point_data[array] = _of_whole(body.mesh, values).astype(np.float32)
        write_text(folder / file, _xml_text(written, Path(file).suffix))
    return write_contact_vtk(result, folder)


def write_contact_vtk(result: CaseResult, folder: str | Path) -> Path:
    """Write the files that change when a case is judged, beside the bodies' files; returns `case.vtm`."""
    folder = Path(folder)
    level = result.load.level
    fine, own = (None, None) if level.yielded is None else (level.yielded.fe, level.yielded.nodal.even())
    meshes = {
        "pressure": contact_surface(result, level.fe, fine),
        "elements": contact_surface(result, level.on_elements, own),
        "hertz_ellipse": ellipse_lines(result),
    }
    _add_field_data(meshes["pressure"], result)
    for name, file in _CONTACT:
        write_text(folder / file, _xml_text(meshes[name], Path(file).suffix))
    return write_text(folder / COLLECTION, _collection_text())


def _ascii(text: str) -> str:
    # VTK's fonts have ASCII only, and names of profiles may have any character
    return text.replace("±", "+-").encode("ascii", "replace").decode("ascii")


def _xml_text(mesh: Any, suffix: str) -> str:
    """A mesh as the text of a VTK XML file.

    VTK's writing to a file ends the whole process without a message if the disk is full.
    """
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

    writer = {".vtu": vtkXMLUnstructuredGridWriter, ".vtp": vtkXMLPolyDataWriter}[suffix]()
    writer.SetInputData(mesh)
    writer.SetDataModeToBinary()
    # files that are 2 % smaller would take twice as long
    writer.SetCompressionLevel(1)
    writer.WriteToOutputStringOn()
    writer.Write()
    return str(writer.GetOutputString())


def write_pvd(path: str | Path, entries: Iterable[tuple[float, str | Path]]) -> Path:
    """Write a collection over time, with a case at each time.

    Parameters
    ----------
    entries
        Time (the lateral shift in mm) and folder of each case, in the order of the list.

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
    paths = [(time, Path(os.path.relpath(file, path.parent)).as_posix()) for time, file in cases]
    lines = [f'    <DataSet timestep="{time!r}" part="0" file={quoteattr(file)}/>' for time, file in paths]
    return write_text(path, _xml("Collection", "0.1", ["  <Collection>", *lines, "  </Collection>"]))


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
    # the approach on the elements' nodes, to which the displacements belong; it is the part along the contact normal
    approach = result.load.level.nodal.approach_mm
    return np.asarray(approach / float(direction @ placement.first.normal) * direction)


def _add_field_data(mesh: Any, result: CaseResult) -> None:
    numbers = {
        "TimeValue": result.case.lateral_shift_mm,
        "lateral_shift_mm": result.case.lateral_shift_mm,
        "load_kN": result.case.load_N / 1e3,
        "normal_force_N": result.normal_force_N,
        "hertz_p0_MPa": result.hertz.p0_MPa,
        "hertz_a_mm": result.hertz.a_mm,
        "hertz_b_mm": result.hertz.b_mm,
    }
    for name, value in numbers.items():
        mesh.field_data[name] = np.array([value])
    for name, text in (("version", __version__), ("annotation", case_annotation(result))):
        mesh.field_data[name] = [_ascii(text)]


def _body(mesh: BodyMesh, displacement: Floats, rigid: Floats, stress: Floats) -> Any:
    """A body as a pyvista grid, mirrored if it is half."""
    import pyvista

    whole = _Mirror.of_mesh(mesh) if mesh.half else None
    points, hexes = mesh.points, mesh.hexes
    if whole is not None:
        points, displacement = (whole.extended(values, _MIRRORED_VECTOR) for values in (points, displacement))
        # both halves meet on the plane: shear that changes its sign is zero in their mean
        stress = stress.copy()
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


def _of_whole(mesh: BodyMesh, values: Floats) -> Floats:
    """Scalars (n,) or vectors (n, 3) at the nodes of a body, followed by the values of its mirror image."""
    if not mesh.half:
        return values
    columns = values.reshape(len(values), -1)
    signs = _MIRRORED_VECTOR if columns.shape[1] == 3 else np.ones(1)
    return _Mirror.of_mesh(mesh).extended(columns, signs).reshape(-1, *values.shape[1:])


@dataclass(frozen=True, kw_only=True, eq=False)
class _Mirror:
    """Mirror images of nodes: nodes on the `plane` of symmetry stay, and the `copied` nodes get images.

    `image` (n,) is the number of each node's image.
    """

    plane: Integers
    copied: Integers
    image: Integers

    @classmethod
    def of_mesh(cls, mesh: BodyMesh) -> _Mirror:
        points = mesh.points
        on_plane = np.unique(mesh.surfaces["symmetry"])
        assert float(np.abs(points[on_plane, 0]).max()) < 1e-6, f"{mesh.name}: its plane of symmetry is not x = 0"
        copied = np.setdiff1d(np.arange(len(points)), on_plane)
        image = np.arange(len(points))
        image[copied] = len(points) + np.arange(copied.size)
        return cls(plane=on_plane, copied=copied, image=image)

    def extended(self, values: Floats, signs: Floats) -> Floats:
        """Values (n, c) at the nodes, followed by those at the images."""
        return np.concatenate([values, values[self.copied] * signs])


# --- `view.py`: opens the ParaView files of a study or a case with cameras, colours and cuts for the contact.

VIEW = "view.py"
_BODY = "script.py.txt"
# Colour scales end at a multiple of this, so that their labels are round.
_ROUND_MPA = 100.0


def write_view(out: Path) -> Path:
    """Write `view.py` into the folder of a study, or of a single case, with ParaView files.

    Paths in the script are relative to the script, so that the folder can be moved. The point to look at, and the
    colour scale for all cases, are numbers at the beginning of the script.

    Raises
    ------
    InputError
        If the folder has no ParaView files.
    """
    out = Path(out)
    collections = sorted(path.name for path in out.glob("study*.pvd"))
    if collections:
        document = read_json(out / "study.json")
        rows = [row for row in document["rows"] if row.get("fe_p_max_MPa") is not None]
        folders = [out / "cases" / str(row["id"]) for row in rows]
    elif (out / COLLECTION).is_file():
        collections, rows, folders = [COLLECTION], [read_row(out / "row.json")], [out]
    else:
        raise InputError(_without_collection(out))
    return write_text(out / VIEW, view_script(collections, rows, folders))


def _without_collection(out: Path) -> str:
    """Message why there is nothing to see, and which folder to give."""
    if single := sorted(path.parent for path in out.glob(f"cases/*/{COLLECTION}")):
        # a .pvd holds several shifts of one pair
        return f"{out}: its cases are no series of shifts; give the folder of one of them, such as {single[0]}"
    return (
        f"{out}: it has no study.pvd and no {COLLECTION}; give the folder that `fecontact run` or"
        " `fecontact solve --out` wrote (a map keeps no meshes)"
    )


def view_script(collections: Sequence[str], rows: Sequence[Row], folders: Sequence[Path]) -> str:
    """The script for collections of the cases in the rows and folders."""
    touches = np.array([_touch_mm(folder) for folder in folders])
    low, high = touches.min(axis=0), touches.max(axis=0)
    extent = _largest(rows, *(f"{of}_extent_{axis}_mm" for axis in "xy" for of in ("fe", "hertz")))
    yields = all(row.get("plastic_p_max_MPa") is not None for row in rows)
    pressure, stress = (
        _ROUND_MPA * math.ceil(_largest(rows, *columns) / _ROUND_MPA)
        for columns in (
            (f"{'plastic' if yields else 'fe'}_p_max_MPa", "hertz_p_max_MPa"),
            ("von_mises_rail_von_mises_MPa", "von_mises_wheel_von_mises_MPa"),
        )
    )
    return f'''"""Shows the contact in ParaView: pressure on the rail, and von Mises stress in the cut across.

Start ParaView in the folder of this file: `paraview --script=view.py`. The slider of the time is the lateral
shift. Paths are relative to this file: the whole folder can be moved.
"""

# collections beside this script; the first one is shown: put another one there
FILES = {json.dumps(list(collections))}
# middle of all touch points, in the track frame
CENTRE_MM = {json.dumps([round(float(middle), 3) for middle in 0.5 * (low + high)])}
# what the cameras show: the largest patch, and how far the touch point moves
SIZE_MM = {json.dumps(round(extent + float(np.max(high - low)), 1))}
# what the relief shows, of bodies that yield where all cases have them
PRESSURE = {json.dumps(f"{'plastic' if yields else 'contact'}_pressure_MPa")}
# ends of the colour scales, the same for all cases
PRESSURE_MPA = {json.dumps(pressure)}
VON_MISES_MPA = {json.dumps(stress)}
''' + (files("fecontact.outputs.paraview") / _BODY).read_text("utf-8")


def _touch_mm(folder: Path) -> tuple[float, float, float]:
    first = read_json(folder / "result.json")["touch_points"][0]
    return first["x_mm"], first["y_mm"], first["z_mm"]


def _largest(rows: Sequence[Row], *columns: str) -> float:
    values = [float(row[column]) for row in rows for column in columns if row.get(column) is not None]
    return max(values, default=1.0)
