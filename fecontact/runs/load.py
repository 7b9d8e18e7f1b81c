"""Stored results read back from their folders: cases, studies and maps, as solving returned them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fecontact.errors import InputError, has_numbers
from fecontact.runs.store import RECORD_FILE, name_case_folder, read_case
from fecontact.runs.stored_folder import REMEDY, read_stored_study, refuse_unusable
from fecontact.runs.stored_map import load_map

_FILES = (RECORD_FILE, "study.json", "map.json")


def load(folder: str | Path) -> Any:
    """Read finished results.

    Parameters
    ----------
    folder
        Folder of a case (from `solve --out`, or a folder in `cases/` of a study), of a study, or of a map.

    Returns
    -------
    CaseResult, tuple of CaseResult, or ApplicabilityMap
        Results as the solution returned them, without the meshes; for a study the cases with a result, in its order.

    Raises
    ------
    InputError
        If there is nothing to read, a result is damaged, or another version of the program solved it.

    Examples
    --------
    >>> import tempfile
    >>> import fecontact
    >>> pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     outcome = fecontact.run([fecontact.Case(**pair, resolution="quick", refine="never")], folder)
    ...     (result,) = fecontact.load(folder)
    >>> result.status, result.verdict.answer
    ('converged', 'HOLDS')
    """
    folder = Path(folder)
    if (folder / RECORD_FILE).is_file():
        refuse_unusable(folder)
        return read_case(folder)
    if (folder / "study.json").is_file():
        _, rows, _ = read_stored_study(folder)
        folders = [name_case_folder(folder, row["id"]) for row in rows if has_numbers(row)]
        for case_path in folders:
            refuse_unusable(case_path)
        return tuple(read_case(case_path) for case_path in folders)
    if (folder / "map.json").is_file():
        return load_map(folder)
    raise InputError(f"{folder} has no {' or '.join(_FILES)}; {REMEDY}")
