"""A picture of the solved pair in three dimensions, drawn by pyvista in a process of its own.

Drawing may end a process without a message where a system library is missing: what is lost is the picture alone.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from fecontact.files import write_atomically

_SECONDS = 120.0
_SIZE = (1500, 1000)
# Tried in turn: a screen if there is one, else a renderer that needs none.
_ENVIRONMENTS: tuple[dict[str, str], ...] = (
    {},
    {"VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"},
    {"VTK_DEFAULT_OPENGL_WINDOW": "vtkOSOpenGLRenderWindow"},
)


# Room between the title and the numbers, and from the picture's edges.
_BAR: dict[str, Any] = {
    **{"title": "pressure in MPa\n", "color": "black", "fmt": "%.0f", "vertical": True, "n_labels": 5},
    **{"position_x": 0.87, "position_y": 0.06, "width": 0.07, "height": 0.5},
    **{"title_font_size": 26, "label_font_size": 24},
}


def begin_scene(case_folder: Path, path: Path) -> Callable[[], str | None]:
    """Begin `write_scene` beside what is done meanwhile; the function waits for it and returns the same."""
    pool = ThreadPoolExecutor(1)
    begun = pool.submit(write_scene, case_folder, path)
    pool.shutdown(wait=False)
    return begun.result


def write_scene(case_folder: Path, path: Path, *, seconds: float = _SECONDS) -> str | None:
    """Draw rail, wheel and pressure of a case's ParaView files into a PNG.

    Returns
    -------
    str or None
        Why there is no picture; None where there is one.
    """
    reason = "it cannot be drawn here"
    for environment in _ENVIRONMENTS:
        try:
            done = subprocess.run(
                [sys.executable, "-m", "fecontact.outputs.paraview.scene", str(case_folder), str(path)],
                env={**os.environ, **environment},
                capture_output=True,
                text=True,
                stdin=subprocess.DEVNULL,
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return f"drawing it took more than {seconds:g} s"
        except OSError as error:
            return f"no process for it ({error})"
        if done.returncode == 0 and path.is_file():
            return None
        reason = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
    return reason


def draw_scene(case_folder: Path, path: Path) -> None:
    """Draw the picture in this process, which may end without a message."""
    import pyvista

    rail, wheel, contact, ellipse = (
        pyvista.read(case_folder / name) for name in ("rail.vtu", "wheel.vtu", "contact.vtp", "hertz_ellipse.vtp")
    )
    centre = ellipse.center
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(_SIZE))
    plotter.set_background("white")
    # the wheel's half behind the contact, so that the pressure is seen
    behind = wheel.clip("x", origin=(centre[0] - 0.6 * ellipse.length, *centre[1:]))
    plotter.add_mesh(rail.extract_surface(algorithm="dataset_surface"), color="#aeb4bb", smooth_shading=False)
    plotter.add_mesh(behind.extract_surface(algorithm="dataset_surface"), color="#c9ced4", opacity=0.55)
    pressed = contact.clip_scalar(scalars="contact_pressure_MPa", value=1.0, invert=False)
    relief = pressed.warp_by_vector("pressure_relief_mm")
    plotter.add_mesh(
        relief,
        scalars="contact_pressure_MPa",
        cmap="viridis",
        clim=(0.0, float(contact.point_data["contact_pressure_MPa"].max())),
        scalar_bar_args=_BAR,
    )
    plotter.add_mesh(ellipse, color="#d55e00", line_width=4)
    plotter.camera.focal_point = centre
    plotter.camera.position = tuple(c + 400.0 * d for c, d in zip(centre, (0.55, 0.4, 0.73), strict=True))
    plotter.camera.up = (0.0, 0.0, 1.0)
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = 1.7 * ellipse.length
    write_atomically(path, plotter.screenshot)
    plotter.close()


if __name__ == "__main__":
    draw_scene(Path(sys.argv[1]), Path(sys.argv[2]))
