"""Template files: a study as TOML, and an equal study as a script."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from fecontact.case import INPUTS
from fecontact.files import refuse_different_files, write_text
from fecontact.inputs.templates import fill_python_template, fill_toml_template

# Template of each file, and the function that fills it with the defaults of a case.
_TEMPLATES = {
    "cases.toml": ("cases.toml", fill_toml_template),
    "study.py": ("study.py.txt", fill_python_template),
}


def write_templates(folder: Path) -> tuple[Path, ...]:
    """Write the template files into a folder.

    Parameters
    ----------
    folder
        Folder for the files.

    Returns
    -------
    tuple of Path
        The files, the TOML file first.

    Raises
    ------
    InputError
        If a file with different content exists already; then nothing is written.
    """
    templates = files("fecontact.runs") / "templates"
    contents = {
        folder / name: fill_template((templates / file).read_text("utf-8"), INPUTS)
        for name, (file, fill_template) in _TEMPLATES.items()
    }
    refuse_different_files(contents.items(), "init", "give another folder")
    return tuple(write_text(path, text) for path, text in contents.items())
