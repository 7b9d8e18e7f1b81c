"""Settings of vehicle-dynamics codes: statements with sources, and numbers of a position against closed forms."""

import json
import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from kept import keep_case
from scipy.special import ellipe, ellipk

import fecontact
from fecontact.bodies import Material
from fecontact.case import Case
from fecontact.cli import call
from fecontact.contact_theories.registry import THEORIES
from fecontact.criteria import Creep
from fecontact.outputs import codes as codes_module
from fecontact.outputs.code_pages import codes_page
from fecontact.outputs.code_settings import (
    numbers_to_set,
    settings_lines,
    settings_of_hertz,
    settings_of_result,
    settings_of_theory,
)
from fecontact.outputs.codes import CERTAINTIES, NOT_FOUND, find_code, read_codes
from fecontact.outputs.records.results import result_record
from fecontact.outputs.tables import Table

CODES = read_codes()
ASKED_CODES = (
    "CONTACT",
    "OpenSees",
    "Chrono",
    "SIMPACK",
    "VI-Rail",
    "GENSYS",
    "VAMPIRE",
    "NUCARS",
    "Medyna",
    "UM",
    "STEM",
)
CONTENT = tomllib.loads(Path(codes_module.__file__).with_suffix(".toml").read_text("utf-8"))
# crossed cylinders: the gap is a parabola up to 1e-4 of the patch
CROSSED = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)
E_STAR = 210e3 / (2.0 * (1.0 - 0.3**2))
# six digits are printed
PRINTED = 2e-5


def numbers(settings, column=0):
    """Printed numbers of a patch by quantity and unit."""
    table = numbers_to_set(settings)
    return {
        (row.cells[0], row.cells[1]): float(row.cells[2 + column]) for row in table.rows if row.cells[2 + column] != "-"
    }


def texts(code, settings):
    """Printed lines without the table."""
    return [line for line in settings_lines(find_code(code, "--set-in"), settings) if not isinstance(line, Table)]


def hertz_settings(case):
    return settings_of_hertz(case, fecontact.hertz(case))


# --- statements


def test_every_asked_code_is_listed():
    assert set(ASKED_CODES) <= set(CODES)


@pytest.mark.parametrize("name", CODES)
def test_every_theory_has_a_row_in_every_code(name):
    code = CODES[name]
    stated = {theory for statement in code.statements for theory in statement.theories}
    assert stated | set(code.not_found) == set(THEORIES)
    assert stated & set(code.not_found) == set()
    assert len(code.not_found) == len(set(code.not_found))


def test_every_statement_has_sources_and_a_certainty():
    statements = [statement for code in CODES.values() for statement in (*code.statements, *code.remarks)]
    assert all(statement.sources and all(len(source) > 20 for source in statement.sources) for statement in statements)
    assert {statement.certainty for statement in statements} <= set(CERTAINTIES)
    source_keys = {
        key
        for code in CONTENT["codes"]
        for kind in ("statements", "remarks")
        for statement in code.get(kind, ())
        for key in statement["sources"]
    }
    assert source_keys == set(CONTENT["sources"])


@pytest.mark.parametrize("name", CODES)
def test_a_code_is_printed_with_all_theories_and_the_source_beside_each_statement(name, capsys):
    assert call(["theories", "--in", name.upper()]) == 0
    out = capsys.readouterr().out
    lines = out.splitlines()
    assert [line.split(":")[0].strip() for line in lines if re.match(r"  [a-z_]+: ", line)] == list(THEORIES)
    assert out.count(NOT_FOUND) == len(CODES[name].not_found)
    sources = sum(len(statement.theories) for statement in CODES[name].statements) + len(CODES[name].remarks)
    assert sum(line.startswith("      source: ") for line in lines) == sources
    assert call(["theories", "--in", name, "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["code"] == name
    assert {key for key, theory in record["theories"].items() if theory["status"] == NOT_FOUND} == set(
        CODES[name].not_found
    )


def test_the_page_of_the_guide_is_made_from_the_data(capsys):
    page = (Path(fecontact.__file__).parent / "guide" / "codes.md").read_text("utf-8")
    assert page == codes_page(), "run: fecontact theories --in all > fecontact/guide/codes.md"
    assert call(["theories", "--in", "all"]) == 0
    assert capsys.readouterr().out == page
    assert call(["theories", "--in", "all", "--json"]) == 0
    assert list(json.loads(capsys.readouterr().out)) == list(CODES)
    assert [line.removeprefix("## ") for line in page.splitlines() if line.startswith("## ")] == list(CODES)


@pytest.mark.parametrize(
    "words",
    [
        ("theories", "--in"),
        *((*command, "--set-in") for command in (("hertz",), ("theory", "strip"), ("solve",), ("judge", "folder"))),
    ],
)
@pytest.mark.parametrize("code", ["SIMPAK", "adams", "", " ", "CONTACT,UM", "x" * 300])
def test_an_unknown_code_is_refused_with_the_list(words, code, capsys):
    assert call([*words, code]) == 2
    error = capsys.readouterr().err
    assert f"allowed: {', '.join(CODES)}" in error
    assert ("did you mean SIMPACK?" in error) == (code == "SIMPAK")


@pytest.mark.parametrize(
    ("spelling", "name"), [("vi rail", "VI-Rail"), ("Universal Mechanism", "UM"), ("simpack-rail", "SIMPACK")]
)
def test_a_code_has_further_spellings(spelling, name):
    assert find_code(spelling, "--in").name == name


@pytest.mark.parametrize("words", [("hertz",), ("theory", "hertz"), ("solve",), ("judge", "folder")])
def test_json_and_settings_together_are_refused(words, capsys):
    assert call([*words, "--json", "--set-in", "CONTACT"]) == 2
    assert "omit one of them" in capsys.readouterr().err


# --- numbers


def test_equal_crossed_cylinders_are_a_sphere_on_a_plane():
    """Closed form of Johnson (1985), section 4.2.

    K_H = 4/3 E* sqrt(R), a^3 = 3 F R / (4 E*), approach a^2/R.
    """
    settings = hertz_settings(replace(CROSSED, rail="circle:460", load_N=80e3))
    printed = numbers(settings)
    stiffness = 4.0 / 3.0 * E_STAR * math.sqrt(460.0)
    a = (3.0 * 80e3 * 460.0 / (4.0 * E_STAR)) ** (1.0 / 3.0)
    expected = {
        ("spring K_H", "N/mm^1.5"): stiffness,
        ("spring K_H, F_n = K_H d^1.5", "N/m^1.5"): stiffness * 1000.0**1.5,
        ("semi-axis a, along the track", "mm"): a,
        ("semi-axis b, across", "mm"): a,
        ("approach d", "mm"): a**2 / 460.0,
        ("A1 = 1/(2 Rx)", "1/mm"): 1.0 / 920.0,
        ("B1 = 1/(2 Ry)", "1/mm"): 1.0 / 920.0,
        ("equivalent radius Rx, along the track", "mm"): 460.0,
        ("equivalent radius Ry, across", "mm"): 460.0,
        ("combined modulus E*", "MPa"): E_STAR,
        ("normal force F_n", "N"): 80e3,
        ("contact angle", "rad"): 0.0,
        ("contact point, y on the rail profile", "mm"): 0.0,
        ("contact point, y on the wheel profile", "mm"): 0.0,
    }
    assert {key: printed[key] for key in expected} == pytest.approx(expected, rel=PRINTED, abs=1e-9)


def test_a_cylinder_on_a_circle_satisfies_hertz_with_complete_elliptic_integrals():
    """Curvatures and approach from the printed semi-axes (Johnson 1985, eq. 3.61, 4.25): no root is searched for."""
    printed = numbers(hertz_settings(replace(CROSSED, load_N=100e3)))
    a, b = printed["semi-axis a, along the track", "mm"], printed["semi-axis b, across", "mm"]
    m = 1.0 - (b / a) ** 2
    force = 3.0 * 100e3 / (2.0 * math.pi * E_STAR)
    A = force * (ellipk(m) - ellipe(m)) / (m * a**3)
    B = force * (ellipe(m) / (1.0 - m) - ellipk(m)) / (m * a**3)
    # the differences of the integrals lose a digit of the six printed ones
    assert pytest.approx((0.5 / 460.0, 0.5 / 300.0), rel=1e-4) == (A, B)
    assert printed["equivalent radius Rx, along the track", "mm"] == pytest.approx(460.0, rel=PRINTED)
    assert printed["equivalent radius Ry, across", "mm"] == pytest.approx(300.0, rel=PRINTED)
    approach = force * ellipk(m) / a
    assert printed["approach d", "mm"] == pytest.approx(approach, rel=PRINTED)
    assert printed["spring K_H", "N/mm^1.5"] == pytest.approx(100e3 / approach**1.5, rel=PRINTED)


def test_the_input_of_contact_has_the_numbers_of_its_user_guide():
    """Cattaneo's problem of the user guide: sphere of 50 mm on a plane, G 200, nu 0.42, FN 9.1954, so AA = BB = 1."""
    soft = Material.from_shear(shear_MPa=200.0, poisson=0.42)
    case = Case(
        rail="circle:50",
        wheel="cylinder:50",
        rolling_radius_mm=50.0,
        inclination_rad=0.0,
        load_N=9.1954,
        rail_material=soft,
        wheel_material=soft,
    )
    lines = [line.split() for line in texts("CONTACT", hertz_settings(case))]
    values = {names.rstrip(";"): line for line in lines for names in line if names in ("AA,", "A1,", "POISS", "FN,")}
    assert [float(number) for number in values["AA,"][2:4]] == pytest.approx([1.0, 1.0], rel=1e-4)
    assert [float(number) for number in values["A1,"][2:4]] == pytest.approx([0.01, 0.01], rel=1e-6)
    assert values["POISS"][:4] == ["0.42", "0.42", "200", "200"]
    assert values["FN,"][0] == "9.1954"


def test_the_wheel_is_body_1_and_friction_is_given():
    wheel = Material.from_shear(shear_MPa=70e3, poisson=0.25)
    case = replace(CROSSED, wheel_material=wheel, creep=Creep(friction=0.35))
    lines = texts("CONTACT", hertz_settings(case))
    assert next(line for line in lines if "POISS" in line).split()[:4] == ["0.25", "0.3", "70000", "80769.23"]
    assert next(line for line in lines if "FSTAT" in line).split()[:2] == ["0.35", "0.35"]
    assert numbers(hertz_settings(case))["coefficient of friction", "1"] == 0.35
    assert not any("turned" in line for line in lines)


def test_an_ellipse_that_is_turned_is_reported():
    case = Case(lateral_shift_mm=-4.0, yaw_rad=0.01)
    settings = hertz_settings(case)
    turn = fecontact.hertz(case)["ellipses"][0]["orientation_rad"]
    assert abs(turn) > 1e-4
    assert any(f"turned by {1e3 * turn:+.3f} mrad" in line for line in texts("CONTACT", settings))


@pytest.fixture(scope="module")
def steep():
    """Gauge corner at 17 degrees under a vertical load: the normal force is 4 % larger."""
    case = Case(lateral_shift_mm=5.75, roll="touching", load_N=50e3)
    return case, settings_of_theory(case, fecontact.theory(case, "hertz"))


def test_codes_with_a_vertical_spring_carry_the_vertical_load(steep):
    _, settings = steep
    printed = numbers(settings)
    cosine = math.cos(printed["contact angle", "rad"])
    assert cosine < 0.97
    assert printed["normal force F_n", "N"] * cosine == pytest.approx(50e3, rel=PRINTED)
    displacement_m = printed["approach d", "mm"] / cosine / 1e3
    vertical = printed["vertical spring, K_H cos(angle)^2.5", "N/m^1.5"]
    assert vertical * displacement_m**1.5 == pytest.approx(50e3, rel=PRINTED)
    (line,) = [line for line in texts("STEM", settings) if line.startswith("point")]
    coefficient = float(re.search(r'"contact_coefficient": (\S+),', line)[1])
    assert (displacement_m / coefficient) ** 1.5 == pytest.approx(50e3, rel=PRINTED)
    (line,) = [line for line in texts("OpenSees", settings) if line.startswith("point")]
    flexibility, spring = (float(number) for number in re.search(r"G = (\S+) m/N.* of (\S+) N/m", line).groups())
    # 0.46^-0.149 = 1.1227, by logarithms: exp(0.149 * 0.77653)
    assert flexibility == pytest.approx(4.57e-8 * 1.12269, rel=1e-4)
    # the force of the element by its own formula at a displacement of 0.1 mm
    assert spring * 1e-4**1.5 == pytest.approx((1e-4 / flexibility) ** 1.5, rel=1e-4)
    assert f"{1e2 * (spring / vertical - 1.0):+.1f} %" in line


def test_chrono_carries_the_normal_force_for_any_effective_radius(steep):
    _, settings = steep
    printed = numbers(settings)
    (line,) = [line for line in texts("Chrono", settings) if line.startswith("point")]
    factor = float(re.search(r"SetKn\((\S+) / R\)", line)[1])
    for radius_m in (0.1, 1.0):
        force = radius_m * (factor / radius_m) * (1e-3 * printed["approach d", "mm"]) ** 1.5
        assert force == pytest.approx(printed["normal force F_n", "N"], rel=PRINTED)


def test_codes_without_public_settings_have_the_numbers_alone(steep):
    _, settings = steep
    for name in ("SIMPACK", "VI-Rail", "GENSYS", "VAMPIRE", "NUCARS", "Medyna", "UM"):
        assert texts(name, settings) == [f"Settings in {name}:", f"  hertz: Hertz; {NOT_FOUND}"]


# --- several contact points, theories without ellipses, solved cases


def test_every_contact_point_has_its_ellipse():
    case = Case(lateral_shift_mm=5.0, roll="touching", load_N=50e3)
    unshared, shared = hertz_settings(case), settings_of_theory(case, fecontact.theory(case, "multi_hertz"))
    assert (
        [place.heading for place in unshared.patches]
        == [place.heading for place in shared.patches]
        == ["point 1", "point 2"]
    )
    assert "multi_hertz" in unshared.note
    for index in range(2):
        alone, together = numbers(unshared, index), numbers(shared, index)
        # the stiffness depends on curvatures, not on the load
        for key in (("spring K_H", "N/mm^1.5"), ("contact point, y on the rail profile", "mm")):
            assert alone[key] == pytest.approx(together[key], rel=1e-9)
        assert together["normal force F_n", "N"] < alone["normal force F_n", "N"]
    blocks = [line for line in texts("CONTACT", shared) if line.startswith("Input of CONTACT")]
    assert len(blocks) == 2


def test_a_junction_has_an_ellipse_for_each_side():
    settings = hertz_settings(replace(CROSSED, rail="arcs:300/80@0"))
    assert [place.heading for place in settings.patches] == ["point 1, gauge side", "point 1, field side"]
    radii = [numbers(settings, index)["equivalent radius Ry, across", "mm"] for index in range(2)]
    assert sorted(radii) == pytest.approx([80.0, 300.0], rel=PRINTED)


def test_a_theory_without_an_ellipse_has_no_stiffness():
    settings = settings_of_theory(CROSSED, fecontact.theory(CROSSED, "kpec"))
    printed = numbers(settings)
    assert ("spring K_H", "N/mm^1.5") not in printed
    assert printed["semi-axis a, along the track", "mm"] == pytest.approx(
        numbers(hertz_settings(CROSSED))["semi-axis a, along the track", "mm"], rel=3e-3
    )
    lines = texts("CONTACT", settings)
    assert "      set: module 1, B = 5" in lines
    assert not any("IPOTCN" in line for line in lines if not line.startswith("      "))


def test_a_solved_case_has_the_setting_of_the_cheapest_theory(elliptic_quick):
    record, case = result_record(elliptic_quick), elliptic_quick.case
    assert record["cheapest_theory"] == "hertz"
    settings = settings_of_result(case, record)
    alone = hertz_settings(case)
    assert numbers(settings) == pytest.approx(numbers(alone), rel=1e-9)
    assert any("IPOTCN" in line for line in texts("CONTACT", settings))
    analyn = settings_of_result(case, {**record, "cheapest_theory": "analyn"})
    assert [place.heading for place in analyn.patches] == ["ANALYN", "Hertz, point 1"]
    assert "      set: module 1, B = 6" in texts("CONTACT", analyn)
    assert not any(line.startswith("Input of CONTACT") for line in texts("CONTACT", analyn))
    assert numbers(analyn, 1) == pytest.approx(numbers(alone), rel=1e-9)
    # the answer for Hertz is stated as it is
    for answer, words in (("FAILS", "Hertz does not hold here"), ("UNRESOLVED", "Hertz is not known to hold here")):
        open_record = {**record, "cheapest_theory": "analyn", "verdict": {**record["verdict"], "answer": answer}}
        assert settings_of_result(case, open_record).note.startswith(words)
    for answer in ("none", "UNRESOLVED"):
        unknown = settings_of_result(case, {**record, "cheapest_theory": answer})
        assert texts("CONTACT", unknown) == ["Settings in CONTACT:", unknown.note]
        assert unknown.note.startswith("No theory is known to hold here; the numbers of Hertz")
    # the theory that may hold is named, with the profile variants that decide
    theories = record["theories"]
    hertz_verdict = {
        **theories["hertz"]["verdict"],
        "variant_answers": {"filter 4 mm": "HOLDS", "filter 8 mm": "FAILS"},
    }
    hertz = {**theories["hertz"], "verdict": {**hertz_verdict, "answer": "UNRESOLVED"}}
    possible = {**record, "cheapest_theory": "UNRESOLVED", "theories": {**theories, "hertz": hertz}}
    assert settings_of_result(case, possible).note.startswith(
        "No theory is known to hold here (cheapest theory that may hold: Hertz holds on 1 of 2 profile variants"
    )


def holding(record, *names):
    """The record of a result in which Hertz fails, and only the named theories hold."""
    theories = {
        name: theory and {**theory, "verdict": {**theory["verdict"], "answer": "HOLDS" if name in names else "FAILS"}}
        for name, theory in record["theories"].items()
    }
    verdict = {**record["verdict"], "answer": "FAILS"}
    return {**record, "verdict": verdict, "theories": theories, "cheapest_theory": names[0]}


@pytest.mark.parametrize(
    ("code", "names", "expected"),
    [
        # the code has the cheapest theory that holds
        ("CONTACT", ("kpec", "strip", "half_space"), None),
        ("CONTACT", ("strip", "half_space"), "half_space"),
        ("CONTACT", ("kik_piotrowski", "analyn", "half_space"), "analyn"),
        ("UM", ("strip", "half_space"), "half_space"),
        # its numbers are printed, whatever the manual says
        ("SIMPACK", ("hertz", "half_space"), None),
        ("CONTACT", ("strip",), ""),
        ("Medyna", ("strip", "half_space"), ""),
    ],
)
def test_a_code_without_the_cheapest_theory_has_the_next_one(code, names, expected, elliptic_quick):
    record = holding(result_record(elliptic_quick), *names)
    lines = texts(code, settings_of_result(elliptic_quick.case, record))
    next_theory = next(
        (line for line, before in zip(lines[1:], lines, strict=False) if "was found there:" in before), ""
    )
    assert lines[1].startswith(f"  {names[0]}: ")
    assert next_theory.startswith(f"  {expected}: " if expected else "")
    assert bool(next_theory) == bool(expected)
    assert any(
        line.startswith(f"No theory that holds here was found in public documentation of {code}") for line in lines
    ) == (expected == "")


def test_a_theory_out_of_its_range_is_no_remedy(elliptic_quick):
    """Unless the criteria let it count."""
    record = holding(result_record(elliptic_quick), "strip", "analyn", "half_space")
    record["theories"]["analyn"]["status"] = "out of range"
    case = elliptic_quick.case
    out_of_range = replace(case, criteria=replace(case.criteria, theories_out_of_range=True))
    assert settings_of_result(case, record).holding == ("strip", "half_space")
    assert settings_of_result(out_of_range, record).holding == ("analyn", "strip", "half_space")


def test_stored_cases_have_settings(elliptic_quick, tmp_path, capsys):
    """As `solve` prints them, by the criteria and the friction that are given."""
    keep_case(elliptic_quick, tmp_path / "one")
    assert call(["judge", str(tmp_path / "one"), "--friction", "0.35", "--set-in", "contact"]) == 0
    out = capsys.readouterr().out
    for line in texts("CONTACT", settings_of_result(elliptic_quick.case, result_record(elliptic_quick))):
        assert line.split("<FSTAT>")[0].rstrip() in out, line
    assert re.search(r"coefficient of friction +1 +0.35\n", out)
    assert "rail circle:300, wheel cylinder:460; shift +0.00 mm" in out
    # Hertz's peak deviates by 0.07 ± 0.25 %
    assert call(["judge", str(tmp_path / "one"), "--p-max-percent", "0.1", "--set-in", "contact"]) == 0
    assert "hertz: Hertz" not in capsys.readouterr().out


def test_a_map_has_no_settings(tmp_path, capsys):
    (tmp_path / "map.json").write_text("{}", "utf-8")
    assert call(["judge", str(tmp_path), "--set-in", "CONTACT"]) == 2
    assert "solve the cell of the map with `fecontact solve" in capsys.readouterr().err


def test_the_commands_print_the_settings(capsys):
    options = ("--rail", "circle:300", "--wheel", "cylinder:460", "--inclination", "none", "--set-in", "vampire")
    for words in (("hertz",), ("theory", "hertz")):
        assert call([*words, *options]) == 0
        out = capsys.readouterr().out
        assert f"hertz: Hertz; {NOT_FOUND}" in out
        assert re.search(r"spring K_H +N/mm\^1.5 +2.9765e\+06", out)
