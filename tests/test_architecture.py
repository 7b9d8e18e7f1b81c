"""Who may import whom, room by room: a validator that shares code with what it validates proves nothing."""

import ast
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from fecontact.features import FEATURES

PACKAGE = Path(__file__).parents[1] / "fecontact"

# Each room and the rooms that it may use, from the ground up. A room is a folder, or a file beside the folders.
ROOMS: dict[str, set[str]] = {
    "arrays": set(),
    "errors": set(),
    "process": set(),
    # names of what there is, imported once it is used
    "features": {"errors"},
    # what not every machine has
    "packages": {"errors"},
    "doctor": {"packages"},
    "contact": {"arrays", "errors"},
    "files": {"errors"},
    "inputs": {"errors"},
    # knows neither physics nor outputs: what is done, and what is written, is handed in
    "jobs": {"errors", "files", "process"},
    "regression": {"errors", "features", "files"},
    "bodies": {"errors", "inputs"},
    "criteria": {"errors", "features", "inputs"},
    # pages of text
    "guide": {"errors", "inputs"},
    "irregularity": {"arrays", "errors", "inputs"},
    "profiles": {"arrays", "errors", "files", "inputs"},
    "case": {"errors", "inputs", "bodies", "criteria", "irregularity", "profiles"},
    "wheel_rail": {"arrays", "errors", "bodies", "irregularity", "profiles"},
    "fe": {"arrays", "errors", "contact", "bodies", "profiles", "wheel_rail"},
    "normal": {"arrays", "errors", "irregularity", "wheel_rail"},
    "rolling": {"arrays", "errors", "bodies", "wheel_rail", "normal"},
    "comparison": {"arrays", "errors", "features", "contact", "bodies", "criteria", "case", "wheel_rail", "normal"},
    "solving": {
        "arrays",
        "errors",
        "features",
        "packages",
        "contact",
        "bodies",
        "irregularity",
        "profiles",
        "case",
        "wheel_rail",
        "fe",
        "normal",
        "comparison",
    },
    "outputs": {
        "arrays",
        "errors",
        "features",
        "contact",
        "files",
        "regression",
        "bodies",
        "criteria",
        "irregularity",
        "profiles",
        "case",
        "wheel_rail",
        "fe",
        "normal",
        "comparison",
        "solving",
    },
    "runs": {
        "errors",
        "features",
        "packages",
        "files",
        "inputs",
        "jobs",
        "regression",
        "bodies",
        "criteria",
        "irregularity",
        "profiles",
        "case",
        "wheel_rail",
        "fe",
        "normal",
        "comparison",
        "solving",
        "outputs",
    },
    "plot": {"errors", "features", "solving", "outputs"},
    "commands": {
        "errors",
        "features",
        "packages",
        "doctor",
        "files",
        "inputs",
        "jobs",
        "regression",
        "bodies",
        "guide",
        "profiles",
        "case",
        "solving",
        "outputs",
        "runs",
    },
    "cli": {"errors", "process", "inputs", "features", "commands"},
    "__init__": {
        "features",
        "bodies",
        "criteria",
        "irregularity",
        "profiles",
        "case",
        "solving",
        "outputs",
        "runs",
        "plot",
    },
    "__main__": {"cli"},
}
# A feature may use every room but the doors, and no other feature; nobody imports one but for the types of the package.
FREE = set(ROOMS) - {"cli", "__init__", "__main__", "doctor", "guide"}
ROOMS |= {feature: FREE for feature in FEATURES}
ROOMS["__init__"] |= set(FEATURES)
FINITE_ELEMENT_PACKAGES = {"skfem", "gmsh", "pypardiso", "pyamg", "meshio", "pyvista", "vtk", "vtkmodules"}


def modules() -> dict[str, Path]:
    """Every module of the package by its dotted name below it."""
    found = {}
    for path in PACKAGE.rglob("*.py"):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        found[".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)] = path
    return found


MODULES = modules()


def room(module: str) -> str:
    return module.partition(".")[0]


@cache
def imported(module: str) -> tuple[set[str], set[str]]:
    """Modules of the package that a module imports, also inside its functions, and packages from elsewhere."""
    inside, outside = set(), set()
    for node in ast.walk(ast.parse(MODULES[module].read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: relative import"
            assert node.module is not None
            # what is imported from a package may be a module of it
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            first, _, rest = name.partition(".")
            if first != "fecontact":
                outside.add(first)
                continue
            while rest and rest not in MODULES:
                rest = rest.rpartition(".")[0]
            inside.add(rest or "__init__")
    # a name such as the version, which needs no other module
    return inside - {"__init__", module}, outside


def reachable(module: str) -> set[str]:
    """Modules that a module needs, directly or through others."""
    seen: set[str] = set()
    queue = [module]
    while queue:
        name = queue.pop()
        if name not in seen:
            seen.add(name)
            queue += imported(name)[0]
    return seen - {module}


def test_every_room_is_known():
    assert {room(module) for module in MODULES} == set(ROOMS)


@pytest.mark.parametrize("name", ROOMS)
def test_a_room_uses_only_the_rooms_below_it(name):
    own = [module for module in MODULES if room(module) == name]
    used = {f"{module} uses {other}" for module in own for other in imported(module)[0] if room(other) != name}
    allowed = {line for line in used if room(line.rpartition(" ")[2]) in ROOMS[name]}
    assert used == allowed


def test_there_are_few_arrows():
    assert sum(len(used) for name, used in ROOMS.items() if name not in FEATURES) <= 150


def test_no_arrow_goes_upwards():
    # graphlib raises for a circle: among the rooms as they are allowed, and among the modules as they are
    TopologicalSorter(ROOMS).prepare()
    TopologicalSorter({module: imported(module)[0] for module in MODULES}).prepare()


def test_the_folders_of_outputs_have_no_circle():
    uses: dict[str, set[str]] = {}
    for module in [module for module in MODULES if module.startswith("outputs.")]:
        folder = module.split(".")[1]
        others = {other.split(".")[1] for other in imported(module)[0] if other.startswith("outputs.")}
        uses.setdefault(folder, set()).update(others - {folder})
    TopologicalSorter(uses).prepare()
    assert len(uses) > 5


def test_no_module_takes_what_another_keeps_for_itself():
    for module, path in MODULES.items():
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("fecontact"):
                assert [
                    alias.name for alias in node.names if alias.name.startswith("_") and alias.name[1] != "_"
                ] == [], f"{module} from {node.module}"


# What evaluates a contact, beside all that is called judge_*.
EVALUATES = {
    *("worst_of", "with_readings", "with_dear_readings", "limits_of"),
    *("creep_force", "creep_forces", "fit_stiffness", "stiffness_of"),
    *("place", "place_wheelset", "place_wheelset_of_case", "wheelset_of_case", "contact_functions"),
    *("place_case", "hertz_alone", "hertz_of_case", "hertz_points", "hertz_points_of_case", "hertz_uncertainty"),
    *("load_limit", "uncertainty", "uncertainties", "deviations", "deviations_of", "misfit_of", "misfit_of_theory"),
    *("measures_of", "values_of", "patch_of", "measure_patch", "compare", "expect_on_half_space", "preview", "solve"),
}


def evaluating_names(source: str) -> set[str]:
    """Names that a source takes from the package and that evaluate something."""
    return {
        alias.name
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("fecontact.")
        for alias in node.names
        if alias.name in EVALUATES or alias.name.startswith("judge_")
    }


def test_outputs_evaluate_nothing():
    # they receive values: what is judged, placed or fitted is so before, once, where results are read
    for module in [module for module in MODULES if room(module) == "outputs"]:
        assert evaluating_names(MODULES[module].read_text("utf-8")) == set(), module
    # the net has no such holes
    assert evaluating_names(MODULES["runs.store"].read_text("utf-8")) >= {"judge_load"}
    assert evaluating_names("def f():\n    from fecontact.comparison.judging import judge_theory") == {"judge_theory"}


def test_readers_of_profile_files_know_nothing_of_the_library():
    for module in [module for module in MODULES if module.startswith("profiles.readers")]:
        assert not reachable(module) & {"profiles.library", "profiles.resolve"}, module


def test_theory_and_finite_elements_never_meet_below_the_comparison():
    for module in MODULES:
        rooms = {room(other) for other in reachable(module)} | {room(module)}
        if {"normal", "fe"} <= rooms:
            assert rooms & {"comparison", "solving"}, module


@pytest.mark.parametrize(
    "name",
    [
        "normal",
        "comparison",
        "contact",
        "rolling",
        "wheel_rail",
        "profiles",
        "case",
        "inputs",
        "bodies",
        "criteria",
    ],
)
def test_what_needs_no_finite_elements_reaches_none(name):
    for module in [module for module in MODULES if room(module) == name]:
        reached = {module, *reachable(module)}
        assert not {other for other in reached if room(other) == "fe"}, module
        assert not {package for other in reached for package in imported(other)[1]} & FINITE_ELEMENT_PACKAGES, module


def test_only_the_doors_open_what_the_command_line_calls():
    users = {room(module) for module in MODULES for other in imported(module)[0] if room(other) == "runs"}
    assert users <= {"runs", "commands", "__init__", *FEATURES}


def test_packages_are_empty_so_that_help_is_instant():
    for path in PACKAGE.rglob("__init__.py"):
        if path.parent != PACKAGE:
            assert len(ast.parse(path.read_text("utf-8")).body) <= 1, path


def test_importing_the_package_is_light():
    # users look at the command line's help many times before they solve anything
    heavy = ["vtk", "vtkmodules", "pyvista", "gmsh", "matplotlib", "pandas", "skfem", "pyamg", "pypardiso"]
    code = f"import sys, fecontact; print([name for name in {heavy!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=PACKAGE.parent)
    assert done.stdout.strip() == "[]"


def test_data_frames_are_for_comparing_alone():
    # their import takes a quarter of a second, a tenth of a solution
    code = "import sys, fecontact.runs.study, fecontact.runs.load; print('pandas' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=PACKAGE.parent)
    assert done.stdout.strip() == "False"
