"""Mesh of a body as a dataset of pyvista, for pictures and measurements in Python."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.solving.case_meshes import mesh_case
from fecontact.solving.solve import CaseResult


def mesh(source: Case | CaseResult, body: Literal["rail", "wheel"]) -> Any:
    """Hexahedra of a body as a `pyvista.UnstructuredGrid`, in mm and in the track frame.

    Half models stay half. Each surface has a point array of 0 and 1: `contact`, `fixed` or `driven`, `end`, `free`, and
    `symmetry` in half models.

    Parameters
    ----------
    source
        For a case the mesh is the first mesh that `solve` makes. For a result it is the finest mesh, with
        `displacement_mm` at the nodes (base and driver held, so without the rigid approach).
    body
        Name of the body.

    Returns
    -------
    pyvista.UnstructuredGrid
        The mesh.

    Raises
    ------
    InputError
        If there is no such body; for a case as in `solve`; for a result that was read from a folder, since the folder
        has its meshes in `rail.vtu` and `wheel.vtu`.

    Examples
    --------
    >>> import fecontact
    >>> pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    >>> rail = fecontact.mesh(fecontact.Case(**pair, resolution="quick"), "rail")
    >>> bool(rail.point_data["contact"].any())
    True
    """
    import pyvista

    if body not in ("rail", "wheel"):
        raise InputError(f"body {body!r}; allowed: rail, wheel")
    if isinstance(source, Case):
        body_mesh = mesh_case(source, body)
    elif source.bodies is not None:
        coupled = source.bodies.coupled
        body_mesh = (coupled.rail if body == "rail" else coupled.wheel).mesh
    else:
        raise InputError(f"a stored result has no meshes; read this mesh with pyvista.read(FOLDER / '{body}.vtu')")
    grid = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: body_mesh.hexes}, body_mesh.points)
    for name, quads in body_mesh.surfaces.items():
        grid.point_data[name] = np.isin(np.arange(len(body_mesh.points)), quads).astype(np.uint8)
    if isinstance(source, CaseResult) and source.bodies is not None:
        grid.point_data["displacement_mm"] = source.bodies.displacement_mm[body]
    return grid
