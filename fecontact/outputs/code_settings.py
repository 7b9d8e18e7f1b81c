"""Numbers of a position for a vehicle-dynamics code.

A code with public documentation has input lines, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ, HERTZ_GAUGE, MULTI_HERTZ, THEORIES
from fecontact.outputs.code_pages import statement_lines
from fecontact.outputs.codes import VehicleCode
from fecontact.outputs.records.asked import elastic_record
from fecontact.outputs.tables import Column, Table, TableRecord, make_table, text_column
from fecontact.outputs.terminal import OutputLines
from fecontact.outputs.theory_records import judged_theories
from fecontact.outputs.verdict_words import cheapest_text

# Theories of ellipses with a stiffness K_H.
_ELLIPSE_THEORIES = (HERTZ, HERTZ_GAUGE, MULTI_HERTZ)
# Smallest coordinate (mm) and angle (rad) that is not rounding.
_LEAST_COORDINATE = 1e-9


@dataclass(frozen=True, kw_only=True)
class PatchAtPoint:
    """Contact patch of a theory at a contact point.

    Attributes
    ----------
    heading
        Name of the patch in tables.
    patch
        Record of the patch with its normal force; an ellipse of Hertz has its curvatures and its stiffness, too.
    contact_point
        Record of the contact point.
    """

    heading: str
    patch: TableRecord
    contact_point: TableRecord

    @property
    def has_stiffness(self) -> bool:
        """Whether the patch is an ellipse of Hertz."""
        return self.patch.get("stiffness_GN_per_m15") is not None

    @property
    def stiffness_N_per_m15(self) -> float:
        """K_H in N/m^1.5."""
        return 1e9 * float(self.patch["stiffness_GN_per_m15"])

    @property
    def vertical_stiffness_N_per_m15(self) -> float:
        """Stiffness for vertical force and vertical displacement, K_H cos(contact angle)^2.5, in N/m^1.5.

        The approach is the displacement times the cosine, and the vertical force is the normal force times the cosine.
        """
        return self.stiffness_N_per_m15 * math.pow(math.cos(self.contact_point["contact_angle_rad"]), 2.5)


@dataclass(frozen=True, kw_only=True)
class PositionSettings:
    """Numbers of a position for a vehicle-dynamics code.

    Attributes
    ----------
    case
        Case with its materials and its friction.
    theory
        Theory whose setting is asked for; None if no theory holds.
    patches
        Patches of the theory, and Hertz's ellipses for comparison.
    note
        Note on patches that are for comparison; may be empty.
    holding
        Theories that hold at the position, the cheapest first; empty if the position was not solved.
    """

    case: Case
    theory: str | None
    patches: Sequence[PatchAtPoint]
    note: str = ""
    holding: Sequence[str] = ()


def settings_of_hertz(case: Case, record: TableRecord) -> PositionSettings:
    """Settings from a record of Hertz alone, with the whole load on each ellipse.

    Parameters
    ----------
    case
        Case of the record.
    record
        Record of Hertz's theory alone.

    Returns
    -------
    PositionSettings
        Settings with an ellipse at each contact point.
    """
    patches = [
        PatchAtPoint(
            heading=_point_heading(ellipse["contact_point_number"], ellipse["side"]),
            patch=ellipse,
            contact_point=record["contact_points"][ellipse["contact_point_number"]],
        )
        for ellipse in record["ellipses"]
        if "problem" not in ellipse
    ]
    count = len(record["contact_points"])
    note = f"Each of the {count} contact points has the whole load; `fecontact theory multi_hertz` divides it."
    return PositionSettings(case=case, theory=HERTZ, patches=patches, note=note if count > 1 else "")


def settings_of_theory(case: Case, record: TableRecord) -> PositionSettings:
    """Settings from a record of a theory alone.

    Parameters
    ----------
    case
        Case of the record.
    record
        Record of a theory at a position.

    Returns
    -------
    PositionSettings
        Settings with the patches of the theory; without patches if there is no contact.
    """
    name = record["theory"]
    patches = [] if record["problem"] else _select_patches(name, record, record["contact_points"])
    note = "This theory has no stiffness K_H; `fecontact hertz` prints the stiffness of Hertz."
    return PositionSettings(case=case, theory=name, patches=patches, note="" if name in _ELLIPSE_THEORIES else note)


def settings_of_result(case: Case, record: TableRecord) -> PositionSettings:
    """Settings from the record of a solved case, for the cheapest theory that holds.

    Parameters
    ----------
    case
        Case of the record.
    record
        Record of a result.

    Returns
    -------
    PositionSettings
        Settings with the patches of this theory. If it is not a theory of Hertz's ellipses, or if no theory holds,
        Hertz's ellipse follows for comparison.
    """
    name = record["cheapest_theory"] if record["cheapest_theory"] in THEORIES else None
    theories, points = record["theories"], record["contact_points"]
    force, holding = {"normal_force_N": record["normal_force_N"]}, _holding_theories(case, record)
    if name == MULTI_HERTZ:
        patches = _select_patches(name, {**theories[name], **force}, points)
        return PositionSettings(case=case, theory=name, patches=patches, holding=holding)
    sides = {HERTZ_GAUGE: "gauge", HERTZ: "field" if theories[HERTZ_GAUGE] else "both"}
    ellipses = [
        PatchAtPoint(
            heading=f"Hertz, {_point_heading(0, side)}",
            patch={**theories[hertz], **force},
            contact_point=points[0],
        )
        for hertz, side in sides.items()
        if theories[hertz] and theories[hertz]["problem"] is None
    ]
    if name in _ELLIPSE_THEORIES:
        return PositionSettings(case=case, theory=name, patches=ellipses, holding=holding)
    if name is None:
        possible = f" ({text})" if (text := cheapest_text(record)) else ""
        note = f"No theory is known to hold here{possible}; the numbers of Hertz are for comparison."
        return PositionSettings(case=case, theory=None, patches=ellipses, note=note)
    fails = elastic_record(record)["verdict"]["answer"] == "FAILS"
    note = f"Hertz {'does not hold' if fails else 'is not known to hold'} here; its numbers are for comparison."
    patches = _select_patches(name, {**theories[name], **force}, points)
    return PositionSettings(case=case, theory=name, patches=[*patches, *ellipses], note=note, holding=holding)


def _holding_theories(case: Case, record: TableRecord) -> tuple[str, ...]:
    """Names of the theories that hold, the cheapest first.

    Theories out of their range are left out, unless the criteria include them.
    """
    answers = {
        name: elastic_record(record)["verdict"]["answer"] if name == HERTZ else theory["verdict"]["answer"]
        for name, theory in judged_theories(record).items()
        if name != HERTZ_GAUGE and (case.criteria.theories_out_of_range or theory["status"] != "out of range")
    }
    return tuple(name for name, answer in answers.items() if answer == "HOLDS")


def _point_heading(number: int, side: str = "both") -> str:
    return f"point {number + 1}" + ("" if side == "both" else f", {side} side")


def _select_patches(name: str, theory: TableRecord, points: Sequence[TableRecord]) -> list[PatchAtPoint]:
    """Ellipses of a theory by contact point.

    A theory without ellipses has its complete contact as a single patch.
    """
    if name not in _ELLIPSE_THEORIES:
        return [PatchAtPoint(heading=THEORIES[name].words, patch=theory, contact_point=points[0])]
    numbered_patches = [(patch["contact_point_number"], patch) for patch in theory["patches"]] or [(0, theory)]
    return [
        PatchAtPoint(heading=_point_heading(number), patch=patch, contact_point=points[number])
        for number, patch in sorted(numbered_patches, key=lambda numbered_patch: numbered_patch[0])
    ]


def settings_lines(code: VehicleCode, settings: PositionSettings) -> OutputLines:
    """Iterate over the outputs of the settings: theory in the code, numbers, and inputs of the code.

    Parameters
    ----------
    code
        Vehicle-dynamics code.
    settings
        Settings of a position.

    Returns
    -------
    iterator of Table and str
        Lines and tables in order.
    """
    yield f"Settings in {code.name}:"
    if settings.theory is not None:
        yield from statement_lines(code, settings.theory)
        yield from _lines_on_other_theory(code, settings)
    if settings.patches:
        yield numbers_to_set(settings)
    if settings.note:
        yield settings.note
    if settings.theory in _ELLIPSE_THEORIES and code.name in _INPUT_LINES:
        for place in settings.patches:
            yield from _INPUT_LINES[code.name](settings.case, place)


def _lines_on_other_theory(code: VehicleCode, settings: PositionSettings) -> Iterator[str]:
    """Iterate over the lines on the cheapest theory that holds and that the code has.

    There are none for a position that was not solved, for a code that has the cheapest theory that holds, and for
    Hertz, whose numbers follow.
    """
    if not settings.holding or settings.theory == HERTZ or code.has_theory(settings.theory or ""):
        return
    theory = next((name for name in settings.holding if code.has_theory(name)), None)
    if theory is None:
        yield f"No theory that holds here was found in public documentation of {code.name}."
        return
    yield f"If your {code.name} does not have it, this is the cheapest theory that holds here and was found there:"
    yield from statement_lines(code, theory)


def numbers_to_set(settings: PositionSettings) -> Table:
    """Table of the numbers of a position: a row per quantity, a column per patch.

    Parameters
    ----------
    settings
        Settings of a position.

    Returns
    -------
    Table
        Numbers with six digits; quantities that no patch has are left out.
    """
    rows = []
    for quantity, unit, read_number in _NUMBERS:
        numbers = [read_number(place) for place in settings.patches]
        if any(number is not None for number in numbers):
            rows.append((quantity, unit, ["-" if number is None else f"{number:.6g}" for number in numbers]))
    shared = {"combined modulus E*": ("MPa", settings.case.contact_modulus_MPa)}
    if settings.case.creep.friction is not None:
        shared["coefficient of friction"] = ("1", settings.case.creep.friction)
    rows += [(quantity, unit, [f"{value:.6g}"] * len(settings.patches)) for quantity, (unit, value) in shared.items()]
    columns = [
        text_column("quantity", lambda row: row[0]),
        text_column("unit", lambda row: row[1]),
        *(_patch_column(place.heading, index) for index, place in enumerate(settings.patches)),
    ]
    return make_table("", columns, rows)


def _patch_column(heading: str, index: int) -> Column:
    """Column with the numbers of a patch."""
    return text_column(heading, lambda row: row[2][index], "number")


_NumberReader = Callable[[PatchAtPoint], float | None]


def _patch_number(key: str) -> _NumberReader:
    return lambda place: place.patch.get(key)


def _ellipse_number(read_number: Callable[[PatchAtPoint], float]) -> _NumberReader:
    return lambda place: read_number(place) if place.has_stiffness else None


def _coordinate(value: float) -> float:
    """Coordinate or angle, with zero in place of rounding."""
    return 0.0 if abs(value) < _LEAST_COORDINATE else float(value)


_NUMBERS: Sequence[tuple[str, str, _NumberReader]] = (
    ("normal force F_n", "N", _patch_number("normal_force_N")),
    ("spring K_H, F_n = K_H d^1.5", "N/m^1.5", _ellipse_number(lambda place: place.stiffness_N_per_m15)),
    ("spring K_H", "N/mm^1.5", _ellipse_number(lambda place: place.stiffness_N_per_m15 * 10.0**-4.5)),
    ("vertical spring, K_H cos(angle)^2.5", "N/m^1.5", _ellipse_number(lambda at: at.vertical_stiffness_N_per_m15)),
    ("approach d", "mm", _patch_number("approach_mm")),
    ("semi-axis a, along the track", "mm", _patch_number("a_mm")),
    ("semi-axis b, across", "mm", _patch_number("b_mm")),
    ("A1 = 1/(2 Rx)", "1/mm", _patch_number("A_per_mm")),
    ("B1 = 1/(2 Ry)", "1/mm", _patch_number("B_per_mm")),
    ("equivalent radius Rx, along the track", "mm", _ellipse_number(lambda place: 0.5 / place.patch["A_per_mm"])),
    ("equivalent radius Ry, across", "mm", _ellipse_number(lambda place: 0.5 / place.patch["B_per_mm"])),
    (
        "turn of the ellipse about the normal",
        "rad",
        _ellipse_number(lambda place: _coordinate(place.patch["orientation_rad"])),
    ),
    ("contact angle", "rad", lambda place: _coordinate(place.contact_point["contact_angle_rad"])),
    ("contact point, y on the rail profile", "mm", lambda place: _coordinate(place.contact_point["rail_y_mm"])),
    ("contact point, y on the wheel profile", "mm", lambda place: _coordinate(place.contact_point["wheel_y_mm"])),
)


def _contact_lines(case: Case, place: PatchAtPoint) -> Iterator[str]:
    """Iterate over an input block of CONTACT, module 3.

    The order of the lines is that of its user guide. Values that fecontact does not have are in angle brackets.
    """
    ellipse, friction = place.patch, case.creep.friction
    wheel, rail = case.wheel_material, case.rail_material
    frictions = "<FSTAT>  <FKIN>" if friction is None else f"{friction:g}  {friction:g}"
    materials = f"{wheel.poisson:g}  {rail.poisson:g}  {wheel.shear_MPa:.7g}  {rail.shear_MPa:.7g}"
    semi_axes = f"{ellipse['a_mm']:.7g}  {ellipse['b_mm']:.7g}"
    curvatures = f"{ellipse['A_per_mm']:.7g}  {ellipse['B_per_mm']:.7g}"
    yield f"Input of CONTACT for {place.heading}, with the ellipse prescribed and FASTSIM; fill in <...>:"
    for values, names in (
        ("3", "MODULE"),
        ("<P>2<T>1<F><S>", "P-B-T-N-F-S; B = 2 prescribes the ellipse, N = 1 the force"),
        ("<L><D><C>3<Z><E>", "L-D-C-M-Z-E; M = 3 is FASTSIM"),
        ("<H><G><I><A><O><W><R>", "H-G-I-A-O-W-R"),
        ("<MAXGS>  <MAXIN>  <MAXNR>  <MAXOUT>  <EPS>", "MAXGS, MAXIN, MAXNR, MAXOUT, EPS; not if G = 1"),
        (f"{ellipse['normal_force_N']:.7g}  <CKSI>  <CETA>  <CPHI>", "FN, CKSI, CETA, CPHI"),
        (frictions, "FSTAT, FKIN; not if L = 1"),
        ("<CHI>  <DQ>  <VELOC>", "CHI, DQ, VELOC"),
        (materials, "POISS 1,2, GG 1,2; body 1 is the wheel"),
        ("<K0_MF>  <ALFAMF>  <BETAMF>", "K0_MF, ALFAMF, BETAMF"),
        ("-3", "IPOTCN"),
        (f"<MX>  <MY>  {semi_axes}  <SCALE>", "MX, MY, AA, BB, SCALE"),
    ):
        yield f"  {values:<47}{names}"
    yield "or, for the pressure from the curvatures, B = 0 and M = 0, no line of K0_MF, and at the end:"
    yield f"  {'-1':<47}IPOTCN"
    yield f"  {f'<MX>  <MY>  {curvatures}  <SCALE>':<47}MX, MY, A1, B1, SCALE"
    if turn_rad := _coordinate(ellipse["orientation_rad"]):
        yield f"x and y of this input are turned by {1e3 * turn_rad:+.3f} mrad from the track"


def _opensees_lines(case: Case, place: PatchAtPoint) -> Iterator[str]:
    """Iterate over the comparison of the vertical springs of the element WheelRail and the ellipse."""
    radius_m = case.rolling_radius_mm / 1e3
    flexibility = 4.57e-8 * radius_m**-0.149
    spring = flexibility**-1.5
    yield (
        f"{place.heading}: for a wheel radius of {radius_m:g} m the element has G = {flexibility:.5g} m/N^(2/3), a"
        f" spring of {spring:.5g} N/m^1.5: {1e2 * (spring / place.vertical_stiffness_N_per_m15 - 1.0):+.1f} %"
        " compared with the vertical spring of the ellipse"
    )


def _chrono_lines(_: Case, place: PatchAtPoint) -> Iterator[str]:
    """Iterate over the stiffness for Chrono, as a function of the effective radius there."""
    yield (
        f"{place.heading}: UseMaterialProperties(false); SetKn({place.stiffness_N_per_m15:.6g} / R), with the effective"
        " radius R of the pair in Chrono, in m"
    )


def _stem_lines(_: Case, place: PatchAtPoint) -> Iterator[str]:
    """Iterate over the inputs of STEM: the flexibility of the vertical spring."""
    flexibility = math.pow(place.vertical_stiffness_N_per_m15, -2.0 / 3.0)
    yield f'{place.heading}: "contact_coefficient": {flexibility:.6g}, "contact_power": 1.5'


_INPUT_LINES: Mapping[str, Callable[[Case, PatchAtPoint], Iterator[str]]] = {
    "CONTACT": _contact_lines,
    "OpenSees": _opensees_lines,
    "Chrono": _chrono_lines,
    "STEM": _stem_lines,
}
