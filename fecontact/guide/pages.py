"""Pages of the guide: every file `TOPIC.md` in this folder."""

from __future__ import annotations

import re
from pathlib import Path

from fecontact.errors import InputError
from fecontact.inputs.texts import suggest_name

_FOLDER = Path(__file__).parent


def read_titles() -> dict[str, str]:
    """Titles of the pages, by topic."""
    return {path.stem: _title(path.read_text("utf-8")) for path in sorted(_FOLDER.glob("*.md"))}


def read_page(topic: str) -> str:
    """Markdown text of a page.

    Parameters
    ----------
    topic
        Topic, with or without the ending `.md`, in upper or lower case.

    Returns
    -------
    str
        Text of the page.

    Raises
    ------
    InputError
        If the topic does not exist. The message has the nearest topic.
    """
    page_titles = read_titles()
    name = topic.lower().removesuffix(".md")
    if name not in page_titles:
        suggestion = suggest_name(
            name,
            {
                spelling: name_of_page
                for name_of_page, title in page_titles.items()
                for spelling in (name_of_page, title)
            },
        )
        raise InputError(f"guide: there is no topic {topic!r}; topics: {', '.join(page_titles)}{suggestion}")
    return (_FOLDER / f"{name}.md").read_text("utf-8")


def remove_links(text: str) -> str:
    """Text of a page for a terminal, without links.

    A link to another page becomes the command that shows the page. Other links and pictures keep their words.

    Parameters
    ----------
    text
        Markdown text of a page.

    Returns
    -------
    str
        Text without links.
    """
    text = re.sub(r"!\[([^\]]*)\]\([^)]*\)", r"(Picture in the documentation: \1)", text)
    text = re.sub(r"\[([^\]]*)\]\((\w+)\.md(?:#[^)]*)?\)", r"\1 (`fecontact guide \2`)", text)
    return re.sub(r"\[([^\]]*)\]\([^)]*\.(?:md|py|ipynb)(?:#[^)]*)?\)", r"\1", text)


def _title(text: str) -> str:
    return text.partition("\n")[0].removeprefix("# ")
