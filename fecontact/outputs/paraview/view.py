"""Script `view.py`: ParaView files of a study or case with cameras, colours and cuts."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

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
    contact_points_mm = np.array([_read_contact_point_mm(folder) for folder in folders])
    low, high = contact_points_mm.min(axis=0), contact_points_mm.max(axis=0)
    extent = _largest_value(rows, *(f"{contact}_extent_{axis}_mm" for axis in "xy" for contact in ("fe", "hertz")))
    all_yield = all(row.get("plastic_p_max_MPa") is not None for row in rows)
    pressure, stress = (
        _COLOUR_SCALE_STEP_MPA * math.ceil(_largest_value(rows, *columns) / _COLOUR_SCALE_STEP_MPA)
        for columns in (
            (f"{'plastic' if all_yield else 'fe'}_p_max_MPa", "hertz_p_max_MPa"),
            ("von_mises_rail_von_mises_MPa", "von_mises_wheel_von_mises_MPa"),
        )
    )
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
# pressure of the relief; for bodies that yield only if all cases have a yield stress
PRESSURE = {json.dumps(f"{'plastic' if all_yield else 'contact'}_pressure_MPa")}
# upper ends of the colour scales, equal for all cases
PRESSURE_MPA = {json.dumps(pressure)}
VON_MISES_MPA = {json.dumps(stress)}
''' + (files("fecontact.outputs.paraview") / _SCRIPT_BODY).read_text("utf-8")


def _read_contact_point_mm(folder: Path) -> tuple[float, float, float]:
    first = read_json(folder / "result.json")["contact_points"][0]
    return first["x_mm"], first["y_mm"], first["z_mm"]


def _largest_value(rows: Sequence[RowMapping], *columns: str) -> float:
    values = [float(row[column]) for row in rows for column in columns if row.get(column) is not None]
    return max(values, default=1.0)
