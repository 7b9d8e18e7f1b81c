"""One HTML file that needs no other one: how reports look, on a screen of any width and on paper."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from fecontact.outputs.tables.table import Column, Table

if TYPE_CHECKING:
    from PIL.Image import Image

_STYLE = """
:root { --line: #d5d9de; --soft: #f4f6f8; --text: #1c2126; --holds: #56b4e9; --open: #f0e442; --fails: #d55e00; }
* { box-sizing: border-box; }
body { font: 16px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: var(--text); margin: 0 auto;
       max-width: 82rem; padding: 1rem clamp(0.8rem, 3vw, 2.5rem) 4rem; overflow-wrap: break-word; }
h1 { font-size: 1.55rem; line-height: 1.25; margin: 0.6em 0 0.3em; }
h2 { font-size: 1.2rem; margin: 2em 0 0.4em; border-bottom: 2px solid var(--line); }
h3 { font-size: 1.05rem; margin: 1.6em 0 0.4em; }
p, ul, dl { max-width: 52rem; }
.lead, .same, .different { font-size: 1.15rem; border-left: 0.4rem solid var(--line); padding-left: 0.8rem; }
.lead.holds, .same { border-color: var(--holds); }
.lead.fails, .different { border-color: var(--fails); }
.answer { font-weight: 700; padding: 0 0.4em; border: 1px solid #333; border-radius: 0.3em; white-space: nowrap;
          color: #000; }
.HOLDS { background: var(--holds); } .UNRESOLVED { background: var(--open); } .FAILS { background: var(--fails); }
.failed { background: #c8c8c8; }
img { display: block; max-width: 100%; height: auto; margin: 0.6rem 0; }
figure { margin: 0.8rem 0; } figcaption { color: #444; font-size: 0.92rem; max-width: 52rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: 0.5em 0 1.2em; font-size: 0.93rem; }
caption { text-align: left; font-weight: 700; padding: 0.3em 0; }
th, td { border-bottom: 1px solid var(--line); padding: 0.25em 0.7em; text-align: left; vertical-align: top; }
th { background: var(--soft); }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tr.beyond td:first-child { border-left: 0.35rem solid var(--fails); }
details { margin: 0.6em 0 1.2em; } summary { cursor: pointer; font-weight: 700; padding: 0.3em 0; }
dt { font-weight: 700; } dd { margin: 0 0 0.5em 1.2em; }
@media screen and (max-width: 60rem) {
  table.cards, table.cards tbody, table.cards tr, table.cards td { display: block; }
  table.cards tr.head { display: none; }
  table.cards tr { border: 1px solid var(--line); border-radius: 0.4rem; margin: 0 0 0.7rem; padding: 0.3rem 0.2rem; }
  table.cards, table.cards caption { width: 100%; } table.cards caption { display: block; }
  table.cards td { border: 0; padding: 0.1em 0.6em; display: grid; grid-template-columns: 8em 1fr; gap: 0.6em;
                   text-align: left; white-space: normal; overflow-wrap: anywhere; }
  table.cards td:empty { display: none; }
  table.cards td::before { content: attr(data-label); color: #555; overflow-wrap: normal; }
  table.cards .answer { justify-self: start; }
}
@media (min-width: 60rem) {
  figure.small { max-width: 40%; } figure.small:has(:checked) { max-width: none; }
  figure.small label { cursor: zoom-in; }
}
/* a picture is as wide as the screen, where its words may be too small to read: a tap shows it in its full size, and
   moves it inside of its frame */
figure label { display: block; overflow-x: auto; }
figure input { position: absolute; opacity: 0; }
@media screen and (max-width: 70rem) {
  figure label { cursor: zoom-in; } figure label:has(:checked) { cursor: zoom-out; }
  figure label:has(:focus-visible) { outline: 2px solid var(--holds); }
  figure :checked + img { max-width: none; width: 72rem; }
  figcaption::after { content: " (Tap the picture for its full size.)"; color: #666; }
}
@media print {
  body { font-size: 10pt; max-width: none; padding: 0; }
  h2 { break-after: avoid; } h3 { break-after: avoid; } figure, tr { break-inside: avoid; }
  /* what is folded on a screen is open on paper */
  details::details-content { content-visibility: visible; display: block; height: auto; }
  details > summary { list-style: none; }
  .scroll { overflow: visible; } * { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
"""


def page(title: str, body: Sequence[str]) -> str:
    """A whole page, well-formed XML as well; parts of the body are HTML already."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8"/>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>\n'
        # without it a browser asks the server for one
        '<link rel="icon" href="data:,"/>\n'
        f"<title>{escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
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
