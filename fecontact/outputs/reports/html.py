"""One HTML file that needs no other one: how a document looks, on a screen of any width and on paper."""

from __future__ import annotations

import base64
from functools import cache
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from jinja2 import Environment, Template
from markupsafe import Markup

from fecontact.outputs.documents.parts import Parts, Picture

if TYPE_CHECKING:
    from PIL.Image import Image

_FILES = files("fecontact.outputs.reports")
_ANSWERS = ("HOLDS", "UNRESOLVED", "FAILS")


def page(title: str, parts: Parts) -> str:
    """A document as a whole page, well-formed XML as well."""
    style = (_FILES / "style.css").read_text("utf-8")
    return _template().render(title=title, parts=list(parts), style=style, answers=_ANSWERS, picture=_picture)


@cache
def _template() -> Template:
    return Environment(autoescape=True).from_string((_FILES / "page.html").read_text("utf-8"))


def _picture(of: Picture) -> Markup:
    """A picture as part of the page, with a text for who cannot see it; nothing where its file is not there."""
    content = of.content
    if isinstance(content, Path):
        if not content.is_file():
            return Markup()
        if content.suffix != ".svg":
            from PIL.Image import open as open_image

            with open_image(content) as image:
                return _figure("image/webp", _webp(image, of.width), of)
        content = content.read_bytes()
    if isinstance(content, bytes):
        return _figure("image/svg+xml", content, of)
    return _figure("image/webp", _webp(content, of.width), of)


def _webp(image: Image, width: int) -> bytes:
    """An image of at most so many pixels, a fifth of the size of a PNG."""
    from PIL.Image import Resampling

    shown = image.convert("RGB")
    if shown.width > width:
        shown = shown.resize((width, round(shown.height * width / shown.width)), Resampling.BICUBIC)
    content = BytesIO()
    # a smaller file by 3 % would take twice as long
    shown.save(content, "WEBP", quality=82, method=2)
    return content.getvalue()


def _figure(kind: str, content: bytes, of: Picture) -> Markup:
    small = Markup(' class="small"') if of.small else ""
    data = base64.b64encode(content).decode("ascii")
    return Markup(
        '<figure{}><label><input type="checkbox" aria-label="Show the picture in its full size"/>'
        '<img alt="{}" src="data:{};base64,{}"/></label><figcaption>{}</figcaption></figure>'
    ).format(small, of.words, kind, data, of.words)
