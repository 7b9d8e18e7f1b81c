"""Pages of help: common options (`--help`), all options (`--help-all`), a topic (`--help TOPIC`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cyclopts import App

from fecontact.console.options import COMMON_INPUTS_TITLE, PANELS, STORED_DEFAULT, TOPICS, find_brief_help
from fecontact.errors import InputError
from fecontact.inputs.texts import suggest_name

if TYPE_CHECKING:
    from cyclopts.help import HelpPanel

_FLAGS = ("--help", "-h", "--help-all")
_ALL = "all"


@dataclass(frozen=True, kw_only=True)
class HelpPage:
    """Page of a command's help, used as the formatter of cyclopts.

    Attributes
    ----------
    tokens
        Words with which cyclopts shows the help of the command.
    topic
        A topic, "all", or empty for the first page.
    topics
        Number of options of each topic of the command.
    """

    tokens: tuple[str, ...]
    topic: str
    topics: dict[str, int]

    def __call__(self, console: Any, options: Any, panel: HelpPanel) -> None:
        """Print a panel if it belongs to this page.

        Parameters
        ----------
        console
            Console of rich.
        options
            Options of the console.
        panel
            Panel of help with its options.
        """
        from attrs import evolve
        from cyclopts.help.formatters import DefaultFormatter

        title = str(panel.title)
        topic = title.lower() if title.lower() in TOPICS else ""
        if title == COMMON_INPUTS_TITLE:
            if self.topic:
                return
            panel = panel.copy(
                entries=[evolve(entry, description=_shorten_description(entry)) for entry in panel.entries]
            )
        elif self.topic not in (topic, _ALL):
            return
        DefaultFormatter()(console, options, panel)

    @property
    def pointer(self) -> str:
        """Line of the first page with the commands for all other pages; empty on other pages."""
        if self.topic or not self.topics:
            return ""
        command = " ".join(("fecontact", *self.tokens[:-1]))
        return f"All {sum(self.topics.values())} inputs: {command} --help-all; by topic: --help {'|'.join(self.topics)}"


def _shorten_description(option: Any) -> Any:
    """Short description of an option, for the first page."""
    # the help of all commands is Markdown; the text of a description is its source
    is_stored = STORED_DEFAULT in option.description.primary_renderable.markup
    return find_brief_help(option.names[0], is_stored=is_stored) or option.description


def find_help_page(app: App, words: Sequence[str]) -> HelpPage | None:
    """Page of help that the words of a command request.

    Parameters
    ----------
    app
        Application with its commands.
    words
        Words of the command line.

    Returns
    -------
    HelpPage or None
        None if the words request no help.

    Raises
    ------
    InputError
        If the topic does not exist.
    """
    flag = next((position for position, word in enumerate(words) if word in _FLAGS), None)
    if flag is None:
        return None
    place = next((position for position, word in enumerate(words) if not word.startswith("-") and word in app), None)
    command = None if place is None else words[place]
    topics = {} if command is None else _topics(app[command])
    topic = next((word for position, word in enumerate(words) if position > flag and position != place), "")
    if words[flag] == "--help-all" or not topics:
        topic = _ALL
    elif topic not in ("", *topics):
        suggestion = suggest_name(topic, {name: name for name in topics})
        raise InputError(f"help: unknown topic {topic!r} of {command}; allowed: {', '.join(topics)}{suggestion}")
    shown_words = words if not topics else words[: (place or 0) + 1]
    return HelpPage(
        tokens=(*(word for word in shown_words if word not in _FLAGS), "--help"), topic=topic, topics=topics
    )


def _topics(command: App) -> dict[str, int]:
    """Number of options of each topic of a command; empty if the command has no first page."""
    if command.default_command is None:
        return {}
    panels: list[Any] = [argument.parameter.group or () for argument in command.assemble_argument_collection()]
    if not any(PANELS[COMMON_INPUTS_TITLE] in argument_panels for argument_panels in panels):
        return {}
    counts = {topic: sum(PANELS[topic] in argument_panels for argument_panels in panels) for topic in TOPICS}
    return {topic: count for topic, count in counts.items() if count}
