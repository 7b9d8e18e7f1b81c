"""Mesh of a body as a dataset of pyvista, for pictures and measurements in Python."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.solving.case_meshes import mesh_case
from fecontact.solving.solve import CaseResult


def mesh(of: Case | CaseResult, body: Literal["rail", "wheel"]) -> Any:
    """The hexahedra of a body as a `pyvista.UnstructuredGrid`, in mm and in the track frame.

    For a case it is the first mesh that `solve` makes; for a result the finest mesh, with `displacement_mm` at the
    nodes (base and driver held: without the rigid approach). Half models stay half. Each surface has a point array of 0
    and 1: `contact`, `fixed` or `driven`, `end`, `free`, and `symmetry` in half models.

    Raises
    ------
    InputError
        If there is no such body; for a case as in `solve`; for a result that was read from a folder, which has its
        meshes in `rail.vtu` and `wheel.vtu`.
    """
    import pyvista

    if body not in ("rail", "wheel"):
        raise InputError(f"body {body!r}; allowed: rail, wheel")
    if isinstance(of, Case):
        made = mesh_case(of, body)
    elif of.bodies is not None:
        coupled = of.bodies.coupled
        made = (coupled.rail if body == "rail" else coupled.wheel).mesh
    else:
        raise InputError(f"a result that was read back has no meshes; pyvista.read(FOLDER / '{body}.vtu') has this one")
    grid = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: made.hexes}, made.points)
    for name, quads in made.surfaces.items():
        grid.point_data[name] = np.isin(np.arange(len(made.points)), quads).astype(np.uint8)
    if isinstance(of, CaseResult) and of.bodies is not None:
        grid.point_data["displacement_mm"] = of.bodies.displacement_mm[body]
    return grid
