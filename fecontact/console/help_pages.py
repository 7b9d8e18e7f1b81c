"""Pages of help: first the options that most runs need, with `--help-all` all of them, with `--help TOPIC` some."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cyclopts import App

from fecontact.console.options import MOST, PANELS, TOPICS, brief
from fecontact.errors import InputError
from fecontact.inputs.texts import nearest

if TYPE_CHECKING:
    from cyclopts.help import HelpPanel

_FLAGS = ("--help", "-h", "--help-all")
_ALL = "all"


@dataclass(frozen=True, kw_only=True)
class Page:
    """What of a command's help is shown, as its formatter.

    Attributes
    ----------
    tokens
        Words by which cyclopts shows the help of the command.
    topic
        A topic, "all", or nothing for the first page.
    topics
        Those of the command, with how many options each has.
    """

    tokens: tuple[str, ...]
    topic: str
    topics: dict[str, int]

    def __call__(self, console: Any, options: Any, panel: HelpPanel) -> None:
        """Print a panel if it is of this page."""
        from attrs import evolve
        from cyclopts.help.formatters import DefaultFormatter

        title = str(panel.title)
        topic = title.lower() if title.lower() in TOPICS else ""
        if title == MOST:
            if self.topic:
                return
            short = [evolve(entry, description=brief(entry.names[0]) or entry.description) for entry in panel.entries]
            panel = panel.copy(entries=short)
        elif self.topic not in (topic, _ALL):
            return
        DefaultFormatter()(console, options, panel)

    @property
    def pointer(self) -> str:
        """What leads from the first page to all the others."""
        if self.topic or not self.topics:
            return ""
        command = " ".join(("fecontact", *self.tokens[:-1]))
        return f"All {sum(self.topics.values())} inputs: {command} --help-all; some: --help {'|'.join(self.topics)}"


def page_of(app: App, words: Sequence[str]) -> Page | None:
    """The page of help that the words of a command ask for, if they ask for one.

    Raises
    ------
    InputError
        For a topic that there is not.
    """
    flag = next((at for at, word in enumerate(words) if word in _FLAGS), None)
    if flag is None:
        return None
    place = next((at for at, word in enumerate(words) if not word.startswith("-") and word in app), None)
    command = None if place is None else words[place]
    topics = {} if command is None else _topics(app[command])
    topic = next((word for at, word in enumerate(words) if at > flag and at != place), "")
    if words[flag] == "--help-all" or not topics:
        topic = _ALL
    elif topic not in ("", *topics):
        meant = nearest(topic, {name: name for name in topics})
        raise InputError(f"help: there is no topic {topic!r}; topics of {command}: {', '.join(topics)}{meant}")
    others = words if not topics else words[: (place or 0) + 1]
    return Page(tokens=(*(word for word in others if word not in _FLAGS), "--help"), topic=topic, topics=topics)


def _topics(command: App) -> dict[str, int]:
    """Topics of a command that has a first page of its own, with how many options each has."""
    if command.default_command is None:
        return {}
    panels: list[Any] = [argument.parameter.group or () for argument in command.assemble_argument_collection()]
    if not any(PANELS[MOST] in own for own in panels):
        return {}
    counts = {topic: sum(PANELS[topic] in own for own in panels) for topic in TOPICS}
    return {topic: count for topic, count in counts.items() if count}
