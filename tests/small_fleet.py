"""A fleet of two wheels on two rails with a short screening."""

from pathlib import Path

from fecontact.features.fleet.examples import write_fleet

SHIFTS, LOADS = "normal = [0.0, 2.0]\ncount = 5", "values = [60, 100]"


def write_small_fleet(folder: Path, *, shifts: str = "values = [0, 3]", loads: str = "values = [60]") -> Path:
    """Write the profiles, tables and file of a fleet; returns its file."""
    path = write_fleet(folder, wheels=2, rails=2, seed=1)
    text = path.read_text("utf-8")
    assert SHIFTS in text
    assert LOADS in text
    path.write_text(text.replace(SHIFTS, shifts).replace(LOADS, loads), "utf-8")
    return path
