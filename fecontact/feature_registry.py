"""Features: what is built on the program without being a part of it, each in a folder that can be taken away.

A feature is a folder in `features/`, or an installed package with an entry point in the group `fecontact.features`: its
name, and the package. It holds its model, its pictures and its command, and may use every folder but the doors. No
other folder imports a feature, but asks here for what features offer. The folder's `feature.py` names what it offers by
its places, so that a thing is imported once it is used:

`COMMANDS`
    Groups of the command line's help, and the commands in each; an `App` has commands of its own.
`NAMES`
    Functions and classes of `fecontact`, which bear their own names there.
`LOADED_CONICITIES`
    A function of a case, a wheel load (N) and `progress`: conicities of the loaded wheelset.

Of a judged load a feature may read something of its own. What it offers there has the name of what is read:

`READINGS`
    Functions of a judged load and its placement; what they give but None is in `JudgedLoad.features`.
`DEAR_READINGS`
    The same for what takes seconds a load; a map by the measure `theory` asks for them.
`TELLINGS`
    How a reading is told (`outputs.parts.Telling`): record, columns of a row, parts of a document.
`MAPS`
    Verdicts that a map draws and finds load limits of (`judging.readings.MappedVerdicts`), by the map's measure.
`LAWS`
    Laws that are judged as theories of the pressure are (`judging.readings.MappedLaws`), by the name of their map.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

from fecontact.errors import InputError

GROUP = "fecontact.features"
"""The folder of features, and the entry points of features that other packages have."""


def _found() -> dict[str, str]:
    """The package of each feature, by its name; a name of this package cannot be taken by another."""
    own = sorted(path.parent.name for path in (Path(__file__).parent / "features").glob("*/feature.py"))
    others = {one.name: one.value for one in metadata.entry_points(group=GROUP)}
    return others | {name: f"{GROUP}.{name}" for name in own}


_HOMES = _found()
FEATURES = tuple(_HOMES)
"""Names of all features that are installed."""


def offers(kind: str) -> Iterator[tuple[str, Any]]:
    """The package of each feature that offers something of a kind, and what that is.

    >>> dict(offers("NAMES"))["fecontact.features.irregular"]
    ('running.irregular',)
    """
    for name in FEATURES:
        if found := getattr(import_module(f"{_HOMES[name]}.feature"), kind, ()):
            yield _HOMES[name], found


def places(kind: str) -> dict[str, str]:
    """The places of what all features offer of a kind that has names.

    >>> list(places("no such kind"))
    []
    """
    return {name: f"{feature}.{place}" for feature, found in offers(kind) for name, place in found.items()}


def offered(kind: str) -> dict[str, Any]:
    """What all features offer of a kind that has names."""
    return {name: at(place) for name, place in places(kind).items()}


def at(place: str) -> Any:
    """What is at a place, such as `fecontact.case.Case`."""
    module, _, name = place.rpartition(".")
    return getattr(import_module(module), name)


def the(kind: str, asked: str) -> Any:
    """The one thing of a kind that a feature offers.

    Raises
    ------
    InputError
        If there is no such feature, with what was asked for.
    """
    for feature, (place,) in offers(kind):
        return at(f"{feature}.{place}")
    raise InputError(f"{asked} needs a feature that is not installed; installed: {', '.join(FEATURES)}; leave it out")


def commands(group: str) -> list[Any]:
    """The commands of all features in a group of the help."""
    return [at(f"{feature}.{place}") for feature, found in offers("COMMANDS") for place in found.get(group, ())]


def public_names() -> dict[str, str]:
    """The public names of all features, and the place of each."""
    return {
        place.rpartition(".")[2].rstrip("_"): f"{feature}.{place}"
        for feature, places in offers("NAMES")
        for place in places
    }
