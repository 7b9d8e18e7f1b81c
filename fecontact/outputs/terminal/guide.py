"""The guide on the terminal: which pages there are, and one of them."""

from __future__ import annotations

from collections.abc import Mapping


def print_titles(titles: Mapping[str, str]) -> None:
    """Print the topics with the titles of their pages."""
    width = max(map(len, titles))
    for topic, title in titles.items():
        print(f"  {topic:{width}}  {title}")
    print("One of them: fecontact guide TOPIC")


def print_page(text: str) -> None:
    """Print a page in Markdown: laid out on a terminal, as it is into a file or a pipe."""
    from rich.console import Console

    console = Console()
    if not console.is_terminal:
        print(text, end="")
        return
    from rich.markdown import Markdown

    # addresses of other pages are shown: a click on them would lead nowhere
    console.print(Markdown(text, hyperlinks=False))
