"""Records and rows with the verdict that was asked for first."""

from __future__ import annotations

from fecontact.contact_theories.registry import HERTZ
from fecontact.judging.measures import MEASURES
from fecontact.outputs.flat_records import Record
from fecontact.outputs.records.results import measures_in
from fecontact.outputs.tables import Item


def asked_record(record: Item) -> Item:
    """A record whose `verdict`, `fe` and Hertz are those against bodies that yield; itself without a yield stress."""
    if (plastic := record.get("plastic")) is None:
        return record
    judged, theories = plastic[HERTZ], record["theories"]
    verdict = {**record["verdict"], **judged["verdict"], "limit_used": judged["limit_used"], "side": "both"}
    against = {name: judged[name] for name in ("deviation", "uncertainty", "verdict", "limit_used")}
    return {
        **record,
        "fe": {**record["fe"], **measures_in(plastic)},
        "verdict": verdict,
        "theories": {**theories, HERTZ: {**theories[HERTZ], **against}},
    }


def asked_row(row: Item) -> Item:
    """A row whose verdict, deviations and measures are those against bodies that yield; itself without a yield stress.

    `elastic_verdict_answer` is the verdict against elastic bodies. Other theories are judged against elastic bodies
    alone, so that the row names none.
    """
    if not row.get("plastic_hertz_verdict_answer"):
        return row
    own = ("deviation_", "uncertainty_")
    found: Record = {
        name: None for name in row if name.startswith(("cheapest_theory", *(f"{HERTZ}_{of}" for of in own)))
    }
    for name, value in row.items():
        of_hertz, measure = name.removeprefix("plastic_hertz_"), name.removeprefix("plastic_")
        if name.startswith("plastic_hertz_"):
            of = "verdict_" if of_hertz == "limit_used" else f"{HERTZ}_" if of_hertz.startswith(own) else ""
            found[f"{of}{of_hertz}"] = value
        elif name != measure and measure in MEASURES:
            found[f"fe_{measure}"] = value
    return {**row, **found, "elastic_verdict_answer": row["verdict_answer"]}
