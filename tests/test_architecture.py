"""Who may import whom: a validator that shares code with what it validates proves nothing."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from fecontact.identity import _NOT_NUMERICAL

PACKAGE = Path(__file__).parents[1] / "fecontact"
FINITE_ELEMENTS = {"section", "meshing", "elasticity", "mortar"}
THEORY = {"hertz", "halfspace", "material"}
REGRESSION = {"tolerances", "regression", "baselines"}


def imported(path: Path) -> set[str]:
    """Names of all modules that a file imports, also inside its functions."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}: relative import"
            assert node.module is not None
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def reachable(module: str) -> set[str]:
    """Modules of the package that a module needs, directly or through others."""
    seen: set[str] = set()
    queue = [module]
    while queue:
        name = queue.pop()
        path = PACKAGE / f"{name}.py"
        if name in seen or not path.exists():
            continue
        seen.add(name)
        queue += [full.split(".")[1] for full in imported(path) if full.startswith("fecontact.")]
    return seen - {module}


@pytest.mark.parametrize("module", sorted(THEORY))
def test_theory_needs_no_finite_elements(module):
    assert not reachable(module) & FINITE_ELEMENTS
    outside = {name.split(".")[0] for name in imported(PACKAGE / f"{module}.py")}
    assert not outside & {"skfem", "gmsh", "pypardiso", "pyamg", "meshio", "pyvista", "vtk"}


@pytest.mark.parametrize("module", sorted(FINITE_ELEMENTS))
def test_finite_elements_need_no_theory(module):
    # the material law is common to both, contact theory is not
    assert not reachable(module) & {"hertz", "halfspace"}


def test_contact_solver_knows_neither_bodies_nor_theory():
    assert reachable("contact") <= {"errors"}


@pytest.mark.parametrize("module", ["profiles.curve", "placement"])
def test_geometry_needs_neither(module):
    path = PACKAGE.joinpath(*module.split(".")).with_suffix(".py")
    names = {full.split(".")[1] for full in imported(path) if full.startswith("fecontact.")}
    assert not names & (FINITE_ELEMENTS | THEORY)


@pytest.mark.parametrize("module", sorted(REGRESSION))
def test_comparing_results_needs_nothing_that_makes_them(module):
    assert reachable(module) <= REGRESSION | {"errors"}


def test_numerical_modules_need_nothing_that_the_fingerprint_leaves_out():
    # a result is reused as long as the sources in its fingerprint are the same
    left_out = {name.removesuffix(".py") for name in _NOT_NUMERICAL}
    numerical = {path.stem for path in PACKAGE.glob("*.py")} - left_out - {"__init__"}
    for module in numerical:
        assert not reachable(module) & left_out, module
        names = {full.split(".")[1] for full in imported(PACKAGE / f"{module}.py") if full.startswith("fecontact.")}
        assert "outputs" not in names, module


def test_checked_modules_exist():
    assert all((PACKAGE / f"{name}.py").is_file() for name in FINITE_ELEMENTS | THEORY | REGRESSION)


def test_importing_the_package_is_light():
    # users look at the command line's help many times before they solve anything
    heavy = ["vtk", "vtkmodules", "pyvista", "gmsh", "matplotlib", "skfem", "pyamg", "pypardiso"]
    code = f"import sys, fecontact; print([name for name in {heavy!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=PACKAGE.parent)
    assert done.stdout.strip() == "[]"
