"""Results read back from their folders: cases, studies and maps, as the objects that solving gave."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fecontact.errors import InputError, has_numbers
from fecontact.runs.store import RESULT, case_folder, read_case
from fecontact.runs.stored_folder import REMEDY, refuse_unusable, stored_study
from fecontact.runs.stored_map import load_map

_FILES = (RESULT, "study.json", "map.json")


def load(folder: str | Path) -> Any:
    """Read finished results.

    Parameters
    ----------
    folder
        Of a case (what `solve --out` writes, or one of a study's `cases/`), of a study, or of a map.

    Returns
    -------
    CaseResult, tuple of CaseResult, or ApplicabilityMap
        What the solution gave, but for the meshes; of a study the cases that have a result, in its order.

    Raises
    ------
    InputError
        If there is nothing to read, a result is damaged, or another version of the program solved it.
    """
    folder = Path(folder)
    if (folder / RESULT).is_file():
        refuse_unusable(folder)
        return read_case(folder)
    if (folder / "study.json").is_file():
        _, rows, _ = stored_study(folder)
        folders = [case_folder(folder, row["id"]) for row in rows if has_numbers(row)]
        for one in folders:
            refuse_unusable(one)
        return tuple(read_case(one) for one in folders)
    if (folder / "map.json").is_file():
        return load_map(folder)
    raise InputError(f"{folder}: it has no {' or '.join(_FILES)}; {REMEDY}")
