"""Reports of creep forces: records, columns of rows, tables and lines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, fields, replace
from importlib.resources import files

from fecontact.contact_theories.rolling.creepage import CreepForce
from fecontact.features.creep.creep_comparison import CreepComparison
from fecontact.features.creep.force_verdict import DECIDING_THEORY
from fecontact.features.creep.judged_force import FORCE_MEASURE
from fecontact.inputs.texts import count_text
from fecontact.outputs.flat_records import Record, select_attributes, to_plain
from fecontact.outputs.parts import Telling
from fecontact.outputs.tables import CellSource, Column, Table, TableRecord, make_table, number_column, text_column
from fecontact.outputs.terminal import OutputLines


def _make_creep_record(comparison: CreepComparison) -> Record:
    """Record of the creep forces of a judged load.

    It has friction, creepages, the forces of each theory on both patches, and the verdict. Deviations are fractions of
    the friction coefficient times the normal force; forces are in N.
    """
    judgement, deviation_names = comparison.verdict, "deviation_of_muN uncertainty_of_muN"
    t_gamma_names = "t_gamma_deviation_percent t_gamma_uncertainty_percent"
    component_names = (
        "fx_deviation_N fx_uncertainty_N fy_deviation_N fy_uncertainty_N mz_deviation_Nmm mz_uncertainty_Nmm"
    )
    return {
        **select_attributes(comparison, "friction limit_N creepages centre_creepages curved surface_of_muN"),
        "theories": {
            theory: {
                "hertz": make_force_record(forces.hertz),
                "fe": make_force_record(forces.fe),
                **select_attributes(forces, f"{deviation_names} {t_gamma_names} {component_names}"),
                "y_over_q": to_plain(forces.y_over_q),
            }
            for theory, forces in comparison.theories.items()
        },
        "verdict": {
            **select_attributes(judgement.verdict, "answer cause"),
            **select_attributes(judgement.decided[0], deviation_names),
            "limit_of_muN": judgement.limits[FORCE_MEASURE],
        },
        "decided": [
            to_plain(deviation.creepages) | select_attributes(deviation, deviation_names)
            for deviation in judgement.decided
        ],
        "warnings": list(comparison.warnings),
    }


def make_force_record(force: CreepForce | str) -> Record:
    """Record of a creep force, or of the reason why there is no force.

    Parameters
    ----------
    force
        Force, or the reason.

    Returns
    -------
    dict
        Fields of the force in N, N mm and mm2, or the reason in `problem`.
    """
    if isinstance(force, str):
        return {**dict.fromkeys(field.name for field in fields(CreepForce)), "problem": force}
    # adding 0.0 removes the sign of zero
    return {name: value if value is None else value + 0.0 for name, value in asdict(force).items()} | {"problem": None}


_SIDES = {"hertz": "Hertz", "fe": "FE"}


def _make_force_column(heading: str, source: CellSource, form: str, factor: float = 1.0) -> Column:
    """A column of forces, with "none" for a theory that has a problem."""
    column = number_column(heading, source, form, factor, none="")
    return replace(column, cell=lambda force: "none" if force["problem"] is not None else column.cell(force))


_FORCE_COLUMNS = (
    text_column("theory", "name"),
    _make_force_column("Fx\nkN", "fx_N", "{:+.3f}", 1e-3),
    _make_force_column("Fy\nkN", "fy_N", "{:+.3f}", 1e-3),
    _make_force_column("Mz\nN m", "mz_Nmm", "{:+.2f}", 1e-3),
    _make_force_column(
        "|F|\n% of mu N", lambda force: math.hypot(force["fx_N"], force["fy_N"]) / force["limit_N"], "{:.1f}", 1e2
    ),
    _make_force_column("adhesion\nmm²", "adhesion_area_mm2", "{:.1f}"),
    _make_force_column("T-gamma\nN", "power_per_speed_N", "{:.2f}"),
)


def report_force_verdicts(rows: Sequence[TableRecord]) -> OutputLines:
    """Yield a sentence for each row that has a verdict of forces.

    Parameters
    ----------
    rows
        Rows of results.

    Returns
    -------
    iterator of str
        Sentences that begin with the id of the row.
    """
    for row in rows:
        if row.get("creep_verdict_answer"):
            deviation, uncertainty = (
                1e2 * row[f"creep_verdict_{name}_of_muN"] for name in ("deviation", "uncertainty")
            )
            cause = row.get("creep_verdict_cause")
            yield f"{row['id']}: {_format_force_verdict(row['creep_verdict_answer'], deviation, uncertainty, cause)}"


def answer_creep_forces(record: TableRecord) -> Iterator[str]:
    """Yield the verdict on Hertz for creep forces, and the forces.

    Parameters
    ----------
    record
        Record of creep forces in a result.

    Yields
    ------
    str
        Sentences: the verdict; creepages and forces on the patch of the finite elements, with T-gamma and the deviation
        of Hertz's T-gamma.
    """
    verdict = record["verdict"]
    deviation_percent, uncertainty_percent = 1e2 * verdict["deviation_of_muN"], 1e2 * verdict["uncertainty_of_muN"]
    condition = f" (limit {1e2 * verdict['limit_of_muN']:g} %), at {_format_creepages(record['decided'][0])}"
    yield _format_force_verdict(verdict["answer"], deviation_percent, uncertainty_percent, verdict["cause"], condition)
    law = record["theories"][DECIDING_THEORY]
    title = f"creep forces at {_format_creepages(record['creepages'])}"
    if law["fe"]["problem"] is not None:
        yield f"{title}: {law['fe']['problem']}"
        return
    forces = f"Fx {1e-3 * law['fe']['fx_N']:+.3f} kN, Fy {1e-3 * law['fe']['fy_N']:+.3f} kN"
    if law["fe"]["mz_Nmm"] is not None:
        forces += f", Mz {1e-3 * law['fe']['mz_Nmm']:+.2f} N m"
    t_gamma = law["fe"]["power_per_speed_N"]
    yield f"{title}: {forces}{_format_force_error(law)}" + (
        "" if t_gamma is None else f", T-gamma {t_gamma:.2f} N{_format_t_gamma_error(law)}"
    )


def _format_force_error(law: TableRecord) -> str:
    """Size of the deviation of Hertz's force with its uncertainty; empty without a deviation."""
    if law["deviation_of_muN"] is None:
        return ""
    deviation, uncertainty = 1e2 * law["deviation_of_muN"], law["uncertainty_of_muN"]
    return (
        f" (Hertz differs by {deviation:.1f}{'' if uncertainty is None else f' ± {1e2 * uncertainty:.1f}'} % of mu N)"
    )


def _format_t_gamma_error(law: TableRecord) -> str:
    """Deviation of Hertz's T-gamma with its uncertainty; empty without a deviation."""
    return _format_relative_error(law["t_gamma_deviation_percent"], law["t_gamma_uncertainty_percent"])


def _format_relative_error(deviation_percent: float | None, uncertainty_percent: float | None) -> str:
    """Deviation of Hertz with its uncertainty, in brackets; empty without a deviation."""
    if deviation_percent is None:
        return ""
    uncertainty = "" if uncertainty_percent is None else f" ± {uncertainty_percent:.1f} %"
    return f" (Hertz {deviation_percent:+.1f} %{uncertainty})"


def answer_total_t_gamma(records: Sequence[TableRecord | None]) -> Iterator[str]:
    """Yield the sum of T-gamma over the wheels of a vehicle.

    The uncertainties of the wheels are added, because their causes are not independent.

    Parameters
    ----------
    records
        Record of creep forces of each wheel; None for a wheel without a usable result.

    Yields
    ------
    str
        Sentence with the sum, the number of wheels, and the deviation of Hertz; nothing if no wheel has T-gamma.
    """
    laws = [record["theories"][DECIDING_THEORY] for record in records if record is not None]
    laws = [law for law in laws if None not in (law["fe"]["power_per_speed_N"], law["hertz"]["power_per_speed_N"])]
    if not laws:
        return
    total_N, hertz_N = (sum(law[side]["power_per_speed_N"] for law in laws) for side in ("fe", "hertz"))
    uncertainties = [
        0.0 if law["fe"]["power_per_speed_N"] == 0.0 else law["t_gamma_uncertainty_percent"] for law in laws
    ]
    deviation = uncertainty = None
    if total_N > 0.0:
        deviation = 1e2 * (hertz_N / total_N - 1.0)
        if None not in uncertainties:
            shares = (law["fe"]["power_per_speed_N"] / total_N for law in laws)
            uncertainty = sum(share * percent for share, percent in zip(shares, uncertainties, strict=True))
    count = f"{len(laws)} of " * (len(laws) < len(records)) + count_text(len(records), "wheel")
    yield f"T-gamma of {count}: {total_N:.2f} N{_format_relative_error(deviation, uncertainty)}"


def report_creep_forces(record: TableRecord) -> OutputLines:
    """Yield the table of forces of a result record, deviations and warnings.

    Parameters
    ----------
    record
        Record of creep forces in a result.

    Returns
    -------
    iterator
        A table and lines.
    """
    theories = record["theories"]
    forces_by_body = {
        f"{theory}, {body}": forces[side] for theory, forces in theories.items() for side, body in _SIDES.items()
    }
    yield _make_force_table("creep forces", record, forces_by_body)
    yield from _report_problems({theory: forces["fe"] for theory, forces in theories.items()})
    deviations = {name: forces["deviation_of_muN"] for name, forces in theories.items()}
    deviations_text = ", ".join(f"{name} {1e2 * value:.1f}" for name, value in deviations.items() if value is not None)
    yield f"deviation of Hertz's creep force, % of mu N: {deviations_text}"
    t_gammas = {name: _format_t_gamma_error(forces) for name, forces in theories.items()}
    t_gamma_text = ", ".join(f"{name}{text}" for name, text in t_gammas.items() if text)
    yield from [f"deviation of Hertz's T-gamma (wear number): {t_gamma_text}"] if t_gamma_text else []
    yield from (f"warning: {warning}" for warning in record["warnings"])


def _format_force_verdict(
    answer: str, deviation: float, uncertainty: float, cause: str | None, condition: str = ""
) -> str:
    """Sentence with the answer for Hertz by creep forces; numbers in percent of mu N."""
    because = f"; cause: {cause}" if cause else ""
    return (
        f"creep forces: Hertz {answer}, largest deviation {deviation:.1f} ± {uncertainty:.1f} % of mu N"
        f"{condition}{because}"
    )


def report_ellipse_forces(record: TableRecord) -> OutputLines:
    """Yield the table of forces on an ellipse, problems and warnings.

    Parameters
    ----------
    record
        Record of the creep forces on an ellipse.

    Yields
    ------
    Table or str
        Table, then problems, then warnings.
    """
    yield _make_force_table("forces on the wheel", record, record["theories"])
    yield from _report_problems(record["theories"])
    yield from (f"warning: {warning}" for warning in record["warnings"])


def _report_problems(theories: Mapping[str, TableRecord]) -> OutputLines:
    return (f"{theory}: {force['problem']}" for theory, force in theories.items() if force["problem"] is not None)


def _format_creepages(creepages: TableRecord) -> str:
    xi, eta, spin = 1e2 * creepages["xi"], 1e2 * creepages["eta"], creepages["spin_per_mm"]
    return f"xi {xi:.3f} %, eta {eta:.3f} %, spin {spin:.3g}/mm"


def _make_force_table(subject: str, record: TableRecord, forces: Mapping[str, TableRecord]) -> Table:
    """Table of forces by the names of their theories."""
    limit_N = record["limit_N"]
    title = f"{subject} at {_format_creepages(record['creepages'])}, mu N {limit_N / 1e3:.2f} kN"
    return make_table(
        title, _FORCE_COLUMNS, ({**force, "name": name, "limit_N": limit_N} for name, force in forces.items())
    )


def _format_force_deviation(row: TableRecord) -> str:
    """Deviation of creep forces with its uncertainty, in percent of mu N."""
    if not row.get("creep_verdict_answer"):
        return "-"
    deviation, uncertainty = (1e2 * float(row[f"creep_verdict_{name}_of_muN"]) for name in ("deviation", "uncertainty"))
    return f"{deviation:.1f} ± {uncertainty:.1f}"


CREEP = Telling(
    record=_make_creep_record,
    keys=(files("fecontact.features.creep") / "result_keys.toml").read_text("utf-8"),
    columns=(
        text_column("creep forces", lambda row: row.get("creep_verdict_answer") or "failed", "answer"),
        text_column("force deviation, % of mu N", _format_force_deviation, "number"),
    ),
    answer=answer_creep_forces,
    parts=report_creep_forces,
    of_rows=report_force_verdicts,
    total=answer_total_t_gamma,
)
