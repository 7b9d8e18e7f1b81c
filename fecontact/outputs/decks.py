"""Input files of CalculiX and Abaqus: a single body, or both with supports, contact and load."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from fecontact import __version__
from fecontact.arrays import Floats, Integers
from fecontact.bodies import Material
from fecontact.fe.body_mesh import BodyMesh
from fecontact.solving.case_meshes import MeshedPair

ElementType = Literal["C3D8", "C3D8I"]
ELEMENT_TYPES = get_args(ElementType)

# Faces S1 to S6 of an eight-node brick by its nodes. Abaqus and CalculiX have equal numbers.
_FACES = np.array([[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]])
# Numbers per line. The formats allow at most 16.
_NUMBERS_PER_LINE = 8


def write_body(mesh: BodyMesh, path: Path, element: ElementType = "C3D8") -> None:
    """Write a body: nodes, elements, and for each surface a node set and a surface of element faces.

    Parameters
    ----------
    mesh
        Mesh of the body, in mm.
    path
        File to write.
    element
        Type of the elements.
    """
    lines = [
        *("*HEADING", f"fecontact {__version__}: {mesh.name}, {_element_text(element)}", *_unit_lines(mesh.half)),
        *_node_lines({mesh.name: mesh.points}),
        *_mesh_lines(mesh, element, first_node=1, first_element=1, prefix=""),
    ]
    _write_lines(path, lines)


def write_deck(pair: MeshedPair, path: Path, element: ElementType = "C3D8") -> None:
    """Write both bodies with separate numbers and names, supports, frictionless contact and the load.

    The supports are as in `fecontact.solve`: the rail is fixed at its base and held across at its ends. The rim of the
    wheel moves as a rigid part, along the load only, with the node `load_point`. A first step moves the rim by the
    approach of half-spaces, so that the second step, with the load, begins in contact.

    Contact is by CalculiX's mortar method. A penalty method between faces that do not match reacts to every micrometre
    between the polygons, with errors of half the pressure. Abaqus's mortar method is `TYPE=SURFACE TO SURFACE`.

    Parameters
    ----------
    pair
        Meshes of both bodies, with their case.
    path
        File to write.
    element
        C3D8 is the element of `fecontact.solve`. C3D8I has incompatible modes, which bend without locking.
    """
    rail, wheel, case = pair.rail, pair.wheel, pair.case
    title = f"{Path(case.rail).name}, {Path(case.wheel).name}, shift {case.lateral_shift_mm:g} mm, {case.load_N:g} N"
    rail_node_count = len(rail.points)
    load_point = rail_node_count + len(wheel.points) + 1
    rim_centre = wheel.points[wheel.surfaces["driven"]].mean(axis=(0, 1))
    held_nodes = np.union1d(rail.surfaces["fixed"], rail.surfaces["end"])
    lines = [
        *("*HEADING", f"fecontact {__version__}: {title}, {_element_text(element)}", *_unit_lines(rail.half)),
        *_node_lines({"rail": rail.points, "wheel": wheel.points, "load_point": rim_centre[None]}),
        *_mesh_lines(rail, element, first_node=1, first_element=1, prefix="rail_"),
        *_mesh_lines(
            wheel, element, first_node=rail_node_count + 1, first_element=len(rail.hexes) + 1, prefix="wheel_"
        ),
        # each node occurs once, because CalculiX counts the reactions of nodes in both sets twice
        *("*NSET, NSET=rail_held", *_number_lines(held_nodes + 1)),
        *_material_lines("rail", pair.case.rail_material),
        *_material_lines("wheel", pair.case.wheel_material),
        *_guide_lines(wheel, pair.direction, rail_node_count, load_point),
        *_CONTACT_LINES,
        *_step_lines(pair, load_point),
    ]
    _write_lines(path, lines)


def _element_text(element: ElementType) -> str:
    """Text on the element type.

    With other types peaks differ by 0.3 to 0.5 % on equal meshes.
    """
    return f"elements {element} {'as' if element == 'C3D8' else 'instead of C3D8'} in fecontact.solve"


def _write_lines(path: Path, lines: Iterable[str]) -> None:
    with path.open("w", encoding="ascii", errors="replace", newline="\n") as file:
        file.writelines(f"{line}\n" for line in lines)


def _unit_lines(half: bool) -> list[str]:
    lines = ["** mm, N, MPa; x along the track, y to the field side, z up"]
    return [*lines, "** half model, x >= 0: its set of nodes 'symmetry' lies on x = 0"] if half else lines


def _mesh_lines(
    mesh: BodyMesh, element: ElementType, *, first_node: int, first_element: int, prefix: str
) -> Iterator[str]:
    """Iterate over the lines of elements, node sets and surfaces of a body.

    The format is the input of Abaqus and CalculiX.

    Parameters
    ----------
    mesh
        Mesh of the body.
    element
        Type of the elements in the deck.
    first_node, first_element
        Numbers of the first node and of the first element of the body.
    prefix
        Start of the names of sets and surfaces, so that they are unique in the deck.
    """
    yield f"*ELEMENT, TYPE={element}, ELSET={mesh.name}"
    for number, nodes in enumerate((mesh.hexes + first_node).tolist(), start=first_element):
        yield f"{number}, {', '.join(map(str, nodes))}"
    for name, quads in mesh.surfaces.items():
        yield f"*NSET, NSET={prefix}{name}"
        yield from _number_lines(np.unique(quads) + first_node)
    for name, quads in mesh.surfaces.items():
        elements, faces = element_faces(mesh.hexes, quads)
        yield f"*SURFACE, NAME={prefix}{name}, TYPE=ELEMENT"
        for number, face in zip((elements + first_element).tolist(), faces.tolist(), strict=True):
            yield f"{number}, S{face + 1}"


def _node_lines(points: Mapping[str, Floats]) -> Iterator[str]:
    """Iterate over the lines of all nodes and of a set for each name.

    The nodes are in one block, numbered from 1, because readers may keep only the last block.
    """
    yield "*NODE"
    for number, point in enumerate(np.vstack(list(points.values())).tolist(), start=1):
        # CalculiX reads only 20 characters of a number
        yield f"{number}, {', '.join(f'{value:.12e}' for value in point)}"
    last = 0
    for name, points_of_body in points.items():
        yield f"*NSET, NSET={name}, GENERATE"
        yield f"{last + 1}, {last + len(points_of_body)}, 1"
        last += len(points_of_body)


def _number_lines(numbers: Integers) -> Iterator[str]:
    for start in range(0, len(numbers), _NUMBERS_PER_LINE):
        yield ", ".join(map(str, numbers[start : start + _NUMBERS_PER_LINE].tolist()))


def element_faces(hexes: Integers, quads: Integers) -> tuple[Integers, Integers]:
    """Elements and faces behind boundary quadrilaterals.

    Parameters
    ----------
    hexes
        Nodes (n, 8) of the elements.
    quads
        Nodes (k, 4) of the boundary quadrilaterals.

    Returns
    -------
    tuple of Integers
        Elements (k,) and numbers of their faces (k,), both from 0.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.outputs.decks import element_faces
    >>> elements, faces = element_faces(np.array([[0, 1, 2, 3, 4, 5, 6, 7]]), np.array([[4, 5, 6, 7]]))
    >>> elements.tolist(), faces.tolist()
    ([0], [1])
    """
    faces = np.sort(hexes[:, _FACES].reshape(-1, 4), axis=1)
    # the three smallest of the four nodes identify a face, and three node numbers fit into an integer
    base = int(hexes.max()) + 1
    face_keys, quad_keys = (
        (nodes[:, 0].astype(np.int64) * base + nodes[:, 1]) * base + nodes[:, 2]
        for nodes in (faces, np.sort(quads, axis=1))
    )
    order = np.argsort(face_keys)
    order_of_quads = order[np.searchsorted(face_keys, quad_keys, sorter=order)]
    assert np.array_equal(faces[order_of_quads], np.sort(quads, axis=1)), (
        "a boundary quadrilateral is no face of an element"
    )
    return order_of_quads // 6, order_of_quads % 6


def _material_lines(body: str, material: Material) -> list[str]:
    """Lines of an elastic material and its section."""
    return [
        f"*MATERIAL, NAME={body}",
        "*ELASTIC",
        f"{material.young_MPa:.9e}, {material.poisson:.9e}",
        f"*SOLID SECTION, ELSET={body}, MATERIAL={body}",
    ]


def _guide_lines(wheel: BodyMesh, direction: Floats, rail_node_count: int, load_point: int) -> Iterator[str]:
    """Iterate over the equations that guide the rim by the load point.

    Each node of the rim moves along the direction of the load with the load point. `rail_node_count` is the number of
    nodes before the wheel's nodes, and `load_point` the number of the node of the load.
    """
    yield "*EQUATION"
    for node in (np.unique(wheel.surfaces["driven"]) + rail_node_count + 1).tolist():
        for axis in _moved_axes(direction):
            yield "2"
            yield f"{node}, {axis + 1}, 1., {load_point}, 3, {-direction[axis]:.12e}"


def _moved_axes(direction: Floats) -> list[int]:
    return [axis for axis in range(3) if abs(float(direction[axis])) > 1e-12]


_CONTACT_LINES = (
    "*SURFACE INTERACTION, NAME=frictionless",
    "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD",
    "** Abaqus: TYPE=SURFACE TO SURFACE",
    "*CONTACT PAIR, INTERACTION=frictionless, TYPE=MORTAR",
    "rail_contact, wheel_contact",
)


def _step_lines(pair: MeshedPair, load_point: int) -> list[str]:
    """Lines of both steps: the approach of half-spaces, then the load."""
    half = pair.rail.half
    held_lines = [
        *("rail_fixed, 1, 3", "rail_end, 2, 3"),
        *(("rail_symmetry, 1, 1", "wheel_symmetry, 1, 1") if half else ()),
        *(f"wheel_driven, {axis + 1}, {axis + 1}" for axis in range(3) if axis not in _moved_axes(pair.direction)),
        f"{load_point}, 1, 2",
    ]
    load_N = pair.case.load_N * (0.5 if half else 1.0)
    static_lines = ["*STATIC", "1., 1."]
    return [
        "** step 1: lower the rim by the approach of half-spaces",
        *("*STEP, INC=100", *static_lines, "*BOUNDARY", *held_lines, f"{load_point}, 3, 3, {-pair.approach_mm:.9e}"),
        "*END STEP",
        f"** step 2: apply the load{', half of it on the half model' if half else ''}",
        *(
            "*STEP, INC=100",
            *static_lines,
            "*BOUNDARY, OP=NEW",
            *held_lines,
            "*CLOAD",
            f"{load_point}, 3, {-load_N:.9e}",
        ),
        *("*NODE FILE", "U", "*EL FILE", "S", "*CONTACT FILE", "CDIS, CSTR"),
        *("*NODE PRINT, NSET=load_point", "U", "*NODE PRINT, NSET=rail_held, TOTALS=ONLY", "RF", "*END STEP"),
    ]
