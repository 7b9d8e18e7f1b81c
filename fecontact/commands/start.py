"""Commands for the first steps: the guide, template files of a study, and checks of the study and of the machine."""

from __future__ import annotations

import sys
from pathlib import Path

from fecontact.console.messages import print_notes
from fecontact.inputs.texts import count_text, quote_path


def guide(topic: str = "", /) -> int:
    """List the topics of the guide, or show the page of a topic.

    Parameters
    ----------
    topic
        Topic of the page; without a topic, all topics are listed.
    """
    from fecontact.guide.pages import read_page, read_titles, remove_links
    from fecontact.outputs.terminal import print_page, print_titles

    if topic:
        print_page(read_page(topic), remove_links)
    else:
        print_titles(read_titles())
    return 0


def check(file: Path, *, quick: bool = False, json: bool = False) -> int:
    """Check a study file without solving it: inputs, profiles, positions, number of cases, time and memory.

    Parameters
    ----------
    file
        A script with `cases(quick=False)`, or a TOML file of cases.
    quick
        Check the small version of the study.
    json
        Print the result as JSON and nothing else.
    """
    from dataclasses import asdict

    from fecontact.files import format_json
    from fecontact.runs.check import check_study

    study_check = check_study(file, quick=quick)
    if json:
        print(format_json(asdict(study_check)))
        return 2 if study_check.problems else 0
    varied = ", ".join(study_check.varied) or "no input varies"
    print(f"{quote_path(file)}: {count_text(study_check.cases, 'case')}, {varied}")
    for line in () if study_check.cost is None else study_check.cost.words:
        print(line)
    print_notes(study_check.notes)
    for problem in study_check.problems:
        print(f"error: {problem}", file=sys.stderr)
    if 0 < study_check.placed < study_check.positions:
        which = "up to the first invalid position" if study_check.problems else "spread over the study"
        print(
            f"{study_check.placed} of {count_text(study_check.positions, 'position')} were checked, {which}",
            file=sys.stderr,
        )
    return 2 if study_check.problems else 0


def init(folder: Path) -> int:
    """Write a study file with comments and an example script into a folder.

    Parameters
    ----------
    folder
        Folder for both files; refused if one of them exists with different content.
    """
    from fecontact.runs.study_templates import write_templates

    template_files = write_templates(folder)
    study = quote_path(template_files[0])
    for path in template_files:
        print(quote_path(path))
    print(f"Next: fecontact check {study}, then: fecontact run {study} --out {quote_path(folder / 'results')}")
    return 0


def doctor() -> int:
    """Check this machine for fecontact: packages, system libraries, solvers, memory; print remedies."""
    from fecontact.doctor import print_diagnosis as examine_machine

    return examine_machine()
