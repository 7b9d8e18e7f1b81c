"""Known rails and wheels that the library does not have, with the reasons."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fecontact.profiles.curve import ProfileKind


@dataclass(frozen=True, kw_only=True)
class UnavailableProfiles:
    """Profiles of one origin that are not in the library for the same reason.

    Attributes
    ----------
    kind
        `rail` or `wheel`.
    origin
        Standard or country.
    names
        Names of the profiles.
    reason
        Reason, the end of a sentence.
    """

    kind: ProfileKind
    origin: str
    names: tuple[str, ...]
    reason: str


_AREMA = "no published text has its radii and junctions: they are in drawings of the AREMA manual, chapter 4"
_TABLE = "only a table of rounded points is published, which does not give its arcs; such a table can be used as a file"
_NO_GEOMETRY = "no published geometry was found"
UNAVAILABLE = (
    UnavailableProfiles(
        kind="rail", origin="AREMA", names=("115RE", "119RE", "132RE", "133RE", "136RE", "141RE"), reason=_AREMA
    ),
    UnavailableProfiles(
        kind="rail",
        origin="GOST R 51685",
        names=("R50", "R65", "R65K", "R75"),
        reason="only the dimensions of its template are published as text, without radii",
    ),
    UnavailableProfiles(
        kind="rail",
        origin="JIS E 1101",
        names=("JIS60", "JIS50N", "50N"),
        reason="only its height and the width of its head are published as text, without radii",
    ),
    UnavailableProfiles(
        kind="rail",
        origin="Australia",
        names=("AS60", "AS50"),
        reason="its radii are published without the junctions, which do not follow from them",
    ),
    UnavailableProfiles(kind="rail", origin="China", names=("CHN75",), reason=_NO_GEOMETRY),
    UnavailableProfiles(kind="rail", origin="China", names=("60D",), reason=_TABLE),
    UnavailableProfiles(kind="rail", origin="Korea", names=("KR60", "KS60"), reason=_NO_GEOMETRY),
    UnavailableProfiles(kind="rail", origin="EN 13674-2", names=("60E1A1", "54E1T1"), reason=_NO_GEOMETRY),
    UnavailableProfiles(
        kind="wheel",
        origin="AAR",
        names=("AAR-1B", "AAR-2A"),
        reason="it is published in words only; APTA220 is of its family, but was not shown to be this wheel",
    ),
    UnavailableProfiles(
        kind="wheel",
        origin="APTA",
        names=("APTA120", "APTA140", "APTA140M", "NRCC-6"),
        reason="its tangent points were not solved; APTA PR-M-S-015-06 has its points, centres and radii",
    ),
    UnavailableProfiles(kind="wheel", origin="GOST 10791", names=("GOST10791",), reason=_NO_GEOMETRY),
    UnavailableProfiles(kind="wheel", origin="China", names=("LM",), reason=_NO_GEOMETRY),
    UnavailableProfiles(kind="wheel", origin="China", names=("XP55",), reason=_TABLE),
    UnavailableProfiles(
        kind="wheel",
        origin="EN 13715",
        names=("EPS", "EN13715_EPS"),
        reason="its throat and its flange root are published as a table with kinks only, without arcs",
    ),
    UnavailableProfiles(
        kind="wheel",
        origin="EN 13715",
        names=("EN13715_1in20", "EN13715_1in30", "EN13715_1in15"),
        reason="EN 13715 has no such tread: it defines 1/40, S1002 and EPS; 1:15 to 15 % are outer slopes",
    ),
    UnavailableProfiles(
        kind="wheel",
        origin="India",
        names=("IRS-wheel",),
        reason="only a sketch of its inspection gauge is published",
    ),
)
"""Profiles that users may ask for."""


def _simplify_name(name: str) -> str:
    """Name without case, spaces and separators; Cyrillic letters of rail names become Latin letters."""
    return re.sub(r"[\s._/-]", "", name.translate(str.maketrans("РрКк", "RrKk"))).lower()


_BY_NAME = {_simplify_name(name): profiles for profiles in UNAVAILABLE for name in profiles.names}


def find_unavailable(name: str) -> UnavailableProfiles | None:
    """Known profiles with a name that the library does not have.

    Parameters
    ----------
    name
        Name in any case of letters, with or without separators.

    Returns
    -------
    UnavailableProfiles or None
        None for an unknown name.

    Examples
    --------
    >>> from fecontact.profiles.unavailable import find_unavailable
    >>> find_unavailable("aar 1b").kind
    'wheel'
    """
    return _BY_NAME.get(_simplify_name(name))
