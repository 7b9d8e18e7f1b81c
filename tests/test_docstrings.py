"""Docstrings follow the NumPy convention.

ruff holds the sections of NumPy and overlooks section names that exist only in Google's convention.
"""

import ast
import re
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "fecontact"
GOOGLE_ONLY = re.compile(r"^ *((Keyword |Other )?Arg(ument)?s|Note|Example|Warning|Todo):$", re.MULTILINE)


def test_no_section_of_another_convention():
    headings = [
        f"{path.relative_to(PACKAGE)}: {section[0].strip()}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        for section in GOOGLE_ONLY.finditer(ast.get_docstring(node) or "")
    ]
    assert not headings, f"{headings}: write Parameters with a line of dashes below it"
