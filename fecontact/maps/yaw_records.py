"""Record of maps at several yaws for the JSON file of a map."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest

from fecontact.maps.telling import build_map_record
from fecontact.maps.yaw_map import MapResult, YawMap, find_yaw_changes
from fecontact.outputs.flat_records import Record
from fecontact.outputs.records.results import package_versions

YAW_MAP_SCHEMA = "fecontact/yaw_map/1"


def build_result_record(map_result: MapResult, provenances: Sequence[Record] = ()) -> Record:
    """Record of a map, or of the maps of several yaws.

    Parameters
    ----------
    map_result
        Map, or maps of several yaws.
    provenances
        Origin of the results of each yaw.

    Returns
    -------
    Record
        Content of the JSON file. For several yaws: the common inputs, the cells whose verdict on Hertz is different at
        two yaws, and in `maps` the record of the map of each yaw.
    """
    if not isinstance(map_result, YawMap):
        return build_map_record(map_result, *provenances)
    yaw_records = [
        build_map_record(single_map, provenance) for single_map, provenance in zip_longest(map_result.maps, provenances)
    ]
    first, shifts_mm = yaw_records[0], {position.lateral_shift_mm for position in map_result.positions}
    return {
        "schema": YAW_MAP_SCHEMA,
        "case": {name: value for name, value in first["case"].items() if name != "yaw_rad"},
        "roll": first["roll"],
        "criteria": first["criteria"],
        "lateral_shifts_mm": sorted(shifts_mm),
        "yaws_rad": [single_map.case.yaw_rad for single_map in map_result.maps],
        "loads_N": first["loads_N"],
        "verdict_changes": build_change_records(map_result),
        "maps": yaw_records,
        "versions": package_versions(),
    }


def build_change_records(yaw_map: YawMap) -> list[Record]:
    """Records of the verdicts on Hertz that change with the yaw.

    Parameters
    ----------
    yaw_map
        Maps of several yaws.

    Returns
    -------
    list of Record
        Shift, load, and the verdict at each yaw in rad.
    """
    yaws_rad = {single_map.yaw_mrad: single_map.case.yaw_rad for single_map in yaw_map.maps}
    verdicts = {
        single_map.yaw_mrad: {(cell.lateral_shift_mm, cell.load_N): cell.verdict for cell in single_map.cells}
        for single_map in yaw_map.maps
    }
    return [
        {
            "lateral_shift_mm": change.lateral_shift_mm,
            "load_N": change.load_N,
            "verdicts": [
                {"yaw_rad": yaws_rad[yaw_mrad], "verdict": answer} for yaw_mrad, answer in change.answers.items()
            ],
        }
        for change in find_yaw_changes(verdicts)
    ]
