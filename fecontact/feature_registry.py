"""Features: parts that are built on the program without being needed by it, each in a removable folder.

A feature is a folder in `features/`, or an installed package with an entry point in the group `fecontact.features`: its
name, and the package. It holds its model, its pictures and its command, and may use every folder but the doors. No
other folder imports a feature. Other folders ask here for the offers of features. The folder's `feature.py` names the
offers by their places, so that they are imported on first use:

`COMMANDS`
    Groups of the command line's help, and the commands in each; an `App` has commands of its own.
`NAMES`
    Functions and classes of `fecontact`, with equal names there.
`RESULT_FILES`
    Files that identify a folder of results, with the kind of the results.
`LOADED_CONICITIES`
    A function of a case, a wheel load (N) and `progress`: conicities of the loaded wheelset.

A feature may read its own results from a judged load. An offer of this kind has the name of the result:

`READINGS`
    Functions of a judged load and its placement; a result other than None is in `JudgedLoad.features`.
`DEAR_READINGS`
    Readings that take seconds per load; a map by the measure `theory` uses them.
`TELLINGS`
    Report of a reading (`outputs.parts.Telling`): record, columns of a row, parts of a document.
`TABLE_COLUMNS`
    Functions of a row of a contact table (`solving.alone.ContactTableRow`) that return further columns of the row.
`MAPS`
    Verdicts with load limits that a map draws (`judging.readings.VerdictReadingView`), by the map's measure.
`NUMBERS`
    Quantities whose deviation of Hertz a map draws in percent (`judging.readings.NumberReadingView`), by the map's
    measure.
`LAWS`
    Laws that are judged like theories of the pressure (`judging.readings.LawReadingView`), by the name of their map.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

from fecontact.errors import InputError

GROUP = "fecontact.features"
"""Package of the features' folder, and group of the entry points of features in other packages."""


def _find_packages() -> dict[str, str]:
    """Package of each feature by its name; an installed package cannot take a name of this package."""
    folders = sorted(path.parent.name for path in (Path(__file__).parent / "features").glob("*/feature.py"))
    installed = {entry_point.name: entry_point.value for entry_point in metadata.entry_points(group=GROUP)}
    return installed | {name: f"{GROUP}.{name}" for name in folders}


_PACKAGES = _find_packages()
FEATURES = tuple(_PACKAGES)
"""Names of all features that are installed."""


def iterate_offers(kind: str) -> Iterator[tuple[str, Any]]:
    """Yield the package of each feature with offers of a kind, and these offers.

    Parameters
    ----------
    kind
        Kind of offer, such as `NAMES` or `COMMANDS`.

    Yields
    ------
    package, offers
        Package of a feature, and its offers of this kind.

    Examples
    --------
    >>> from fecontact.feature_registry import iterate_offers
    >>> dict(iterate_offers("NAMES"))["fecontact.features.irregular"]
    ('running.irregular',)
    """
    for name in FEATURES:
        if content := getattr(import_module(f"{_PACKAGES[name]}.feature"), kind, ()):
            yield _PACKAGES[name], content


def find_places(kind: str) -> dict[str, str]:
    """Places of the offers of all features, by name.

    Parameters
    ----------
    kind
        Kind of offer with a place for each name, such as `READINGS`.

    Returns
    -------
    dict
        Place of each offer, such as `fecontact.features.creep.telling.CREEP`, by its name.

    Examples
    --------
    >>> from fecontact.feature_registry import find_places
    >>> list(find_places("no such kind"))
    []
    """
    return {
        name: f"{feature}.{place}"
        for feature, places_by_name in iterate_offers(kind)
        for name, place in places_by_name.items()
    }


def load_offers(kind: str) -> dict[str, Any]:
    """Import the offers of all features of a kind with names.

    Parameters
    ----------
    kind
        Kind of offer.

    Returns
    -------
    dict
        Imported object of each offer, by its name.
    """
    return {name: import_place(place) for name, place in find_places(kind).items()}


def import_place(place: str) -> Any:
    """Import the object at a place, such as `fecontact.case.Case`.

    Parameters
    ----------
    place
        Module and name, joined by a dot.

    Returns
    -------
    object
        The imported object.
    """
    module, _, name = place.rpartition(".")
    return getattr(import_module(module), name)


def load_single_offer(kind: str, asked: str) -> Any:
    """Import the only offer of a kind.

    Parameters
    ----------
    kind
        Kind of the offer, such as `LOADED_CONICITIES`.
    asked
        Option or input that needs the offer, for the message.

    Returns
    -------
    object
        The offered function or class.

    Raises
    ------
    InputError
        If no installed feature has an offer of this kind.
    """
    for feature, (place,) in iterate_offers(kind):
        return import_place(f"{feature}.{place}")
    raise InputError(
        f"{asked} needs a feature that is not installed; installed: {', '.join(FEATURES)}; leave this input out, or"
        " install the feature"
    )


def load_commands(group: str) -> list[Any]:
    """Import the commands of all features in a group of the help.

    Parameters
    ----------
    group
        Heading of the group.

    Returns
    -------
    list
        Functions and apps.
    """
    return [
        import_place(f"{feature}.{place}")
        for feature, commands_by_group in iterate_offers("COMMANDS")
        for place in commands_by_group.get(group, ())
    ]


def find_public_names() -> dict[str, str]:
    """Public names of all features, with their places.

    Returns
    -------
    dict
        Place below `fecontact` of each name.
    """
    return {
        place.rpartition(".")[2].rstrip("_"): f"{feature}.{place}"
        for feature, places in iterate_offers("NAMES")
        for place in places
    }
