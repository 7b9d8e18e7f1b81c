"""What ParaView itself makes of the files: pvpython tests/paraview_check.py FOLDER [PICTURES].

Loads every collection of a study or a case, walks all steps, integrates both pressures over the contact, and, with a
folder for pictures, renders both views of `view.py` at every step. Exit code 1 and a line for each fault.
"""

import math
import os
import sys
from pathlib import Path

from paraview import servermanager, simple

BODY = {"displacement_mm": 3, "stress_MPa": 6, "von_mises_MPa": 1}
CONTACT = {"contact_pressure_MPa": 1, "hertz_pressure_MPa": 1, "pressure_difference_MPa": 1, "gap_mm": 1}
CONTACT |= {"in_contact": 1, "pressure_relief_mm": 3, "hertz_relief_mm": 3}
ARRAYS = {"rail": BODY, "wheel": BODY, "contact": CONTACT, "hertz_ellipse": {}}
# Facets are chords of the rail, and nodes at the edge of a patch stand for cells that are only partly in it.
TOLERANCE = 1e-3


def say(line: str) -> None:
    # ParaView keeps what is printed until it ends as usual
    os.write(1, f"{line}\n".encode())


def main(folder: Path, pictures: Path | None) -> list[str]:
    collections = sorted(folder.glob("study*.pvd")) or [folder / "case.vtm"]
    faults = [fault for path in collections for fault in check_collection(path)]
    return faults + (render(folder, pictures) if pictures else [])


def check_collection(path: Path) -> list[str]:
    source = simple.OpenDataFile(str(path))
    steps = list(getattr(source, "TimestepValues", None) or [None])
    faults = []
    for step in steps:
        where = path.name + (f" at {step:g} mm" if step is not None else "")
        faults += [f"{where}: {fault}" for fault in check_step(source, step)]
        say(f"{where}: read")
    simple.Delete(source)
    return faults


def check_step(source, step: float | None) -> list[str]:
    faults = []
    for name, arrays in ARRAYS.items():
        block = simple.ExtractBlock(Input=source)
        block.Selectors = [f"/Root/{name}"]
        block.UpdatePipeline(step) if step is not None else block.UpdatePipeline()
        found = {key: array.GetNumberOfComponents() for key, array in block.PointData.items()}
        if found != arrays:
            faults.append(f"{name} has {found}")
        if name == "contact":
            faults += check_contact(block, step)
        simple.Delete(block)
    return faults


def check_contact(block, step: float | None) -> list[str]:
    data = servermanager.Fetch(block)
    while hasattr(data, "GetBlock"):
        data = next(data.GetBlock(k) for k in range(data.GetNumberOfBlocks()) if data.GetBlock(k) is not None)
    force = data.GetFieldData().GetArray("normal_force_N").GetValue(0)
    faults = []
    shift = data.GetFieldData().GetArray("lateral_shift_mm").GetValue(0)
    if step is not None and shift != step:
        faults.append(f"the case of {shift:g} mm is at another time")
    if not data.GetFieldData().GetAbstractArray("annotation").GetValue(0).count("Hertz"):
        faults.append("the annotation does not tell the verdict")
    integrated = simple.IntegrateVariables(Input=block)
    integrated.UpdatePipeline(step) if step is not None else integrated.UpdatePipeline()
    for name in ("contact_pressure_MPa", "hertz_pressure_MPa"):
        part = integrated.PointData[name].GetRange()[0] / force - 1.0
        say(f"  {name}: integral {1e2 * part:+.4f} % from the normal force")
        if not abs(part) < TOLERANCE:
            faults.append(f"{name} integrates to {1e2 * part:+.3f} % beside the force")
    simple.Delete(integrated)
    return faults


def render(folder: Path, pictures: Path) -> list[str]:
    import numpy as np
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOImage import vtkPNGReader

    pictures.mkdir(parents=True, exist_ok=True)
    script = folder / "view.py"
    made = {"__file__": str(script), "__name__": "__main__"}
    exec(compile(script.read_text("utf-8"), script, "exec"), made)
    for view in made["VIEWS"]:
        # letters keep their size in points
        view.ViewSize = [1100, 850]
    faults = []
    for step in list(getattr(made["SOURCE"], "TimestepValues", None) or [math.nan]):
        if not math.isnan(step):
            simple.GetAnimationScene().AnimationTime = step
        for name, view in zip(("pressure", "stress"), made["VIEWS"], strict=True):
            path = pictures / (f"{name}.png" if math.isnan(step) else f"{name}_{step:+.2f}mm.png")
            simple.Render(view)
            simple.SaveScreenshot(str(path), view, ImageResolution=[1100, 850])
            reader = vtkPNGReader()
            reader.SetFileName(str(path))
            reader.Update()
            pixels = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())[:, :3]
            colours = len(np.unique(pixels, axis=0))
            say(f"{path.name}: {colours} colours")
            # a blank picture, or one of bodies alone, has some tens
            if colours < 300:
                faults.append(f"{path.name} has {colours} colours only")
    return faults


if __name__ == "__main__":
    FAULTS = main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
    say("\n".join(f"FAULT {fault}" for fault in FAULTS) or "all as it should be")
    # ParaView 5.11 loses its drawing context while it ends, and with it the exit code
    os._exit(1 if FAULTS else 0)
