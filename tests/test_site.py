"""The site of the documentation, built from the repository: links, pages, pictures, nothing from elsewhere."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


# the gallery is run for its pictures
@pytest.mark.slow
def test_the_site_is_built_and_whole(tmp_path):
    """As `make docs` does; a link that leads nowhere ends the build."""
    pytest.importorskip("material", reason="the site needs the extra docs")
    site = tmp_path / "site"
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", "studies/mkdocs.yml", "--site-dir", str(site)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=1200, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    # each study has a page, with the checks of its last validation
    for path in (ROOT / "studies").glob("[0-9]*.py"):
        page = (site / "studies" / f"{path.stem}.html").read_text("utf-8")
        checked = (ROOT / "studies" / "validation" / f"{path.stem}.md").exists()
        assert ("E / u_val" in page) == checked, path
    validation = (site / "studies" / "VALIDATION.html").read_text("utf-8")
    assert 'href="06_manchester.html#checks"' in validation
    # public names with their inputs, the gallery with its pictures
    assert "lateral_shift_mm" in (site / "api" / "Case.html").read_text("utf-8")
    gallery = (site / "gallery.html").read_text("utf-8")
    shown = re.findall(r'<img [^>]*src="([^":]+)"', gallery)
    assert len(shown) > 5
    assert [one for one in shown if not (site / one).is_file()] == []


def test_a_page_that_needs_something_from_elsewhere_is_refused():
    pages = pytest.importorskip("studies.site.pages", reason="the site needs the extra docs")
    page = type("Page", (), {"file": type("File", (), {"src_uri": "a.md"})})
    assert pages.on_post_page('<img src="a.png">', page, None)
    with pytest.raises(pages.PluginError, match="needs something from elsewhere"):
        pages.on_post_page('<script src="https://elsewhere/a.js"></script>', page, None)
