"""Options of the command line for a case, shifts and loads, with their help."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, make_dataclass, replace
from functools import cache, cached_property
from typing import Annotated, Any, Protocol, TypeVar, get_args

from cyclopts import App, ArgumentCollection, Parameter
from cyclopts import Group as Panel

from fecontact.case import INPUTS, Case, Group, make_case
from fecontact.errors import InputError
from fecontact.inputs.slots import InputPlace
from fecontact.inputs.texts import parse_numbers, suggest_name

Command = TypeVar("Command", bound=Callable[..., int])
COMMON_INPUTS_TITLE = "Inputs that most runs need"
"""Title of the panel on the first page of help."""
STORED_DEFAULT = "default as stored"
"""Text for the default of an option that keeps a stored value."""
TOPICS = (*get_args(Group), "run")
"""Topics of help: the groups of a case's inputs, and `run` for the options of many cases."""
PANELS = {
    COMMON_INPUTS_TITLE: Panel(COMMON_INPUTS_TITLE, sort_key=0),
    **{topic: Panel(topic.capitalize(), sort_key=position) for position, topic in enumerate(TOPICS, start=1)},
}
"""Panels of help, by topic."""
CONTACT_GROUPS: tuple[Group, ...] = ("pair", "wheelset", "standing", "profiles", "material")
"""Groups of inputs for lists of shifts and loads of smooth and elastic bodies."""
POSITION_GROUPS: tuple[Group, ...] = (*CONTACT_GROUPS, "position", "load")
"""Groups of inputs for a single position of smooth and elastic bodies."""
# Help of each common option on the first page, in a single line.
_BRIEF = {
    ("", "rail"): "Rail: library name, file, or circle:R in mm",
    ("", "wheel"): "Wheel: library name, file, or cylinder:R in mm",
    ("", "lateral_shift_mm"): "Shift of the wheelset in mm, > 0 to the left",
    ("", "load_N"): "Wheel load in kN",
    ("", "inclination_rad"): "Rail inclination: 1:40, or none if canted already",
    ("", "roll"): "Roll: touching, given (--roll-mrad) or loaded",
    ("", "resolution"): "Mesh: quick, standard, fine, or sizes in mm: 0.5,0.4",
    ("creep", "friction"): "Coefficient of friction, for creep forces",
    ("criteria", "p_max"): "Limit of the deviation in peak pressure in %",
    ("criteria", "judged_by"): "Judged by: strength, patch, all, or measures",
}


class CaseOptions(Protocol):
    """Values of the options on the command line."""

    def list_values(self, table: str) -> dict[str, Any]:
        """List the given values of a table of inputs.

        Parameters
        ----------
        table
            Name of the table, such as `criteria`.

        Returns
        -------
        dict
            Values by the names of the fields, without the options that are not given.
        """

    def case(self) -> Case:
        """Case that the options describe.

        Returns
        -------
        Case
            Case with the default values of all options that are not given.

        Raises
        ------
        InputError
            If a value is outside its range.
        """


@dataclass(frozen=True, kw_only=True)
class CaseOption:
    """Option of the command line: its names, its inputs and its help.

    Attributes
    ----------
    names
        Names on the command line; the first gives the attribute.
    slots
        Inputs that take the value of the option: inputs of both bodies, or a single input.
    help
        Text for `--help`.
    """

    names: tuple[str, ...]
    slots: tuple[InputPlace, ...]
    help: str

    @property
    def attribute(self) -> str:
        """Attribute of the option among the values of all options."""
        return self.names[0].removeprefix("--").replace("-", "_")

    @cached_property
    def annotation(self) -> Any:
        """Type annotation from which cyclopts makes the option."""
        slot = self.slots[0]
        common_panel = (PANELS[COMMON_INPUTS_TITLE],) if slot.place in _BRIEF else ()
        parameter = Parameter(
            name=self.names, help=self.help, group=(*common_panel, PANELS[slot.group]), show_default=False
        )
        if slot.input.alone:
            # The option has no value after it.
            return Annotated[bool | None, parameter]
        value_parameter = Parameter(n_tokens=1, converter=lambda _, tokens: self.read(tokens[0].value))
        return Annotated[Any, parameter, value_parameter]

    def read(self, text: str) -> dict[InputPlace, Any]:
        """Read the values of the option's inputs.

        Parameters
        ----------
        text
            Text after the option on the command line.

        Returns
        -------
        dict
            Values in the units inside the program, by input.

        Raises
        ------
        InputError
            If the text cannot be understood.
        """
        if not self.slots[0].option:
            return dict.fromkeys(self.slots, self.slots[0].input.read_word(text))
        slots_by_stem, values = {slot.stems[0]: slot for slot in self.slots}, {}
        # Commas split only before a name with an equals sign, because texts of profiles may have commas.
        for assignment in re.split(r",(?=[a-z-]+=)", text):
            name, sign, value = assignment.partition("=")
            if name.strip() not in slots_by_stem or not sign:
                suggestion = suggest_name(name.strip(), {stem: stem for stem in slots_by_stem})
                raise InputError(
                    f"{self.names[0]}: {assignment!r}; allowed: {', '.join(f'{stem}=...' for stem in slots_by_stem)}"
                    f"{suggestion}"
                )
            slot = slots_by_stem[name.strip()]
            values[slot] = slot.input.read_word(value)
        return values


def find_brief_help(option: str, *, is_stored: bool) -> str:
    """Help of an option on the first page.

    Parameters
    ----------
    option
        Name of the option on the command line.
    is_stored
        Whether an option that is not given keeps its stored value.

    Returns
    -------
    str
        Help in a single line; empty if the first page does not have the option.
    """
    helps = (
        f"{_BRIEF[slot.place]} [{'stored' if is_stored else slot.shown_default}]"
        for slot in INPUTS
        if slot.place in _BRIEF and option in slot.names
    )
    return next(helps, "")


def _refuse_unused_reading(case: Case, values: Iterable[InputPlace]) -> None:
    """Refuse options on reading a profile file if the profile is not a file.

    Parameters
    ----------
    case
        Case with the profiles.
    values
        Inputs that the user gave.

    Raises
    ------
    InputError
        For the first option without a file.
    """
    reading_slots = [slot for slot in values if slot.body and slot.group == "profiles"]
    if not reading_slots:
        return
    # Imported here because a page of help does not need the profiles.
    from fecontact.profiles.library import is_library_name
    from fecontact.profiles.reading import is_short_form

    for slot in reading_slots:
        specs = [spec for body, spec in case.profiles.items() if body.endswith(slot.body)]
        if all(is_library_name(spec) or is_short_form(spec) for spec in specs):
            raise InputError(
                f"{slot.names[0]} is only for a profile file, but the {slot.body} is {' and '.join(specs)};"
                f" omit this option, or give a file with --{slot.body}"
            )


def select_options(*groups: Group) -> tuple[CaseOption, ...]:
    """Options of all inputs of the given groups.

    Options for both bodies come first, and options for a single body override them.

    Parameters
    ----------
    *groups
        Groups of inputs.

    Returns
    -------
    tuple of CaseOption
        The options, in the order in which they are applied.
    """
    return tuple(option for option in _all_options() if option.slots[0].group in groups)


# Cached because a dozen commands use equal options.
@cache
def _all_options() -> tuple[CaseOption, ...]:
    """Options of all inputs: first the options for both bodies, then the options of each input."""
    options_of_both: dict[tuple[str, ...], list[InputPlace]] = {}
    options_of_each: dict[tuple[str, ...], list[InputPlace]] = {}
    for slot in INPUTS:
        options_of_each.setdefault(slot.names, []).append(slot)
        if slot.common_names:
            options_of_both.setdefault(slot.common_names, []).append(slot)
    return tuple(
        CaseOption(names=names, slots=tuple(slots), help=_format_help(slots, is_for_both=options is options_of_both))
        for options in (options_of_both, options_of_each)
        for names, slots in options.items()
    )


def _format_help(slots: Sequence[InputPlace], *, is_for_both: bool, default: str = "") -> str:
    """Help text of an option with its allowed values and its default.

    Parameters
    ----------
    slots
        Inputs of the option.
    is_for_both
        Whether the option sets the inputs of both bodies.
    default
        Text for the default; the default of the input if it is empty.
    """
    slot = slots[0]
    description, default = slot.input, default or f"default {slot.shown_default}"
    if slot.option:
        names = ",".join(f"{member.stems[0]}=..." for member in slots)
        return f"Opposite side of the wheelset, if it differs: one or more of {names}; {default}."
    if is_for_both:
        return f"{description.help} (both bodies): {description.domain}; {default}."
    if description.alone:
        return f"{description.help}{f' ({slot.body})' if slot.body else ''}; {default}."
    alternative = ", or the value of both bodies" if slot.both else ""
    return f"{description.help}{f' ({slot.body})' if slot.body else ''}: {description.domain}; {default}{alternative}."


def add_case_options(*groups: Group, of_stored_results: bool = False) -> Callable[[Command], Command]:
    """Decorator that gives a command the options of some groups as its parameter `options`.

    Parameters
    ----------
    groups
        Groups of a case's inputs.
    of_stored_results
        Whether an option that is not given keeps its stored value.

    Returns
    -------
    Callable
        Decorator of a command.
    """
    options = select_options(*groups)
    if of_stored_results:
        options = tuple(
            replace(option, help=_format_help(option.slots, is_for_both=False, default=STORED_DEFAULT))
            for option in options
        )
    options_class = _make_options_class(options)

    def decorate(command: Command) -> Command:
        function: Any = command
        # cyclopts makes the options from the fields of this class.
        function.__annotations__["options"] = options_class
        function.__kwdefaults__ = {**(function.__kwdefaults__ or {}), "options": options_class()}
        return command

    return decorate


def _make_options_class(options: Sequence[CaseOption]) -> Any:
    """Class with the values of options; each value is None by default."""

    def collect_values(option_values: Any) -> dict[InputPlace, Any]:
        """Values of all options that are given, by input."""
        values: dict[InputPlace, Any] = {}
        for option in options:
            if (value := getattr(option_values, option.attribute)) is not None:
                values |= value if isinstance(value, Mapping) else dict.fromkeys(option.slots, value)
        return values

    def list_values(option_values: Any, table: str) -> dict[str, Any]:
        """Given values of a table of inputs, by field."""
        return {slot.field: value for slot, value in collect_values(option_values).items() if slot.table == table}

    def case(option_values: Any) -> Case:
        """Case with the inputs of all options that are given."""
        values = collect_values(option_values)
        case = make_case(values)
        if any(option.slots[0].field == "rail" for option in options):
            _refuse_unused_reading(case, values)
        return case

    values = make_dataclass(
        "CaseOptions",
        [(option.attribute, option.annotation, field(default=None)) for option in options],
        frozen=True,
        kw_only=True,
        repr=False,
        eq=False,
        # cyclopts ignores the fields of classes in the module "types", so the class gets the name of this module.
        # Without `__doc__` the dataclass would generate a docstring.
        namespace={
            "case": case,
            "list_values": list_values,
            "__module__": __name__,
            "__doc__": "Options as they were given.",
        },
    )
    return Parameter(name="*")(values)


# --- Whole numbers.

_WHOLE_NUMBER = re.compile(r"[+-]?[0-9]+(\.0*)?")


def refuse_fractions(_app: App, _commands: tuple[str, ...], arguments: ArgumentCollection) -> None:
    """Refuse options for whole numbers with a different value, which cyclopts would round.

    cyclopts calls this function before it converts the words of a command.

    Parameters
    ----------
    _app, _commands
        Command and the words that name it.
    arguments
        Options of the command with their words.

    Raises
    ------
    InputError
        For the first word that is not a whole number.
    """
    for argument in arguments:
        if int not in (argument.hint, *get_args(argument.hint)):
            continue
        for token in argument.tokens:
            if not _WHOLE_NUMBER.fullmatch(token.value):
                raise InputError(
                    f"{argument.name} is {token.value or 'empty'}; allowed: whole numbers; give a number without a"
                    " fraction, such as 2"
                )


# --- Shifts and loads of a map or of a contact table, as written on the command line.


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class GridOptions:
    """Positions, each under all loads.

    Attributes
    ----------
    shifts
        Lateral shifts in mm: numbers and ranges FROM:TO:STEP, separated by commas, such as -6:6:0.5.
    loads_kn
        Wheel loads in kN, in the same form.
    """

    shifts: Annotated[str, Parameter(allow_leading_hyphen=True)]
    loads_kn: Annotated[str, Parameter(name="--loads-kn", allow_leading_hyphen=True)] = "10,20,50,80,100,125,150"

    @property
    def shifts_mm(self) -> tuple[float, ...]:
        """Lateral shifts in mm."""
        return parse_numbers(self.shifts, "shifts")

    @property
    def loads_N(self) -> list[float]:
        """Wheel loads in N."""
        return [1e3 * load for load in parse_numbers(self.loads_kn, "loads")]
