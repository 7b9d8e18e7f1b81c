"""Meshes for other programs, with the named surfaces kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError
from fecontact.fe.meshing import BodyMesh
from fecontact.files import write_atomically

Integers = NDArray[np.int64]

# Faces S1 to S6 of a C3D8 by its nodes (Abaqus and CalculiX number them alike).
_FACES = np.array([[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]])


def write_mesh(mesh: BodyMesh, path: str | Path) -> Path:
    """Write a mesh in the format of the path's ending, in mm and in the track frame.

    ======== ================================================================================================
    `.msh`   gmsh 4.1 as text: one physical group for the volume, named as the body, and one for each surface
    `.inp`   CalculiX and Abaqus: C3D8, a node set and an element-face surface for each surface, an element set
             for the body; no shell elements, which would ask for a section
    `.vtu`   hexahedra and the surfaces' quadrilaterals; cell array `surface_id` (0 in the volume, then 1, 2, ...
             in the order of the point arrays) and one point array of 0 and 1 for each surface
    ======== ================================================================================================

    Raises
    ------
    InputError
        If the ending is none of these.
    """
    path = Path(path)
    writer = _WRITERS.get(path.suffix.lower())
    if writer is None:
        raise InputError(
            f"mesh file {path}: the ending {path.suffix or '(none)'} is not known; allowed are .msh (gmsh), .inp"
            " (CalculiX, Abaqus) and .vtu (ParaView)"
        )
    return write_atomically(path, lambda temporary: writer(mesh, temporary))


def _write_msh(mesh: BodyMesh, path: Path) -> None:
    import meshio

    cells = _cells(mesh)
    tags = [np.full(len(block), max(number, 1)) for number, (_, block) in enumerate(cells)]
    groups: dict[str, Integers] = {mesh.name: np.array([1, 3])}
    groups |= {name: np.array([number, 2]) for number, name in enumerate(mesh.surfaces, start=1)}
    made = meshio.Mesh(
        mesh.points,
        cells,
        point_data={"gmsh:dim_tags": _entities(mesh)},
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data=groups,
    )
    # text: a small reference mesh under version control then shows what changed
    meshio.write(path, made, file_format="gmsh", binary=False)


def _cells(mesh: BodyMesh) -> list[tuple[str, Integers]]:
    return [("hexahedron", mesh.hexes), *(("quad", quads) for quads in mesh.surfaces.values())]


def _entities(mesh: BodyMesh) -> Integers:
    """Dimension and tag (n, 2) of the geometric entity on which each node lies, as the format asks for.

    A node on an edge goes to the smaller surface: a surface without any node would lose its name.
    """
    entities = np.tile([3, 1], (len(mesh.points), 1))
    numbered = sorted(enumerate(mesh.surfaces.values(), start=1), key=lambda item: -len(item[1]))
    for number, quads in numbered:
        entities[np.unique(quads)] = (2, number)
    kept = set(entities[entities[:, 0] == 2, 1].tolist())
    assert len(kept) == len(mesh.surfaces), f"{mesh.name}: a surface shares all of its nodes with smaller ones"
    return entities


def _write_inp(mesh: BodyMesh, path: Path) -> None:
    import meshio

    made = meshio.Mesh(
        mesh.points,
        [("hexahedron", mesh.hexes)],
        point_sets={name: np.unique(quads) for name, quads in mesh.surfaces.items()},
        cell_sets={mesh.name: [np.arange(len(mesh.hexes))]},
    )
    meshio.write(path, made, file_format="abaqus")
    with path.open("a", encoding="ascii", newline="\n") as file:
        for name, quads in mesh.surfaces.items():
            elements, faces = _element_faces(mesh.hexes, quads)
            file.write(f"*SURFACE, NAME={name}, TYPE=ELEMENT\n")
            file.writelines(
                f"{element + 1}, S{face + 1}\n" for element, face in zip(elements.tolist(), faces.tolist(), strict=True)
            )


def _element_faces(hexes: Integers, quads: Integers) -> tuple[Integers, Integers]:
    """Element and number of its face (k,) behind each boundary quadrilateral (k, 4)."""
    faces = np.sort(hexes[:, _FACES].reshape(-1, 4), axis=1)
    # the three smallest of four nodes tell the faces of a mesh apart, and three fit into one integer each
    base = int(hexes.max()) + 1
    keys, wanted = (
        (nodes[:, 0].astype(np.int64) * base + nodes[:, 1]) * base + nodes[:, 2]
        for nodes in (faces, np.sort(quads, axis=1))
    )
    order = np.argsort(keys)
    found = order[np.searchsorted(keys, wanted, sorter=order)]
    assert np.array_equal(faces[found], np.sort(quads, axis=1)), "a boundary quadrilateral is no face of an element"
    return found // 6, found % 6


def _write_vtu(mesh: BodyMesh, path: Path) -> None:
    import meshio

    cells = _cells(mesh)
    flags: dict[str, Any] = {}
    for name, quads in mesh.surfaces.items():
        flags[name] = np.zeros(len(mesh.points), dtype=np.uint8)
        flags[name][np.unique(quads)] = 1
    made = meshio.Mesh(
        mesh.points,
        cells,
        point_data=flags,
        cell_data={"surface_id": [np.full(len(block), number) for number, (_, block) in enumerate(cells)]},
    )
    meshio.write(path, made, file_format="vtu")


_WRITERS: dict[str, Callable[[BodyMesh, Path], None]] = {".msh": _write_msh, ".inp": _write_inp, ".vtu": _write_vtu}
