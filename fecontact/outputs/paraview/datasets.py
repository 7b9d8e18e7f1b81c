"""Datasets of VTK from arrays, and their XML texts.

The modules of VTK are imported in each function: they are not needed without files for ParaView. Importing pyvista
instead takes 0.4 CPU s more per process.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats, Integers


def build_surface(points: Floats, quads: Integers) -> Any:
    """Build a surface of quadrilaterals.

    Parameters
    ----------
    points : ndarray of shape (n, 3)
        Nodes in mm.
    quads : ndarray of shape (m, 4)
        Numbers of the nodes of each quadrilateral.

    Returns
    -------
    vtkPolyData
        The surface, without arrays.
    """
    surface = _build_poly_data(points)
    surface.SetPolys(_build_cells(quads))
    return surface


def build_lines(points: Floats, segments: Integers) -> Any:
    """Build straight segments.

    Parameters
    ----------
    points : ndarray of shape (n, 3)
        Nodes in mm.
    segments : ndarray of shape (m, 2)
        Numbers of the nodes of each segment.

    Returns
    -------
    vtkPolyData
        The segments, without arrays.
    """
    lines = _build_poly_data(points)
    lines.SetLines(_build_cells(segments))
    return lines


def build_hexahedra(points: Floats, hexes: Integers) -> Any:
    """Build a body of hexahedra.

    Parameters
    ----------
    points : ndarray of shape (n, 3)
        Nodes in mm.
    hexes : ndarray of shape (m, 8)
        Numbers of the nodes of each hexahedron.

    Returns
    -------
    vtkUnstructuredGrid
        The body, without arrays.
    """
    from vtkmodules.vtkCommonDataModel import VTK_HEXAHEDRON, vtkUnstructuredGrid

    grid = vtkUnstructuredGrid()
    grid.SetPoints(_build_points(points))
    grid.SetCells(VTK_HEXAHEDRON, _build_cells(hexes))
    return grid


def add_array(attributes: Any, name: str, values: NDArray[Any], components: Sequence[str] = ()) -> None:
    """Add an array to the points, cells or field data of a dataset.

    Parameters
    ----------
    attributes
        Attributes of a dataset, such as `dataset.GetPointData()`.
    name
        Name of the array, with its unit.
    values : ndarray of shape (n,) or (n, c)
        Values; Boolean arrays are not allowed, since ParaView takes them for field data.
    components
        Names of the c components.
    """
    array = _to_vtk(values)
    array.SetName(name)
    for number, component in enumerate(components):
        array.SetComponentName(number, component)
    attributes.AddArray(array)


def add_text(dataset: Any, name: str, text: str) -> None:
    """Add a text to the field data of a dataset.

    Parameters
    ----------
    dataset
        Dataset of VTK.
    name
        Name of the text.
    text
        Text in ASCII.
    """
    from vtkmodules.vtkCommonCore import vtkStringArray

    array = vtkStringArray()
    array.SetName(name)
    array.InsertNextValue(text)
    dataset.GetFieldData().AddArray(array)


def format_xml(dataset: Any) -> str:
    """XML text of a dataset.

    If VTK writes to a file and the disk is full, it ends the process without a message.

    Parameters
    ----------
    dataset
        Surface, lines or body.

    Returns
    -------
    str
        Content of a .vtp or .vtu file.
    """
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

    writer = (vtkXMLPolyDataWriter if dataset.IsA("vtkPolyData") else vtkXMLUnstructuredGridWriter)()
    writer.SetInputData(dataset)
    writer.SetDataModeToBinary()
    # another level gives files that are 2 % smaller and takes twice as long
    writer.SetCompressionLevel(1)
    writer.WriteToOutputStringOn()
    writer.Write()
    return str(writer.GetOutputString())


def _build_poly_data(points: Floats) -> Any:
    from vtkmodules.vtkCommonDataModel import vtkPolyData

    poly_data = vtkPolyData()
    poly_data.SetPoints(_build_points(points))
    return poly_data


def _build_points(points: Floats) -> Any:
    from vtkmodules.vtkCommonCore import vtkPoints

    vtk_points = vtkPoints()
    vtk_points.SetData(_to_vtk(points))
    return vtk_points


def _build_cells(cells: Integers) -> Any:
    """Cells with equal numbers of nodes, as integers of 32 bits."""
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    vtk_cells = vtkCellArray()
    vtk_cells.SetData(cells.shape[1], _to_vtk(cells.astype(np.int32).ravel()))
    return vtk_cells


def _to_vtk(values: NDArray[Any]) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtk

    return numpy_to_vtk(np.ascontiguousarray(values))  # type: ignore[no-untyped-call]
