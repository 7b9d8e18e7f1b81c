"""One HTML file that needs no other one: how reports look, on a screen of any width and on paper."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from fecontact.outputs.tables.table import Column, Table

if TYPE_CHECKING:
    from PIL.Image import Image


def page(title: str, body: Sequence[str]) -> str:
    """A whole page, well-formed XML as well; parts of the body are HTML already."""
    style = (files("fecontact.outputs.reports") / "style.css").read_text("utf-8")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8"/>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>\n'
        # without it a browser asks the server for one
        '<link rel="icon" href="data:,"/>\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n"
        + "\n".join(part for part in body if part)
        + "\n</body>\n</html>\n"
    )


def heading(text: str, level: int = 2) -> str:
    """A heading."""
    return f"<h{level}>{escape(text)}</h{level}>"


def paragraph(text: str, style: str = "") -> str:
    """A paragraph of plain text; nothing where there is none."""
    of = f' class="{style}"' if style else ""
    return f"<p{of}>{escape(text)}</p>" if text else ""


def answer(text: str) -> str:
    """A verdict on its colour; nothing where there is none."""
    if not text:
        return ""
    kind = text if text in ("HOLDS", "UNRESOLVED", "FAILS") else "failed"
    return f'<span class="answer {kind}">{escape(text)}</span>'


def items(lines: Sequence[str]) -> str:
    """A list; nothing where it is empty."""
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>" if lines else ""


def table(of: Table) -> str:
    """A table, each row a card of its own on a narrow screen; nothing where it has no rows."""
    if not of.rows:
        return ""
    heads = [column.heading.replace("\n", " ").strip() for column in of.columns]

    def cell(column: Column, head: str, text: str) -> str:
        kind = ' class="number"' if column.kind == "number" else ""
        shown = answer(text) if column.kind == "answer" else escape(text)
        return f'<td{kind} data-label="{escape(head)}">{shown}</td>'

    lines = []
    for row in of.rows:
        texts = "".join(map(cell, of.columns, heads, row.cells))
        beyond = ' class="beyond"' if row.tone == "fails" else ""
        lines.append(f"<tr{beyond}>{texts}</tr>\n")
    title = f"<caption>{escape(of.title)}</caption>\n" if of.title else ""
    head = "".join(f'<th scope="col">{escape(name)}</th>' for name in heads)
    content = f'{title}<tr class="head">{head}</tr>\n{"".join(lines)}'
    return f'<div class="scroll"><table class="cards">\n{content}</table></div>'


def folded(summary: str, content: str) -> str:
    """What is shown on demand only; nothing where there is nothing."""
    return f"<details>\n<summary>{escape(summary)}</summary>\n{content}</details>" if content else ""


def terms(pairs: Sequence[tuple[str, str]]) -> str:
    """Terms and what they mean."""
    return "<dl>" + "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in pairs) + "</dl>"


def picture(path: Path, words: str, *, small: bool = False) -> str:
    """A PNG or SVG file as part of the page, with a text for who cannot see it; nothing where the file is not there.

    On a wide screen a small one takes 40 % of it.
    """
    if not path.is_file():
        return ""
    if path.suffix == ".svg":
        return drawing(path.read_bytes(), words)
    from PIL.Image import open as open_image

    with open_image(path) as image:
        return pixels(image, words, small=small)


def drawing(svg: bytes, words: str) -> str:
    """An SVG as part of the page."""
    return _figure("image/svg+xml", svg, words)


def pixels(image: Image, words: str, *, width: int = 1600, small: bool = False) -> str:
    """An image as part of the page: WebP of at most `width` pixels, a fifth of the size of a PNG."""
    from PIL.Image import Resampling

    shown = image.convert("RGB")
    if shown.width > width:
        shown = shown.resize((width, round(shown.height * width / shown.width)), Resampling.BICUBIC)
    content = BytesIO()
    # a smaller file by 3 % would take twice as long
    shown.save(content, "WEBP", quality=82, method=2)
    return _figure("image/webp", content.getvalue(), words, small=small)


def _figure(kind: str, content: bytes, words: str, *, small: bool = False) -> str:
    data = base64.b64encode(content).decode("ascii")
    of = ' class="small"' if small else ""
    return (
        f'<figure{of}><label><input type="checkbox" aria-label="Show the picture in its full size"/>'
        f'<img alt="{escape(words)}" src="data:{kind};base64,{data}"/></label>'
        f"<figcaption>{escape(words)}</figcaption></figure>"
    )
