"""Running conditions in a curve, with the default radii and theory of a run.

The module imports no arrays, so that the help of the command can read the defaults.
"""

from __future__ import annotations

from fecontact.criteria import FRICTION
from fecontact.errors import InputError
from fecontact.inputs.kinds import input_field, number_field
from fecontact.inputs.slots import input_dataclass

MAX_UNBALANCED_M_S2 = 2.0
"""Largest lateral acceleration (m/s2).

At 2.2 m/s2 and above, Newton's method stalls if a wheelset moves from tread to flange.
"""
DEFAULT_RADII_M = (300.0, 500.0, 1000.0, 3000.0)
"""Radii of curves (m) if no radii are given."""
DEFAULT_THEORY = "overlap"
"""Theory of the normal force if no theory is given."""


@input_dataclass
class Conditions:
    """Running conditions in a curve.

    Without a speed, the speed is derived from the lateral acceleration `unbalanced_m_s2` that the cant leaves.

    Examples
    --------
    >>> from fecontact.features.curves.conditions import Conditions
    >>> conditions = Conditions(friction=0.4, speed_km_h=80.0)
    >>> conditions.friction, conditions.cant_mm
    (0.4, 100.0)
    """

    friction: float = input_field(0.3, FRICTION)
    cant_mm: float = number_field(100.0, "Cant, over 1500 mm", high=300.0, remedy="usual values are 0 to 180 mm")
    unbalanced_m_s2: float = number_field(
        0.0,
        "Lateral acceleration in the plane of the track, outwards positive",
        label="unbalanced acceleration",
        low=-MAX_UNBALANCED_M_S2,
        high=MAX_UNBALANCED_M_S2,
        remedy="usual limits are 0.65 to 1 m/s2, and 2 m/s2 for tilting trains",
    )
    speed_km_h: float | None = number_field(None, "Running speed", remedy="omit it for the balanced speed")

    def __post_init__(self) -> None:
        """Refuse a speed together with an unbalanced acceleration.

        Each of them determines the other.

        Raises
        ------
        InputError
            If both are given.
        """
        if self.speed_km_h is not None and self.unbalanced_m_s2 != 0.0:
            raise InputError(
                f"unbalanced acceleration is {self.unbalanced_m_s2:g} m/s2 and speed {self.speed_km_h:g} km/h; allowed:"
                " only one of them, because each determines the other; omit one"
            )
