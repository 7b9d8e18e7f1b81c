"""A picture of the solved pair in three dimensions, drawn by pyvista in a process of its own.

Drawing may end a process without a message where a system library is missing: what is lost is the picture alone.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from fecontact.files import write_atomically
from fecontact.outputs.style import HERTZ

_SECONDS = 120.0
_SIZE = [1500, 1000]
# Of the depth of view, so much nearer (in parts of 2^-24).
_IN_FRONT = -1e6


def begin_scene(case_folder: Path, path: Path) -> Callable[[], str | None]:
    """Begin `write_scene` beside what is done meanwhile; the function waits for it and returns the same."""
    pool = ThreadPoolExecutor(1)
    begun = pool.submit(write_scene, case_folder, path)
    pool.shutdown(wait=False)
    return begun.result


def write_scene(case_folder: Path, path: Path) -> str | None:
    """Draw rail, wheel and pressure of a case's ParaView files into a PNG.

    Returns
    -------
    str or None
        Why there is no picture; None where there is one.
    """
    command = [sys.executable, "-m", "fecontact.outputs.paraview.scene", str(case_folder), str(path)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=_SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        return f"drawing it took more than {_SECONDS:g} s"
    except OSError as error:
        return f"no process for it ({error})"
    if done.returncode == 0 and path.is_file():
        return None
    return (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]


def draw_scene(case_folder: Path, path: Path) -> None:
    """Draw the picture in this process, which may end without a message."""
    import pyvista

    files: tuple[Any, ...] = tuple(
        pyvista.read(case_folder / name) for name in ("rail.vtu", "wheel.vtu", "contact.vtp", "hertz_ellipse.vtp")
    )
    rail, wheel, contact, ellipse = files
    centre, size = ellipse.center, ellipse.length
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=_SIZE, lighting="light kit")
    plotter.set_background("white")
    plotter.add_mesh(rail, color="#aeb4bb")
    # the wheel's half behind the contact, so that the pressure is seen
    behind = wheel.clip("x", origin=(centre[0] - 0.6 * size, *centre[1:]))
    plotter.add_mesh(behind, color="#c9ced4", opacity=0.55)
    relief = contact.clip_scalar(scalars="contact_pressure_MPa", value=1.0, invert=False)
    text = {"color": "black", "title_font_size": 26, "label_font_size": 24, "unconstrained_font_size": True}
    place = {"vertical": True, "position_x": 0.87, "position_y": 0.06, "width": 0.07, "height": 0.5}
    plotter.add_mesh(
        relief.warp_by_vector("pressure_relief_mm"),
        scalars="contact_pressure_MPa",
        cmap="viridis",
        clim=(0.0, float(contact["contact_pressure_MPa"].max())),
        # room between the title and the numbers
        scalar_bar_args={"title": "pressure in MPa\n", "n_labels": 5, "fmt": "%.0f", **text, **place},
    )
    edge = plotter.add_mesh(ellipse, color=HERTZ, line_width=4.0)
    # in front of the relief, which goes on to the next node beyond the patch and would hide it
    edge.mapper.SetResolveCoincidentTopologyToPolygonOffset()
    edge.mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0.0, _IN_FRONT)
    position = tuple(c + 400.0 * d for c, d in zip(centre, (0.55, 0.4, 0.73), strict=True))
    plotter.camera_position = [position, centre, (0.0, 0.0, 1.0)]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = 1.7 * size
    plotter.renderer.ResetCameraClippingRange()
    write_atomically(path, plotter.screenshot)


if __name__ == "__main__":
    draw_scene(Path(sys.argv[1]), Path(sys.argv[2]))
