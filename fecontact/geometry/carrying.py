"""Which places of a wheel's line can carry it on a rail: its tread, its flange up to the steepest place, or beyond."""

from __future__ import annotations

import numpy as np

from fecontact.geometry.poses import search_parameters
from fecontact.geometry.touch_points import TouchPoint
from fecontact.profiles.curve import Profile

# Treads rise to the field side by 0.07, chamfers by 0.8.
_CHAMFER_RAD = 0.35
# Less is no flange but a tread that is worn.
_FLANGE_RAD = 0.25 * np.pi
# A straight flank through points swings by as much: where a flange is less steep than at its steepest place by no more
# than this, that is its flank still. On the arc of an S1002 beyond it (R 20) it is 0.08 mm.
_FLANK_RAD = 4e-3


def why_it_cannot_carry(wheel: Profile, touch: TouchPoint, *, climbs: bool, flange_climb: bool) -> str:
    """Why a wheel cannot run on a touch point where it climbs or not; empty if it can. `flange_climb` lets it climb."""
    y_mm = touch.wheel_y_mm
    if any(abs(y_mm - j.y_mm) < 1e-6 and j.is_corner for j in wheel.junctions):
        return f"the wheel leaves the rail: the corner of its tread at y = {y_mm:.2f} mm carries it"
    # on the chamfer beyond the tread's corner a wheel slides down between the rails
    beyond = any(0.0 < j.y_mm < y_mm and j.is_corner for j in wheel.junctions)
    if beyond and touch.contact_angle_rad > _CHAMFER_RAD:
        return f"the wheel leaves the rail: its chamfer carries it, at y = {y_mm:.2f} mm"
    if not climbs:
        return ""
    where = f"the wheel derails: the rail touches it at y = {y_mm:.2f} mm, beyond the"
    p = wheel.evaluate(search_parameters(wheel)[1:-1])
    if y_mm <= float(p.y[np.argmin(p.z)]):
        return f"{where} top of its flange"
    return "" if flange_climb else f"{where} steepest place of its flange (--flange-climb takes it nevertheless)"


def climbs_at(wheel: Profile, y_mm: float) -> bool:
    """Whether a place of a wheel's line (mm across) lies beyond the steepest place of its flange."""
    p = wheel.evaluate(search_parameters(wheel)[1:-1])
    # angles, not slopes: a flange may be upright
    slope = np.where(p.y < 0.0, np.arctan2(p.dz, p.dy), 0.0)
    steepest = float(np.max(slope))
    # without a flange there is nothing to climb on
    return steepest > _FLANGE_RAD and y_mm < float(np.min(p.y[slope > steepest - _FLANK_RAD]))
