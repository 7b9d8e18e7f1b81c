"""Checks of the files in ParaView itself: pvpython tests/paraview_check.py FOLDER [PICTURES].

Loads every collection of a study or a case, walks all steps and integrates the pressures over the contact. With a
folder for pictures it renders both views of `view.py` at every step, as large as they are in ParaView windows of 1000
and 1600 pixels: along Hertz's ellipse there must be pixels of its colour, and no text may touch the border. Exit code 1
and a line for each fault.
"""

import os
import sys
from pathlib import Path

import numpy as np
from paraview import servermanager, simple
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkPNGReader

BODY = {"displacement_mm": 3, "stress_MPa": 6, "von_mises_MPa": 1}
CONTACT = {"contact_pressure_MPa": 1, "hertz_pressure_MPa": 1, "hertz_minus_fe_MPa": 1, "gap_mm": 1}
CONTACT |= {"in_contact": 1, "pressure_squared_MPa2": 1, "pressure_vector_MPa": 3}
RAIL = BODY | {"contact_pressure_MPa": 1}
LINE = {"contact_pressure_MPa": 1, "pressure_vector_MPa": 3}
ARRAYS = {
    "case.vtm": {"pressure": CONTACT, "hertz_ellipse": LINE, "rail": RAIL},
    "bodies.vtm": {"rail": RAIL, "wheel": BODY, "elements": CONTACT},
}
# Facets are chords of the rail, and nodes at the edge of a patch stand for cells that are only partly in it.
TOLERANCE = 1e-3
# Pixels of a view beside the panels, by the width of ParaView's window.
VIEWS = {1000: (340, 460), 1600: (640, 760)}
# Ellipses have the colour of missing values, yellow, when a file is opened by itself.
LINE_LEVEL = 150
# Part of the ellipse that must be seen, pixels to look around a point of it, and units of colour that may differ.
SEEN, AROUND, OFF_COLOUR = 0.9, 2, 40
# Load and directions of the case at each time step.
Cases = dict[float | None, dict[str, np.ndarray]]


def say(line: str) -> None:
    # ParaView keeps what is printed until it ends as usual
    os.write(1, f"{line}\n".encode())


def main(folder: Path, pictures: Path | None) -> list[str]:
    collections = [path for path in sorted(folder.glob("study*.pvd")) if not path.stem.endswith("_bodies")]
    faults = []
    for path in collections or [folder / "case.vtm"]:
        bodies = path.with_name("bodies.vtm" if path.suffix == ".vtm" else f"{path.stem}_bodies.pvd")
        cases: Cases = {}
        faults += check_collection(path, ARRAYS["case.vtm"], cases)
        faults += check_collection(bodies, ARRAYS["bodies.vtm"], cases)
        faults += check_first_sight(path, pictures)
    return faults + (render(folder, pictures) if pictures else [])


def check_first_sight(path: Path, pictures: Path | None) -> list[str]:
    """Faults of the first picture of a collection: the pressure on the rail, in colours."""
    source = simple.OpenDataFile(str(path))
    view = simple.CreateView("RenderView")
    view.ViewSize = [800, 600]
    display = simple.Show(source, view)
    # as ParaView does when a file is opened in its window
    display.SetScalarBarVisibility(view, True)
    simple.ResetCamera(view)
    simple.Render(view)
    faults = []
    if list(display.ColorArrayName) != ["POINTS", "contact_pressure_MPa"]:
        faults.append(f"{path.name}: by itself coloured by {list(display.ColorArrayName)}")
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
        red, green, blue = pixels(view, pictures / f"{path.stem}_by_itself.png")[:, :600].T
        is_line = (red > LINE_LEVEL) & (green > LINE_LEVEL) & (blue < red - LINE_LEVEL)
        if np.count_nonzero((red > blue + 30) & ~is_line) < 20:
            faults.append(f"{path.name}: by itself no pixel has the colour of a high pressure")
        if np.count_nonzero(is_line) < 20:
            faults.append(f"{path.name}: by itself Hertz's ellipse has no colour different from the pressure")
    simple.Delete(view)
    simple.Delete(source)
    return faults


def check_collection(path: Path, arrays: dict[str, dict[str, int]], cases: Cases) -> list[str]:
    """Faults of a collection, step by step; `cases` gets the load and the directions of each step."""
    source = simple.OpenDataFile(str(path))
    steps = list(getattr(source, "TimestepValues", None) or [None])
    faults = []
    for step in steps:
        where = path.name + (f" at {step:g} mm" if step is not None else "")
        faults += [f"{where}: {fault}" for fault in check_step(source, step, arrays, cases)]
        say(f"{where}: read")
    simple.Delete(source)
    return faults


def check_step(
    source,
    step: float | None,
    arrays_by_block: dict[str, dict[str, int]],
    cases: Cases,
) -> list[str]:
    """Faults of the blocks and arrays at a time step; None for a file without steps."""
    faults = []
    for name, arrays in arrays_by_block.items():
        block = simple.ExtractBlock(Input=source)
        block.Selectors = [f"/Root/{name}"]
        block.UpdatePipeline(step) if step is not None else block.UpdatePipeline()
        components = {key: array.GetNumberOfComponents() for key, array in block.PointData.items()}
        # bodies that yield have more
        if not arrays.items() <= components.items():
            faults.append(f"{name} has {components}")
        field_data = fetched(block).GetFieldData()
        if (field_data.GetNumberOfArrays() > 0) != (name == "pressure"):
            faults.append(f"{name} has {field_data.GetNumberOfArrays()} field data")
        if name == "pressure":
            names = ("load_kN", "normal_force_N", "load_direction", "contact_normal")
            cases[step] = {key: vtk_to_numpy(field_data.GetArray(key)).ravel() for key in names}
            faults += check_field_data(field_data, step)
        if arrays is CONTACT:
            faults += check_forces(block, name, step, cases[step])
        simple.Delete(block)
    return faults


def fetched(block):
    data = servermanager.Fetch(block)
    while hasattr(data, "GetBlock"):
        data = next(data.GetBlock(k) for k in range(data.GetNumberOfBlocks()) if data.GetBlock(k) is not None)
    return data


def check_field_data(field_data, step: float | None) -> list[str]:
    """Faults of the shift and of the annotation in the field data."""
    faults = []
    shift = field_data.GetArray("lateral_shift_mm").GetValue(0)
    if step is not None and shift != step:
        faults.append(f"the case of {shift:g} mm is at another time")
    if not field_data.GetAbstractArray("annotation").GetValue(0).count("Hertz"):
        faults.append("the annotation does not tell the verdict")
    return faults


def check_forces(block, name: str, step: float | None, case: dict[str, np.ndarray]) -> list[str]:
    """Faults of pressures that do not integrate to the load (N)."""
    integrated = simple.IntegrateVariables(Input=block)
    integrated.UpdatePipeline(step) if step is not None else integrated.UpdatePipeline()
    sums = fetched(integrated).GetPointData()
    force = np.array(sums.GetArray("pressure_vector_MPa").GetTuple(0))
    hertz = sums.GetArray("hertz_pressure_MPa").GetValue(0)
    simple.Delete(integrated)
    (load_kN,), (normal_force,) = case["load_kN"], case["normal_force_N"]
    deviations = {
        "the pressure along the load": force @ case["load_direction"] / (1e3 * load_kN) - 1.0,
        "the pressure along the contact normal": force @ case["contact_normal"] / normal_force - 1.0,
        "Hertz's pressure": hertz / normal_force - 1.0,
    }
    faults = []
    for words, deviation in deviations.items():
        say(f"  {name}: integral of {words}: {1e2 * deviation:+.4f} % from the force")
        if not abs(deviation) < TOLERANCE:
            faults.append(f"{name}: integral of {words}: {1e2 * deviation:+.3f} % from the force")
    return faults


def render(folder: Path, pictures: Path) -> list[str]:
    """Run the script of the view, write pictures of each step, and return faults."""
    pictures.mkdir(parents=True, exist_ok=True)
    script = folder / "view.py"
    script_names = {"__file__": str(script), "__name__": "__main__"}
    exec(compile(script.read_text("utf-8"), script, "exec"), script_names)
    faults = []
    for step in list(getattr(script_names["SOURCE"], "TimestepValues", None) or [None]):
        if step is not None:
            simple.GetAnimationScene().AnimationTime = step
        for width, size in VIEWS.items():
            for name, view in zip(("pressure", "stress"), script_names["VIEWS"], strict=True):
                # a picture for each window: letters keep their size in points
                view.ViewSize = size
                path = pictures / f"{name}{'' if step is None else f'_{step:+.2f}mm'}_{width}.png"
                picture = pixels(view, path)
                found = seen(view, picture, step, script_names) if name == "pressure" else []
                found += [*at_border(view, path.with_suffix(".text.png"))]
                faults += [f"{path.name}: {fault}" for fault in found]
    return faults


def pixels(view, path: Path) -> np.ndarray:
    """The picture of a view (height, width, 3), from its lower edge on; it is written as well."""
    simple.Render(view)
    simple.SaveScreenshot(str(path), view, ImageResolution=view.ViewSize)
    reader = vtkPNGReader()
    reader.SetFileName(str(path))
    reader.Update()
    width, height, _ = reader.GetOutput().GetDimensions()
    return vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars()).reshape(height, width, -1)[..., :3].astype(int)


def seen(view, picture: np.ndarray, step: float | None, script_names: dict) -> list[str]:
    """Faults of Hertz's ellipses: along how much of each there are pixels of the colour of an ellipse."""
    lines = simple.FindSource("ellipses on the relief")
    lines.UpdatePipeline(step) if step is not None else lines.UpdatePipeline()
    data = fetched(lines)
    of_lobe = vtk_to_numpy(data.GetCellData().GetArray("lobe"))
    points = vtk_to_numpy(data.GetPoints().GetData())
    ends = points[[[data.GetCell(k).GetPointId(i) for i in (0, 1)] for k in range(data.GetNumberOfCells())]]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    colours = 255.0 * np.array([script_names["ORANGE"], script_names["PINK"]])
    coloured = (np.abs(picture[..., None, :] - colours).max(axis=-1) < OFF_COLOUR).any(axis=-1)
    is_coloured = np.array([is_there(coloured, pixel(view, middle)) for middle in ends.mean(axis=1)])
    faults = [] if has_legend(step, bool(of_lobe.any())) else ["the legend explains other lines than are drawn"]
    for lobe in np.unique(of_lobe):
        in_lobe = of_lobe == lobe
        fraction = float(lengths[in_lobe] @ is_coloured[in_lobe] / lengths[in_lobe].sum())
        words = "Hertz's ellipse" if lobe == 0 else f"the ellipse of lobe {lobe}"
        say(
            f"  {'' if step is None else f'{step:+g} mm, '}{view.ViewSize[0]} pixels: {1e2 * fraction:.1f} % of {words}"
        )
        if fraction < SEEN:
            faults.append(f"{1e2 * fraction:.1f} % of {words} is seen")
    return faults


def has_legend(step: float | None, has_lobes: bool) -> bool:
    """Whether the legend explains the ellipses of lobes if there are any, and only then."""
    legend = simple.FindSource("legend")
    legend.UpdatePipeline(step) if step is not None else legend.UpdatePipeline()
    text = fetched(legend).GetColumn(0).GetValue(0)
    return "orange" in text and ("pink" in text) == has_lobes


def pixel(view, point: np.ndarray) -> tuple[int, int]:
    """Column and row of a point in a view's picture."""
    renderer = view.GetClientSideObject().GetRenderer()
    renderer.SetWorldPoint(*point.tolist(), 1.0)
    renderer.WorldToDisplay()
    column, row, _ = renderer.GetDisplayPoint()
    return round(column), round(row)


def is_there(coloured: np.ndarray, place: tuple[int, int]) -> bool:
    column, row = place
    if not (0 <= column < coloured.shape[1] and 0 <= row < coloured.shape[0]):
        return False
    near = (slice(max(0, index - AROUND), index + AROUND + 1) for index in (row, column))
    return bool(coloured[tuple(near)].any())


def at_border(view, path: Path) -> list[str]:
    """Faults of letters, drawn without the bodies: whether any touch the border, and whether there are any."""
    bodies = [body for body in view.Representations if hasattr(body, "ColorArrayName") and body.Visibility]
    for body in bodies:
        body.Visibility = 0
    picture = pixels(view, path)
    for body in bodies:
        body.Visibility = 1
    letters = picture.max(axis=-1) < 200
    edges = np.concatenate([letters[0], letters[-1], letters[:, 0], letters[:, -1]])
    path.unlink()
    return ["it has no text"] * (not letters.any()) + ["text touches the border"] * bool(edges.any())


if __name__ == "__main__":
    FAULTS = main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
    say("\n".join(f"FAULT {fault}" for fault in FAULTS) or "all as it should be")
    # ParaView 5.11 loses its drawing context while it ends, and with it the exit code
    os._exit(1 if FAULTS else 0)
