"""Rows as CSV, for other programs."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from pathlib import Path

from fecontact.files import write_text
from fecontact.outputs.tables.table import Record, missing


def write_csv(rows: Iterable[Record], path: str | Path) -> Path:
    """Write rows as CSV: the columns in the order in which they first occur, missing values and NaN empty."""
    rows = list(rows)
    columns = list(dict.fromkeys(key for row in rows for key in row))
    text = io.StringIO()
    table = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    table.writeheader()
    table.writerows({key: None if missing(value) else value for key, value in row.items()} for row in rows)
    return write_text(path, text.getvalue())
