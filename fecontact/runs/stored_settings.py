"""Settings of a vehicle-dynamics code for the stored cases of a study."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError, has_numbers
from fecontact.outputs.case_words import case_words
from fecontact.outputs.code_settings import PositionSettings, settings_of_result
from fecontact.outputs.records.results import result_record
from fecontact.runs.judged_study import list_stored_cases
from fecontact.runs.store import read_case, read_stored_inputs
from fecontact.runs.stored_folder import describe_unusable_result


def refuse_map(folder: Path) -> None:
    """Refuse the folder of a map.

    The cells of a map are not stored with their contact points.

    Parameters
    ----------
    folder
        Folder of results.

    Raises
    ------
    InputError
        If the folder is a map.
    """
    if (folder / "map.json").is_file():
        raise InputError(
            f"{folder} is a map, and settings of a code are for a case; solve the cell of the map with"
            " `fecontact solve --shift ... --load-kn ... --set-in CODE`"
        )


def read_settings(
    folder: Path,
    criteria: Criteria | Mapping[str, Any] | None = None,
    creep: Creep | Mapping[str, Any] | None = None,
) -> Iterator[tuple[str, PositionSettings]]:
    """Iterate over the settings of the cases of a stored study or case.

    Parameters
    ----------
    folder
        Folder of the study or the case.
    criteria
        Change of the stored criteria, by which the cheapest theory holds.
    creep
        Change of the stored friction, for the code.

    Yields
    ------
    tuple of str and PositionSettings
        Pair, position and load of a case in words, with its settings. Cases without a usable result are left out.

    Raises
    ------
    InputError
        If the folder holds neither a study nor a case.
    """
    _, rows, folders, _ = list_stored_cases(folder)
    for row, case_folder in zip(rows, folders, strict=True):
        if not has_numbers(row) or describe_unusable_result(case_folder) is not None:
            continue
        # without friction no creep forces are computed, which take seconds
        stored_case = read_stored_inputs(case_folder)
        result = read_case(case_folder, criteria=stored_case.criteria.apply_change(criteria), creep=Creep())
        record = result_record(result)
        case = replace(result.case, creep=stored_case.creep.apply_change(creep))
        yield case_words(record["case"]), settings_of_result(case, record)
