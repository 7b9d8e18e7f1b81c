"""How large the program is, and how much of it is logic: printed by `make lint`.

Code lines are lines with code, without comments and docstrings. Logic is what is left of them after imports,
signatures, fields, constants and tables, raised errors, brackets, and lines that only hand a name on.
"""

from __future__ import annotations

import ast
import re
import statistics
import sys
import tokenize
from pathlib import Path

_LAYOUT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
_BRACKETS = re.compile(r"[\s()\[\]{},:]*$")
_HANDED_ON = re.compile(r"\s*\**(\w+=)?[A-Za-z_][\w.]*,?$")
_OF_CONSTANTS = (ast.Assign, ast.AnnAssign)


def is_text(node: ast.AST) -> bool:
    """Whether a statement is a text alone: a docstring, also that of a constant."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def lines_of(node: ast.AST, end: int | None = None) -> set[int]:
    """Lines of a node, or those before its body."""
    first = min([node.lineno, *(one.lineno for one in getattr(node, "decorator_list", ()))])  # type: ignore[attr-defined]
    return set(range(first, (node.end_lineno if end is None else end) + 1))  # type: ignore[attr-defined]


def measured(path: Path) -> tuple[set[int], set[int], set[int], list[int]]:
    """Code lines of a module, its imports, what else is no logic, and the code lines of its functions."""
    text = path.read_text("utf-8")
    with path.open("rb") as file:
        code = {
            line
            for token in tokenize.tokenize(file.readline)
            if token.type not in {*_LAYOUT, tokenize.ENCODING}
            for line in range(token.start[0], token.end[0] + 1)
        }
    imports: set[int] = set()
    other: set[int] = set()
    functions: list[ast.AST] = []
    for node in ast.walk(ast.parse(text)):
        body = getattr(node, "body", None)
        if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module) and isinstance(body, list) and body:
            code -= {line for one in body if is_text(one) for line in lines_of(one)}
        if isinstance(node, ast.Import | ast.ImportFrom):
            imports |= lines_of(node)
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            other |= lines_of(node, node.body[0].lineno - 1 if node.body[0].lineno > node.lineno else node.lineno)
            if isinstance(node, ast.FunctionDef):
                functions.append(node)
        elif isinstance(node, ast.Raise):
            other |= lines_of(node)
        if isinstance(node, ast.ClassDef | ast.Module):
            other |= {line for one in node.body if isinstance(one, _OF_CONSTANTS) for line in lines_of(one)}
    written = text.splitlines()
    other |= {n for n in code if _BRACKETS.match(written[n - 1]) or _HANDED_ON.match(written[n - 1])}
    return code, imports & code, (other & code) - imports, [len(lines_of(one) & code) for one in functions]


def main(package: Path) -> None:
    """Print the size of a package."""
    found = [measured(path) for path in sorted(package.rglob("*.py"))]
    found = [one for one in found if one[0]]
    total, imports, other = (sum(len(one[k]) for one in found) for k in range(3))
    functions = sorted(length for one in found for length in one[3])
    logic, brought = (100 * part / total for part in (total - imports - other, imports))
    median, most, longest = statistics.median(functions), functions[int(0.9 * len(functions))], functions[-1]
    print(f"{package.name}: {total} code lines in {len(found)} files; logic {logic:.1f} %, imports {brought:.1f} %")
    print(f"functions: {median:.0f}, {most} and {longest} code lines (median, nine of ten, longest)")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
