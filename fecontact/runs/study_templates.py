"""Files to begin with: a study as TOML, and the same study as a script."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from fecontact.errors import InputError
from fecontact.files import write_text

_TEMPLATES = {"cases.toml": "cases.toml", "study.py": "study.py.txt"}


def write_templates(folder: Path) -> tuple[Path, ...]:
    """Write the files and return their paths, the TOML first.

    Raises
    ------
    InputError
        If one of them is there already; then nothing is written.
    """
    there = [str(folder / name) for name in _TEMPLATES if (folder / name).exists()]
    if there:
        raise InputError(f"{', '.join(there)}: there already; give another folder")
    own = files("fecontact.runs") / "templates"
    return tuple(write_text(folder / name, (own / file).read_text("utf-8")) for name, file in _TEMPLATES.items())
