"""Records and rows with the verdict that was asked for first."""

from __future__ import annotations

from fecontact.contact_theories.registry import HERTZ, HERTZ_GAUGE
from fecontact.judging.measures import MEASURES
from fecontact.outputs.flat_records import Record
from fecontact.outputs.records.results import measures_in
from fecontact.outputs.tables import Item


def asked_record(record: Item) -> Item:
    """A record whose `fe` and Hertz are those against bodies that yield, as its verdict is.

    Returns the record itself without a yield stress.
    """
    if (plastic := record.get("plastic")) is None:
        return record
    judged, theories = plastic[HERTZ], record["theories"]
    side = record["verdict"]["side"]
    against = {name: judged[name] for name in ("deviation", "uncertainty", "verdict", "limit_used")}
    name = HERTZ_GAUGE if side == "gauge" else HERTZ
    return {
        **record,
        "fe": {**record["fe"], **measures_in(plastic)},
        "theories": {**theories, name: {**theories[name], **against}},
    }


def elastic_record(record: Item) -> Item:
    """A record with the verdict against elastic bodies; the record itself without a yield stress."""
    return {**record, "verdict": record["elastic_verdict"]} if record.get("plastic") is not None else record


def asked_row(row: Item) -> Item:
    """A row as it is shown: verdict and numbers of Hertz belong to one side and to equal bodies.

    At a curvature junction the columns of Hertz have the curvature of the side that decided. With a yield stress
    deviations and measures are against bodies that yield, as the verdict is. All other theories are judged against
    elastic bodies alone, so the row names none of them. Without both it is the row itself.
    """
    if row.get("verdict_side") == "gauge":
        gauge = f"{HERTZ_GAUGE}_"
        of_gauge = {name.removeprefix(gauge): value for name, value in row.items() if name.startswith(gauge)}
        row = {**row, **{f"{HERTZ}_{name}": value for name, value in of_gauge.items()}}
    if not row.get("elastic_verdict_answer"):
        return row
    own = ("deviation_", "uncertainty_")
    found: Record = {
        name: None for name in row if name.startswith(("cheapest_theory", *(f"{HERTZ}_{of}" for of in own)))
    }
    for name, value in row.items():
        of_hertz, measure = name.removeprefix("plastic_hertz_"), name.removeprefix("plastic_")
        if name.startswith("plastic_hertz_") and of_hertz.startswith(own):
            found[f"{HERTZ}_{of_hertz}"] = value
        elif name != measure and measure in MEASURES:
            found[f"fe_{measure}"] = value
    return {**row, **found}
