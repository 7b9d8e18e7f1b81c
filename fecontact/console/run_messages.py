"""Messages of commands that work through many jobs: what was reused, what is lost, which files there are."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from fecontact.console.messages import print_reasons, say
from fecontact.console.run_options import RunOptions
from fecontact.errors import usable, with_remedy
from fecontact.outputs.terminal import count


def tell_reused(reused: Collection[str], recomputed: Mapping[str, str], what: str, how: RunOptions) -> None:
    """Say what was finished before, and why some of it was done again."""
    print_reasons("done again", recomputed)
    if reused:
        told = f"{count(len(reused), f'finished {what}')} {'was' if len(reused) == 1 else 'were'}"
        say(f"{told} reused; --force solves again", quiet=how.quiet)


def tell_lost(rows: Sequence[Mapping[str, Any]], what: str, how_lost: str) -> int:
    """Say which rows of cases have no result that can be used, and why; how many these are."""
    lost = {str(row["id"]): with_remedy(row) for row in rows if not usable(row)}
    print_reasons(f"{len(lost)} of {count(len(rows), what)} {how_lost}", lost)
    return len(lost)


def tell_files(out: Path, files: Sequence[str], more: str, how: RunOptions) -> None:
    """Say which files there are, and what to do where it is a part alone."""
    if how.part is None:
        there = ", ".join(f"{name}/" if (out / name).is_dir() else name for name in files if (out / name).exists())
        say(f"Results in {out}: {there}{more}", quiet=how.quiet)
    else:
        words = f"Part {how.part} is in {out}; when all parts are, the same command without --part puts them together"
        say(words, quiet=how.quiet)
