"""The documentation site, built from the repository.

Checked: links, pages, pictures, and that nothing comes from elsewhere.
"""

import json
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest
from browser import looked_at
from test_documents import commands
from test_documents import test_a_command_is_understood as check_command

from fecontact.cli import call

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site from `make docs`.

    A broken link ends the build.
    """
    pytest.importorskip("material", reason="the site needs the extra docs")
    site = tmp_path_factory.mktemp("docs") / "site"
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", "studies/mkdocs.yml", "--site-dir", str(site)]
    completed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=1200, check=False)
    assert completed.returncode == 0, completed.stderr[-3000:]
    return site


# the gallery is run for its pictures
@pytest.mark.slow
def test_the_site_is_built_and_whole(site):
    # each study has a page, with the checks of its last validation
    for path in (ROOT / "studies").glob("[0-9]*.py"):
        page = (site / "studies" / f"{path.stem}.html").read_text("utf-8")
        checked = (ROOT / "studies" / "validation" / f"{path.stem}.md").exists()
        assert ("E / u_val" in page) == checked, path
    validation = (site / "studies" / "VALIDATION.html").read_text("utf-8")
    assert 'href="06_manchester.html#checks"' in validation
    # what a page shows is HTML: the name of a tag has ASCII letters
    for path in site.rglob("*.html"):
        assert [
            tag for tag in TextOfPage(path.read_text("utf-8")).tags if not re.fullmatch("[a-z][a-z0-9-]*", tag)
        ] == []
    assert "sqrt(5 &lt;x²&gt;)" in (site / "data_dictionary.html").read_text("utf-8")
    # public names with their inputs, the gallery with its pictures
    assert "lateral_shift_mm" in (site / "api" / "Case.html").read_text("utf-8")
    gallery = (site / "gallery.html").read_text("utf-8")
    pictures = re.findall(r'<img [^>]*src="([^":]+)"', gallery)
    assert len(pictures) > 5
    assert [picture for picture in pictures if not (site / picture).is_file()] == []


# WCAG 2.1: 4.5 for text; 3 for large text and for what else is to be seen, such as the colours of code
@pytest.mark.slow
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [390, 1400])
def test_pages_of_the_site_fit_and_can_be_read_in_a_browser(site, width, dark, tmp_path):
    pages = sorted(path.relative_to(site).as_posix() for path in site.rglob("*.html") if path.name != "404.html")
    assert len(pages) > 50
    # the one with the widest tables is the one to look at
    pages.sort(key=lambda page: page != "studies/VALIDATION.html")
    faults_by_page = looked_at(site, pages, width, tmp_path, dark=dark, least_contrast=3.0)
    assert sorted(faults_by_page) == sorted(pages)
    for page, faults in faults_by_page.items():
        assert faults["width"] == width
        assert faults["content_width"] <= width, page
        assert faults["sticks_out"] == [], page
        # black is 0 and white 1
        assert (faults["ground"] < 0.03) if dark else (faults["ground"] > 0.9), page
        assert faults["words"] > 3, page
        assert faults["faint"] == [], page
        assert faults["lost"] == [], page


def test_what_does_not_fit_or_cannot_be_read_is_seen(tmp_path):
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "bad.html").write_text(
        """<!DOCTYPE html><html><body style="margin:0"><article>
        <p style="color:#999">hardly</p><p style="color:#aaa">faint</p><p style="color:rgba(0, 0, 0, 0.3)">thin</p>
        <div style="overflow-x:auto"><p style="width:900px">scrolls</p></div><div style="overflow:hidden"><p
        style="width:900px">cut</p></div><img src="none.png" width="9" height="9"></article></body></html>""",
        "utf-8",
    )
    faults = looked_at(tmp_path / "site", ["bad.html"], 390, tmp_path, dark=True, least_contrast=2.5)["bad.html"]
    assert (faults["width"], faults["content_width"], faults["sticks_out"], faults["words"]) == (390, 390, ["cut"], 5)
    # white in spite of the wish for a dark ground; greys of 2.8, 2.3 and 2.1 on it
    assert faults["ground"] == 1.0
    assert [(round(size, 1), words) for size, words in faults["faint"]] == [(2.3, "P: faint"), (2.1, "P: thin")]
    assert [address.rpartition("/")[2] for address in faults["lost"]] == ["none.png"]


class TextOfPage(HTMLParser):
    """Text of a page outside code, and the names of its tags."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.text, self.tags, self.depth = "", set(), 0
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.depth += tag in ("code", "pre", "script", "style")

    def handle_endtag(self, tag):
        self.depth -= tag in ("code", "pre", "script", "style")

    def handle_data(self, text):
        self.text += text * (self.depth == 0)


def test_no_page_swallows_a_less_than_sign():
    """Each `<` outside code is text: Python's Markdown takes `<x²>` for a tag."""
    pages = pytest.importorskip("studies.site.pages", reason="the site needs the extra docs")
    import markdown

    extensions = {"tables": {}, "attr_list": {}, "pymdownx.superfences": {}, "pymdownx.details": {}}
    sources = dict(pages.read_pages())
    assert {
        "overview.md",
        "fecontact/guide/results.md",
        "data_dictionary.md",
        "studies/12_uncertainty.md",
    } <= sources.keys()
    counts = {}
    for uri, source in sources.items():
        outside_code = pages.CODE.sub("", source)
        if "<" not in outside_code:
            continue
        rendered = TextOfPage(markdown.markdown(pages.escape_angles(source), extensions=[*extensions]))
        assert rendered.text.count("<") == outside_code.count("<"), uri
        assert rendered.text.count("&lt;") == outside_code.count("&lt;"), uri
        counts[uri] = outside_code.count("<")
    # the test can fail: these pages have such signs, and would lose them
    assert counts["fecontact/guide/results.md"] > 0
    plain = TextOfPage(markdown.markdown(sources["fecontact/guide/results.md"], extensions=[*extensions]))
    assert plain.text.count("<") < counts["fecontact/guide/results.md"]


@pytest.mark.parametrize(
    ("text", "escaped"),
    [
        ("sqrt(5 <x²>)", "sqrt(5 &lt;x²>)"),
        ("`a < b` and c < d", "`a < b` and c &lt; d"),
        ("``a ` < b`` < c", "``a ` < b`` &lt; c"),
        ("```text\n<S>\n```\n<S>", "```text\n<S>\n```\n&lt;S>"),
        (
            "??? example\n\n    ```python\n    a < b\n    ```\n<",
            "??? example\n\n    ```python\n    a < b\n    ```\n&lt;",
        ),
        ("a ` alone < b\n\nand ` < c", "a ` alone &lt; b\n\nand ` &lt; c"),
    ],
)
def test_a_less_than_sign_outside_code_is_text(text, escaped):
    pages = pytest.importorskip("studies.site.pages", reason="the site needs the extra docs")
    assert pages.escape_angles(text) == escaped


def load_documented(source: str, name: str, tmp_path: Path):
    """An object of a module with this source, as the site documents it."""
    griffe = pytest.importorskip("griffe", reason="the site needs the extra docs")
    from studies.site.pages import Docstrings

    (tmp_path / "documented.py").write_text(source, "utf-8")
    extensions = griffe.load_extensions(Docstrings)
    module = griffe.load("documented", search_paths=[tmp_path], extensions=extensions, docstring_parser="numpy")
    return module[name]


def test_parameters_come_first_on_the_page_of_a_function(tmp_path):
    """Purpose, parameters with their types, results and errors; then explanation, example and notes."""
    source = '''def f(a: int, b: str = "x") -> int:
    """Purpose.

    Explanation with 1 < 2.

    >>> f(1)
    2

    Parameters
    ----------
    a, b
        Both.

    Returns
    -------
    int
        Result.

    Raises
    ------
    ValueError
        Never.

    Notes
    -----
    Source.
    """
'''
    sections = load_documented(source, "f", tmp_path).docstring.parsed
    assert [section.kind.value for section in sections] == [
        "text", "parameters", "returns", "raises", "text", "admonition",
    ]  # fmt: skip
    assert sections[0].value == "Purpose."
    assert sections[4].value.startswith("Explanation with 1 &lt; 2.\n\n```pycon\n>>> f(1)\n2\n```")
    assert [(parameter.name, str(parameter.annotation), parameter.value) for parameter in sections[1].value] == [
        ("a", "int", None), ("b", "str", "'x'"),
    ]  # fmt: skip


@pytest.mark.slow
def test_the_landing_page_has_a_map_and_three_doors(site):
    page = (site / "index.html").read_text("utf-8")
    assert 'src="studies/figures/map.png"' in page
    article = page.partition("<article")[2].partition("</article>")[0]
    assert re.findall(r'<h2 id="([^"]+)"', article) == [
        "you-are-new-here", "you-have-a-vehicle-model", "you-do-research", "all-pages",
    ]  # fmt: skip
    for link in ("gallery.html", "studies/VALIDATION.html", "fecontact/guide/decision.html", "overview.html"):
        assert f'href="{link}' in article, link
        assert (site / link).is_file()


def test_the_commands_of_the_landing_page_are_understood():
    text = re.sub("^ {4}", "", (ROOT / "studies" / "site" / "index.md").read_text("utf-8"), flags=re.MULTILINE)
    typed_commands = commands(text)
    assert len(typed_commands) == 5
    for command in typed_commands:
        check_command(command)
    targets = re.findall(r"^ *make ([a-z]+)$", text, re.MULTILINE)
    assert targets == ["demo", "validate"]
    assert all(f"\n{target}: " in (ROOT / "Makefile").read_text("utf-8") for target in targets)


def test_a_page_that_needs_something_from_elsewhere_is_refused():
    pages = pytest.importorskip("studies.site.pages", reason="the site needs the extra docs")
    page = type("Page", (), {"file": type("File", (), {"src_uri": "a.md"})})
    assert pages.on_post_page('<img src="a.png">', page, None)
    with pytest.raises(pages.PluginError, match="needs something from elsewhere"):
        pages.on_post_page('<script src="https://elsewhere/a.js"></script>', page, None)


NOTEBOOKS = sorted((ROOT / "studies").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_has_cells_without_outputs(path):
    notebook = json.loads(path.read_text("utf-8"))
    assert (notebook["nbformat"], notebook["metadata"]["kernelspec"]["language"]) == (4, "python")
    assert {cell["cell_type"] for cell in notebook["cells"]} == {"code", "markdown"}
    code_cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code_cells)
    assert len({cell["id"] for cell in notebook["cells"]}) == len(notebook["cells"])


def test_the_cells_of_a_notebook_share_names_and_show_outputs_and_pictures(tmp_path):
    pages = pytest.importorskip("studies.site.pages", reason="the site needs the extra docs")
    sources = [
        ("markdown", "# A page"),
        ("code", "value = 2\nprint('value', value)"),
        ("code", "from pathlib import Path\n\nPath('drawn.png').write_bytes(bytes(value))"),
    ]
    cells = [{"cell_type": kind, "source": source.splitlines(keepends=True)} for kind, source in sources]
    (tmp_path / "small.ipynb").write_text(json.dumps({"cells": cells}), "utf-8")
    folder = tmp_path / "empty"
    folder.mkdir()
    page = pages.run_notebook(tmp_path / "small.ipynb", folder)
    assert page.startswith("# A page\n\n```python\nvalue = 2\nprint('value', value)\n```\n\n```text\nvalue 2\n```\n")
    assert "```\n\n![drawn](drawn.png)\n" in page
    assert (folder / "drawn.png").read_bytes() == b"\0\0"
    # an error of a cell ends the build
    cells[1]["source"] = ["1 / 0"]
    (tmp_path / "small.ipynb").write_text(json.dumps({"cells": cells}), "utf-8")
    with pytest.raises(ZeroDivisionError):
        pages.run_notebook(tmp_path / "small.ipynb", folder)


@pytest.mark.slow
def test_the_notebook_of_the_decision_has_the_answers_of_the_commands(tmp_path, capsys):
    """From a file to the settings: `fecontact hertz --set-in` prints equal numbers."""
    pages = pytest.importorskip("studies.site.pages", reason="the site needs the extra docs")
    page = pages.run_notebook(ROOT / "studies" / "decision.ipynb", tmp_path)
    assert "![decision](decision.png)" in page
    printed = "".join(re.findall(r"^```text\n(.*?)^```$", page, re.MULTILINE | re.DOTALL))
    assert "rolling radius 460.0 mm" in printed
    position = re.search(r"^equilibrium: shift (\S+) mm, yaw (\S+) mrad$", printed, re.MULTILINE)
    assert re.search(r"^Hertz HOLDS", printed, re.MULTILINE)
    assert "cheapest theory that holds: hertz" in printed
    assert re.search(r"^T-gamma of Hertz [+-][\d.]+ ± [\d.]+ %$", printed, re.MULTILINE)
    assert re.search(r"^Hertz for forces HOLDS", printed, re.MULTILINE)
    options = ["--rail", "UIC60", "--inclination", "1:20", "--wheel", str(tmp_path / "worn" / "wheel.whl")]
    options += ["--side", "right", "--shift", position[1], "--yaw-mrad", position[2], "--load-kn", "60"]
    capsys.readouterr()
    assert call(["hertz", *options, "--set-in", "SIMPACK"]) == 0
    rows = {
        tuple(re.split(r" {2,}", line)[:2]): float(line.split()[-1])
        for line in capsys.readouterr().out.splitlines()
        if len(re.split(r" {2,}", line)) == 3 and re.fullmatch(r"[\d.e+-]+", line.split()[-1])
    }
    for text, row, digits in (
        (r"K_H (\S+) N/m", ("spring K_H, F_n = K_H d^1.5", "N/m^1.5"), 1e-3),
        (r"^a (\S+) mm along", ("semi-axis a, along the track", "mm"), 1e-3),
        (r"mm along the track, b (\S+) mm across", ("semi-axis b, across", "mm"), 1e-3),
        (r"^Rx (\S+) mm", ("equivalent radius Rx, along the track", "mm"), 1e-3),
        (r"mm, Ry (\S+) mm", ("equivalent radius Ry, across", "mm"), 2e-3),
        (r"y (\S+) mm of the rail", ("contact point, y on the rail profile", "mm"), 1e-3),
    ):
        assert float(re.search(text, printed, re.MULTILINE)[1]) == pytest.approx(rows[row], rel=digits), row
