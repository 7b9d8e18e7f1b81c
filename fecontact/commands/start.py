"""Commands of the first minutes: an example, the guide, a study to begin with, its check, and the machine's."""

from __future__ import annotations

import sys
from pathlib import Path

from fecontact.commands.console import many, tell_notes
from fecontact.outputs.terminal import count, show
from fecontact.packages import require_finite_elements


def demo(*, out: Path = Path("out/demo")) -> int:
    """Solve one position and a sphere, where Hertz is exact, and say what came out; half a minute.

    Parameters
    ----------
    out
        Folder for the results.
    """
    from fecontact.outputs.documents import rows_parts
    from fecontact.runs.study import demo_study, demo_words, run_study

    require_finite_elements()
    print("A wheel on a rail, and a sphere on a plane, for which Hertz's theory is exact; half a minute:", flush=True)
    with many("cases") as progress:
        outcome = run_study(demo_study(), out, progress=progress)
    show(rows_parts(outcome.rows))
    print(demo_words(out, outcome))
    return 0 if outcome.all_converged else 3


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
    from fecontact.runs.study import check_study

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
    from fecontact.runs.casefile import write_templates

    made = write_templates(folder)
    for path in made:
        print(path)
    print(f"Next: fecontact check {made[0]}, then: fecontact run {made[0]} --out {folder / 'results'}")
    return 0


def doctor() -> int:
    """Say what this machine has for fecontact: packages, system libraries, solvers, memory, and what to do."""
    from fecontact.doctor import doctor as examine_machine

    return examine_machine()
