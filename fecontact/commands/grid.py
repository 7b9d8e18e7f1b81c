"""Shifts and loads of a map, or of a contact table, as they are written on the command line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from cyclopts import Parameter


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class GridOptions:
    """Positions, each under all loads.

    Attributes
    ----------
    shifts
        Lateral shifts in mm: numbers and ranges FROM:TO:STEP, separated by commas, such as -6:6:0.5.
    loads_kn
        Wheel loads in kN, likewise.
    """

    shifts: Annotated[str, Parameter(allow_leading_hyphen=True)]
    loads_kn: Annotated[str, Parameter(name="--loads-kn", allow_leading_hyphen=True)] = "10,20,50,80,100,125,150"

    @property
    def shifts_mm(self) -> tuple[float, ...]:
        """Lateral shifts."""
        from fecontact.inputs.texts import parse_numbers

        return parse_numbers(self.shifts, "shifts")

    @property
    def loads_N(self) -> list[float]:
        """Wheel loads."""
        from fecontact.inputs.texts import parse_numbers

        return [1e3 * load for load in parse_numbers(self.loads_kn, "loads")]
