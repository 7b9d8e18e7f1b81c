"""Marks of tests with parameters."""

from collections.abc import Iterable
from typing import Any

import pytest


def slow_but(params: Iterable[Any], *quick: int) -> list[Any]:
    """Parameters of a test, marked slow except at some places.

    Only the parameters at these places are in the usual suite.
    """
    return [
        pytest.param(
            *parameter if isinstance(parameter, tuple) else (parameter,),
            marks=() if place in quick else pytest.mark.slow,
        )
        for place, parameter in enumerate(params)
    ]
