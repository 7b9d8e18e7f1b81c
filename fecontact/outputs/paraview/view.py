"""Script `view.py`: ParaView files of a study or case with cameras, colours and cuts."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.errors import InputError
from fecontact.files import read_json, write_text
from fecontact.outputs.pair_names import RowMapping
from fecontact.outputs.paraview.vtk import COLLECTION, list_series, name_bodies
from fecontact.outputs.records.results import read_row

SCRIPT_FILE = "view.py"
_SCRIPT_BODY = "script.py.txt"
# Colour scales end at a multiple of this, so that their labels are round numbers.
_COLOUR_SCALE_STEP_MPA = 100.0
# Steps of labels, and the largest number of steps on a colour scale: in a view of 460 pixels more labels overlap.
_LABEL_STEPS = (1.0, 2.0, 5.0)
_MAX_LABEL_STEPS = 5
# Largest height of the relief, as a fraction of the smallest width of an ellipse. A higher relief hides lines.
_RELIEF_FRACTION = 0.1
# Direction of the camera of the pressure, in parts along the rail, across the rail's surface, and along its normal.
_CAMERA = np.array([0.4, 0.15, 0.9])


def write_view(out: Path) -> Path:
    """Write `view.py` into the folder of a study or case with ParaView files.

    Paths in the script are relative to the script, so that the folder can be moved. The point to look at, and the
    colour scale for all cases, are numbers at the beginning of the script.

    Parameters
    ----------
    out
        Folder of the study or of the single case.

    Returns
    -------
    Path
        The written file.

    Raises
    ------
    InputError
        If the folder has no ParaView files.
    """
    out = Path(out)
    if collections := list_series(out):
        document = read_json(out / "study.json")
        rows = [row for row in document["rows"] if row.get("fe_p_max_MPa") is not None]
        folders = [out / "cases" / str(row["id"]) for row in rows]
    elif (out / COLLECTION).is_file():
        collections, rows, folders = [COLLECTION], [read_row(out / "row.json")], [out]
    else:
        raise InputError(_missing_collection_text(out))
    return write_text(out / SCRIPT_FILE, view_script(collections, rows, folders))


def _missing_collection_text(out: Path) -> str:
    """Message on missing ParaView files, with the folder to give instead."""
    if single := sorted(path.parent for path in out.glob(f"cases/*/{COLLECTION}")):
        # a .pvd holds several shifts of one pair
        return f"{out}: the cases are not a series of shifts; give the folder of a single case, such as {single[0]}"
    return (
        f"{out}: no study.pvd and no {COLLECTION}; give a folder of `fecontact run` or `fecontact solve --out`"
        " (a map stores no meshes)"
    )


def view_script(collections: Sequence[str], rows: Sequence[RowMapping], folders: Sequence[Path]) -> str:
    """Text of `view.py` for collections of cases.

    Parameters
    ----------
    collections
        Names of the collections; the script shows the first.
    rows
        Rows of the cases.
    folders
        Folders of the cases.

    Returns
    -------
    str
        Python script for ParaView.
    """
    records = [read_json(folder / "result.json") for folder in folders]
    contact_points_mm = np.array([point_mm for record in records for point_mm in _read_contact_points_mm(record)])
    low, high = contact_points_mm.min(axis=0), contact_points_mm.max(axis=0)
    extent = _largest_value(rows, *(f"{contact}_extent_{axis}_mm" for axis in "xy" for contact in ("fe", "hertz")))
    # the relief has the judged pressure: of bodies that yield if a case has a yield stress
    judged_rows = [{**row, "fe_p_max_MPa": row.get("plastic_p_max_MPa") or row["fe_p_max_MPa"]} for row in rows]
    pressure, stress = (
        _COLOUR_SCALE_STEP_MPA * math.ceil(_largest_value(judged_rows, *columns) / _COLOUR_SCALE_STEP_MPA)
        for columns in (
            ("fe_p_max_MPa", "hertz_p_max_MPa"),
            ("von_mises_rail_von_mises_MPa", "von_mises_wheel_von_mises_MPa"),
        )
    )
    widths_mm = [min(float(row["hertz_extent_x_mm"]), float(row["hertz_extent_y_mm"])) for row in rows]
    widths_mm += [
        min(lobe["hertz"]["extent_x_mm"], lobe["hertz"]["extent_y_mm"])
        for record in records
        for lobe in record["lobes"]
        if lobe["hertz"] is not None
    ]
    return f'''"""Show the contact in ParaView: pressure on the rail, and von Mises stress in the lateral cut.

Start ParaView in the folder of this file: `paraview --script=view.py`. The time slider sets the lateral shift.
Paths are relative to this file, so that you can move the whole folder.
"""

# collections in the folder of this script; the script shows the first
FILES = {json.dumps(list(collections))}
# the bodies of each collection
BODIES = {json.dumps([name_bodies(name) for name in collections])}
# centre of all contact points, in the track frame
CENTRE_MM = {json.dumps([round(float(middle), 3) for middle in 0.5 * (low + high)])}
# size of the view: the largest patch plus the range of the contact points
SIZE_MM = {json.dumps(round(extent + float(np.max(high - low)), 1))}
# direction from the contact to the camera of the pressure, about the middle of the normals of all patches
CAMERA = {json.dumps(_find_camera_direction(records))}
# height of the relief per pressure, equal for all cases; it is too low to hide an ellipse
RELIEF_MM_PER_MPA = {json.dumps(_round_down(_RELIEF_FRACTION * min(widths_mm) / pressure))}
# upper ends of the colour scales, equal for all cases, and their labels
PRESSURE_MPA = {json.dumps(pressure)}
PRESSURE_LABELS = {json.dumps(_choose_labels(pressure))}
VON_MISES_MPA = {json.dumps(stress)}
VON_MISES_LABELS = {json.dumps(_choose_labels(stress))}
''' + (files("fecontact.outputs.paraview") / _SCRIPT_BODY).read_text("utf-8")


def _read_contact_points_mm(record: Mapping[str, Any]) -> list[tuple[float, float, float]]:
    """Contact points of a case: the first, and points of lobes and second patches."""
    numbers = {0, *(lobe["contact_point_number"] for lobe in record["lobes"])} - {None}
    contact_points = [record["contact_points"][number] for number in sorted(numbers)]
    return [(point["x_mm"], point["y_mm"], point["z_mm"]) for point in contact_points]


def _find_camera_direction(records: Sequence[Mapping[str, Any]]) -> list[float]:
    """Unit vector (3,) from the contact to the camera.

    It is inclined to the middle of the normals of all patches. A camera that looks down vertically does not see the
    patch on a gauge corner.
    """
    places = [place for record in records for place in (record["contact_points"][0], *record["lobes"])]
    angles_rad = [float(place["contact_angle_rad"]) for place in places]
    middle_rad = 0.5 * (min(angles_rad) + max(angles_rad))
    cosine, sine = math.cos(middle_rad), math.sin(middle_rad)
    axes = np.array([[1.0, 0.0, 0.0], [0.0, cosine, sine], [0.0, -sine, cosine]])
    direction = _CAMERA @ axes / np.linalg.norm(_CAMERA)
    return [round(float(component), 4) for component in direction]


def _round_down(value: float) -> float:
    """Round a positive value down to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(f"{max(step for step in _LABEL_STEPS if step * power <= value * (1.0 + 1e-9)) * power:.1g}")


def _choose_labels(end_MPa: float) -> list[float]:
    """Labels of a colour scale from zero: round numbers, and its end without a label close below it."""
    step = next(
        step * power
        for power in (10.0**exponent for exponent in range(9))
        for step in _LABEL_STEPS
        if end_MPa <= _MAX_LABEL_STEPS * step * power
    )
    labels = [step * number for number in range(math.ceil(end_MPa / step)) if step * number < end_MPa - 0.5 * step]
    return [*labels, end_MPa]


def _largest_value(rows: Sequence[RowMapping], *columns: str) -> float:
    values = [float(row[column]) for row in rows for column in columns if row.get(column) is not None]
    return max(values, default=1.0)
