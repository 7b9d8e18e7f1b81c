"""Reports: comparison with their records, and their appearance in a browser."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from browser import assert_readable, shown
from kept import keep_as

from fecontact.case import Criteria
from fecontact.cli import call
from fecontact.files import write_sealed
from fecontact.judging.judge import judge_load
from fecontact.outputs import style
from fecontact.outputs.cases import ReportedCase
from fecontact.outputs.figures.relief import relief_picture
from fecontact.outputs.figures.report_pictures import ladder_figure, patches_figure
from fecontact.outputs.figures.study import draw_study
from fecontact.outputs.report_words import answer_words
from fecontact.outputs.study_files import write_tables
from fecontact.outputs.study_report import DrawnCase, read_reported_case, write_study_report
from fecontact.outputs.tables import write_csv
from fecontact.outputs.verdict_words import utilisation_text
from fecontact.outputs.words import MEASURE_WORDS
from fecontact.solving.solve import CaseResult

LOST = {
    "id": "lost",
    "status": "failed: the wheel <leaves> the rail",
    "rail": "circle:300",
    "wheel": "cylinder:460",
    "lateral_shift_mm": 30.0,
    "load_kN": 100.0,
}


@pytest.fixture(scope="module")
def study(elliptic_quick: CaseResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two shifts with different criteria, and a third shift that was not solved.

    With the second criteria, the verdict is UNRESOLVED.
    """
    out = tmp_path_factory.mktemp("a study & more")
    rows = []
    for shift, criteria in ((-1.0, Criteria()), (2.5, Criteria(misplaced=0.0047))):
        case = replace(elliptic_quick.case, lateral_shift_mm=shift, criteria=criteria)
        load = judge_load(replace(elliptic_quick.load.solved, case=case), elliptic_quick.placement)
        rows.append(keep_as(replace(elliptic_quick, load=load), out / "cases" / f"at{shift:g}"))
    assert [row["verdict_answer"] for row in rows] == ["HOLDS", "UNRESOLVED"]
    rows.append(LOST)
    draw_study(rows, out / "study.png")
    write_tables("two", 3, rows, out / "study")
    pair = DrawnCase(row=rows[1], placement=elliptic_quick.placement)
    write_study_report("two <shifts>", report_cases(out, rows), out, shown=pair, conclusion="It is as expected.")
    return out


def report_cases(out: Path, rows: list[dict[str, Any]]) -> list[ReportedCase]:
    return [read_reported_case(row, out / "cases" / row["id"]) for row in rows]


def parse_page(path: Path) -> ElementTree.Element:
    return ElementTree.fromstring(path.read_text("utf-8").removeprefix("<!DOCTYPE html>\n"))


def text_of(element: ElementTree.Element) -> str:
    return "".join(element.itertext())


@pytest.mark.slow
def test_the_answer_of_a_study_without_a_conclusion_stands_once(study, tmp_path):
    rows = json.loads((study / "study.json").read_text("utf-8"))["rows"]
    shutil.copy(study / "study.svg", tmp_path)
    page = parse_page(write_study_report("two", report_cases(study, rows), tmp_path))
    assert text_of(next(page.iter("h1"))).startswith("Hertz holds in 1 of 3 cases")
    head = [text_of(paragraph) for paragraph in page.iter("p")]
    assert head[0] == "Rail circle:300 and wheel cylinder:460, 100 kN; study two"
    assert head[1].startswith("Can Hertz's ellipse replace the contact")


def test_a_report_says_question_answer_and_reason(study):
    page = parse_page(study / "report.html")
    head = [text_of(paragraph) for paragraph in page.iter("p")]
    # the headline is the verdict; the pair is below, then the conclusion of the study
    (headline,) = map(text_of, page.iter("h1"))
    assert headline == "Hertz holds in 1 of 3 cases, fails in 0, is unresolved in 1, 1 could not be used"
    assert head[0] == "Rail circle:300 and wheel cylinder:460, 100 kN; study two <shifts>"
    assert head[1] == "It is as expected."
    assert head[2].startswith("Can Hertz's ellipse replace the contact of rail circle:300 and wheel cylinder:460?")
    assert [
        text_of(paragraph)
        for paragraph in page.iter("p")
        if "to decide, use --resolution standard" in text_of(paragraph)
    ]
    titles = [text_of(heading) for heading in page.iter("h2")]
    assert titles == ["Verdicts", "The pair", "Cases", "Meshes and solver", "Terms", "Versions"]
    lines = [[text_of(cell) for cell in line.iter("td")] for line in next(page.iter("table")).iter("tr")][1:]
    assert [line[:3] for line in lines] == [
        ["-1.00", "100", "HOLDS"], ["+2.50", "100", "UNRESOLVED"], ["+30.00", "100", "failed"],
    ]  # fmt: skip
    assert lines[2][3] == "failed: the wheel <leaves> the rail"


def test_the_picture_of_the_pair_says_which_case_it_shows(study):
    words = [text_of(caption) for caption in parse_page(study / "report.html").iter("figcaption")]
    rows = json.loads((study / "study.json").read_text("utf-8"))["rows"]
    utilisations = [row.get("verdict_limit_utilisation", 0.0) for row in rows]
    assert utilisations[1] == max(utilisations) > utilisations[0] > 0.0
    case = f"at +2.50 mm, 100 kN, the case with the largest limit utilisation ({utilisations[1]:.2f})"
    # the caption after the caption of the whole study
    assert words[1] == f"Section through the first contact point {case}."


def test_every_measure_that_is_judged_is_defined(study):
    page = parse_page(study / "report.html")
    definitions = dict(zip(map(text_of, page.iter("dt")), map(text_of, page.iter("dd")), strict=True))
    for words in MEASURE_WORDS.values():
        meaning = definitions[f"{words.short}: {words.title}"]
        # the definition does not repeat the name
        assert len(meaning) > 25
        assert words.title.lower() not in meaning.lower()


def test_all_measures_are_open_on_paper(study):
    style = (study / "report.html").read_text("utf-8").partition("@media print")[2].partition("</style>")[0]
    assert "details::details-content { content-visibility: visible;" in style


def test_a_page_has_one_width_and_one_headline(study):
    page = parse_page(study / "report.html")
    (body,) = page.iter("body")
    assert [(child.tag, child.get("class")) for child in body] == [("main", "content")]
    assert [text_of(heading) for heading in body[0][0].iter("h1")] == [text_of(heading) for heading in page.iter("h1")]
    on_screen = (study / "report.html").read_text("utf-8").partition("<style>")[2].partition("@media print")[0]
    blocks = re.findall(r"([^{};]+)\{[^{}]*(?<![(\w-])max-width: ([\d.]+(?:rem|px|em|ch))", on_screen)
    assert [(selector.strip().rpartition("\n")[2], width) for selector, width in blocks] == [(".content", "62rem")]


def test_paper_cuts_no_table(study, tmp_path):
    """With the rules for paper, nothing is wider than A4."""
    text = (study / "report.html").read_text("utf-8")
    page = tmp_path / "paper.html"
    page.write_text(text.replace("@media print {", "@media all {").replace("@media screen and", "@media speech and"))
    (head, *_) = parse_page(study / "report.html").iter("thead")
    assert [row.get("class") for row in head] == ["head"]
    for rule in ("thead { display: table-header-group; }", "figure, tr, dt, li, header { break-inside: avoid; }"):
        assert rule in text.partition("@media print {")[2]
    # 190 mm at 96 pixels per inch; without a browser the rules alone are checked
    rendered = shown(page, 718, tmp_path)
    assert rendered["content_width"] <= 718
    assert {table for table, _ in rendered["tables"]} <= set(range(719))


@pytest.mark.parametrize(
    ("measure", "deviation", "words"),
    [
        ("p_max_MPa", -0.158, "peak pressure too low by 15.80 ± 0.50 % (limit 10 %)"),
        ("b_mm", -0.0745, "patch too narrow by 7.45 ± 0.50 % (limit 10 %)"),
        ("a_mm", 0.4934, "patch too long by 49.34 ± 0.50 % (limit 10 %)"),
        ("separate_load", 0.08, "separate patches carry 8.00 ± 0.50 % of the load (limit 10 %)"),
        (
            "centre_over_b",
            -0.2,
            "centre of pressure 0.200 ± 0.005 half-widths from the contact point (limit 0.1 half-widths)",
        ),
        ("approach_mm", -0.3, "approach too small by 30.00 ± 0.50 % (limit 10 %)"),
    ],
)
def test_a_deviation_has_a_physical_meaning(measure, deviation, words):
    assert MEASURE_WORDS[measure].describe_deviation(deviation, 0.005, 0.1) == words


def test_a_utilisation_above_1_is_not_a_number_of_a_report():
    assert [utilisation_text(value) for value in (None, 0.4765, 1.0, 1.004, 374.48)] == [
        "-", "0.48", "1.00", "above 1", "above 1",
    ]  # fmt: skip


def test_numbers_of_a_report_are_those_of_the_result(study):
    record = json.loads((study / "cases" / "at-1" / "result.json").read_text("utf-8"))
    hertz = record["theories"]["hertz"]
    page = parse_page(study / "report.html")
    record |= record["theories"]
    (verdicts, measures, *_, solver) = list(page.iter("table"))
    cells = [text_of(cell) for cell in verdicts.iter("td")][:8]
    off, uncertainty = ({name: 1e2 * hertz[key][name] for name in hertz[key]} for key in ("deviation", "uncertainty"))
    nearest = "p_max_MPa"
    assert cells[3] == f"peak pressure {off[nearest]:+.2f} % ± {uncertainty[nearest]:.2f} % (limit ±5 %)"
    assert cells[5:7] == [f"{measures_of_method['p_max_MPa']:.0f}" for measures_of_method in (record["fe"], hertz)]
    lines = {text_of(line[0]): [text_of(cell) for cell in line] for line in measures.iter("tr") if line[0].tag == "td"}
    peak = lines["peak pressure (MPa)"]
    assert [float(cell) for cell in peak[1:3]] == pytest.approx(
        [record["fe"]["p_max_MPa"], hertz["p_max_MPa"]], rel=1e-4
    )
    assert peak[3:] == [
        f"{off['p_max_MPa']:+.2f} %",
        f"{uncertainty['p_max_MPa']:.2f} %",
        "±5 %",
        "HOLDS",
    ]
    # the deciding measures; the other measures are folded
    assert list(lines) == [MEASURE_WORDS[measure].title for measure in record["verdict"]["limits"]]
    assert str(sum(record["solver"]["degrees_of_freedom"].values())) in [text_of(cell) for cell in solver.iter("td")]


def test_a_report_is_one_file_that_asks_for_nothing(study):
    text = (study / "report.html").read_text("utf-8")
    sources = re.findall(r'(?:src|href)="([^"#][^"]{0,30})', text)
    # section, study, ladder and two cases, and the embedded icon, so that no browser requests it
    assert len(sources) == 6
    assert all(source.startswith("data:") for source in sources)
    assert "<script" not in text
    assert "url(" not in text.partition("</style>")[0]


def test_a_case_alone_and_a_judged_one_have_a_report(elliptic_quick, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("fecontact.runs.store.solve", lambda case, progress=None: elliptic_quick)
    command = ["solve", "--rail", "circle:300", "--wheel", "cylinder:460", "--inclination", "0"]
    assert call([*command, "--out", str(tmp_path / "one")]) == 0
    # the relief of the pressure, which can be turned, is in this file
    assert (tmp_path / "one" / "report.html").stat().st_size < 5e6
    page = parse_page(tmp_path / "one" / "report.html")
    (decided,) = page.iter("h1")
    assert decided.get("class") == "lead holds"
    size = r"0\.\d\d ± 0\.\d\d %"
    assert re.fullmatch(
        rf"Hertz HOLDS: (peak pressure too low by {size} \(limit 5 %\)"
        rf"|{size} of the load at a different place \(limit 10 %\))",
        text_of(decided),
    )
    words = [text_of(caption) for caption in page.iter("figcaption")]
    # section, the case, and its relief: a single point does not give a line over the shift
    assert len(words) == 3
    assert words[0] == "Section through the first contact point at +0.00 mm, 100 kN."
    (relief,) = [
        json.loads(text_of(script)) for script in page.iter("script") if script.get("type") == "application/json"
    ]
    x, y, z, pressure = (np.array(relief[name]) for name in ("x", "y", "z", "p"))
    # the peak in the text of the page is between nodes
    assert relief["peak_MPa"] == round(elliptic_quick.comparison.fe.p_max_MPa)
    assert [relief["peak_MPa"], pressure.max()] == pytest.approx([1238.4] * 2, abs=1.0)
    # the relief is on the rail of radius 300, and its pressure carries the load
    assert np.hypot(y, z + 300.0) == pytest.approx(300.0, abs=1e-3)
    carried = np.trapezoid(np.trapezoid(pressure.reshape(x.size, y.size), 300.0 * np.arctan2(y, z + 300.0)), x)
    assert carried == pytest.approx(100e3, rel=2e-3)
    # the limit is close to the error of the elements; judging a stored case with forces is tested in test_load
    command_again = ["judge", str(tmp_path / "one"), "--out", str(tmp_path / "again")]
    assert call([*command_again, "--misplaced-load-percent", "0.01"]) == 0
    page = parse_page(tmp_path / "again" / "report.html")
    assert re.fullmatch(
        rf"Hertz UNRESOLVED: {size} of the load at a different place \(limit 0\.01 %\).*",
        text_of(next(page.iter("h1"))),
    )
    # the picture does not show the old verdict
    assert "(limit < 0.01 %)" in text_of(page)
    assert {path.name for path in (tmp_path / "again").iterdir()} == {
        "study.csv", "study.json", "report.html",
    }  # fmt: skip


@pytest.mark.slow
def test_a_report_can_be_read_on_a_telephone_and_on_a_screen(study, tmp_path):
    rendered = assert_readable(study / "report.html", tmp_path)
    assert rendered["title"] == "Rail circle:300 and wheel cylinder:460, 100 kN: where Hertz holds"
    assert len(rendered["pictures"]) == 5
    assert not any(is_open for _, is_open in rendered["folded"])


def test_a_relief_turns_in_a_browser(elliptic_quick, tmp_path):
    """In place of its picture; in the dark as well, and without a request."""
    picture = relief_picture(elliptic_quick.load, elliptic_quick.placement)
    page = tmp_path / "relief.html"
    check = """
    <script>addEventListener("load", () => requestAnimationFrame(() => requestAnimationFrame(() => {
      const canvas = document.querySelector("canvas"), before = canvas.toDataURL();
      canvas.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowLeft"}));
      requestAnimationFrame(() => requestAnimationFrame(() => {
        if (canvas.toDataURL() === before) console.error("it does not turn");
        if (document.querySelector("img").checkVisibility()) console.error("the picture is still there");
        document.title = "turned";
      }));
    })));</script></body>"""
    page.write_text(style.render_page("relief", [picture]).replace("</body>", check), "utf-8")
    rendered = shown(page, 800, tmp_path)
    assert rendered["console"] == []
    assert rendered["requests"] == []
    assert rendered["content_width"] == 800


def test_the_browser_finds_what_is_wrong(tmp_path):
    """The test above can fail: a picture that is not there, a request, a word that sticks out, a console error."""
    page = tmp_path / "bad.html"
    page.write_text(
        style.render_page("bad", ()).replace(
            "</body>",
            f'<img alt="x" src="http://127.0.0.1:9/no.png"/><pre>{"w" * 500}</pre>'
            "<script>console.error('planted')</script></body>",
        )
    )
    rendered = shown(page, 400, tmp_path)
    assert rendered["content_width"] > 400
    assert rendered["pictures"][0][1] == 0
    assert rendered["requests"] == ["http://127.0.0.1:9/no.png"]
    assert [line for line in rendered["console"] if "planted" in line]


@pytest.mark.slow
def test_a_comparison_can_be_read_on_a_telephone_and_on_a_screen(study, tmp_path):
    other_study = tmp_path / "other"
    shutil.copytree(study, other_study)
    document = json.loads((other_study / "study.json").read_text("utf-8"))
    document["rows"][0]["fe_p_max_MPa"] *= 1.03
    del document["sha256"]
    write_csv(document["rows"], other_study / "study.csv")
    write_sealed(other_study / "study.json", document, [other_study / "study.csv"])
    page = tmp_path / "comparison.html"
    assert call(["compare", str(study), str(other_study), "--out", str(tmp_path)]) == 1
    rendered = assert_readable(page, tmp_path)
    texts = [text for text, _, _ in rendered["cells"]]
    # differences are visible, with a readable name; equal columns are folded
    assert texts[:3] == ["fe_p_max_MPa", "1/3", "-1 mm, 100 kN"]
    assert len(texts) == 8 + 7
    assert len(rendered["folded"]) == 4
    assert not any(is_open for _, is_open in rendered["folded"])


def test_only_the_worst_of_many_cases_have_pictures(study, monkeypatch):
    rows = json.loads((study / "study.json").read_text("utf-8"))["rows"]
    monkeypatch.setattr("fecontact.outputs.study_report.MAX_PICTURES", 1)
    monkeypatch.setattr("fecontact.outputs.study_report.REPORT_FILE", "few.html")
    page = parse_page(write_study_report("few", report_cases(study, rows), study))
    assert [text_of(heading) for heading in page.iter("h3")] == [
        "rail circle:300 and wheel cylinder:460, +2.50 mm, 100 kN: UNRESOLVED"
    ]
    assert "1 of 3 cases, with the largest limit utilisation; all are in cases/ID/case.png." in text_of(page)


def test_the_ladder_is_drawn_only_of_what_tells_it(study):
    assert ladder_figure([LOST]) is None
    rows = json.loads((study / "study.json").read_text("utf-8"))["rows"]
    figure = ladder_figure(rows)
    assert figure is not None
    # each step has a mark per case
    assert all(len(line.get_xdata()) == 2 for ax in figure.axes for line in ax.get_lines() if line.get_marker() == "o")


def test_patches_in_small_name_their_verdicts(elliptic_quick):
    figure = patches_figure([(elliptic_quick.load, elliptic_quick.placement)] * 5)
    titles = [ax.get_title() for ax in figure.axes if ax.get_title()]
    assert titles == ["+0.00 mm, 100 kN: HOLDS"] * 5


@pytest.mark.parametrize(
    ("verdicts", "words"),
    [
        (["HOLDS"], "Hertz holds in 1 of 1 x, fails in 0"),
        (
            ["HOLDS", "FAILS", "UNRESOLVED", "failed"],
            "Hertz holds in 1 of 4 x, fails in 1, is unresolved in 1, 1 could not be used",
        ),
    ],
)
def test_an_answer_counts_every_verdict(verdicts, words):
    assert answer_words(verdicts, "x") == words
