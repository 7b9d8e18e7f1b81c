"""Commands on the theories themselves: which there are, and one of them at a position, without any mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, TypeAlias

from cyclopts import Parameter

from fecontact.case import unusual
from fecontact.console import tell_notes
from fecontact.options import CaseOptions, options_of

# no stress is looked at, and nothing is meshed
_OF_THEORY = options_of("place", "profiles", "load", "material", without=("yield_MPa",))
if TYPE_CHECKING:
    TheoryOptions: TypeAlias = CaseOptions
else:
    TheoryOptions = type(_OF_THEORY)


def theories(*, json: Annotated[bool, Parameter(negative="")] = False) -> int:
    """List the theories of the pressure and the laws of creep forces: cost, source, range, what differs from it.

    Parameters
    ----------
    json
        Print the list as JSON and nothing else.
    """
    from fecontact.files import json_text
    from fecontact.outputs.terminal.theories import print_theories
    from fecontact.runs.analytic import theories as listed

    if json:
        print(json_text(listed()))
    else:
        print_theories(listed())
    return 0


def theory(
    name: str, /, options: TheoryOptions = _OF_THEORY, *, json: Annotated[bool, Parameter(negative="")] = False
) -> int:
    """One theory of the pressure at a position: peak, area, half-widths, approach (no mesh, no gmsh).

    Parameters
    ----------
    name
        As `fecontact theories` lists them: hertz, multi_hertz, kik_piotrowski, analyn, strip, half_space, ...
    json
        Print the result as JSON and nothing else.
    """
    from fecontact.files import json_text
    from fecontact.outputs.terminal.theories import print_alone
    from fecontact.runs.analytic import theory as alone

    case = options.case()
    tell_notes(unusual([case]))
    record = alone(case, name)
    if json:
        print(json_text(record))
    else:
        print_alone(record)
    return 0 if record["status"] == "solved" else 3
