"""Finished positions of applicability maps on disk, each in a file of its own, so that no later map can lose them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from fecontact.case import Case
from fecontact.files import json_text, write_json
from fecontact.jobs.provenance import difference, json_digest, makers, position_id
from fecontact.map.cells import MapPosition
from fecontact.outputs.map_record import position_from_record, position_record

SCHEMA = "fecontact/map-position/1"


def position_file(out: Path, base_case: Case, shift_mm: float, loads_N: Sequence[float]) -> Path:
    """File of a finished position; another one for other inputs or other loads."""
    name = position_id(replace(base_case, lateral_shift_mm=shift_mm, load_N=max(loads_N)), loads_N)
    return out / "positions" / f"{name}.json"


def write_position(position: MapPosition, out: Path, base_case: Case, loads_N: Sequence[float]) -> Path | None:
    """Keep a position, unless a cell of it is inferred or not converged: those are tried again."""
    if not all(cell.status == "converged" for cell in position.cells):
        return None
    record = {"schema": SCHEMA, "made_by": makers(base_case), "position": position_record(position)}
    path = position_file(out, base_case, position.shift_mm, loads_N)
    return write_json(path, record | {"sha256": json_digest(json.loads(json_text(record)))})


@dataclass(frozen=True, kw_only=True)
class KeptPositions:
    """Positions that need not be solved again, and why others that are on disk have to be."""

    positions: tuple[MapPosition, ...] = ()
    problems: tuple[str, ...] = ()


def kept_positions(out: Path, base_case: Case, shifts_mm: Sequence[float], loads_N: Sequence[float]) -> KeptPositions:
    """Read the finished positions of a map that were solved by the same versions."""
    found, problems = [], []
    made_by = makers(base_case)
    for shift in shifts_mm:
        path = position_file(out, base_case, shift, loads_N)
        try:
            record = json.loads(path.read_text("utf-8"))
            if record.pop("sha256") != json_digest(record):
                problems.append(f"{path} is damaged (its checksum differs)")
            elif changes := difference(record["made_by"], made_by):
                problems.append(f"{path} was made by another version: {changes}")
            else:
                found.append(position_from_record(record["position"]))
        except FileNotFoundError:
            continue
        except (OSError, ValueError) as error:
            problems.append(f"{path} cannot be read ({error})")
        except (AttributeError, KeyError, TypeError) as error:
            problems.append(f"{path} has another layout ({type(error).__name__}: {error})")
    return KeptPositions(positions=tuple(found), problems=tuple(problems))
