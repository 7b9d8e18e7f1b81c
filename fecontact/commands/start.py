"""Commands of the first minutes: the guide, a study to begin with, its check, and the machine's."""

from __future__ import annotations

import sys
from pathlib import Path

from fecontact.console.messages import tell_notes
from fecontact.outputs.terminal import count


def guide(topic: str = "", /) -> int:
    """Show the guide: its topics, or the page of one.

    Parameters
    ----------
    topic
        Which page; without it the topics are listed.
    """
    from fecontact.guide.pages import page, titles, without_links
    from fecontact.outputs.terminal import print_page, print_titles

    if topic:
        print_page(page(topic), without_links)
    else:
        print_titles(titles())
    return 0


def check(file: Path, *, quick: bool = False, json: bool = False) -> int:
    """Check a study file without solving it: inputs, profiles and positions, how many cases, what time and memory.

    Parameters
    ----------
    file
        A script with `cases(quick=False)`, or a TOML file of cases.
    quick
        The small version of the study.
    json
        Print what was found as JSON and nothing else.
    """
    from dataclasses import asdict

    from fecontact.files import json_text
    from fecontact.runs.check import check_study

    found = check_study(file, quick=quick)
    if json:
        print(json_text(asdict(found)))
        return 2 if found.problems else 0
    print(f"{file}: {count(found.cases, 'case')}, {', '.join(found.varied) or 'nothing varied'}")
    for line in () if found.cost is None else found.cost.words:
        print(line)
    tell_notes(found.notes)
    for problem in found.problems:
        print(f"error: {problem}", file=sys.stderr)
    if 0 < found.placed < found.positions:
        which = "up to the first that is none" if found.problems else "spread over the study"
        print(f"{found.placed} of {count(found.positions, 'position')} were tried, {which}", file=sys.stderr)
    return 2 if found.problems else 0


def init(folder: Path) -> int:
    """Put a study file with comments and a script into a folder, to begin with.

    Parameters
    ----------
    folder
        Where they go; files that are there already stay.
    """
    from fecontact.runs.study_templates import write_templates

    made = write_templates(folder)
    for path in made:
        print(path)
    print(f"Next: fecontact check {made[0]}, then: fecontact run {made[0]} --out {folder / 'results'}")
    return 0


def doctor() -> int:
    """Say what this machine has for fecontact: packages, system libraries, solvers, memory, and what to do."""
    from fecontact.doctor import doctor as examine_machine

    return examine_machine()
