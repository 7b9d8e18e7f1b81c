"""Vehicle-dynamics codes in words: the theories in a code, and the page of the guide on all codes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fecontact.contact_theories.registry import THEORIES
from fecontact.outputs.codes import NOT_FOUND, READ, CodeRemark, CodeStatement, VehicleCode, read_codes
from fecontact.outputs.flat_records import Record, to_plain
from fecontact.outputs.terminal import OutputLines


def code_record(code: VehicleCode) -> Record:
    """Record of a code: its statements on each theory, and its remarks.

    Parameters
    ----------
    code
        Vehicle-dynamics code.

    Returns
    -------
    Record
        Statements by theory, the cheapest theory first. `status` is `found`, or the text that nothing was found.
    """
    return {
        "code": code.name,
        "theories": {
            name: {
                "words": theory.words,
                "status": "found" if code.select_statements(name) else NOT_FOUND,
                "statements": to_plain(code.select_statements(name)),
            }
            for name, theory in THEORIES.items()
        },
        "remarks": to_plain(code.remarks),
    }


def code_lines(code: VehicleCode) -> OutputLines:
    """Iterate over the lines on a code: each theory with its statements, then the remarks.

    Parameters
    ----------
    code
        Vehicle-dynamics code.

    Returns
    -------
    iterator of str
        Lines, with a source for each statement.
    """
    yield f"Theories of the pressure in {code.name}, the cheapest first:"
    for name in THEORIES:
        yield from statement_lines(code, name)
    if code.remarks:
        yield f"More on {code.name}:"
    for remark in code.remarks:
        yield f"  {remark.text}"
        yield f"      source: {_source_text(remark)}"


def statement_lines(code: VehicleCode, theory: str) -> Iterator[str]:
    """Iterate over the lines on a theory in a code.

    Parameters
    ----------
    code
        Vehicle-dynamics code.
    theory
        Name of the theory in the registry.

    Returns
    -------
    iterator of str
        The name of the theory, and its statements or the text that nothing was found.
    """
    statements = code.select_statements(theory)
    yield f"  {theory}: {THEORIES[theory].words}{'' if statements else f'; {NOT_FOUND}'}"
    for statement in statements:
        yield f"      model: {statement.model}"
        yield from (f"      set: {text}" for text in [statement.setting] if text)
        yield f"      source: {_source_text(statement)}"


def _source_text(statement: CodeStatement | CodeRemark) -> str:
    certainty = "" if statement.certainty == READ else f" ({statement.certainty})"
    return f"{'; '.join(statement.sources)}{certainty}"


_PAGE_TITLE = "Settings in vehicle-dynamics codes"
_INTRODUCTION = f"""\
```console
fecontact theories --in CONTACT
fecontact hertz --rail circle:300 --wheel cylinder:460 --inclination none --load-kn 100 --set-in CONTACT
```

`theories --in` prints how a code calls each [theory](theories.md), what you set there, and the source of the
statement. `--set-in` of `hertz`, `theory` and `solve` adds the numbers of the position, with the names of the code
where they are public. `solve` takes the cheapest theory that holds there: if Hertz fails, you see what to set in its
place. If this theory was not found in the code, the next theory follows that holds and that the code has. `judge
FOLDER --set-in CODE` prints this for all cases of a stored study. The last command prints, among others,

```text
quantity                               unit          point 1
normal force F_n                       N              100000
spring K_H, F_n = K_H d^1.5            N/m^1.5   9.41251e+10
spring K_H                             N/mm^1.5   2.9765e+06
vertical spring, K_H cos(angle)^2.5    N/m^1.5   9.41251e+10
approach d                             mm           0.104119
semi-axis a, along the track           mm            7.16168
semi-axis b, across                    mm            5.38717
A1 = 1/(2 Rx)                          1/mm       0.00108696
B1 = 1/(2 Ry)                          1/mm       0.00166667
equivalent radius Rx, along the track  mm                460
equivalent radius Ry, across           mm                300
turn of the ellipse about the normal   rad                 0
contact angle                          rad                 0
contact point, y on the rail profile   mm                  0
contact point, y on the wheel profile  mm                  0
combined modulus E*                    MPa            115385
Input of CONTACT for point 1, with the ellipse prescribed and FASTSIM; fill in <...>:
  3                                              MODULE
  <P>2<T>1<F><S>                                 P-B-T-N-F-S; B = 2 prescribes the ellipse, N = 1 the force
  <L><D><C>3<Z><E>                               L-D-C-M-Z-E; M = 3 is FASTSIM
  <H><G><I><A><O><W><R>                          H-G-I-A-O-W-R
  <MAXGS>  <MAXIN>  <MAXNR>  <MAXOUT>  <EPS>     MAXGS, MAXIN, MAXNR, MAXOUT, EPS; not if G = 1
  100000  <CKSI>  <CETA>  <CPHI>                 FN, CKSI, CETA, CPHI
  <FSTAT>  <FKIN>                                FSTAT, FKIN; not if L = 1
  <CHI>  <DQ>  <VELOC>                           CHI, DQ, VELOC
  0.3  0.3  80769.23  80769.23                   POISS 1,2, GG 1,2; body 1 is the wheel
  <K0_MF>  <ALFAMF>  <BETAMF>                    K0_MF, ALFAMF, BETAMF
  -3                                             IPOTCN
  <MX>  <MY>  7.161676  5.387172  <SCALE>        MX, MY, AA, BB, SCALE
or, for the pressure from the curvatures, B = 0 and M = 0, no line of K0_MF, and at the end:
  -1                                             IPOTCN
  <MX>  <MY>  0.001086957  0.001666667  <SCALE>  MX, MY, A1, B1, SCALE
```

**Definitions.** K_H is the factor of Hertz's spring F_n = K_H d^1.5, with the normal force F_n and the approach d of
distant points of both bodies, along the normal. It depends on curvatures and materials, but not on the load.
1 N/mm^1.5 is 31623 N/m^1.5. A spring for vertical force and vertical displacement has K_H cos(contact angle)^2.5. The
undeformed gap is A1 x² + B1 y², with x along the track and y across: A1 = 1/(2 Rx) and B1 = 1/(2 Ry), each summed over
both bodies. Rx and Ry are the equivalent radii of one body on a plane. The semi-axes are a along the track and b
across. 1/E* = (1 - nu1²)/E1 + (1 - nu2²)/E2. The axes of y and of the contact angle are in
[conventions](conventions.md); your code may have a different sign and origin.

`--json` and tables have these numbers as `stiffness_GN_per_m15` (K_H in GN/m^1.5), `A_per_mm`, `B_per_mm`, `a_mm`,
`b_mm`, `approach_mm`, `normal_force_N`, and `contact_points`. E* follows from the materials in `case`.

The tables have statements of public documentation and public source code alone.
"{NOT_FOUND}" means a search without a result, not that the
code lacks the theory. "secondary source" is a text by others than the makers of the code.

**Contact tables.** `fecontact table` writes CSV and NetCDF. A complete public description of the contact tables of
SIMPACK, VAMPIRE, GENSYS (.kpfr), NUCARS, VI-Rail, Medyna and UM was not found, so there is no export to these formats:
import the columns of the CSV with the tools of your code.
"""


def codes_page() -> str:
    """Page of the guide on all codes, in Markdown.

    Returns
    -------
    str
        Introduction, and a table and the remarks of each code.
    """
    parts = [f"# {_PAGE_TITLE}\n", _INTRODUCTION]
    for code in read_codes().values():
        parts += [f"## {code.name}\n", *_table_of_code(code)]
        parts += [f"\n| more on {code.name} | source |", "|---|---|"] * bool(code.remarks)
        parts += [f"| {remark.text} | {_source_text(remark)} |" for remark in code.remarks]
        parts.append("")
    return "\n".join(parts).rstrip("\n") + "\n"


def _table_of_code(code: VehicleCode) -> list[str]:
    """Table of a code in Markdown.

    All theories that were not found share a row.
    """
    rows = [
        [_theory_names(statement.theories), statement.model, statement.setting, _source_text(statement)]
        for statement in code.statements
    ]
    if code.not_found:
        rows.append([_theory_names(code.not_found), NOT_FOUND, "", ""])
    return ["| theory | model | set | source |", "|---|---|---|---|", *(f"| {' | '.join(row)} |" for row in rows)]


def _theory_names(theories: Sequence[str]) -> str:
    return ", ".join(f"`{name}`" for name in theories)
