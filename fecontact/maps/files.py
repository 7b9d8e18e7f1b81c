"""Files of a map: tables, JSON and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.errors import InputError
from fecontact.feature_registry import load_offers
from fecontact.files import is_file_name, read_json, write_sealed
from fecontact.maps.model import ApplicabilityMap
from fecontact.maps.picture import save_map_figure
from fecontact.maps.telling import build_contact_row, build_law_row, build_stiffness_rows
from fecontact.maps.theory_views import find_judged_laws
from fecontact.maps.views import build_views
from fecontact.maps.yaw_map import MapResult, YawMap, add_yaw_column, format_yaw, list_maps
from fecontact.maps.yaw_records import build_result_record
from fecontact.outputs.alone import equalise_columns
from fecontact.outputs.flat_records import Record
from fecontact.outputs.tables import write_csv


def write_map(
    map_result: MapResult,
    out: Path,
    name: str = "map",
    *,
    theory: str = HERTZ,
    provenances: Sequence[Record] = (),
    drawn: bool = True,
) -> None:
    """Write the tables and pictures of a map into a folder.

    The files are NAME.csv, NAME.json, NAME.png (Hertz) and NAME_theory.png (the cheapest theory of the pressure that
    holds); for another `theory` NAME_THEORY.png; a picture of each verdict of a feature (`MAPS`) that the case
    requests; a table and a picture of the feature's laws (`LAWS`), if they were judged. A whole map also has
    contacts.csv, rows of a contact table with the theory to use, and stiffness.csv, if the map has stiffnesses. For
    several yaws each table has all yaws, and each yaw has its own pictures, such as NAME_yaw_5mrad.png.

    Parameters
    ----------
    map_result
        Map, or maps of several yaws.
    out
        Folder.
    name
        Stem of the file names; "map" for a whole map.
    theory
        Further theory of the pressure with a picture.
    provenances
        Origin of the results of each yaw, for the JSON file.
    drawn
        Whether pictures are drawn.
    """
    former_own_names = _list_former_own(out / f"{name}.json")
    write_csv(map_result.rows(), out / f"{name}.csv")
    if name == "map":
        _write_contacts(map_result, out)
    write_sealed(out / f"{name}.json", build_result_record(map_result, provenances), [out / f"{name}.csv"])
    maps_with_results = [single_map for single_map in list_maps(map_result) if single_map.positions]
    if not (drawn and maps_with_results):
        return
    _remove_pictures(out, name, former_own_names, has_yaws=isinstance(map_result, YawMap))
    law_rows: dict[str, list[Record]] = {}
    for single_map in maps_with_results:
        stem = f"{name}_yaw_{format_yaw(single_map.yaw_mrad)}mrad" if isinstance(map_result, YawMap) else name
        for suffix, view in build_views(single_map, theory, at_yaw=isinstance(map_result, YawMap)).items():
            save_map_figure(view, out / f"{stem}{suffix and f'_{suffix}'}.png")
        for suffix, laws in find_judged_laws(single_map).items():
            rows = [build_law_row(cell, laws) for cell in single_map.cells]
            law_rows.setdefault(suffix, []).extend(_add_yaw(rows, map_result, single_map))
    for suffix, rows in law_rows.items():
        write_csv(rows, out / f"{name}_{suffix}.csv")


def _list_picture_names() -> list[str]:
    """Names of all possible pictures except the picture of Hertz."""
    return [*load_offers("MAPS"), *load_offers("NUMBERS"), *load_offers("LAWS"), *THEORIES, "theory"]


def _write_contacts(map_result: MapResult, out: Path) -> None:
    """Write the rows of a contact table, and the stiffnesses if there are any."""
    contact_rows: list[Record] = []
    stiffness_rows: list[Record] = []
    for single_map in list_maps(map_result):
        rows = [
            build_contact_row(cell, position.placement) for position in single_map.positions for cell in position.cells
        ]
        contact_rows += _add_yaw(rows, map_result, single_map)
        rows = [row for position in single_map.positions for row in build_stiffness_rows(position)]
        stiffness_rows += _add_yaw(rows, map_result, single_map)
    write_csv(equalise_columns(contact_rows), out / "contacts.csv")
    if stiffness_rows:
        write_csv(stiffness_rows, out / "stiffness.csv")
    else:
        # A file of other loads would not belong to this map.
        (out / "stiffness.csv").unlink(missing_ok=True)


def _add_yaw(rows: list[Record], map_result: MapResult, single_map: ApplicabilityMap) -> list[Record]:
    """Rows of a single map, with its yaw if the result has several maps."""
    return [add_yaw_column(row, single_map.case) for row in rows] if isinstance(map_result, YawMap) else rows


def _list_former_own(path: Path) -> list[str]:
    """Names of the pictures of a user's criteria in an earlier map.

    They are from its JSON file; without such a file there are none.
    """
    try:
        own_criteria = read_json(path)["criteria"]["own"]
        picture_names = [f"own_{criterion['name']}" for criterion in own_criteria]
    except (InputError, LookupError, TypeError):
        return []
    return [picture_name for picture_name in picture_names if is_file_name(picture_name)]


def _remove_pictures(out: Path, name: str, former_own_names: Sequence[str], *, has_yaws: bool) -> None:
    """Remove earlier pictures of other inputs: friction, theories, criteria and yaws.

    They would not belong to this map. With yaws, the picture of Hertz without a yaw in its name goes too.
    """
    former_names = [f"_{former_name}" for former_name in _list_picture_names()]
    for former_name in (*former_names, *[""] * has_yaws):
        for ending in ("png", "svg", *["csv"] * bool(former_name)):
            (out / f"{name}{former_name}.{ending}").unlink(missing_ok=True)
    for ending in ("png", "svg"):
        own_pictures = (out / f"{name}_{own_name}.{ending}" for own_name in former_own_names)
        for path in (*out.glob(f"{name}_yaw_*mrad*.{ending}"), *own_pictures):
            path.unlink(missing_ok=True)
