"""Header of a MiniProf file: place, vehicle, and results that the instrument computed."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fecontact.arrays import Floats
from fecontact.profiles.readers.numerals import parse_number

# Diameters of wheels and gauges of tracks (mm). A value outside has a different unit, or is a placeholder.
ALLOWED_DIAMETERS_MM, _ALLOWED_GAUGES_MM = (200.0, 2000.0), (500.0, 2000.0)
_INCH_MM = 25.4
# Attributes with their keys in the file in lower case, and their names in messages.
_TEXTS = {
    **{"side": ("side", "side"), "rail": ("rail", "rail"), "stock": ("stock", "stock"), "car_number": ("carno", "car")},
    **{"axle_number": ("axleno", "axle"), "wheel_id": ("wheelid", "wheel"), "line": ("line", "line")},
    **{"track": ("track", "track"), "curve": ("curve", "curve"), "position": ("position", "position")},
    "date": ("date", "date"),
}
_LENGTHS = {
    **{"track_gauge_mm": ("gauge", "gauge"), "tread_diameter_mm": ("diametertaperline", "diameter")},
    **{"flange_diameter_mm": ("diameterflange", "diameter at the tip of the flange")},
    **{"flange_thickness_mm": ("sd", "Sd"), "flange_height_mm": ("sh", "Sh"), "flange_gradient_mm": ("qr", "qR")},
    **{"vertical_wear_mm": ("w1", "W1"), "side_wear_mm": ("w2", "W2"), "corner_wear_mm": ("w3", "W3")},
}
_SIDES = {"l": "left", "left": "left", "r": "right", "right": "right", "low": "low", "high": "high"}
# Files from before the keys have lines of words, and a first line with the type and the number of the instrument, and
# the year, the month and the day. Sd, Sh and qR are in the line of their names, or in the line before it.
_WORDS = {"stock": "stock", "car number": "carno", "axle number": "axleno", "wheel id": "wheelid"}
_WORD_LINE = re.compile(r"(Stock|Car Number|Axle Number|Wheel ID)\s*\.*\s*:\s*(.*)", re.IGNORECASE)
_FIRST_LINE = re.compile(r"MINIPROF\s+\d+\s+\d+\s+(\d{4})\s+(\d{1,2})\s+(\d{1,2})", re.IGNORECASE)
_FLANGE_LINE = re.compile(r'"?\s*([\d.]+)\s+([\d.]+)\s+([\d.]+)\s*"?\s*(\(Sd/Sh/qR\))?', re.IGNORECASE)
_FLANGE_NAMES = re.compile(r"\(Sd/Sh/qR\)", re.IGNORECASE)
# EN 15313 measures the thickness of a flange 10 mm below the tape circle, and its gradient from there to 2 mm above the
# tip. Four files of the instrument in the test bank of CONTACT have the dimensions of their own profile: these
# definitions give them within 0.18 mm.
_THICKNESS_DEPTH_MM, _GRADIENT_HEIGHT_MM = 10.0, 2.0
_LARGEST_DIFFERENCE_MM = 0.3


@dataclass(frozen=True, kw_only=True)
class InstrumentHeader:
    """Entries of the header of a MiniProf file; None or an empty text for a missing entry.

    Attributes
    ----------
    side
        Side of the rail or the wheel: `left`, `right`, or the text of the file.
    rail
        Rail of a curve: `low`, `high`, or the text of the file.
    stock, car_number, axle_number, wheel_id
        Vehicle and wheel.
    line, track, curve, position, date
        Place and date of the measurement.
    track_gauge_mm
        Gauge of the track.
    tread_diameter_mm, flange_diameter_mm
        Diameters of the wheel at the tape circle and at the tip of the flange.
    flange_thickness_mm, flange_height_mm, flange_gradient_mm
        Sd, Sh and qR of the wheel.
    vertical_wear_mm, side_wear_mm, corner_wear_mm
        W1, W2 and W3 of the rail: vertical, horizontal, and at 45 degrees.
    """

    side: str = ""
    rail: str = ""
    stock: str = ""
    car_number: str = ""
    axle_number: str = ""
    wheel_id: str = ""
    line: str = ""
    track: str = ""
    curve: str = ""
    position: str = ""
    date: str = ""
    track_gauge_mm: float | None = None
    tread_diameter_mm: float | None = None
    flange_diameter_mm: float | None = None
    flange_thickness_mm: float | None = None
    flange_height_mm: float | None = None
    flange_gradient_mm: float | None = None
    vertical_wear_mm: float | None = None
    side_wear_mm: float | None = None
    corner_wear_mm: float | None = None

    @property
    def columns(self) -> dict[str, str | float]:
        """Entries of the file by their names, as columns of a table."""
        return {name: value for name in (*_TEXTS, *_LENGTHS) if (value := getattr(self, name)) not in ("", None)}

    @property
    def rolling_radius_mm(self) -> float | None:
        """Rolling radius (mm) at the tape circle.

        Without a diameter at the tape circle, it follows from the diameter and the height of the flange.
        """
        diameter_mm = self.tread_diameter_mm
        if diameter_mm is None and self.flange_diameter_mm is not None and self.flange_height_mm is not None:
            diameter_mm = self.flange_diameter_mm - 2.0 * self.flange_height_mm
        low, high = ALLOWED_DIAMETERS_MM
        return 0.5 * diameter_mm if diameter_mm is not None and low <= diameter_mm <= high else None

    @property
    def gauge_mm(self) -> float | None:
        """Gauge of the track (mm), if it is plausible."""
        low, high = _ALLOWED_GAUGES_MM
        return self.track_gauge_mm if self.track_gauge_mm is not None and low <= self.track_gauge_mm <= high else None

    def describe(self) -> str:
        """Describe all entries in a line.

        Returns
        -------
        str
            Names, values and units; empty without entries.
        """
        words = {name: label for name, (_, label) in (_TEXTS | _LENGTHS).items()}
        return ", ".join(
            f"{words[name]} {value}" if isinstance(value, str) else f"{words[name]} {value:g} mm"
            for name, value in self.columns.items()
        )


def make_header(keys: Mapping[str, str], factor: float = 1.0) -> InstrumentHeader:
    """Header of the keys of a file.

    Parameters
    ----------
    keys
        Keys in lower case with their values.
    factor
        Size of the unit of the file in mm.

    Returns
    -------
    InstrumentHeader
        Entries with lengths in mm. A length of 0 and a text instead of a number are missing entries.
    """
    # a percent sign marks a value that the instrument took from its list
    texts = {name: keys.get(key, "").removeprefix("%").strip() for name, (key, _) in _TEXTS.items()}
    texts |= {name: _SIDES.get(texts[name].lower(), texts[name]) for name in ("side", "rail")}
    numbers = {name: parse_number(keys.get(key, "")) for name, (key, _) in _LENGTHS.items()}
    lengths = {
        name: factor * value if value is not None and np.isfinite(value) and value != 0.0 else None
        for name, value in numbers.items()
    }
    return InstrumentHeader(**texts, **lengths)  # type: ignore[arg-type]


def parse_words(line: str, next_line: str) -> dict[str, str]:
    """Keys of a line of a header in words, as old files have it.

    Parameters
    ----------
    line, next_line
        Lines of the header.

    Returns
    -------
    dict
        Keys in lower case with their values; empty for another line.
    """
    if match := _WORD_LINE.fullmatch(line):
        return {_WORDS[match[1].lower()]: match[2].strip()}
    if match := _FIRST_LINE.match(line):
        return {"date": f"{match[1]}-{int(match[2]):02d}-{int(match[3]):02d}"}
    if (match := _FLANGE_LINE.fullmatch(line)) and (match[4] or _FLANGE_NAMES.fullmatch(next_line)):
        return dict(zip(("sd", "sh", "qr"), match.groups()[:3], strict=True))
    return {}


def describe_diameter(header: InstrumentHeader) -> list[str]:
    """Describe the diameter of a wheel, which gives the rolling radius of the case.

    Parameters
    ----------
    header
        Header of a wheel.

    Returns
    -------
    list of str
        Notes.
    """
    given_mm, radius_mm = header.tread_diameter_mm, header.rolling_radius_mm
    if radius_mm is not None:
        source = (
            f"DiameterTaperline = {given_mm:g} mm"
            if given_mm is not None
            else f"DiameterFlange = {header.flange_diameter_mm:g} mm minus twice Sh = {header.flange_height_mm:g} mm"
        )
        return [f"{source} of the header gives the rolling radius {radius_mm:g} mm, unless you give a different radius"]
    if given_mm is None:
        return []
    low, high = ALLOWED_DIAMETERS_MM
    in_inches = f", {0.5 * given_mm * _INCH_MM:g} if it is in inches" if low <= given_mm * _INCH_MM <= high else ""
    return [
        f"DiameterTaperline = {given_mm:g} mm of the header is not used; allowed: {low:g} to {high:g} mm; give the"
        f" rolling radius with --rolling-radius-mm{in_inches}"
    ]


def measure_flange(points: Floats) -> dict[str, float]:
    """Measure the thickness, the height and the gradient of a flange as in EN 15313.

    Parameters
    ----------
    points
        Points (n, 2) in mm, with y = 0 at the tape circle and z up, from small to large y.

    Returns
    -------
    dict
        Sd without the distance of the tape circle from the back of the flange, Sh and qR in mm; empty for a profile
        without a flange, or without its tape circle.
    """
    y, z = points.T
    tip = int(np.argmin(z))
    face_y, face_z = y[tip:], z[tip:]
    if not face_y[0] < 0.0 < face_y[-1]:
        return {}
    tread_mm = float(np.interp(0.0, np.maximum.accumulate(face_y), face_z))
    # the first points of the face above both heights
    heights = tread_mm - _THICKNESS_DEPTH_MM, float(z[tip]) + _GRADIENT_HEIGHT_MM
    if not heights[1] < heights[0]:
        return {}
    places = []
    for height in heights:
        upper = int(np.argmax(face_z > height))
        chord = slice(upper - 1, upper + 1)
        places.append(float(np.interp(height, face_z[chord], face_y[chord])))
    return {"sd": places[0], "sh": tread_mm - float(z[tip]), "qr": places[0] - places[1]}


def compare_flange(header: InstrumentHeader, points: Floats, back_mm: float) -> list[str]:
    """Compare Sd, Sh and qR of a header with the points.

    Parameters
    ----------
    header
        Header of a wheel.
    points
        Points (n, 2) in mm, with y = 0 at the tape circle and z up.
    back_mm
        Distance of the tape circle from the back of the flange (mm).

    Returns
    -------
    list of str
        Note on the dimensions that differ by more than 0.3 mm.
    """
    measured = measure_flange(points if points[0, 0] < points[-1, 0] else points[::-1])
    if not measured:
        return []
    values = {
        "Sd": (header.flange_thickness_mm, measured["sd"] + back_mm),
        "Sh": (header.flange_height_mm, measured["sh"]),
        "qR": (header.flange_gradient_mm, measured["qr"]),
    }
    different = [
        f"{name} = {value:g} mm instead of {on_points:.2f} mm"
        for name, (value, on_points) in values.items()
        if value is not None and abs(value - on_points) > _LARGEST_DIFFERENCE_MM
    ]
    if not different:
        return []
    return [
        f"the header contradicts the points (EN 15313): {', '.join(different)}; the points are used, so check that the"
        " header belongs to them"
    ]
