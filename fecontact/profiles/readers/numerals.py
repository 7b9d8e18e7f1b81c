"""Numbers as instruments, spreadsheets and Fortran programs write them."""

from __future__ import annotations

import csv
import re

# Signs that word processors and spreadsheets write for a minus: the minus of Unicode, hyphens, the figure dash, the en
# dash (also from Windows-1252), and the small and the wide hyphen. They count at the start of a number or an exponent.
_MINUS = re.compile(r"(?:(?<=[\s,;\"'=(+eEdD])|(?<![^\n]))[\u2212\u2010-\u2013\u0096\ufe63\uff0d](?=[\d.])")
_FORTRAN_EXPONENT = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+))[dD]([-+]?\d+)")
_QUOTED = re.compile(r"\"[^\"]*\"|'[^']*'")
_QUOTED_NUMBER = re.compile(r"[\"']\s*[-+]?[.,]?\d[\d.,]*(?:[eEdD][-+]?\d+)?\s*[\"']")


def replace_minus_signs(text: str) -> str:
    """Replace typographic minus signs before numbers by the sign of ASCII.

    Parameters
    ----------
    text
        Text of a file.

    Returns
    -------
    str
        The text with `-` before these numbers.
    """
    return text if text.isascii() else _MINUS.sub("-", text)


def unquote_numbers(line: str) -> str:
    """Remove the quotes around the numbers of a line.

    Separators between quoted fields become semicolons, because commas may be decimal signs within the quotes.

    Parameters
    ----------
    line
        Line of a file.

    Returns
    -------
    str
        The line without quotes; the unchanged line if it has no quoted numbers.
    """
    if not (number := _QUOTED_NUMBER.search(line)):
        return line
    separators = _QUOTED.sub("", line)
    separator = next((sign for sign in ";\t," if sign in separators), " ")
    fields = next(csv.reader([line], delimiter=separator, quotechar=number[0][0], skipinitialspace=True))
    # several blanks are one separator
    return ";".join(field.strip() for field in fields if field.strip() or separator != " ")


def parse_number(field: str, *, comma: bool = False) -> float | None:
    """Parse a number, also with the exponent letter D of Fortran.

    Parameters
    ----------
    field
        Text of the number.
    comma
        Whether a comma is the decimal sign.

    Returns
    -------
    float or None
        Number; None for other texts.
    """
    # float() accepts underscores and digits of different scripts too, which no instrument writes
    if not field.isascii() or "_" in field:
        return None
    field = field.replace(",", ".") if comma else field
    if match := _FORTRAN_EXPONENT.fullmatch(field):
        field = f"{match[1]}e{match[2]}"
    try:
        return float(field)
    except ValueError:
        return None
