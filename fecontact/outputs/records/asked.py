"""Records and rows with the requested verdict first."""

from __future__ import annotations

from fecontact.contact_theories.registry import HERTZ, HERTZ_GAUGE
from fecontact.judging.measures import MEASURES
from fecontact.outputs.flat_records import Record
from fecontact.outputs.tables import TableRecord
from fecontact.outputs.theory_records import select_measures
from fecontact.own_criterion import is_own


def requested_record(record: TableRecord) -> TableRecord:
    """Record in which `fe` and Hertz belong to bodies that yield, as the verdict does.

    Parameters
    ----------
    record
        Record of a load.

    Returns
    -------
    dict
        The converted record. Without a yield stress it is the given record.
    """
    if (plastic := record["plastic"]) is None:
        return record
    plastic_judgement, theories = plastic[HERTZ], record["theories"]
    side = record["verdict"]["side"]
    plastic_entries = {
        name: plastic_judgement[name] for name in ("deviation", "uncertainty", "verdict", "limit_utilisation")
    }
    name = HERTZ_GAUGE if side == "gauge" else HERTZ
    return {
        **record,
        "fe": {**record["fe"], **select_measures(plastic)},
        "theories": {**theories, name: {**theories[name], **plastic_entries}},
    }


def elastic_record(record: TableRecord) -> TableRecord:
    """Record with the verdict against elastic bodies.

    Without a yield stress it is the given record.
    """
    return {**record, "verdict": record["elastic_verdict"]} if record["plastic"] is not None else record


def requested_row(row: TableRecord) -> TableRecord:
    """Row as tables show it: verdict and numbers of Hertz belong together.

    At a curvature junction the columns of Hertz have the curvature of the side that decided. With a yield stress
    deviations and measures are against bodies that yield, as the verdict is. All other theories are judged against
    elastic bodies only, so the row names no other theory.

    Parameters
    ----------
    row
        Row of a load.

    Returns
    -------
    dict
        The converted row. It is the given row without a junction and without a yield stress.
    """
    if row.get("verdict_side") == "gauge":
        gauge_prefix = f"{HERTZ_GAUGE}_"
        gauge_columns = {
            name.removeprefix(gauge_prefix): value for name, value in row.items() if name.startswith(gauge_prefix)
        }
        row = {**row, **{f"{HERTZ}_{name}": value for name, value in gauge_columns.items()}}
    if not row.get("elastic_verdict_answer"):
        return row
    prefixes = ("deviation_", "uncertainty_")
    replaced: Record = {
        name: None
        for name in row
        if name.startswith(("cheapest_theory", *(f"{HERTZ}_{prefix}" for prefix in prefixes)))
    }
    for name, value in row.items():
        hertz_column, measure = name.removeprefix("plastic_hertz_"), name.removeprefix("plastic_")
        if name.startswith("plastic_hertz_") and hertz_column.startswith(prefixes):
            replaced[f"{HERTZ}_{hertz_column}"] = value
        elif name != measure and (measure in MEASURES or is_own(measure)):
            replaced[f"fe_{measure}"] = value
    return {**row, **replaced}
