"""The options of the command line that describe a case, shifts and loads, and the pages of help on them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, make_dataclass
from functools import cache, cached_property
from typing import Annotated, Any, Protocol, TypeVar, get_args

from cyclopts import Group as Panel
from cyclopts import Parameter

from fecontact.case import INPUTS, Case, Group, case_with
from fecontact.errors import InputError
from fecontact.inputs.slots import Slot
from fecontact.inputs.texts import nearest, parse_numbers

Command = TypeVar("Command", bound=Callable[..., int])
MOST = "Inputs that most runs need"
"""Title of the panel that the first page of help begins with."""
TOPICS = (*get_args(Group), "run")
"""Topics of help: the groups of a case's inputs, and how many cases are worked through."""
PANELS = {
    MOST: Panel(MOST, sort_key=0),
    **{topic: Panel(topic.capitalize(), sort_key=position) for position, topic in enumerate(TOPICS, start=1)},
}
"""Panels of help, by topic."""
CONTACT: tuple[Group, ...] = ("pair", "wheelset", "standing", "profiles", "material")
"""Groups of what lists of shifts and loads are worked through for, of smooth and elastic bodies."""
POSITION: tuple[Group, ...] = (*CONTACT, "position", "load")
"""Groups of one position of smooth and elastic bodies."""
# what the first page says of them, in a line each
_BRIEF = {
    ("", "rail"): "Rail: library name, file, or circle:R in mm",
    ("", "wheel"): "Wheel: library name, file, or cylinder:R in mm",
    ("", "lateral_shift_mm"): "Shift of the wheelset in mm, > 0 to the left",
    ("", "load_N"): "Wheel load in kN",
    ("", "inclination_rad"): "Of the rail: 1:40, or none if canted already",
    ("", "roll"): "touching, given (--roll-mrad) or loaded",
    ("", "resolution"): "quick, standard, fine, or sizes in mm: 0.5,0.4",
    ("creep", "friction"): "Coefficient of friction, for creep forces",
    ("criteria", "p_max"): "Largest error of Hertz's peak pressure in %",
    ("criteria", "judged_by"): "What decides: strength, patch, all, or measures",
}


class CaseOptions(Protocol):
    """Options as they were given."""

    def case(self) -> Case:
        """The case that they describe.

        Raises
        ------
        InputError
            If a value is outside its range.
        """


@dataclass(frozen=True, kw_only=True)
class CaseOption:
    """One option: its names, the inputs that it gives, and its help."""

    names: tuple[str, ...]
    slots: tuple[Slot, ...]
    help: str

    @property
    def attribute(self) -> str:
        """Name of its value among the values of all options."""
        return self.names[0].removeprefix("--").replace("-", "_")

    @cached_property
    def annotation(self) -> Any:
        """What cyclopts makes the option from."""
        slot = self.slots[0]
        first = (PANELS[MOST],) if slot.place in _BRIEF else ()
        shown = Parameter(name=self.names, help=self.help, group=(*first, PANELS[slot.group]), show_default=False)
        if slot.input.alone:
            # without a value behind it
            return Annotated[bool | None, shown]
        read = Parameter(n_tokens=1, converter=lambda _, tokens: self.read(tokens[0].value))
        return Annotated[Any, shown, read]

    def read(self, text: str) -> dict[Slot, Any]:
        """Values in the units inside, by input.

        Raises
        ------
        InputError
            If the text cannot be understood.
        """
        if not self.slots[0].option:
            return dict.fromkeys(self.slots, self.slots[0].input.read_word(text))
        own, found = {slot.stems[0]: slot for slot in self.slots}, {}
        # texts of profiles may have commas
        for item in re.split(r",(?=[a-z-]+=)", text):
            name, sign, value = item.partition("=")
            if name.strip() not in own or not sign:
                meant = nearest(name.strip(), {one: one for one in own})
                raise InputError(
                    f"{self.names[0]}: {item!r} is none of {', '.join(f'{one}=...' for one in own)}{meant}"
                )
            slot = own[name.strip()]
            found[slot] = slot.input.read_word(value)
        return found


def brief(option: str) -> str:
    """What the first page of help says of an option; empty where it says nothing."""
    found = (
        f"{_BRIEF[slot.place]} [{slot.shown_default}]"
        for slot in INPUTS
        if slot.place in _BRIEF and option in slot.names
    )
    return next(found, "")


def _refuse_unread(case: Case, values: Iterable[Slot]) -> None:
    """Refuse options on how the file of a profile is read where the profile is none."""
    read = [slot for slot in values if slot.body and slot.group == "profiles"]
    if not read:
        return
    # not for a page of help
    from fecontact.profiles.library import is_known
    from fecontact.profiles.reading import is_short_form

    for slot in read:
        own = [spec for body, spec in case.profiles.items() if body.endswith(slot.body)]
        if all(is_known(spec) or is_short_form(spec) for spec in own):
            raise InputError(
                f"{slot.names[0]}: it says how a file is read, but the {slot.body} is {' and '.join(own)}, which is"
                f" none; leave it out, or give the file by --{slot.body}"
            )


def case_options(*groups: Group) -> tuple[CaseOption, ...]:
    """Options of all inputs of some groups; options for both bodies come first, and options for one override them."""
    return tuple(option for option in _all_options() if option.slots[0].group in groups)


# cached: a dozen of commands take the same ones
@cache
def _all_options() -> tuple[CaseOption, ...]:
    common: dict[tuple[str, ...], list[Slot]] = {}
    own: dict[tuple[str, ...], list[Slot]] = {}
    for slot in INPUTS:
        own.setdefault(slot.names, []).append(slot)
        if slot.common_names:
            common.setdefault(slot.common_names, []).append(slot)
    return tuple(
        CaseOption(names=names, slots=tuple(slots), help=_help(slots, both=options is common))
        for options in (common, own)
        for names, slots in options.items()
    )


def _help(slots: Sequence[Slot], *, both: bool) -> str:
    slot = slots[0]
    described, default = slot.input, f"default {slot.shown_default}"
    if slot.option:
        names = ",".join(f"{one.stems[0]}=..." for one in slots)
        return f"Other side of the wheelset, if it is another one: {names}, of which some; {default}."
    if both:
        return f"{described.help} (both bodies): {described.domain}; {default}."
    of_both = ", or the value of both bodies" if slot.both else ""
    return f"{described.help}{f' ({slot.body})' if slot.body else ''}: {described.domain}; {default}{of_both}."


def takes(*groups: Group) -> Callable[[Command], Command]:
    """Give a command the options of some groups of a case's inputs: what stands for its parameter `options`."""
    made = _options_of(case_options(*groups))

    def taking(command: Command) -> Command:
        function: Any = command
        # cyclopts makes the options from the fields of this class
        function.__annotations__["options"] = made
        function.__kwdefaults__ = {**(function.__kwdefaults__ or {}), "options": made()}
        return command

    return taking


def _options_of(options: Sequence[CaseOption]) -> Any:
    """Class of the values of some options, without any if none is given."""

    def case(given: Any) -> Case:
        values: dict[Slot, Any] = {}
        for option in options:
            if (value := getattr(given, option.attribute)) is not None:
                values |= value if isinstance(value, Mapping) else dict.fromkeys(option.slots, value)
        case = case_with(values)
        if any(option.slots[0].field == "rail" for option in options):
            _refuse_unread(case, values)
        return case

    values = make_dataclass(
        "CaseOptions",
        [(option.attribute, option.annotation, field(default=None)) for option in options],
        frozen=True,
        kw_only=True,
        repr=False,
        eq=False,
        # cyclopts does not look into classes of the module "types"; without a text the class would write one of itself
        namespace={"case": case, "__module__": __name__, "__doc__": "Options as they were given."},
    )
    return Parameter(name="*")(values)


# --- Shifts and loads of a map, or of a contact table, as they are written on the command line.


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class GridOptions:
    """Positions, each under all loads.

    Attributes
    ----------
    shifts
        Lateral shifts in mm: numbers and ranges FROM:TO:STEP, separated by commas, such as -6:6:0.5.
    loads_kn
        Wheel loads in kN, likewise.
    """

    shifts: Annotated[str, Parameter(allow_leading_hyphen=True)]
    loads_kn: Annotated[str, Parameter(name="--loads-kn", allow_leading_hyphen=True)] = "10,20,50,80,100,125,150"

    @property
    def shifts_mm(self) -> tuple[float, ...]:
        """Lateral shifts."""
        return parse_numbers(self.shifts, "shifts")

    @property
    def loads_N(self) -> list[float]:
        """Wheel loads."""
        return [1e3 * load for load in parse_numbers(self.loads_kn, "loads")]
