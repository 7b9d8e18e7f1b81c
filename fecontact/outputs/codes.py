"""Vehicle-dynamics codes: how each code calls and sets the theories, from public documentation.

The statements are in `codes.toml`. A theory that is in `not_found` of a code was searched for without a result.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.inputs.texts import suggest_name

NOT_FOUND = "not found in public documentation: look into your manual"
"""Text for a theory whose setting in a code was searched for and not found."""
READ = "read"
"""Certainty of a statement that was read in its source."""
CERTAINTIES = (READ, "read in part", "secondary source")
"""Certainties of a statement: read in the source, in a part of the source, or in a text by others."""


@dataclass(frozen=True, kw_only=True)
class CodeStatement:
    """Statement on theories in a vehicle code.

    Attributes
    ----------
    theories
        Names of the theories in the registry.
    model
        Model of the code, or the absence of a model.
    setting
        Options and inputs by their names in the code; empty if there is nothing to set.
    has_model
        Whether the code has the theory, or a variant of the theory.
    sources
        Full texts of the sources.
    certainty
        One of `CERTAINTIES`.
    """

    theories: tuple[str, ...]
    model: str
    sources: tuple[str, ...]
    setting: str = ""
    has_model: bool = True
    certainty: str = READ


@dataclass(frozen=True, kw_only=True)
class CodeRemark:
    """Remark on a vehicle code that does not belong to a theory.

    Attributes
    ----------
    text
        The remark.
    sources
        Full texts of the sources.
    certainty
        One of `CERTAINTIES`.
    """

    text: str
    sources: tuple[str, ...]
    certainty: str = READ


@dataclass(frozen=True, kw_only=True)
class VehicleCode:
    """Vehicle-dynamics code with the public statements on its contact models.

    Attributes
    ----------
    name
        Name of the code.
    spellings
        Further names under which users may look for the code.
    statements
        Statements on theories.
    remarks
        Remarks on the code.
    not_found
        Theories whose setting was not found in public documentation.
    """

    name: str
    spellings: tuple[str, ...]
    statements: tuple[CodeStatement, ...]
    remarks: tuple[CodeRemark, ...]
    not_found: tuple[str, ...]

    def select_statements(self, theory: str) -> tuple[CodeStatement, ...]:
        """Statements on a theory; empty if nothing was found.

        Parameters
        ----------
        theory
            Name of the theory in the registry.

        Returns
        -------
        tuple of CodeStatement
            Statements in the order of the data file.
        """
        return tuple(statement for statement in self.statements if theory in statement.theories)

    def has_theory(self, theory: str) -> bool:
        """Whether the code has a theory, according to public documentation.

        Parameters
        ----------
        theory
            Name of the theory in the registry.

        Returns
        -------
        bool
            False for a theory that was not found, too.
        """
        return any(statement.has_model for statement in self.select_statements(theory))


@cache
def read_codes() -> Mapping[str, VehicleCode]:
    """Vehicle-dynamics codes by name, in the order of the data file.

    Returns
    -------
    dict
        Codes with their statements.
    """
    content = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
    sources: Mapping[str, str] = content["sources"]

    def complete(statement: Mapping[str, Any]) -> dict[str, Any]:
        """Statement with tuples for lists, and with the full texts of its sources."""
        tuples = {key: tuple(value) if isinstance(value, list) else value for key, value in statement.items()}
        return tuples | {"sources": tuple(sources[key] for key in statement["sources"])}

    return {
        code["name"]: VehicleCode(
            name=code["name"],
            spellings=tuple(code.get("spellings", ())),
            statements=tuple(CodeStatement(**complete(statement)) for statement in code.get("statements", ())),
            remarks=tuple(CodeRemark(**complete(remark)) for remark in code.get("remarks", ())),
            not_found=tuple(code["not_found"]),
        )
        for code in content["codes"]
    }


def find_code(name: str, option: str) -> VehicleCode:
    """Find a vehicle-dynamics code by its name.

    Parameters
    ----------
    name
        Name or further spelling, in upper or lower case, with or without spaces and hyphens.
    option
        Option that has the name, for the message.

    Returns
    -------
    VehicleCode
        The code.

    Raises
    ------
    InputError
        If there is no such code; the message has the allowed names.

    Examples
    --------
    >>> from fecontact.outputs.codes import find_code
    >>> find_code("universal mechanism", "--in").name
    'UM'
    """
    codes = read_codes()
    names = {spelling: code.name for code in codes.values() for spelling in (code.name, *code.spellings)}
    found_name = {_simplify(spelling): code_name for spelling, code_name in names.items()}.get(_simplify(name))
    if found_name is None:
        raise InputError(f"{option} is {name!r}; allowed: {', '.join(codes)}{suggest_name(name, names)}")
    return codes[found_name]


def find_code_to_set(name: str | None, *, json: bool) -> VehicleCode | None:
    """Find the code of the option `--set-in`.

    Parameters
    ----------
    name
        Value of the option; None if it is not given.
    json
        Whether the result is printed as JSON.

    Returns
    -------
    VehicleCode or None
        The code; None without the option.

    Raises
    ------
    InputError
        For an unknown code, and for the option together with JSON, which has the numbers anyway.
    """
    if name is None:
        return None
    if json:
        raise InputError(
            f"--set-in {name} prints text, and --json prints JSON alone; omit one of them: JSON has the numbers as"
            " stiffness_GN_per_m15, A_per_mm, B_per_mm, a_mm, b_mm, contact_points"
        )
    return find_code(name, "--set-in")


def _simplify(name: str) -> str:
    """Name in lower case without spaces, hyphens and underscores."""
    return "".join(character for character in name.lower() if character not in " -_")
