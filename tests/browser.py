"""Pages as a browser shows them: a headless Chromium that gets them from this process, and from nowhere else."""

import contextlib
import json
import os
import shutil
import subprocess
import threading
from collections.abc import Sequence
from functools import partial
from html import unescape
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")

# The page lies in a frame of the width that is asked for: a window cannot be as narrow as a telephone.
_FRAME = """<!DOCTYPE html><body style="margin:0"><iframe id="page" src="{name}" width="{width}" height="4000"
 style="border:0"></iframe><pre id="told"></pre><script>
const page = document.getElementById("page");
page.onload = () => {{
  const inside = page.contentDocument, shown = inside.documentElement;
  const images = [...inside.images];
  const full = image => {{
    // a tap on a picture shows it in its full size, inside of its frame
    const box = image.parentElement.querySelector("input");
    if (!box) return null;
    box.click();
    const seen = [image.getBoundingClientRect().width, shown.scrollWidth];
    box.click();
    return seen;
  }};
  const cells = [...inside.querySelectorAll("td")].filter(cell => cell.checkVisibility());
  document.getElementById("told").textContent = JSON.stringify({{
    title: inside.title,
    width: page.contentWindow.innerWidth,
    content_width: shown.scrollWidth,
    pictures: images.map(image => [
      image.alt, image.naturalWidth, image.getBoundingClientRect().right, full(image)]),
    requests: page.contentWindow.performance.getEntriesByType("resource").map(one => one.name)
      .filter(name => !name.startsWith("data:")),
    tables: [...inside.querySelectorAll("main > .scroll > table")].map(
      table => [table.offsetWidth, table.parentElement.offsetWidth]),
    blocks: [...inside.querySelectorAll("main > :is(header, p, ul, dl, h2, h3, figure, .scroll), main > figure img")]
      .filter(block => block.checkVisibility() && !block.matches(".small"))
      .map(block => [block.tagName, block.offsetWidth]),
    cells: cells.map(cell => [cell.textContent, cell.offsetWidth, parseFloat(getComputedStyle(cell).fontSize)]),
    folded: [...inside.querySelectorAll("details")].map(one => [one.querySelector("summary").textContent, one.open]),
  }});
}};
</script></body>"""


def browser() -> str:
    """The browser; skips the test where there is none."""
    path_found = next((path for name in _NAMES if (path := shutil.which(name))), None)
    if path_found is None:
        pytest.skip("no Chromium is installed (Debian: apt-get install chromium)")
    return path_found


class _Quiet(SimpleHTTPRequestHandler):
    """Server of a folder with a list of its requests."""

    asked: list[str] = []  # noqa: RUF012

    def log_message(self, format: str, *arguments: object) -> None:
        if format.startswith('"'):
            # a request, such as "GET /page.html HTTP/1.1"
            self.asked.append(str(arguments[0]))


def shown(page: Path, width: int, tmp_path: Path) -> dict[str, Any]:
    """Pictures, requests, cells and console messages of a page at a width.

    With FECONTACT_SCREENSHOTS set to a folder a picture of the page is put there, to be looked at.
    """
    folder = tmp_path / "served"
    folder.mkdir(exist_ok=True)
    shutil.copyfile(page, folder / page.name)
    (folder / "frame.html").write_text(_FRAME.format(name=page.name, width=width), "utf-8")
    record, console = _told(folder, width, tmp_path, page.stem)
    requests = [line.split()[1] for line in _Quiet.asked]
    return record | {"console": console, "asked": sorted(set(requests))}


def _told(folder: Path, width: int, tmp_path: Path, picture: str, *flags: str) -> tuple[Any, list[str]]:
    """Record of frame.html in a folder, and messages on the console."""
    program = browser()
    _Quiet.asked = []
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(folder))) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/frame.html"
        command = [program, "--headless=new", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", *flags]
        command += [f"--user-data-dir={tmp_path / 'browser'}", f"--window-size={max(width, 500)},4000"]
        command += ["--no-first-run", "--virtual-time-budget=20000", "--hide-scrollbars"]
        text = said = ""
        for _ in range(3):
            # on a busy machine the first start may end before the page is there, or never
            with contextlib.suppress(subprocess.TimeoutExpired):
                process = subprocess.run(
                    [*command, "--dump-dom", address], capture_output=True, text=True, timeout=120, check=False
                )
                said = process.stderr
                text = process.stdout.partition('<pre id="told">')[2].partition("</pre>")[0]
            if text:
                break
        if picture and (picture_folder := os.environ.get("FECONTACT_SCREENSHOTS")):
            path = Path(picture_folder) / f"{picture}_{width}.png"
            subprocess.run([*command, f"--screenshot={path}", address], capture_output=True, timeout=180, check=True)
        server.shutdown()
    assert text, said[-2000:]
    return json.loads(unescape(text)), [line for line in said.splitlines() if "CONSOLE" in line]


# Pages of a site, one after the other in one frame: what sticks out, the ground, and what is hard to read on it.
_SITE_FRAME = """<!DOCTYPE html><body style="margin:0"><iframe id="page" width="{width}" height="4000"
 style="border:0"></iframe><pre id="told"></pre><script>
const page = document.getElementById("page"), names = {names}, told = {{}};
const parts = text => {{
  const [red, green, blue, alpha = 1] = text.match(/[\\d.]+/g).map(Number);
  return [red, green, blue, alpha];
}};
const over = ([red, green, blue, alpha], below) =>
  [red, green, blue].map((part, k) => alpha * part + (1 - alpha) * below[k]);
const luminance = colour => {{
  const linear = colour.map(part => part / 255).map(c => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
}};
const ground = (one, style) => {{
  const below = one.parentElement ? ground(one.parentElement, style) : [255, 255, 255];
  return over(parts(style(one).backgroundColor), below);
}};
const measured = () => {{
  const inside = page.contentDocument, shown = inside.documentElement;
  const style = one => page.contentWindow.getComputedStyle(one);
  const scrolls = one => one && (["auto", "scroll"].includes(style(one).overflowX) || scrolls(one.parentElement));
  const own = [...inside.querySelectorAll("article *")].filter(one => one.checkVisibility() && one.offsetWidth);
  const has_words = one => [...one.childNodes].some(node => node.nodeType === 3 && node.data.trim());
  const words = own.filter(one => has_words(one) && !one.matches(".headerlink, .md-clipboard"));
  const contrast = one => {{
    const below = ground(one, style), light = [luminance(over(parts(style(one).color), below)), luminance(below)];
    return (Math.max(...light) + 0.05) / (Math.min(...light) + 0.05);
  }};
  return {{
    width: page.contentWindow.innerWidth,
    content_width: shown.scrollWidth,
    sticks_out: own.filter(one => one.getBoundingClientRect().right > {width} + 1 && !scrolls(one))
      .map(one => one.textContent.slice(0, 60)),
    ground: luminance(ground(inside.querySelector("article"), style)),
    words: words.length,
    faint: words.map(one => [contrast(one), one.tagName + ": " + one.textContent.trim().slice(0, 40)])
      .filter(([size]) => size < {least}),
    lost: [...inside.images].filter(one => !one.loading || one.complete).filter(one => !one.naturalWidth)
      .map(one => one.src),
  }};
}};
const next = () => {{
  if (names.length) page.src = names.shift();
  else document.getElementById("told").textContent = JSON.stringify(told);
}};
page.onload = () => {{
  if (!page.contentDocument.querySelector("article")) return;
  told[decodeURI(page.contentWindow.location.pathname.slice(1))] = measured();
  next();
}};
next();
</script></body>"""


def looked_at(
    site: Path, pages: Sequence[str], width: int, tmp_path: Path, *, dark: bool, least_contrast: float
) -> dict[str, Any]:
    """Records of pages of a site at a width, on a light or a dark ground.

    With FECONTACT_SCREENSHOTS set, a picture is taken of the first page.
    """
    frame, scheme = site / "frame.html", f"--blink-settings=preferredColorScheme={0 if dark else 1}"

    def told(names: Sequence[str], picture: str) -> dict[str, Any]:
        frame.write_text(_SITE_FRAME.format(width=width, names=json.dumps(names), least=least_contrast), "utf-8")
        return _told(site, width, tmp_path, picture, scheme)[0]

    try:
        if os.environ.get("FECONTACT_SCREENSHOTS"):
            told(pages[:1], f"site_{'dark' if dark else 'light'}")
        return told(pages, "")
    finally:
        frame.unlink()


def assert_readable(page: Path, tmp_path: Path, *, widths: tuple[int, ...] = (400, 1600)) -> dict[str, Any]:
    """Check that a page is complete and readable at these widths.

    Returns the record of the page at the last width.
    """
    pages: dict[str, Any] = {}
    for width in widths:
        pages = shown(page, width, tmp_path)
        assert pages["console"] == []
        assert pages["requests"] == []
        # the favicon of the frame is the browser's own wish
        assert set(pages["asked"]) <= {"/frame.html", f"/{page.name}", "/favicon.ico"}
        assert pages["width"] == width
        # nothing sticks out, and texts, tables and pictures have one width
        assert pages["content_width"] <= width
        assert len({block_width for _, block_width in pages["blocks"]}) == 1, pages["blocks"]
        assert all(table >= frame for table, frame in pages["tables"])
        for words, size, right, full in pages["pictures"]:
            assert size > 100, words
            # the picture itself, not only its frame
            assert right <= width, words
            assert full is not None, words
            # in full size its words can be read on a telephone as on a screen; the page does not get wider
            assert full[0] > 0.99 * min(1100, size), words
            assert full[1] <= width, words
        for text, wide, font in pages["cells"]:
            assert font >= 12.0, text
            # no word is broken into syllables: an average character is half of its height wide
            longest = max((len(word) for word in text.split()), default=0)
            assert wide >= min(0.4 * font * longest, 0.5 * width), text
    return pages
