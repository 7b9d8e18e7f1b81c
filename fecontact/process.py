"""What each process of the program sets for itself: the one that a user starts, and its workers."""

from __future__ import annotations

import gc


def collect_rarely() -> None:
    """Let Python look through all objects for cycles half as often.

    Modules stay, and so does most of what a solution makes: to look through it takes 3 to 4 % of the time.
    """
    gc.set_threshold(gc.get_threshold()[0], 20, 20)
