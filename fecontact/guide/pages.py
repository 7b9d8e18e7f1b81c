"""Which pages the guide has, and what they say: every `TOPIC.md` of this folder is one."""

from __future__ import annotations

import re
from pathlib import Path

from fecontact.errors import InputError
from fecontact.inputs.texts import nearest

_FOLDER = Path(__file__).parent


def titles() -> dict[str, str]:
    """Title of each page by its topic."""
    return {path.stem: _title(path.read_text("utf-8")) for path in sorted(_FOLDER.glob("*.md"))}


def page(topic: str) -> str:
    """The page of a topic, in Markdown.

    Raises
    ------
    InputError
        If there is no such topic.
    """
    known = titles()
    name = topic.lower().removesuffix(".md")
    if name not in known:
        meant = nearest(name, {spelling: each for each, title in known.items() for spelling in (each, title)})
        raise InputError(f"guide: there is no topic {topic!r}; topics are {', '.join(known)}{meant}")
    return (_FOLDER / f"{name}.md").read_text("utf-8")


def without_links(text: str) -> str:
    """A page for a terminal: a link to another page names its command, others and pictures have their words alone."""
    text = re.sub(r"!\[([^\]]*)\]\([^)]*\)", r"(Picture in the documentation: \1)", text)
    text = re.sub(r"\[([^\]]*)\]\((\w+)\.md(?:#[^)]*)?\)", r"\1 (`fecontact guide \2`)", text)
    return re.sub(r"\[([^\]]*)\]\([^)]*\.(?:md|py)(?:#[^)]*)?\)", r"\1", text)


def _title(text: str) -> str:
    return text.partition("\n")[0].removeprefix("# ")
