"""Stored results judged again, by different criteria or by a newer evaluation, without finite elements."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Protocol

from fecontact.contact_theories.registry import HERTZ
from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError
from fecontact.jobs.remaining import Progress
from fecontact.outputs.parts import Part
from fecontact.runs.judged_study import judge_study, refuse_output_folder
from fecontact.runs.stored_map import judge_map


class Judged(Protocol):
    """Results by different criteria, with their descriptions."""

    @property
    def all_judged(self) -> bool:
        """Whether all results were judged and may be used."""

    @property
    def problems(self) -> tuple[str, ...]:
        """Reasons for results that cannot be judged, if the rows do not give them."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Criteria of a user that were judged by their stored values, with the reason."""

    @property
    def words(self) -> str:
        """Description of the judged results, with their criteria."""

    @property
    def record(self) -> Mapping[str, Any]:
        """Complete results for other programs."""

    def terminal_parts(self, width: int | None) -> Iterable[Part]:
        """Complete results for a terminal with `width` columns.

        Parameters
        ----------
        width
            Columns of the terminal; None without a terminal.

        Returns
        -------
        iterable
            The parts, such as lines and tables.
        """


def judge(
    folder: str | Path,
    criteria: Criteria | Mapping[str, Any] | None = None,
    *,
    creep: Creep | Mapping[str, Any] | None = None,
    measure: str = "pressure",
    theory: str = HERTZ,
    out: str | Path | None = None,
    progress: Progress | None = None,
) -> Any:
    """Judge a stored study, map or case again, by different criteria or with friction; nothing is solved.

    Parameters
    ----------
    folder
        Folder that fecontact wrote; it stays unchanged.
    criteria
        The stored criteria of each case if not given. `{"p_max": 0.03}` changes the named values of the stored
        criteria. `Criteria(...)` gives all criteria: values that it does not name have their defaults, and stored
        criteria of a user stay if `own` is None.
    creep
        Friction and creepages, with the same forms; without friction the stored values of each case are used.
    measure
        Measure of a map; for `theory` with friction the laws of creep forces are judged too.
    theory
        For a map: theory of the pressure with a separate map beside the map of Hertz.
    out
        Folder for tables, pictures and report of the new verdicts.
    progress
        Receives the progress as for `run`; for a map with positions in place of cases.

    Returns
    -------
    JudgedStudy or JudgedMap
        The new verdicts.

    Raises
    ------
    InputError
        If the folder holds no results or is `out`, for unrecognised names, for creepages without friction, and for a
        measure that needs friction if there is none.

    Examples
    --------
    >>> import tempfile
    >>> import fecontact
    >>> pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     outcome = fecontact.run([fecontact.Case(**pair, resolution="quick", refine="never")], folder)
    ...     strict = fecontact.judge(folder, fecontact.Criteria(p_max=1e-3))
    >>> outcome.rows[0]["verdict_answer"], strict.rows[0]["verdict_answer"]
    ('HOLDS', 'UNRESOLVED')
    """
    folder, out = Path(folder), None if out is None else Path(out)
    _refuse_other_kind("criteria", criteria, Criteria)
    _refuse_other_kind("creep", creep, Creep)
    if isinstance(creep, Creep):
        creep.refuse_unheard()
    elif creep:
        # wrong values are refused before the results are read
        Creep(**creep)
    if isinstance(criteria, Criteria):
        criteria.refuse_unsendable_own()
    elif criteria:
        # whether `own` may decide alone depends on the stored criteria
        is_own_alone = criteria.get("judged_by") == ("own",)
        Criteria(
            **{name: value for name, value in criteria.items() if not (is_own_alone and name == "judged_by")}
        ).refuse_unsendable_own()
    refuse_output_folder(folder, out)
    if (folder / "map.json").is_file():
        return judge_map(folder, criteria, out, creep=creep, measure=measure, theory=theory, progress=progress)
    if measure != "pressure" or theory != HERTZ:
        what = f"measure is {measure!r}" if measure != "pressure" else f"theory is {theory!r}"
        raise InputError(
            f"{what}, but {folder} is not a map (no map.json); leave it out: the tables of a study or a case have all"
            " theories, and with --friction also forces"
        )
    return judge_study(folder, criteria, out, creep=creep, progress=progress)


def _refuse_other_kind(name: str, change: Any, kind: type) -> None:
    """Refuse a change that is neither a `kind` nor a mapping nor None."""
    if change is not None and not isinstance(change, kind | Mapping):
        raise InputError(f"{name} is {change!r:.80}; allowed: a {kind.__name__}(...), or changed values by their names")
