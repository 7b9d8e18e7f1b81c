"""Damaged results and study files: each is read, or refused in a line; nothing else ever comes of it.

`python tests/fuzz_results.py FOLDER [--count N] [--seed S]` (part of `make fuzz`) changes one thing in copies of a
folder of results (a case, a study or a map), with checksums made to fit, and loads, judges and compares it.
"""

import argparse
import json
import random
import shutil
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import fecontact
from fecontact.criteria import Criteria
from fecontact.errors import FecontactError
from fecontact.files import SEAL_KEY, hash_file, read_json, write_json, write_sealed
from fecontact.jobs.store import MANIFEST
from fecontact.regression.tables import load_table
from fecontact.runs.toml_cases import read_toml_cases

SLOWEST_S, LONGEST_MESSAGE = 20.0, 1200
VALUES = (
    None, True, False, 0, -1, 1e308, -1e-308, 10**400, "", "x", "../../x", "/dev/zero", "\ud800", "nan", [], {}, [[]],
    {"a": 1}, "x" * 5000, [1, 2, 3],
)  # fmt: skip
INSERTED = (b"[[", b"1e999", b"nan", b"\xff\xfe", b"9" * 400, b'"""', b"= ", b"{")
STUDIES = (
    'rail = "60E1"\nwheel = "S1002"\nload_kN = [50, 100]\nlateral_shift_mm = "-4:4:2"\nresolution = "quick"\n'
    '[criteria]\np_max_percent = 5.0\njudged_by = "all"\n[track]\ngauge_mm = 1435.0\n[[case]]\nroll_mrad = 0.4\n'
)


def places(value: Any) -> list[tuple[Any, Any]]:
    """All containers of a document with their keys."""
    items = (
        list(value.items()) if isinstance(value, dict) else list(enumerate(value)) if isinstance(value, list) else []
    )
    return [(value, key) for key, _ in items] + [place for _, inner in items for place in places(inner)]


def mutate(document: Any, rng: random.Random) -> str:
    """Change or remove a value anywhere in a document."""
    container, key = rng.choice(places(document))
    before = repr(container[key])[:40]
    if rng.random() < 0.3:
        del container[key]
        return f"{key} ({before}) removed"
    container[key] = rng.choice(VALUES)
    return f"{key} ({before}) = {container[key]!r:.40}"


def damaged(folder: Path, rng: random.Random) -> str:
    """Change a JSON file of a folder of results and make all checksums fit."""
    files = [path for path in sorted(folder.rglob("*.json")) if path.name != MANIFEST or rng.random() < 0.2]
    path = rng.choice(files)
    document = read_json(path)
    seal = document.pop(SEAL_KEY, None)
    what = mutate(document, rng)
    if seal is None or "\\ud" in what:
        # half of a pair of surrogates, which is a text in JSON and in no file that is sealed
        path.write_text(json.dumps(document), "utf-8")
    else:
        write_sealed(path, document, [path.with_suffix(".csv")])
    manifest = path.parent / MANIFEST
    if path != manifest and manifest.is_file():
        sealed = read_json(manifest)
        write_json(manifest, {**sealed, "files": {name: hash_file(path.parent / name) for name in sealed["files"]}})
    return f"{path.name}: {what}"


def read_all(folder: Path, out: Path) -> dict[str, Callable[[], object]]:
    """Everything that reads a folder of results."""
    criteria = Criteria(p_max=0.03)
    return {
        "load": lambda: fecontact.rows(fecontact.load(folder)),
        "judge": lambda: fecontact.judge(folder, criteria),
        "compare": lambda: load_table(folder),
    }


def tried(call: Callable[[], object]) -> tuple[str, str]:
    """Outcome of a call: read, refused, or a failure with its words."""
    start = time.process_time()
    try:
        call()
        ending, said = "read", ""
    except FecontactError as error:
        ending, said = "refused", str(error)
    except Exception as error:
        return "failure", f"{type(error).__name__}: {str(error)[:150]}"
    if len(said) > LONGEST_MESSAGE:
        return "failure", f"a message of {len(said)} characters"
    seconds = time.process_time() - start
    return ("failure", f"took {seconds:.0f} CPU s") if seconds > SLOWEST_S else (ending, said)


def fuzz_results(original: Path, count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Damage a folder a number of times; returns the endings and the failures."""
    rng, endings, failures = random.Random(seed), Counter[str](), []
    for _ in range(count):
        with TemporaryDirectory() as temporary:
            folder = shutil.copytree(original, Path(temporary) / "results")
            what = damaged(folder, rng)
            for name, call in read_all(folder, Path(temporary) / "out").items():
                result, said = tried(call)
                endings[result] += 1
                if result == "failure":
                    failures.append(f"{name}, {what}: {said}")
    return endings, failures


def fuzz_studies(count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Damage study files in TOML, also with bytes that are not UTF-8."""
    rng, endings, failures = random.Random(seed), Counter[str](), []
    with TemporaryDirectory() as temporary:
        path = Path(temporary) / "study.toml"
        for _ in range(count):
            data = bytearray(STUDIES.encode())
            for _ in range(rng.choice((1, 1, 2, 5))):
                at = rng.randrange(len(data))
                match rng.randrange(4):
                    case 0:
                        data[at] = rng.randrange(256)
                    case 1:
                        del data[at : at + rng.choice((1, 1, 10, 80))]
                    case 2:
                        data[at:at] = data[at : at + rng.choice((1, 10, 80))]
                    case _:
                        data[at:at] = rng.choice(
                            (b"[[", b"1e999", b"nan", b"\xff\xfe", b"9" * 400, b'"""', b"= ", b"{")
                        )
            path.write_bytes(data)
            result, said = tried(lambda: read_toml_cases(path))
            endings[result] += 1
            if result == "failure":
                failures.append(f"{bytes(data)[:300]!r}: {said}")
    return endings, failures


def main() -> int:
    """Fuzz results and study files and print the endings."""
    parser = argparse.ArgumentParser(description="Damage results and study files.")
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    results = {"study files": fuzz_studies(options.count, options.seed)}
    if options.folder is not None:
        results[str(options.folder)] = fuzz_results(options.folder, options.count, options.seed)
    for name, (endings, failures) in results.items():
        print(f"{name}: {dict(endings)}", flush=True)
        for text in failures[:30]:
            print(f"      {text}")
    return int(any(failures for _, failures in results.values()))


if __name__ == "__main__":
    sys.exit(main())
