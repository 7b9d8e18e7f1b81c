"""Marks of tests with parameters."""

from collections.abc import Iterable
from typing import Any

import pytest


def slow_but(params: Iterable[Any], *quick: int) -> list[Any]:
    """Parameters of a test, of which only those at some places are in the usual suite; the others are slow."""
    return [
        pytest.param(*one if isinstance(one, tuple) else (one,), marks=() if place in quick else pytest.mark.slow)
        for place, one in enumerate(params)
    ]
