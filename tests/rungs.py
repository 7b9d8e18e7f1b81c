"""Rungs that nobody solved: a pressure, and what goes with it."""

import numpy as np

from fecontact.contact.grid import ContactGrid, Rung


def rung_with(grid: ContactGrid, pressure_MPa: np.ndarray, **changes: object) -> Rung:
    """A rung of nothing but a pressure (nx, ns), and of what is given."""
    plain = {
        "gap_mm": np.zeros(grid.shape),
        "approach_mm": 0.1,
        "normal_force_N": float(grid.whole_area_mm2() @ pressure_MPa.ravel()),
        "status": "converged",
        "iterations": 1,
        "compliance_calls": 1,
        "contact_residual": 0.0,
        "penetration_residual": 0.0,
        "load_balance": 0.0,
    }
    return Rung(grid=grid, pressure_MPa=pressure_MPa, **{**plain, **changes})
