"""Random commands that compute, over the whole library, with the rules for their ends and outputs.

`python tests/command_matrix.py [--rounds N] [--seed S] [--solve]` prints a table: how many lines of each command were
drawn, answered and refused, with the reasons, and ends with exit code 1 if a line broke a rule. With `--solve` it draws
the commands with finite elements.
"""

import argparse
import contextlib
import json
import math
import os
import random
import re
import shlex
import sys
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fuzz_commands import LONGEST_MESSAGE, Ended, no_numbers, run

from fecontact.contact_theories.registry import THEORIES
from fecontact.judging.verdict import compare_with_limit
from fecontact.outputs.theory_records import judged_theories
from fecontact.profiles.library import list_names

SLOWEST_S = 400.0
INCLINATIONS = ("1:20", "1:30", "1:40", "none")
IRREGULARITIES = (
    "sine:wavelength_mm=30,amplitude_um=25,phase_deg=90",
    "sine:wavelength_mm=300,amplitude_um=100",
    "chord:length_mm=40",
    "haversine:length_mm=52,depth_mm=0.4",
)
LAWS = ("kalker", "vermeulen_johnson", "she", "polach", "fastsim", "rolling_half_space")
# lines of each command in a round; curves are the dearest, with 3 to 6 CPU s each
FAST = {"hertz": 4, "theory": 8, "place": 2, "geometry": 2, "table": 2, "creep": 3, "curve": 1, "irregular": 2}
SOLVING = {"solve": 8, "map": 1, "run": 1, "loaded geometry": 1, "fleet": 1}


@dataclass
class Tally:
    """Answers, refusals and broken rules of the lines of a command."""

    drawn: int = 0
    answered: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    bad: list[str] = field(default_factory=list)


def pair(rng: random.Random) -> list[str]:
    """Options of a rail and a wheel of the library."""
    return [
        f"--rail={rng.choice(list_names('rail'))}",
        f"--wheel={rng.choice(list_names('wheel'))}",
        f"--inclination={rng.choice(INCLINATIONS)}",
    ]


def maybe(rng: random.Random, probability: float, *words: str) -> list[str]:
    """Words of a command, in a part of the draws."""
    return list(words) if rng.random() < probability else []


def position_options(rng: random.Random) -> list[str]:
    """Options of a wheel on a rail, without its shift and load."""
    return [
        *pair(rng),
        f"--side={rng.choice(('left', 'right'))}",
        *maybe(rng, 0.25, f"--yaw-mrad={rng.choice((-8, 3, 12))}"),
        *maybe(rng, 0.2, "--load-kind=normal"),
        *maybe(rng, 0.2, f"--roll={rng.choice(('given', 'loaded'))}"),
        *maybe(rng, 0.1, "--flange-climb"),
    ]


def position(rng: random.Random) -> list[str]:
    """Options of a wheel on a rail under a load."""
    return [
        *position_options(rng),
        f"--shift={rng.uniform(-8.0, 8.0):.2f}",
        f"--load-kn={rng.choice((2, 20, 60, 100, 160, 250))}",
        *irregular(rng),
    ]


def irregular(rng: random.Random) -> list[str]:
    """Options of an irregularity, in a fifth of the draws."""
    body = rng.choice(("rail", "wheel"))
    line = f"--{body}-irregularity={rng.choice(IRREGULARITIES)}"
    return maybe(rng, 0.2, line, f"--distance-mm={rng.choice((0, 7, -20))}")


def shown(rng: random.Random, out: str = "", ending: str = "") -> list[str]:
    """How the answer is shown, and where it is written."""
    name = f"--out={out}{rng.randrange(10**9)}{ending}"
    return [*maybe(rng, 0.6, "--json"), *(maybe(rng, 0.3, name) if out else [])]


def shifts(rng: random.Random) -> str:
    """Three shifts."""
    first = rng.uniform(-8.0, 4.0)
    return ",".join(f"{first + step:.2f}" for step in (0.0, 1.7, 4.1))


def _creep(rng: random.Random) -> list[str]:
    axes = [f"--a-mm={rng.uniform(1.0, 12.0):.2f}", f"--b-mm={rng.uniform(1.0, 12.0):.2f}"]
    slip = [f"--xi={rng.choice((0.0, 1e-3, -5e-3))}", f"--eta={rng.choice((0.0, 2e-3, -1e-2))}"]
    force = [f"--normal-force-kn={rng.choice((5, 60, 160))}", f"--friction={rng.choice((0.05, 0.3, 0.6))}"]
    spin = f"--spin-per-mm={rng.choice((0.0, 2e-4, -1e-3))}"
    return [*axes, *force, *slip, spin, f"--theory={rng.choice(LAWS)}", *shown(rng)]


def _curve(rng: random.Random) -> list[str]:
    """Random options of `fecontact curve`."""
    radii = rng.sample((200, -250, 500, -600, 1500, -4000, 10000), 2)
    return [
        *pair(rng),
        f"--vehicle={rng.choice(('wheelset', 'manchester', 'metro'))}",
        f"--bogie={rng.choice(('leading', 'trailing'))}",
        f"--radii={','.join(map(str, radii))}",
        f"--friction={rng.choice((0.1, 0.3, 0.5))}",
        f"--cant-mm={rng.choice((0, 100))}",
        *maybe(rng, 0.3, f"--unbalanced-m-s2={rng.choice((-0.5, 1.0))}"),
        *maybe(rng, 0.2, f"--theory={rng.choice(('hertz', 'multi_hertz', 'strip', 'overlap,hertz'))}"),
        *shown(rng, "curve"),
    ]


def _irregular(rng: random.Random) -> list[str]:
    alone = f"--irregularity={rng.choice(IRREGULARITIES)}"
    waves = [f"--wavelengths-mm={rng.choice(('20', '30,120'))}", f"--amplitudes-um={rng.choice(('5', '10,80'))}"]
    what = rng.choice(([alone, "--positions-mm=-20,0,11"], waves))
    where = [f"--shift={rng.uniform(-8.0, 8.0):.2f}", f"--load-kn={rng.choice((20, 100))}"]
    return [*position_options(rng), *where, *what, "--workers=1", *shown(rng, "irregular")]


def _geometry(rng: random.Random) -> list[str]:
    yaw = maybe(rng, 0.2, f"--yaw-mrad={rng.choice((-4, 6))}")
    return [*pair(rng), *yaw, f"--shifts={shifts(rng)}", *shown(rng, "geometry", ".png")]


def yielding(rng: random.Random) -> list[str]:
    """Options of a yield stress, in a fifth of the draws."""
    return maybe(rng, 0.2, f"--yield-mpa={rng.choice((400, 700))}", f"--tangent-mpa={rng.choice((0, 4200))}")


def _solved(rng: random.Random) -> list[str]:
    friction = [f"--friction={rng.choice((0.1, 0.4))}", f"--xi={rng.choice((1e-3, -4e-3))}"]
    evidence = maybe(rng, 0.1, "--refine=evidence") or maybe(rng, 0.3, "--refine=never")
    strength, quick = maybe(rng, 0.5, "--judged-by=strength"), maybe(rng, 0.5, "--resolution=quick")
    return [*yielding(rng), *maybe(rng, 0.3, *friction), *evidence, *strength, *quick]


def _map(rng: random.Random) -> list[str]:
    loads = f"--loads-kn={rng.choice(('20,100', '60'))}"
    # a map is stored always
    out = f"--out=map{rng.randrange(10**9)}"
    return [*position_options(rng), *_solved(rng), f"--shifts={shifts(rng)}", loads, "--workers=1", out, "--json"]


def _run(rng: random.Random) -> list[str]:
    """A study in a file of this folder; at its last shift no wheel stands, which takes nothing of the others."""
    number = rng.randrange(10**9)
    rail, wheel, inclination = (word.split("=")[1] for word in pair(rng))
    lines = [
        *(f'rail = "{rail}"', f'wheel = "{wheel}"', f'inclination = "{inclination}"'),
        f"lateral_shift_mm = [{rng.uniform(-6.0, 5.0):.2f}, 60.0]",
        f"load_kN = [{rng.choice(('20', '20, 120'))}]",
        *('refine = "never"', f'side = "{rng.choice(("left", "right"))}"'),
    ]
    Path(f"study{number}.toml").write_text("\n".join(lines), "utf-8")
    return [f"study{number}.toml", "--workers=1", f"--out=run{number}", "--json", *maybe(rng, 0.5, "--quick")]


def line_of(command: str, rng: random.Random) -> list[str]:
    """A command line with options drawn at random."""
    words = {
        "hertz": lambda: [*position(rng), *shown(rng)],
        "theory": lambda: [rng.choice((*THEORIES,)), *position(rng), *shown(rng)],
        "place": lambda: [*position(rng), *yielding(rng), *shown(rng, "place", ".png")],
        "geometry": lambda: _geometry(rng),
        "table": lambda: [
            *position_options(rng),
            f"--shifts={shifts(rng)}",
            "--loads-kn=20,110",
            *shown(rng, "table", ".csv"),
        ],
        "creep": lambda: _creep(rng),
        "curve": lambda: _curve(rng),
        "irregular": lambda: _irregular(rng),
        # of each wheel an equilibrium under the load at each of many shifts
        "loaded geometry": lambda: [*_geometry(rng), "--loaded-kn=80"],
        "solve": lambda: [*position(rng), *_solved(rng), *shown(rng, "solve")],
        "map": lambda: _map(rng),
        "run": lambda: _run(rng),
        "fleet": lambda: ["run", "fleet/fleet.toml", f"--out=screened{rng.randrange(10**9)}"],
    }
    return [command.split()[-1], *words[command]()]


def ending(line: list[str], *, slowest_s: float = SLOWEST_S) -> Ended:
    """How a command line ends, with each warning as an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return run(line, slowest_s=slowest_s)


def message(ended: Ended) -> str:
    """The refusal that a command printed; empty if it printed none."""
    return "\n".join(re.findall(r"^error: (.*(?:\n(?! ).+)*)", ended.err, re.MULTILINE))


def reason(text: str) -> str:
    """A refusal without its numbers and names, for counting."""
    text = re.sub(r"[+-]?\d[\d.,e:+-]*", "N", text)
    for name in (*list_names("rail"), *list_names("wheel")):
        text = text.replace(name, "NAME")
    return re.split(r"[;(]", text)[0][:110].strip()


def _not_json(text: str) -> str:
    """Problem of a text that is not strict JSON; empty if there is no problem."""

    def refuse(constant: str) -> None:
        raise ValueError(f"{constant} in JSON")

    try:
        json.loads(text, parse_constant=refuse)
    except ValueError as error:
        return f"no JSON: {error}"
    return ""


def _lost(line: list[str], answer: Any) -> str:
    """Items that were asked for and are not in the answer."""
    options = {word.split("=")[0]: word.split("=", 1)[-1] for word in line}
    counts = {
        "geometry": ("positions", "--shifts", 1),
        "table": ("rows", "--shifts", 2),
        "curve": ("curves", "--radii", 1 + options.get("--theory", "").count(",")),
        "map": ("cells", "--shifts", 1 + options.get("--loads-kn", "").count(",")),
    }
    if line[0] == "run" and line[1].startswith("study"):
        loads = answer and {row["load_kN"] for row in answer}
        solved_count = sum(row.get("fe_p_max_MPa") is not None for row in answer)
        return (
            ""
            if len(answer) == 2 * len(loads) and solved_count in (0, len(loads))
            else f"{solved_count} of {len(answer)} cases"
        )
    if line[0] not in counts:
        return ""
    items, option, times = counts[line[0]]
    expected = times * len(options[option].split(","))
    # a table is a list
    count = len(answer if isinstance(answer, list) else answer[items])
    return "" if count == expected else f"{count} of {expected} {items}"


def _contradictions(record: dict[str, Any]) -> Iterator[str]:
    """Theories of a solved case with a verdict that contradicts their deviation, uncertainty and limit."""
    limits, verdict = record["verdict"]["limits"], record["verdict"]
    side = "hertz_gauge" if verdict["side"] == "gauge" else "hertz"
    # with a yield stress, the verdict is against bodies that yield
    hertz = record["plastic"]["hertz"] if record.get("plastic") else record["theories"][side]
    utilisation = max(abs(hertz["deviation"][measure]) / limit for measure, limit in limits.items())
    if not math.isclose(utilisation, verdict["limit_utilisation"], rel_tol=1e-9):
        yield f"{verdict['limit_utilisation']} of a limit against {utilisation} by its numbers"
    plastic = {} if record["plastic"] is None else {"plastic": record["plastic"]["hertz"]["verdict"]}
    against = {side: verdict, **plastic}
    for name, judgement in against.items():
        answers = set(judgement["each"].values())
        worst = next(answer for answer in ("FAILS", "UNRESOLVED", "HOLDS") if answer in answers)
        # numbers that must not be used leave it open, but for a failure that the half-space makes certain
        if judgement["answer"] != worst and record["status"] == "converged" and name != "plastic":
            yield f"{name} {judgement['answer']} where the worst measure {worst}"
    if record["plastic"] is not None:
        yield from _number_contradictions("plastic", record["plastic"]["hertz"], limits)
    yield from _number_contradictions("elements", record["elements"]["hertz"], limits)
    for name, theory in judged_theories(record).items():
        yield from _number_contradictions(name, theory, limits)


def _number_contradictions(name: str, theory: dict[str, Any], limits: dict[str, float]) -> Iterator[str]:
    """Sentences on measures with an answer that contradicts deviation, uncertainty and limit."""
    # measured profiles are judged on each of their lines; the library's are exact
    for measure, answer in theory.get("verdict", {}).get("each", {}).items():
        numbers = [theory[key].get(measure, math.nan) for key in ("deviation", "uncertainty")]
        if (
            compare_with_limit(*(math.nan if number is None else number for number in numbers), limits[measure])
            != answer
        ):
            yield f"{name} {answer} by {measure} against its numbers"


def broken_rules(line: list[str], ended: Ended) -> Iterator[str]:
    """Rules that the end of a command breaks."""
    if ended.raised:
        yield ended.raised
        return
    if ended.code not in (0, 2, 3):
        yield f"exit code {ended.code}"
    said = message(ended)
    if ended.code == 2 and not said:
        yield "refused without a reason"
    if said and ("\n" in said or len(said) > LONGEST_MESSAGE or no_numbers(said) or "Traceback" in ended.err):
        yield f"no clear sentence: {said!r}"
    if numbers := no_numbers(ended.out):
        yield f"prints {numbers[0]}"
    if "--json" in line and ended.out:
        if problem := _not_json(ended.out):
            yield problem
        elif lost := _lost(line, json.loads(ended.out)):
            yield f"lost: {lost}"
        elif line[0] == "solve":
            yield from _contradictions(json.loads(ended.out))
    if ended.code == 0 and not ended.out:
        yield "prints nothing"
    if ended.code == 3 and not (said or ended.out):
        yield "neither an answer nor a reason"


def try_lines(counts: Mapping[str, int], seed: int) -> dict[str, Tally]:
    """Run a number of lines of each command in an empty folder."""
    rng, tallies = random.Random(seed), {command: Tally() for command in counts}
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        if "fleet" in counts:
            ending(["fleet", "examples", "fleet", "--wheels=2", "--rails=2"])
        for command, tally in tallies.items():
            for _ in range(counts[command]):
                line = line_of(command, rng)
                ended = ending(line)
                tally.drawn += 1
                if ended.code == 0:
                    tally.answered += 1
                elif ended.code in (2, 3):
                    tally.refused[f"{ended.code}: {reason(message(ended)) or 'told in the answer'}"] += 1
                tally.bad += [f"{shlex.join(line)}: {rule}" for rule in broken_rules(line, ended)]
    return tallies


def main() -> int:
    """Draw command lines and print their tallies."""
    parser = argparse.ArgumentParser(description="Draw commands that compute over the library.")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--solve", action="store_true")
    options = parser.parse_args()
    os.environ.setdefault("COLUMNS", "200")
    counts = {command: options.rounds * count for command, count in (SOLVING if options.solve else FAST).items()}
    tallies = try_lines(counts, options.seed)
    print(f"{'command':16} {'drawn':>6} {'answered':>8} {'refused':>8} {'bad':>5}")
    for command, tally in tallies.items():
        row = (tally.drawn, tally.answered, sum(tally.refused.values()), len(tally.bad))
        print("{:16} {:6} {:8} {:8} {:5}".format(command, *row))
    for why, times in sum((tally.refused for tally in tallies.values()), Counter()).most_common():
        print(f"{times:6} {why}")
    for text in (text for tally in tallies.values() for text in tally.bad):
        print(f"BAD {text}")
    return int(any(tally.bad for tally in tallies.values()))


if __name__ == "__main__":
    sys.exit(main())
