"""Cases at the ends of the declared ranges of their inputs, solved with coarse meshes.

`python tests/fuzz_extremes.py [--count N] [--seed S] [--command solve|hertz|place]` prints how the cases ended, and
ends with exit code 1 if a case ended in a traceback, a message that is no sentence, a number that is none, or not at
all. Each case changes a few inputs of a usual position; `tests/command_matrix.py` draws usual values of all inputs.
"""

import argparse
import contextlib
import math
import os
import random
import resource
import shlex
import sys
from collections import Counter
from tempfile import TemporaryDirectory

from command_matrix import broken_rules, ending, maybe, message, reason
from fuzz_commands import MOST_BYTES, options

from fecontact.case import INPUTS
from fecontact.inputs.kinds import Number
from fecontact.inputs.slots import InputPlace

PAIRS = (
    ("60E1", "S1002", "1:40"),
    ("60E2", "S1002", "1:20"),
    ("54E1", "S1002", "1:40"),
    ("circle:300", "cylinder:460", "none"),
    ("circle:80", "cylinder:1000", "none"),
    ("arcs:300/80@2.5", "S1002", "1:40"),
)
# sizes of elements in mm: the patch of 100 kN has semi-axes of about 5 mm
RESOLUTIONS = ("quick", "1.6,1.3", "3,3", "0.5,5", "8,0.8", "40,40")
# beyond them lie 1e-30 and 1e20, which are allowed for every positive quantity
_FAR = (1e-30, 1e-12, 1e-6, 1e-3, 0.1, 10.0, 1e3, 1e6, 1e12, 1e20)
_GROUPS = ("position", "load", "wheelset", "standing", "material", "yield", "mesh", "verdict", "creep", "pair")


def ends(number: Number) -> list[float]:
    """Values at the ends of the allowed range and of the usual range."""
    usual = [bound for bound in number.usual if math.isfinite(bound)]
    if not math.isfinite(number.high):
        # a factor of the usual values as well, because most of the whole range is refused
        return [*_FAR, *usual, *(factor * bound for bound in usual for factor in (0.1, 0.5, 2.0, 10.0))]
    span = number.high - number.low
    inner = [number.low + span * fraction for fraction in (1e-9, 1e-6, 1e-3, 0.999, 1.0 - 1e-6)]
    middle = [0.0] if number.low < 0.0 < number.high else []
    return [*([number.low, number.high] if number.inclusive else []), *inner, *middle, *usual]


NUMBERS = [
    place
    for place in INPUTS
    if isinstance(place.input, Number) and (place.input.group or place.group) in _GROUPS and not place.option
]


def option(place: InputPlace, rng: random.Random) -> str:
    """Option of a number with a value at an end of its range."""
    number = place.input
    assert isinstance(number, Number)
    return f"{rng.choice([*place.names, *place.common_names])}={number.shown(rng.choice(ends(number)))}"


def numbers_of(command: str) -> list[InputPlace]:
    """Numbers that a command takes.

    Numbers of the criteria are drawn less often, because they do not change the solution.
    """
    names = {name for name, _ in options(command)}
    offered = [place for place in NUMBERS if {*place.names} <= names]
    criteria = [place for place in offered if (place.input.group or place.group) in ("verdict", "creep")]
    return [*criteria, *(4 * [place for place in offered if place not in criteria])]


def extreme_case(rng: random.Random, command: str) -> list[str]:
    """A command line with up to three inputs at the ends of ranges."""
    rail, wheel, inclination = rng.choice(PAIRS)
    places = rng.sample(numbers_of(command), rng.choice((1, 1, 2, 3)))
    extremes = dict(option(place, rng).split("=") for place in places)
    chosen = {"--rail": rail, "--wheel": wheel, "--inclination": inclination, **extremes}
    if rng.random() < 0.3:
        chosen["--roll"] = rng.choice(("given", "touching", "loaded"))
    if rng.random() < 0.2:
        chosen["--load-kind"] = "normal"
    if command == "solve":
        chosen |= {"--resolution": rng.choice(RESOLUTIONS), "--refine": "never"}
    return [command, *(f"{name}={value}" for name, value in chosen.items()), *maybe(rng, 0.2, "--flange-climb")]


def fuzz_extremes(count: int, seed: int, command: str = "solve") -> tuple[Counter[str], list[str]]:
    """Run cases; returns how they ended and the failures."""
    endings, failures = Counter[str](), []
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, hard))
        try:
            for number in range(seed, seed + count):
                line = extreme_case(random.Random(number), command)
                ended = ending(line, slowest_s=120.0)
                broken = list(broken_rules(line, ended))
                failures += [f"seed {number}: {shlex.join(line)}: {rule}" for rule in broken]
                said = f": {reason(message(ended))}" if ended.code else ""
                endings["failure" if broken else f"exit code {ended.code}{said}"] += 1
        finally:
            resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
    return endings, failures


def main() -> int:
    """Draw cases and print their endings."""
    parser = argparse.ArgumentParser(description="Solve cases at the ends of the ranges of their inputs.")
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--command", choices=("solve", "hertz", "place"), default="solve")
    arguments = parser.parse_args()
    os.environ.setdefault("COLUMNS", "200")
    endings, failures = fuzz_extremes(arguments.count, arguments.seed, arguments.command)
    for text, times in endings.most_common():
        print(f"{times:6} {text}")
    for text in failures:
        print(f"BAD {text}")
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
