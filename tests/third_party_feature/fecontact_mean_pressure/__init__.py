"""Mean pressure over the contact patch, as a command, a Python function and a column of every table of results."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from fecontact.outputs.parts import Telling
from fecontact.outputs.tables import number_column

if TYPE_CHECKING:
    from fecontact.judging.judged_load import JudgedLoad
    from fecontact.placement.wheel_on_rail import Placement


@dataclass(frozen=True, kw_only=True)
class MeanPressure:
    """Normal force over patch area (MPa)."""

    hertz_MPa: float
    fe_MPa: float


def read_mean_pressure(load: JudgedLoad, placement: Placement) -> MeanPressure:
    """Mean pressure of Hertz's ellipse and of the finite elements."""
    force_N, hertz, fe = load.normal_force_N, load.comparison.hertz, load.comparison.fe
    return MeanPressure(hertz_MPa=force_N / hertz.area_mm2, fe_MPa=force_N / fe.area_mm2)


MEAN_PRESSURE = Telling(
    columns=(number_column("mean\nMPa", "mean_pressure_fe_MPa", "{:.0f}"),),
    parts=lambda record: [
        f"mean pressure {record['fe_MPa']:.0f} MPa, of Hertz's ellipse {record['hertz_MPa']:.0f} MPa"
    ],
)


def mean_pressure_MPa(folder: str | Path) -> float:
    """Mean pressure of the finite elements (MPa) from the folder of a solved case."""
    import fecontact

    return fecontact.load(folder).load.features["mean_pressure"].fe_MPa


def mean_pressure(folder: Path) -> int:
    """Print the mean pressure over the contact patch of a solved case.

    Parameters
    ----------
    folder
        Folder that `fecontact solve --out` has written.
    """
    print(f"mean pressure {mean_pressure_MPa(folder):.1f} MPa")
    return 0
