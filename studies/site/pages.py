"""Pages of the site: README, guide, studies, validation, and public names.

They are made from the files of the repository. Pages keep their places in the repository, so that links between them
are right here and there.
"""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from dataclasses import is_dataclass
from io import StringIO
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from griffe import DocstringSection, DocstringSectionText, Extension
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

import fecontact
from fecontact.feature_registry import find_public_names
from fecontact.guide.pages import read_titles
from fecontact.inputs.slots import list_descriptions
from fecontact.outputs.records.data_dictionary import dictionary_page

ROOT = Path(__file__).parents[2]
STUDIES = sorted(path for path in (ROOT / "studies").glob("*.py"))
NAMES = [name for name in fecontact.__all__ if not name.startswith("_")]
NOTEBOOKS = sorted((ROOT / "studies").glob("*.ipynb"))
PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)]+)\)")


def on_config(config: Any) -> Any:
    """Set the order of the pages."""
    config.nav = [
        {"Home": ["index.md", "overview.md"]},
        {"Guide": [{title: f"fecontact/guide/{topic}.md"} for topic, title in read_titles().items()]},
        {"Gallery": "gallery.md"},
        {"Notebooks": [f"studies/{path.stem}.md" for path in NOTEBOOKS]},
        {"Studies": ["studies/README.md", *(f"studies/{path.stem}.md" for path in STUDIES)]},
        {"Python": ["api/README.md", *({name: f"api/{name}.md"} for name in NAMES)]},
        {"Data dictionary": "data_dictionary.md"},
        {"Project": ["CONTRIBUTING.md", "CHANGELOG.md", "studies/VALIDATION.md"]},
    ]
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the pages, and the pictures that they show."""
    for uri, content in pages():
        files.append(File.generated(config, uri, content=content))
    for path in (ROOT / "studies" / "figures").glob("*.png"):
        files.append(File.generated(config, f"studies/figures/{path.name}", abs_src_path=str(path)))
    for path in NOTEBOOKS:
        folder = Path(mkdtemp())
        files.append(File.generated(config, f"studies/{path.stem}.md", content=run_notebook(path, folder)))
        for picture in folder.glob("*.png"):
            files.append(File.generated(config, f"studies/{picture.name}", abs_src_path=str(picture)))
    gallery = files.get_file_from_path("gallery.md")
    assert gallery is not None
    folder = run(gallery.content_string)
    for path in folder.rglob("*.png"):
        files.append(File.generated(config, path.relative_to(folder).as_posix(), abs_src_path=str(path)))
    text = gallery.content_string + "\n![Hertz minus finite elements](by_python.png)\n" + studies_gallery()
    files.remove(gallery)
    files.append(File.generated(config, "gallery.md", content=text))
    return files


def on_post_page(output: str, page: Any, config: Any) -> str:
    """Refuse a page with external scripts, links or pictures."""
    if outside_links := re.findall(r'<(?:script|link|img|iframe)[^>]*(?:src|href)="(?:https?:)?//[^"]*"', output):
        raise PluginError(f"{page.file.src_uri} needs something from elsewhere: {outside_links[0]}")
    return output


def pages() -> Iterator[tuple[str, str]]:
    """Places and texts of the pages, in Markdown."""
    for uri, text in read_pages():
        yield uri, escape_angles(text)


def read_pages() -> Iterator[tuple[str, str]]:
    """Places and texts of the pages; a `<` may still be text."""
    # the landing page is index.md, and a page README.md in its folder would have the same address
    for name, uri in (("README.md", "overview.md"), ("CONTRIBUTING.md", None), ("CHANGELOG.md", None)):
        yield uri or name, link_to_notebooks((ROOT / name).read_text("utf-8"))
    yield "data_dictionary.md", dictionary_page()
    for topic in read_titles():
        text = (ROOT / "fecontact" / "guide" / f"{topic}.md").read_text("utf-8")
        yield f"fecontact/guide/{topic}.md", link_to_notebooks(text)
    yield "studies/README.md", re.sub(r"\((\w+)\.py\)", r"(\1.md)", (ROOT / "studies" / "README.md").read_text("utf-8"))
    for path in STUDIES:
        yield f"studies/{path.stem}.md", study(path)
    # each study has its checks on its page
    validation = (ROOT / "studies" / "VALIDATION.md").read_text("utf-8")
    yield "studies/VALIDATION.md", re.sub(r"\(validation/(\w+\.md)\)", r"(\1#checks)", validation)
    yield "api/README.md", f"# Python\n\n{fenced(fecontact.__doc__ or '')}\n## Names\n\n{list_names()}"
    for name in NAMES:
        place = find_public_names().get(name) or f"fecontact.{fecontact._HOMES.get(name) or name}"
        table = inputs(getattr(fecontact, name))
        # the table already describes the fields
        alone = "    options: {show_if_no_docstring: false}\n" if table else ""
        purpose = (getattr(fecontact, name).__doc__ or "").partition("\n\n")[0] if table else ""
        yield f"api/{name}.md", f"# fecontact.{name}\n\n{purpose}\n\n{table}\n\n::: {place}\n{alone}"


# Code in Markdown: a block between fences, which can be indented, or a span between backticks.
CODE = re.compile(r"^( *)(`{3,})[^`\n]*\n.*?^\1\2 *$|(?<!`)(`+)(?!`)(?:(?!\n\n).)+?(?<!`)\3(?!`)", re.M | re.S)


def escape_angles(text: str) -> str:
    """Escape each `<` outside code, so that Markdown takes no text for a tag."""
    parts, end = [], 0
    for code in CODE.finditer(text):
        parts += [text[end : code.start()].replace("<", "&lt;"), code[0]]
        end = code.end()
    return "".join([*parts, text[end:].replace("<", "&lt;")])


def link_to_notebooks(text: str) -> str:
    """Text of a page with links to the pages of notebooks instead of their files."""
    return re.sub(r"\.ipynb\)", ".md)", text)


def list_names() -> str:
    """Table of public names with the first lines of their docstrings."""
    docs = {name: (getattr(fecontact, name).__doc__ or "").partition("\n")[0] for name in NAMES}
    return "\n".join(["| name | |", "|---|---|", *(f"| [`{name}`]({name}.md) | {doc} |" for name, doc in docs.items())])


def inputs(kind: Any) -> str:
    """Table of the inputs of a class; empty for a class without inputs."""
    descriptions = list_descriptions(kind) if is_dataclass(kind) else {}
    rows = [
        f"| `{name}` | `{description.key or name}` | {description.allowed} | {description.help} |".replace("\n", " ")
        for name, description in descriptions.items()
    ]
    head = ["## Inputs", "", "| in Python | in a study file | allowed in a study file | |", "|---|---|---|---|"]
    return "\n".join([*head, *rows]) if rows else ""


def study(path: Path) -> str:
    """Page of a study: question, method, findings, answer, checks, and script."""
    checked = ROOT / "studies" / "validation" / path.name.replace(".py", ".md")
    code = path.read_text("utf-8")
    question, _, body = (ast.get_docstring(ast.parse(code)) or path.stem).partition("\n")
    answer = re.search(rf"^\| \[`\w+`\]\({path.stem}\.py\).*?\|[^|]*\| (.*) \|$", STUDIES_README, re.MULTILINE)
    parts = [f"# {path.stem}: {question}", answer[1] if answer else "", body.strip()]
    if checked.exists():
        head, *tables = re.split(r"^## ", checked.read_text("utf-8"), flags=re.MULTILINE)
        _, _, answer_text = head.strip().split("\n\n", 2)
        about = "From the last [validation](VALIDATION.md) at full size; nothing was run for this page."
        parts += ["## Checks", about, answer_text, *(f"### {table}" for table in tables)]
    script = "\n".join(f"    {line}".rstrip() for line in code.splitlines())
    return "\n\n".join([*parts, "## Script", f'??? example "studies/{path.name}"\n\n    ```python\n{script}\n    ```'])


STUDIES_README = (ROOT / "studies" / "README.md").read_text("utf-8")


def studies_gallery() -> str:
    """Pictures of the studies, with their questions and links to their scripts."""
    parts = []
    for name, question, answer in re.findall(
        r"^\| \[`\w+`\]\((\w+)\.py\).*?\| ([^|]*) \| (.*) \|$", STUDIES_README, re.M
    ):
        for picture in re.findall(r"\((figures/[^)]+)\)", answer):
            command = f"fecontact run studies/{name}.py --out out/{name}"
            parts += [f"## {question}", f"```console\n{command}\n```", f"![{question}](studies/{picture})"]
            parts.append(f"[The study and its script](studies/{name}.md)")
    return "\n\n" + "\n\n".join(parts) + "\n"


class Docstrings(Extension):
    """Docstrings with the parameters first, and with doctests as blocks of code.

    In Markdown doctests are quotations with links.
    """

    def on_object(self, *, obj: Any, **keywords: Any) -> None:
        """Change the docstring of an object."""
        if obj.docstring:
            obj.docstring.value = escape_angles(fenced(obj.docstring.value))
            obj.docstring.parsed = [*put_parameters_first(obj.docstring.parsed)]
            for section in obj.docstring.parsed:
                # griffe gives all parameters of a line the type and the default of the first
                for parameter in section.value if section.kind.value == "parameters" else ():
                    if obj.is_function and parameter.name in obj.parameters:
                        parameter.annotation = obj.parameters[parameter.name].annotation
                        parameter.value = obj.parameters[parameter.name].default


ORDER = {"parameters": 0, "attributes": 0, "returns": 1, "yields": 1, "raises": 2}


def put_parameters_first(sections: list[DocstringSection]) -> Iterator[DocstringSection]:
    """Purpose, parameters, results and errors, then the explanation, notes and examples."""
    (first, *remaining) = sections
    if first.kind.value == "text":
        purpose, _, explanation = first.value.partition("\n\n")
        yield DocstringSectionText(purpose)
        remaining += [DocstringSectionText(explanation)] * bool(explanation.strip())
    else:
        remaining.insert(0, first)
    yield from sorted(remaining, key=lambda section: (ORDER.get(section.kind.value, 3), section.kind.value != "text"))


def fenced(text: str) -> str:
    """A docstring with its doctests in fences."""
    return re.sub(r"((?<=\n)( *)>>> (?:.+\n)+)", r"\2```pycon\n\1\2```\n", f"{text}\n")


def run_notebook(path: Path, folder: Path) -> str:
    """Run the cells of a notebook in order, and return its page with outputs.

    Parameters
    ----------
    path
        Notebook of Python cells, without outputs.
    folder
        Empty folder in which the cells are run. A cell that writes NAME.png into it shows this picture.

    Returns
    -------
    str
        Page in Markdown, with a link to the notebook.
    """
    names: dict[str, Any] = {"__name__": "__main__"}
    parts = []
    for cell in json.loads(path.read_text("utf-8"))["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(escape_angles(source))
            continue
        earlier_pictures = set(folder.glob("*.png"))
        with chdir(folder), redirect_stdout(StringIO()) as printed:
            exec(compile(source, path.name, "exec"), names)
        parts.append(f"```python\n{source}\n```")
        parts += [f"```text\n{text}\n```" for text in [printed.getvalue().rstrip()] if text]
        parts += [f"![{name.stem}]({name.name})" for name in sorted(set(folder.glob("*.png")) - earlier_pictures)]
    parts.append(f"This page is the notebook `studies/{path.name}`; its cells were run for the outputs.")
    return "\n\n".join(parts) + "\n"


def run(text: str) -> Path:
    """Run the blocks of a page in order and return their folder.

    The folder is new and empty.
    """
    folder = Path(mkdtemp())
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, sys.path)])}
    for language, code in re.findall(r"^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        if language == "python":
            command = [sys.executable, "-c", code + '\nfigure.savefig("by_python.png", dpi=130)\n']
        else:
            command = ["bash", "-ec", f'fecontact() {{ "{sys.executable}" -m fecontact "$@"; }}\n{code}']
        subprocess.run(command, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
    return folder
