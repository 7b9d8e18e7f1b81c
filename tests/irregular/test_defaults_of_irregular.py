"""Default limit of `fecontact irregular`."""

import inspect

import fecontact
from fecontact.features.irregular.command import IrregularOptions


def test_the_limit_is_the_limit_of_the_function():
    limit = inspect.signature(fecontact.irregular).parameters["limit"].default
    assert IrregularOptions().limit_percent == 100.0 * limit == 5.0
