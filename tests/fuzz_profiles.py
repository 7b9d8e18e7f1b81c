"""Mutated profile files: each must end in a clear refusal, or in a line with notes on its repairs.

`python tests/fuzz_profiles.py [--count N] [--seed S]` (`make fuzz`) mutates N files of each format and ends with exit
code 1 if one of them raises anything but a refusal, takes more than two seconds, gets a message that nobody reads, or
is taken in silence for a line on which Hertz is more than 20 % off. Such a file is kept in the folder `fuzz_failures`.
"""

import argparse
import math
import random
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from points import simpack

from fecontact.case import Case
from fecontact.errors import FecontactError
from fecontact.profiles.curve import Profile
from fecontact.profiles.library import load_library_profile, toml_text
from fecontact.profiles.reading import DEFAULT_READING, Reading
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.profiles.writers import csv_text, sample_points
from fecontact.solving.hertz import compute_hertz
from fecontact.solving.placing import place_case
from fecontact.solving.profile_variants import estimate_hertz_uncertainty

FORMATS = (".csv", ".txt", ".prr", ".prw", ".ban", ".whl", ".toml")
SLOWEST_S = 2.0
LONGEST_MESSAGE = 1200
MOST_OFF = 0.2
# Positions at which a changed line shows: tread, and the gauge side of the crown.
SHIFTS_MM = (-4.0, 4.0)
HOSTILE = (
    "[" * 3000, "0x" + "f" * 6000, "9" * 5000, "1e400", "-1e400", "nan", "inf", "\x00", "\u0665", "1_0", "''' '", "{}",
    "=" * 50, "\ufeff", "-", "1e-400", "[[surface]]", "point.end", "point.begin", "!", "1,5;2,5", "\r", "\t\t",
)  # fmt: skip


def originals() -> dict[str, str]:
    """A good file per format: heads and treads with points 0.5 mm apart."""
    rail, wheel = load_library_profile("54E1"), load_library_profile("S1002")
    # the instrument's own axes: into the depth of the body, and from the back of the flange
    ban, whl = sample_points(rail, 0.5) * (1.0, -1.0), sample_points(wheel, 0.5) * (1.0, -1.0) + (70.0, 0.0)
    return {
        ".csv": csv_text(rail, step_mm=0.5),
        ".txt": csv_text(wheel, step_mm=0.5).replace(",", " "),
        ".prr": simpack(*sample_points(rail, 0.5).T),
        ".prw": simpack(*sample_points(wheel, 0.5).T, "wheel"),
        ".ban": "Filename=a.ban\nXoffset=0.0000\nYoffset=0.0000\nColumnDef=X,Y\n\n" + _rows(ban),
        ".whl": "Filename=a.whl\nXoffset=0.0000\nColumnDef=X,Y\nWheelDiameterTaperline=70.0000\n\n" + _rows(whl),
        ".toml": toml_text("S1002"),
    }


def _rows(points: np.ndarray) -> str:
    return "".join(f"{x:.12f} {y:.12f}\n" for x, y in points)


def kind_of(ending: str) -> str:
    """Which body the original file of an ending is."""
    return "wheel" if ending in (".txt", ".prw", ".whl", ".toml") else "rail"


def mutated(text: str, rng: random.Random) -> str:
    """Apply one to four mutations to a text."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        text = rng.choice(MUTATIONS)(text, rng)
    return text


def _character(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    return text[:at] + chr(rng.choice((rng.randrange(32, 127), rng.randrange(1, 300)))) + text[at + rng.randrange(2) :]


def _cut(text: str, rng: random.Random) -> str:
    return text[: rng.randrange(len(text) + 1)]


def _lines(change: Callable[[list[str], random.Random], None]) -> Callable[[str, random.Random], str]:
    def mutate(text: str, rng: random.Random) -> str:
        lines = text.split("\n")
        change(lines, rng)
        return "\n".join(lines)

    return mutate


def _drop(lines: list[str], rng: random.Random) -> None:
    at = rng.randrange(len(lines))
    del lines[at : at + rng.choice((1, 1, 3, 20))]


def _double(lines: list[str], rng: random.Random) -> None:
    at = rng.randrange(len(lines))
    lines.insert(at, lines[at])


def _swap(lines: list[str], rng: random.Random) -> None:
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]


def _number(lines: list[str], rng: random.Random) -> None:
    """Change a digit, sign, point or power of ten in a line."""
    at = rng.randrange(len(lines))
    line = lines[at]
    digits = [i for i, c in enumerate(line) if c.isdigit()]
    if not digits:
        return
    i = rng.choice(digits)
    new = rng.choice((str(rng.randrange(10)), "", "-", ".", "e2", "e-3", f"{line[i]}{line[i]}", ","))
    lines[at] = line[:i] + new + line[i + 1 :]


def _hostile(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    return text[:at] + rng.choice(HOSTILE) + text[at:]


def _scaled(text: str, rng: random.Random) -> str:
    """Another decimal sign or separator everywhere."""
    return text.replace(*rng.choice(((".", ","), (",", ";"), (" ", "\t"), ("-", ""), ("\n", "\r\n"), (" ", " ; "))))


MUTATIONS = (
    _character, _cut, _hostile, _scaled, _lines(_drop), _lines(_double), _lines(_swap), _lines(_number),
    _lines(_number), _lines(_number),
)  # fmt: skip


@dataclass
class Count:
    """Counts of refused, accepted and failed files of a format."""

    refused: int = 0
    taken: int = 0
    same: int = 0
    failures: list[str] = field(default_factory=list)


def _hertz(case: Case) -> tuple[float, float, bool]:
    """Peak pressure, its uncertainty from the profiles, and whether there is an ellipse."""
    try:
        placement = place_case(case)
        uncertainty = estimate_hertz_uncertainty(case, placement) or {"p_max_MPa": 0.0}
        return compute_hertz(case, placement).p0_MPa, uncertainty["p_max_MPa"], True
    except FecontactError:
        return 0.0, 0.0, False


def _case(path: Path, shift: float) -> Case:
    body = {kind_of(path.suffix): str(path)}
    return Case(lateral_shift_mm=shift, wheel_file=Reading(), rail_file=Reading(), **body)


def _read(path: Path, reading: Reading, count: Count) -> Profile | None:
    """The line of a file, None where it is refused; whatever else happens is a failure."""
    try:
        if kind_of(path.suffix) == "rail":
            return resolve_rail(str(path), reading)
        return resolve_wheel(str(path), reading).profile
    except FecontactError as error:
        if len(str(error)) > LONGEST_MESSAGE or "\n" in str(error):
            count.failures.append(f"a message of {len(str(error))} characters")
    except Exception as error:
        count.failures.append(f"{type(error).__name__}: {str(error)[:200]}")
    return None


def check(path: Path, expected: dict[float, float], notes: set[str], count: Count, *, hertz: bool) -> None:
    """Read a mutated file and count its outcome."""
    _check_other_readings(path, count, smoothed=hertz)
    # of this process: on a busy machine the clock on the wall tells nothing
    start = time.process_time()
    profile = _read(path, DEFAULT_READING, count)
    if profile is None:
        count.refused += 1
        # what is left out of a file must not make another one that no line goes through
        _read(path, Reading(repair=True), count)
    else:
        count.taken += 1
        silent = {note for note in profile.notes if "with a noise of about" not in note} <= notes
        if hertz and silent:
            try:
                for shift, p0 in expected.items():
                    peak_MPa, open_part, is_placed = _hertz(_case(path, shift))
                    off = abs(peak_MPa - p0)
                    # what is stated is a part of what was found
                    if is_placed and not (math.isnan(open_part) or off <= max(MOST_OFF * p0, open_part * peak_MPa)):
                        said = f"Hertz is {100 * off / p0:.0f} % off at {shift:g} mm, and nothing is said"
                        count.failures.append(said)
            except Exception as error:
                count.failures.append(f"{type(error).__name__} in the placement: {str(error)[:200]}")
    if time.process_time() - start > SLOWEST_S * (4.0 if hertz else 1.0):
        count.failures.append(f"took {time.process_time() - start:.1f} CPU s")


def _check_other_readings(path: Path, count: Count, *, smoothed: bool) -> None:
    """Read a file with its faults left out, and now and then smoothed.

    Each reading takes half a second.
    """
    for reading in (Reading(repair=True), *([Reading(filter_mm=20.0, repair=True)] if smoothed else [])):
        try:
            resolve_rail(str(path), reading) if kind_of(path.suffix) == "rail" else resolve_wheel(str(path), reading)
        except FecontactError:
            continue
        except Exception as error:
            way = "smoothed" if reading.filter_mm else "repaired"
            count.failures.append(f"{way}: {type(error).__name__}: {str(error)[:200]}")


def fuzz(ending: str, count: int, seed: int, keep: Path | None = None, *, hertz_every: int = 20) -> Count:
    """Mutate the file of a format a number of times.

    Hertz is computed for every `hertz_every`-th accepted file.
    """
    rng, made = random.Random(f"{seed}{ending}"), Count()
    text = originals()[ending]
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"mutated{ending}"
        path.write_text(text, "utf-8")
        expected = {shift: _hertz(_case(path, shift))[0] for shift in SHIFTS_MM}
        profile = resolve_rail(str(path)) if kind_of(ending) == "rail" else resolve_wheel(str(path)).profile
        notes = {note for note in profile.notes if "with a noise of about" not in note}
        for number in range(count):
            changed = mutated(text, rng)
            if changed == text:
                made.same += 1
                continue
            content = changed.encode("utf-8", "surrogatepass")
            if number % 10 == 0:
                # a byte that is no UTF-8
                at = rng.randrange(len(content) + 1)
                content = content[:at] + bytes([rng.randrange(128, 256)]) + content[at:]
            path.write_bytes(content)
            before = len(made.failures)
            check(path, expected, notes, made, hertz=number % hertz_every == 0)
            if len(made.failures) > before and keep is not None:
                keep.mkdir(parents=True, exist_ok=True)
                (keep / f"{ending[1:]}_{seed}_{number}{ending}").write_bytes(content)
    return made


def main() -> int:
    """Fuzz all formats and print the counts."""
    parser = argparse.ArgumentParser(description="Mutate profile files of every format.")
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--hertz-every", type=int, default=20, help="of how many files one is also smoothed and placed")
    parser.add_argument("--format", choices=FORMATS, action="append")
    options = parser.parse_args()
    failed = 0
    for ending in options.format or FORMATS:
        start = time.perf_counter()
        count = fuzz(ending, options.count, options.seed, Path("fuzz_failures"), hertz_every=options.hertz_every)
        failed += len(count.failures)
        print(
            f"{ending:5} {options.count} files: {count.refused} refused, {count.taken} taken, {len(count.failures)}"
            f" failures, {time.perf_counter() - start:.0f} s",
            flush=True,
        )
        for text in count.failures[:10]:
            print(f"      {text}")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
