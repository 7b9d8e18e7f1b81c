"""Stored results judged again, by other criteria or by a newer evaluation: no finite elements, no meshes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Protocol

from fecontact.contact_theories.registry import HERTZ
from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError
from fecontact.jobs.remaining import Progress
from fecontact.outputs.parts import Part
from fecontact.runs.judged_study import check_out, judge_study
from fecontact.runs.stored_map import judge_map


class Judged(Protocol):
    """Results by other criteria, and what they say of themselves."""

    @property
    def all_judged(self) -> bool:
        """Whether all was judged and may be used."""

    @property
    def problems(self) -> tuple[str, ...]:
        """What cannot be judged, where the rows do not say it."""

    @property
    def words(self) -> str:
        """What was judged; where the criteria stand is {criteria}."""

    @property
    def record(self) -> Mapping[str, Any]:
        """All of it, for other programs."""

    def parts(self, width: int | None) -> Iterable[Part]:
        """All of it, for a terminal of so many columns."""


def judge(
    folder: str | Path,
    criteria: Criteria | None = None,
    *,
    creep: Creep | None = None,
    measure: str = "pressure",
    theory: str = HERTZ,
    out: str | Path | None = None,
    progress: Progress | None = None,
) -> Any:
    """Judge a stored study, map or case again, by other criteria or with friction; nothing is solved.

    Parameters
    ----------
    folder
        That fecontact wrote; it stays as it is.
    criteria
        The usual ones if not given.
    creep
        Friction and creepages; without friction each case's own are used.
    measure
        Of a map, what it is about; by `theory` with friction the laws of creep forces are judged too.
    theory
        Of a map: a theory of the pressure, whose map is drawn beside the map of Hertz.
    out
        Folder for tables, pictures and report of the new verdicts.
    progress
        As for `run`; of a map with positions in place of cases.

    Returns
    -------
    JudgedStudy or JudgedMap

    Raises
    ------
    InputError
        If the folder holds no results or is `out`, for creepages without friction, and for a measure without it.
    """
    folder, out = Path(folder), None if out is None else Path(out)
    criteria, creep = criteria or Criteria(), creep or Creep()
    creep.refuse_unheard()
    asked = creep if creep.asked else None
    check_out(folder, out)
    if (folder / "map.json").is_file():
        return judge_map(folder, criteria, out, creep=asked, measure=measure, theory=theory, progress=progress)
    if measure != "pressure" or theory != HERTZ:
        what = f"measure is {measure!r}" if measure != "pressure" else f"theory is {theory!r}"
        raise InputError(
            f"{what}, but {folder} has no map.json; a study and a case have every theory in their tables, and forces by"
            " --friction alone"
        )
    return judge_study(folder, criteria, out, creep=asked, progress=progress)
