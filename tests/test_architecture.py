"""Permitted imports of each folder of the package.

A validator that shares code with the validated module proves nothing.
"""

import ast
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from fecontact.feature_registry import FEATURES

PACKAGE = Path(__file__).parents[1] / "fecontact"

# Each folder, or file beside the folders, and what it may use, from the ground up: all of it stands before it here.
# Features are found by the registry, so that what lies below them asks the registry and imports none of them.
BASE = ("arrays", "errors", "process", "packages", "feature_registry", "files", "inputs", "bodies")
PHYSICS = (
    *("profiles", "placement", "own_criterion", "criteria", "case", "contact", "fe", "contact_theories"),
    *("judging", "solving"),
)
WORK = ("jobs", "regression", "outputs", "console", "maps", "runs")
ROOMS: dict[str, set[str]] = {
    "arrays": set(),
    "errors": set(),
    "process": {"errors"},
    # packages that not every machine has
    "packages": {"errors"},
    # names of what features offer, imported once it is used
    "feature_registry": {"errors"},
    "files": {"errors"},
    "inputs": {"errors", "files"},
    "bodies": {"errors", "inputs"},
    "profiles": {"arrays", "errors", "files", "inputs"},
    "placement": {"arrays", "errors", "files", "inputs", "bodies", "profiles"},
    "own_criterion": {"errors"},
    "criteria": {"errors", "feature_registry", "inputs", "own_criterion"},
    "case": {"errors", "inputs", "bodies", "profiles", "placement", "own_criterion", "criteria"},
    "contact": {"arrays", "errors"},
    # theories and finite elements meet nowhere below the judges
    "fe": {"arrays", "errors", "process", "bodies", "profiles", "placement", "contact"},
    "contact_theories": {"arrays", "errors", "bodies", "placement", "case", "contact"},
    "judging": {
        *("arrays", "errors", "feature_registry", "bodies", "placement", "own_criterion", "criteria"),
        *("case", "contact", "contact_theories"),
    },
    "solving": {
        *("arrays", "errors", "packages", "feature_registry", "bodies", "profiles", "placement", "case", "contact"),
        *("fe", "contact_theories", "judging"),
    },
    # knows neither physics nor outputs: what is done, and what is written, is handed in
    "jobs": {"errors", "process", "files"},
    "regression": {"errors", "files", "inputs"},
    "outputs": {
        *(
            "arrays",
            "errors",
            "inputs",
            "feature_registry",
            "files",
            "bodies",
            "profiles",
            "placement",
            "own_criterion",
            "criteria",
            "case",
        ),
        *("contact", "fe", "contact_theories", "judging", "solving", "regression"),
    },
    "console": {"errors", "files", "inputs", "profiles", "case", "jobs", "outputs"},
    "maps": {
        *("arrays", "errors", "inputs", "feature_registry", "files", "placement", "case", "contact_theories"),
        *("judging", "solving", "outputs"),
    },
    "runs": {
        *("errors", "packages", "feature_registry", "files", "inputs", "profiles", "placement", "own_criterion"),
        *("criteria", "case", "fe", "contact_theories", "judging", "solving", "jobs", "regression", "outputs", "maps"),
    },
    # the folder itself; each feature is a room of its own
    "features": set(),
}
# A feature may use every room that is no door, and no other feature; the doors open features by the registry.
OWN = [f"features.{name}" for name in sorted(FEATURES)]
ROOMS |= {feature: {*BASE, *PHYSICS, *WORK} for feature in OWN}
ROOMS |= {
    "doctor": {"process", "packages"},
    # pages of text
    "guide": {"errors", "inputs"},
    "plot": {"errors", "solving", "outputs", "maps"},
    "commands": {
        *(
            "errors",
            "process",
            "packages",
            "feature_registry",
            "files",
            "inputs",
            "profiles",
            "case",
            "solving",
            "jobs",
        ),
        *("regression", "outputs", "console", "maps", "runs", "doctor", "guide"),
    },
    "cli": {"errors", "process", "feature_registry", "inputs", "console", "commands"},
    # features for the types of their public names alone; the import of a removed feature is one of their folder
    "__init__": {
        "features",
        *("feature_registry", "bodies", "profiles", "placement", "own_criterion", "criteria", "case", "solving"),
        *("outputs", "runs", "plot", *OWN),
    },
    "__main__": {"cli"},
}
# What one folder takes of another is counted in arrows, and in imports of single modules: 81 and 493 when features lay
# among the folders of the core. Larger modules were divided since, each with its own imports. `inputs` was a file then,
# which nearly all folders use. It is left out.
MOST_ARROWS = 81
FINITE_ELEMENT_PACKAGES = {"skfem", "gmsh", "pypardiso", "pyamg", "meshio", "pyvista", "vtk", "vtkmodules"}


def modules() -> dict[str, Path]:
    """Every module of the package by its dotted name below it."""
    module_paths = {}
    for path in PACKAGE.rglob("*.py"):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        module_paths[".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)] = path
    return module_paths


MODULES = modules()


def room(module: str) -> str:
    # each feature is a room of its own
    parts = module.split(".")
    return ".".join(parts[: 1 + (parts[0] == "features")])


@cache
def imported(module: str) -> tuple[set[str], set[str]]:
    """Imported modules of the package and imported packages from elsewhere.

    Imports inside the functions of the module count too.
    """
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
    reached: set[str] = set()
    queue = [module]
    while queue:
        name = queue.pop()
        if name not in reached:
            reached.add(name)
            queue += imported(name)[0]
    return reached - {module}


def test_every_room_is_known():
    assert {room(module) for module in MODULES} == set(ROOMS)


@pytest.mark.parametrize("name", ROOMS)
def test_a_room_uses_only_the_rooms_below_it(name):
    room_modules = [module for module in MODULES if room(module) == name]
    outside_imports = {
        f"{module} uses {imported_module}"
        for module in room_modules
        for imported_module in imported(module)[0]
        if room(imported_module) != name
    }
    allowed_imports = {line for line in outside_imports if room(line.rpartition(" ")[2]) in ROOMS[name]}
    assert outside_imports == allowed_imports


def test_every_room_uses_only_what_stands_before_it():
    order = list(ROOMS)
    upwards = {
        (name, used_room)
        for name, used_rooms in ROOMS.items()
        for used_room in used_rooms
        if used_room not in order[: order.index(name)]
    }
    assert upwards == set()


def test_there_are_few_arrows_between_folders():
    folders = {path.parent.relative_to(PACKAGE).parts[:1] for path in MODULES.values()} - {()}
    names = {name for (name,) in folders} - {"features", "inputs"} | set(OWN)
    arrows = {
        (room(module), room(imported_module))
        for module in MODULES
        for imported_module in imported(module)[0]
        if room(module) in names and room(imported_module) in names and room(module) != room(imported_module)
    }
    assert len(arrows) <= MOST_ARROWS


def test_no_arrow_goes_upwards():
    # graphlib raises for a circle: among the rooms as they are allowed, and among the modules as they are
    TopologicalSorter(ROOMS).prepare()
    TopologicalSorter({module: imported(module)[0] for module in MODULES}).prepare()


def test_the_folders_of_outputs_have_no_circle():
    uses: dict[str, set[str]] = {}
    for module in [module for module in MODULES if module.startswith("outputs.")]:
        folder = module.split(".")[1]
        imported_folders = {
            imported_module.split(".")[1]
            for imported_module in imported(module)[0]
            if imported_module.startswith("outputs.")
        }
        uses.setdefault(folder, set()).update(imported_folders - {folder})
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
    assert evaluating_names("def f():\n    from fecontact.judging.theory import judge_theory") == {"judge_theory"}


def test_readers_of_profile_files_know_nothing_of_the_library():
    for module in [module for module in MODULES if module.startswith("profiles.readers")]:
        assert not reachable(module) & {"profiles.library", "profiles.resolve"}, module


def test_theory_and_finite_elements_never_meet_below_the_comparison():
    for module in MODULES:
        rooms = {room(reached_module) for reached_module in reachable(module)} | {room(module)}
        if {"contact_theories", "fe"} <= rooms:
            assert rooms & {"judging", "solving"}, module


@pytest.mark.parametrize(
    "name",
    [
        "contact_theories",
        "judging",
        "contact",
        "placement",
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
        assert not {reached_module for reached_module in reached if room(reached_module) == "fe"}, module
        assert (
            not {package for reached_module in reached for package in imported(reached_module)[1]}
            & FINITE_ELEMENT_PACKAGES
        ), module


def test_only_the_doors_open_what_the_command_line_calls():
    users = {
        room(module) for module in MODULES for imported_module in imported(module)[0] if room(imported_module) == "runs"
    }
    assert users <= {"runs", "commands", "__init__", *OWN}


def test_packages_are_empty_so_that_help_is_instant():
    for path in PACKAGE.rglob("__init__.py"):
        if path.parent not in (PACKAGE, PACKAGE / "features"):
            assert len(ast.parse(path.read_text("utf-8")).body) <= 1, path


def test_importing_the_package_is_light():
    # users look at the command line's help many times before they solve anything
    heavy = ["vtk", "vtkmodules", "pyvista", "gmsh", "matplotlib", "pandas", "skfem", "pyamg", "pypardiso"]
    code = f"import sys, fecontact; print([name for name in {heavy!r} if name in sys.modules])"
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=PACKAGE.parent
    )
    assert process.stdout.strip() == "[]"


def test_data_frames_are_for_comparing_alone():
    # their import takes a quarter of a second, a tenth of a solution
    code = "import sys, fecontact.runs.study, fecontact.runs.load; print('pandas' in sys.modules)"
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=PACKAGE.parent
    )
    assert process.stdout.strip() == "False"


def test_hertz_from_python_starts_without_packages_that_it_does_not_call():
    # they took half of the time of this call
    unused = ["pandas", "pydantic", "scipy.ndimage", "scipy.stats", "scipy.io", "rich", "cyclopts", "fecontact.maps"]
    unused += ["vtk", "vtkmodules", "pyvista", "gmsh", "meshio", "matplotlib", "PIL", "skfem", "pyamg", "pypardiso"]
    show = f"print([name for name in {unused!r} if name in sys.modules])"
    code = f"import sys, fecontact; fecontact.hertz(fecontact.Case()); {show}"
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=PACKAGE.parent
    )
    assert process.stdout.strip() == "[]"


def test_no_folder_hides_a_public_name():
    # a folder that is imported is an attribute of the package, in place of a function of its name
    code = "import fecontact; print(*fecontact.__all__)"
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=PACKAGE.parent
    )
    assert {module.partition(".")[0] for module in MODULES} & set(process.stdout.split()) == {"plot"}
