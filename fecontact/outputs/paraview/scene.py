"""A picture of the solved pair in three dimensions, drawn by VTK in a process of its own.

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
from fecontact.outputs.figures.style import HERTZ

_SECONDS = 120.0
_SIZE = (1500, 1000)
# Of the depth of view, so much nearer (in parts of 2^-24).
_IN_FRONT = -1e6
# Tried in turn: a screen if there is one, else a renderer that needs none.
_ENVIRONMENTS: tuple[dict[str, str], ...] = (
    {},
    {"VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"},
    {"VTK_DEFAULT_OPENGL_WINDOW": "vtkOSOpenGLRenderWindow"},
)
# Of the colour map of pressures in other pictures, at equal steps.
_COLOURS = ["440154", "472d7b", "3b528b", "2c728e", "21918c", "28ae80", "5ec962", "addc30", "fde725"]


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
    """Draw the picture in this process, which may end without a message.

    By VTK itself: to load what pyvista draws with takes longer than to draw.
    """
    # what draws texts, and everything
    import vtkmodules.vtkRenderingFreeType
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
    from vtkmodules.vtkCommonDataModel import vtkPlane
    from vtkmodules.vtkFiltersCore import vtkClipPolyData
    from vtkmodules.vtkFiltersGeneral import vtkTableBasedClipDataSet, vtkWarpVector
    from vtkmodules.vtkRenderingCore import vtkLightKit, vtkRenderer

    rail, wheel, contact, ellipse = (
        _read(case_folder / name) for name in ("rail.vtu", "wheel.vtu", "contact.vtp", "hertz_ellipse.vtp")
    )
    centre, size = ellipse.GetCenter(), ellipse.GetLength()
    # the wheel's half behind the contact, so that the pressure is seen
    plane = vtkPlane()
    plane.SetOrigin(centre[0] - 0.6 * size, *centre[1:])
    plane.SetNormal(1.0, 0.0, 0.0)
    behind = _filtered(vtkTableBasedClipDataSet(), wheel, ClipFunction=plane, InsideOut=True)
    contact.GetPointData().SetActiveScalars("contact_pressure_MPa")
    contact.GetPointData().SetActiveVectors("pressure_relief_mm")
    relief = _filtered(vtkWarpVector(), _filtered(vtkClipPolyData(), contact, Value=1.0))
    renderer: Any = vtkRenderer()
    renderer.SetBackground(1.0, 1.0, 1.0)
    renderer.AddActor(_actor(_surface(rail), Color=_rgb("aeb4bb")))
    renderer.AddActor(_actor(_surface(behind), Color=_rgb("c9ced4"), Opacity=0.55))
    shown = _actor(relief)
    _colour_by_pressure(renderer, shown.GetMapper(), contact.GetPointData().GetScalars().GetRange()[1])
    renderer.AddActor(shown)
    edge = _actor(ellipse, Color=_rgb(HERTZ.removeprefix("#")), LineWidth=4.0)
    # in front of the relief, which goes on to the next node beyond the patch and would hide it
    edge.GetMapper().SetResolveCoincidentTopologyToPolygonOffset()
    edge.GetMapper().SetRelativeCoincidentTopologyLineOffsetParameters(0.0, _IN_FRONT)
    renderer.AddActor(edge)
    lights = vtkLightKit()
    lights.AddLightsToRenderer(renderer)
    lights.Update()
    camera = renderer.GetActiveCamera()
    camera.SetFocalPoint(centre)
    camera.SetPosition([c + 400.0 * d for c, d in zip(centre, (0.55, 0.4, 0.73), strict=True)])
    camera.SetViewUp(0.0, 0.0, 1.0)
    camera.ParallelProjectionOn()
    camera.SetParallelScale(1.7 * size)
    renderer.ResetCameraClippingRange()
    write_atomically(path, lambda temporary: _write(renderer, temporary))


def _read(file: Path) -> Any:
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader

    if not file.is_file():
        raise FileNotFoundError(f"{file} is missing")
    reader = vtkXMLPolyDataReader() if file.suffix == ".vtp" else vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(file))
    reader.Update()
    return reader.GetOutput()


def _filtered(by: Any, data: Any, **settings: Any) -> Any:
    _set(by, **settings)
    by.SetInputData(data)
    by.Update()
    return by.GetOutput()


def _surface(grid: Any) -> Any:
    from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter

    return _filtered(vtkDataSetSurfaceFilter(), grid)


def _set(what: Any, **settings: Any) -> None:
    for name, value in settings.items():
        getattr(what, f"Set{name}")(value)


def _rgb(colour: str) -> tuple[float, float, float]:
    red, green, blue = (value / 255.0 for value in bytes.fromhex(colour))
    return red, green, blue


def _actor(data: Any, **look: Any) -> Any:
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    mapper, actor = vtkPolyDataMapper(), vtkActor()
    mapper.SetInputData(data)
    mapper.SetScalarVisibility(False)
    actor.SetMapper(mapper)
    actor.GetProperty().SetInterpolationToFlat()
    _set(actor.GetProperty(), **look)
    return actor


def _colour_by_pressure(renderer: Any, mapper: Any, top_MPa: float) -> None:
    """Colours from 0 to the highest pressure, and their bar."""
    from vtkmodules.vtkRenderingAnnotation import vtkScalarBarActor
    from vtkmodules.vtkRenderingCore import vtkColorTransferFunction

    colours, bar = vtkColorTransferFunction(), vtkScalarBarActor()
    for number, colour in enumerate(_COLOURS):
        colours.AddRGBPoint(top_MPa * number / (len(_COLOURS) - 1), *_rgb(colour))
    _set(mapper, LookupTable=colours, ScalarVisibility=True)
    _set(bar, LookupTable=colours, LabelFormat="%.0f", NumberOfLabels=5, UnconstrainedFontSize=True)
    # room between the title and the numbers, and from the picture's edges
    _set(bar, Title="pressure in MPa\n", Width=0.07, Height=0.5)
    bar.SetPosition(0.87, 0.06)
    for text, points in ((bar.GetTitleTextProperty(), 26), (bar.GetLabelTextProperty(), 24)):
        _set(text, FontSize=points, Color=(0.0, 0.0, 0.0), Bold=False, Italic=False, Shadow=False)
    renderer.AddActor(bar)


def _write(renderer: Any, path: Path) -> None:
    from vtkmodules.vtkIOImage import vtkPNGWriter
    from vtkmodules.vtkRenderingCore import vtkRenderWindow, vtkWindowToImageFilter

    window, image, writer = vtkRenderWindow(), vtkWindowToImageFilter(), vtkPNGWriter()
    window.SetOffScreenRendering(True)
    window.SetSize(*_SIZE)
    window.AddRenderer(renderer)
    window.Render()
    image.SetInput(window)
    _set(image, ReadFrontBuffer=False, ShouldRerender=False)
    writer.SetFileName(str(path))
    writer.SetInputConnection(image.GetOutputPort())
    writer.Write()


if __name__ == "__main__":
    draw_scene(Path(sys.argv[1]), Path(sys.argv[2]))
