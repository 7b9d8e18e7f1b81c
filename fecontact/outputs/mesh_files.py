"""Mesh files for other programs, with named surfaces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.arrays import Floats, Integers
from fecontact.errors import InputError
from fecontact.fe.body_mesh import BodyMesh
from fecontact.files import require_ending, write_atomically
from fecontact.outputs.decks import ELEMENT_TYPES, ElementType, write_body, write_deck
from fecontact.solving.case_meshes import MeshedPair


def write_mesh(mesh: BodyMesh | MeshedPair, path: str | Path, *, element: ElementType = "C3D8") -> Path:
    """Write a body, or both bodies, in mm and in the track frame.

    The ending of the path gives the format. Surfaces are named as in `BodyMesh.surfaces`. If both bodies are written,
    the body's name comes first, such as `rail_contact`.

    ======== ================================================================================================
    `.msh`   gmsh 4.1 as text: a physical group for each volume, named as the body, and one for each surface
    `.inp`   CalculiX and Abaqus: a node set and an element-face surface for each surface, an element set for
             each body; no shell elements, which would need a section. Both bodies make a deck with materials, supports,
             contact and load, see `outputs.decks`
    `.vtu`   hexahedra and the surfaces' quadrilaterals; cell array `surface_id` (0 in the volumes, then 1, 2,
             ... in the order of the point arrays) and one point array of 0 and 1 for each surface
    ======== ================================================================================================

    Parameters
    ----------
    mesh
        Mesh of a body, or of both bodies.
    path
        File to write.
    element
        Type of the elements in `.inp`: C3D8, as in `fecontact.solve`, or C3D8I.

    Returns
    -------
    Path
        The written file.

    Raises
    ------
    InputError
        If the ending or the type of the elements is not allowed.
    """
    path = Path(path)
    require_ending(path, MESH_ENDINGS, "mesh")
    writer = _WRITERS[path.suffix.lower()]
    if element not in ELEMENT_TYPES:
        raise InputError(f"element {element!r}; allowed: {', '.join(ELEMENT_TYPES)}")
    return write_atomically(path, lambda temporary: writer(mesh, temporary, element))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Cells:
    """Nodes (n, 3) in mm, hexahedra of each body and quadrilaterals of each surface."""

    points: Floats
    bodies: dict[str, Integers]
    surfaces: dict[str, Integers]

    @classmethod
    def build(cls, mesh: BodyMesh | MeshedPair) -> _Cells:
        """Cells of a body, or of both bodies with consecutive node numbers.

        Parameters
        ----------
        mesh
            Mesh of a body, or of both bodies.

        Returns
        -------
        _Cells
            Nodes, hexahedra and quadrilaterals. With both bodies the surfaces have the body's name as prefix.
        """
        if isinstance(mesh, BodyMesh):
            return cls(points=mesh.points, bodies={mesh.name: mesh.hexes}, surfaces=mesh.surfaces)
        rail, wheel, rail_node_count = mesh.rail, mesh.wheel, len(mesh.rail.points)
        return cls(
            points=np.vstack([rail.points, wheel.points]),
            bodies={"rail": rail.hexes, "wheel": wheel.hexes + rail_node_count},
            surfaces={
                **{f"rail_{name}": quads for name, quads in rail.surfaces.items()},
                **{f"wheel_{name}": quads + rail_node_count for name, quads in wheel.surfaces.items()},
            },
        )

    @property
    def blocks(self) -> list[tuple[str, Integers]]:
        """Cells in the form of meshio."""
        return [
            *(("hexahedron", hexes) for hexes in self.bodies.values()),
            *(("quad", quads) for quads in self.surfaces.values()),
        ]

    @property
    def block_numbers(self) -> list[int]:
        """Number of each block among the blocks of its kind, from 1."""
        return [*range(1, len(self.bodies) + 1), *range(1, len(self.surfaces) + 1)]


def _write_msh(mesh: BodyMesh | MeshedPair, path: Path, _: ElementType) -> None:
    """Write a mesh file of gmsh in its text format.

    Bodies are physical groups of dimension 3, surfaces are physical groups of dimension 2. Points are undeformed, in
    mm; the type of element is not used.
    """
    import meshio

    cells = _Cells.build(mesh)
    tags = [np.full(len(block), number) for (_, block), number in zip(cells.blocks, cells.block_numbers, strict=True)]
    groups: dict[str, Integers] = {name: np.array([number, 3]) for number, name in enumerate(cells.bodies, start=1)}
    groups |= {name: np.array([number, 2]) for number, name in enumerate(cells.surfaces, start=1)}
    mesh_file = meshio.Mesh(
        cells.points,
        cells.blocks,
        point_data={"gmsh:dim_tags": _entities(cells)},
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data=groups,
    )
    # as text, so that changes of a small reference mesh are visible under version control
    meshio.write(path, mesh_file, file_format="gmsh", binary=False)


def _entities(cells: _Cells) -> Integers:
    """Dimension and tag (n, 2) of the geometric entity of each node.

    The format requires them. A node on an edge belongs to the smaller surface, because a surface without nodes would
    lose its name.
    """
    entities = np.tile([3, 1], (len(cells.points), 1))
    for number, hexes in enumerate(cells.bodies.values(), start=1):
        entities[np.unique(hexes)] = (3, number)
    numbered_surfaces = sorted(
        enumerate(cells.surfaces.values(), start=1), key=lambda numbered_quads: -len(numbered_quads[1])
    )
    for number, quads in numbered_surfaces:
        entities[np.unique(quads)] = (2, number)
    surface_tags = set(entities[entities[:, 0] == 2, 1].tolist())
    assert len(surface_tags) == len(cells.surfaces), "a surface shares all of its nodes with smaller ones"
    return entities


def _write_inp(mesh: BodyMesh | MeshedPair, path: Path, element: ElementType) -> None:
    if isinstance(mesh, BodyMesh):
        write_body(mesh, path, element)
    else:
        write_deck(mesh, path, element)


def _write_vtu(mesh: BodyMesh | MeshedPair, path: Path, _: ElementType) -> None:
    """Write a mesh file of ParaView.

    The file has the undeformed mesh with quadrilaterals of its surfaces. Each surface has a point array of 0 and 1. The
    `surface_id` of a cell is 0 for hexahedra, and the number of the surface for quadrilaterals. The element type is not
    used.
    """
    import meshio

    cells = _Cells.build(mesh)
    flags: dict[str, Any] = {}
    for name, quads in cells.surfaces.items():
        flags[name] = np.zeros(len(cells.points), dtype=np.uint8)
        flags[name][np.unique(quads)] = 1
    ids = [
        0 if kind == "hexahedron" else number
        for (kind, _), number in zip(cells.blocks, cells.block_numbers, strict=True)
    ]
    mesh_file = meshio.Mesh(
        cells.points,
        cells.blocks,
        point_data=flags,
        cell_data={
            "surface_id": [
                np.full(len(block), surface_id) for (_, block), surface_id in zip(cells.blocks, ids, strict=True)
            ]
        },
    )
    meshio.write(path, mesh_file, file_format="vtu")


_WRITERS: dict[str, Callable[[BodyMesh | MeshedPair, Path, ElementType], None]] = {
    ".msh": _write_msh,
    ".inp": _write_inp,
    ".vtu": _write_vtu,
}
MESH_ENDINGS = tuple(_WRITERS)
"""Endings of mesh files."""
