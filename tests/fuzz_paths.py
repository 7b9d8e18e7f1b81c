"""Hostile names, links, pipes, folders and devices at the paths of commands.

`python tests/fuzz_paths.py [--seed S] [--solve]` (part of `make fuzz`) gives each command files and folders with
hostile names. Then it puts a link, a pipe, a folder, a device or an unreadable file at each path that the command wrote
in a first run, and at each of its inputs. Each ends with a result or a refusal in one line, within 60 s, and files of
others keep their bytes. It prints how many were tried, used, refused and bad.
"""

import argparse
import contextlib
import os
import random
import shutil
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files as files_of
from pathlib import Path
from tempfile import TemporaryDirectory

from fuzz_commands import files
from fuzz_fleets import Tally, find_problem, keep_in, run_timed, write_fleet

POSITION = ("--rail=60E1", "--wheel=S1002", "--shift=3")
QUICK = ("--rail=circle:300", "--wheel=cylinder:460", "--inclination=none", "--resolution=quick", "--refine=never")
# {out} is the output, {in} an input file
COMMANDS: Mapping[str, tuple[str, ...]] = {
    "place": ("place", *POSITION, "--out={out}.png"),
    "profiles": ("profiles", "{good.csv}", "--out={out}.png"),
    "geometry": ("geometry", "--rail=60E1", "--wheel=S1002", "--shifts=0,2", "--out={out}.png"),
    "table": ("table", "--rail=60E1", "--wheel=S1002", "--shifts=0,2", "--loads-kn=50", "--out={out}.csv"),
    "hertz": ("hertz", "--rail={good.csv}", "--shift=3", "--load-kn=80"),
    "curve": ("curve", "--radii=1000", "--vehicle={vehicle.toml}", "--out={out}"),
    "irregular": ("irregular", *POSITION, "--irregularity=chord:length_mm=40", "--workers=1", "--out={out}"),
    "init": ("init", "{out}"),
    "check": ("check", "{good.toml}"),
    "compare": ("compare", "{table.csv}", "{table.csv}", "--tolerance={tolerance.toml}", "--out={out}"),
    "fleet examples": ("fleet", "examples", "{out}", "--wheels=1", "--rails=1"),
    "fleet check": ("fleet", "check", "{trial/fleet.toml}"),
    "fleet run": ("fleet", "run", "{trial/fleet.toml}", "--workers=1", "--out={out}"),
    "fleet report": ("fleet", "report", "{out}"),
}
SOLVING: Mapping[str, tuple[str, ...]] = {
    "solve": ("solve", *QUICK, "--out={out}"),
    "run": ("run", "{study.toml}", "--workers=1", "--out={out}"),
    "map": ("map", *QUICK, "--shifts=0", "--loads-kn=60", "--workers=1", "--out={out}"),
    "judge": ("judge", "{out}"),
    "view": ("view", "{out}"),
    "baseline": ("baseline", "update", "{out}", "--baselines=base", "--reason=x"),
    "mesh": ("mesh", "rail", *QUICK, "--out={out}.msh"),
}
# commands on what another command wrote
AFTER: Mapping[str, str] = {"fleet report": "fleet run", "judge": "run", "view": "run", "baseline": "run"}
INPUTS = ("good.csv", "good.toml", "table.csv", "vehicle.toml", "tolerance.toml", "study.toml", "trial/fleet.toml")
NAMES = (
    "$\\frac{$x", "a*b", "fr[1]", "run [2024]", "**", "~", "~root", "-x", "--out", "a b", "ü", "\udcff", "x" * 255,
    "x" * 240, "<script>alert(1)</script>", "'; DROP TABLE screen;--", 'a"b', "a\nb", "\x1b[2J", "\u202eabc", "%s%n",
    "{x}", "=1+1", "CON", "a.tar.gz", ".hidden", "...", "#x", "a\\b", "a|b", "$HOME", "`id`", "\u0301", "x:y",
)  # fmt: skip
VEHICLE = files_of("fecontact.features.curves") / "data" / "wheelset.toml"


def plant_link_to_file(path: Path, neighbour: Path) -> None:
    path.symlink_to(neighbour / "notes.txt")


def plant_link_to_folder(path: Path, neighbour: Path) -> None:
    path.symlink_to(neighbour)


def plant_dangling_link(path: Path, neighbour: Path) -> None:
    path.symlink_to(neighbour / "missing")


def plant_loop(path: Path, neighbour: Path) -> None:
    path.symlink_to(path.name)


def plant_pipe(path: Path, neighbour: Path) -> None:
    os.mkfifo(path)


def plant_folder(path: Path, neighbour: Path) -> None:
    path.mkdir()
    (path / "notes.txt").write_text("a note of somebody else", "utf-8")


def plant_device(path: Path, neighbour: Path) -> None:
    path.symlink_to("/dev/zero")


def plant_unreadable(path: Path, neighbour: Path) -> None:
    path.write_text("a file of somebody else", "utf-8")
    path.chmod(0o000)


def plant_unwritable_folder(path: Path, neighbour: Path) -> None:
    plant_folder(path, neighbour)
    path.chmod(0o500)


PLANTS: tuple[Callable[[Path, Path], None], ...] = (
    plant_link_to_file, plant_link_to_folder, plant_dangling_link, plant_loop, plant_pipe, plant_folder, plant_device,
    plant_unreadable, plant_unwritable_folder,
)  # fmt: skip


def content(folder: Path) -> dict[str, bytes]:
    """Bytes of all regular files below a folder."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def write_inputs(folder: Path) -> None:
    """Write the inputs of all commands, and a folder of somebody else."""
    folder.mkdir()
    files(folder)
    (folder / "tolerance.toml").write_text("[columns.p_max_fe_MPa]\nrelative = 0.01\n", "utf-8")
    (folder / "vehicle.toml").write_text(VEHICLE.read_text("utf-8"), "utf-8")
    (folder / "study.toml").write_text(
        'rail = "circle:300"\nwheel = "cylinder:460"\ninclination = "none"\nresolution = "quick"\nrefine = "never"\n',
        "utf-8",
    )
    write_fleet(folder / "trial")
    (folder / "others").mkdir()
    (folder / "others" / "notes.txt").write_text("notes of somebody else", "utf-8")


@dataclass(frozen=True, kw_only=True)
class Prepared:
    """Folder with the inputs of a command and the outputs of a first run."""

    folder: Path
    command: str
    written: tuple[str, ...]


def words_of(command: str, out: str, renamed: Mapping[str, str] | None = None) -> list[str]:
    """Words of a command with the name of its output, and other names of inputs."""
    line = list({**COMMANDS, **SOLVING}[command])
    for name in INPUTS:
        new = (renamed or {}).get(name, name)
        line = [word.replace("{" + name + "}", new) for word in line]
    return [word.replace("{out}", out) for word in line]


def prepare(command: str, folder: Path) -> Prepared:
    """Run a command once, and list the files and folders that it wrote and read."""
    write_inputs(folder)
    with contextlib.chdir(folder):
        for name in (*([AFTER[command]] if command in AFTER else []), command):
            before = {path.as_posix() for path in Path().rglob("*")}
            ended = run_timed(words_of(name, "out"))
            assert ended.code == 0, (name, ended)
        after = {path.as_posix() for path in Path().rglob("*")}
    words = {**COMMANDS, **SOLVING}[command]
    inputs = [name for name in INPUTS if any("{" + name + "}" in word for word in words)]
    if command.startswith("fleet") and "trial/fleet.toml" in inputs:
        inputs += [f"trial/{name}.csv" for name in ("wheels", "rails", "pairs", "positions", "wheel")]
    read_again = [path for path in before if path.startswith("out")] if command in AFTER else []
    written = sorted(
        {*(after - before), *inputs, *read_again, *(["out"] if any(word.endswith("{out}") for word in words) else [])}
    )
    return Prepared(folder=folder, command=command, written=tuple(written))


def try_plant(prepared: Prepared, place: str, plant: Callable, fresh: bool, tally: Tally, keep: Path | None) -> None:
    """Put something at a path, run the command, and check the files of others."""
    with TemporaryDirectory() as temporary:
        folder = shutil.copytree(prepared.folder, Path(temporary) / "work", symlinks=True)
        path = folder / place
        if fresh and place.startswith("out") and prepared.command not in AFTER:
            for written in folder.glob("out*"):
                shutil.rmtree(written) if written.is_dir() else written.unlink()
            path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        path.unlink(missing_ok=True)
        plant(path, folder / "others")
        neighbour_bytes = content(folder / "others")
        what = f"{plant.__name__} at {place}{', fresh' * fresh}"
        keep_copy = keep_in(keep, folder, f"paths_{prepared.command}_{plant.__name__}_{place}".replace("/", "_")[:150])
        line = words_of(prepared.command, "out")
        with contextlib.chdir(folder):
            count = len(tally.bad)
            tally.add(line, what, keep_copy)
        now = content(folder / "others")
        # a folder that the user names as the output may get new files
        is_named = path == folder / "out"
        lost = [name for name in neighbour_bytes if now.get(name) != neighbour_bytes[name]]
        lost += [name for name in now if name not in neighbour_bytes and not is_named]
        if plant in (plant_folder, plant_unwritable_folder) and not _has_notes(path):
            lost.append(f"{place}/notes.txt")
        if lost and len(tally.bad) == count:
            tally.bad.append(f"{what}; {' '.join(line)[:120]}: {', '.join(lost[:3])} of somebody else changed")
        for root in folder.rglob("*"):
            if root.is_dir() and not root.is_symlink():
                root.chmod(0o700)


def _has_notes(path: Path) -> bool:
    try:
        return (path / "notes.txt").read_text("utf-8") == "a note of somebody else"
    except OSError:
        return False


def fuzz_paths(
    commands: Mapping[str, object], seed: int, keep: Path | None = None, *, draw_limit: int = 10**9
) -> dict[str, Tally]:
    """Put hostile things at the paths of each command; at most a number of draws for each command."""
    rng, tallies = random.Random(seed), {}
    for command in commands:
        tally = tallies[command] = Tally()
        with TemporaryDirectory() as temporary:
            prepared = prepare(command, Path(temporary) / "work")
            draws = [(place, plant, fresh) for place in prepared.written for plant in PLANTS for fresh in (True, False)]
            for draw in rng.sample(draws, min(draw_limit, len(draws))):
                try_plant(prepared, *draw, tally, keep)
    return tallies


def fuzz_names(
    commands: Mapping[str, object], seed: int, keep: Path | None = None, *, draw_limit: int = 10**9
) -> dict[str, Tally]:
    """Give each command hostile names of its output and of its inputs."""
    rng, tallies = random.Random(seed), {}
    for command, words in commands.items():
        tally = tallies[command] = Tally()
        assert isinstance(words, tuple)
        inputs = [name for name in INPUTS if any("{" + name + "}" in word for word in words)]
        draws = [(name, place) for name in NAMES for place in ("out", *inputs)]
        for name, place in rng.sample(draws, min(draw_limit, len(draws))):
            with TemporaryDirectory() as temporary:
                folder = Path(temporary) / "work"
                write_inputs(folder)
                neighbour_bytes = content(folder / "others")
                with contextlib.chdir(folder):
                    out, renamed = (name, {}) if place == "out" else ("out", {})
                    if place != "out":
                        path = Path(place)
                        renamed[place] = str(path.with_name(name + path.suffix))
                        with contextlib.suppress(OSError):
                            path.rename(renamed[place])
                    if command in AFTER and find_problem(run_timed(words_of(AFTER[command], out, renamed))):
                        continue
                    tally.add(
                        words_of(command, out, renamed), f"{place} named {name!r:.40}", keep_in(keep, folder, "names")
                    )
                if content(folder / "others") != neighbour_bytes:
                    tally.bad.append(f"{command}: {place} named {name!r:.40}: a file of somebody else changed")
    return tallies


def main() -> int:
    """Fuzz paths and names and print the counts."""
    parser = argparse.ArgumentParser(description="Hostile names, links, pipes and folders at the paths of commands.")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most", type=int, default=60, help="draws for each command")
    parser.add_argument("--command", action="append", choices=(*COMMANDS, *SOLVING))
    parser.add_argument("--solve", action="store_true", help="also the commands with finite elements")
    options = parser.parse_args()
    os.environ.setdefault("COLUMNS", "200")
    keep = Path("fuzz_failures").absolute()
    available = {**COMMANDS, **SOLVING}
    names = options.command or [*COMMANDS, *(SOLVING if options.solve else ())]
    commands = {name: available[name] for name in names}
    bad = 0
    for kind, fuzz in (("paths", fuzz_paths), ("names", fuzz_names)):
        for command in commands:
            for tally in fuzz({command: commands[command]}, options.seed, keep, draw_limit=options.most).values():
                print(f"{kind} of {command}: {tally}", flush=True)
                for text in tally.bad:
                    print(f"      {text}")
                bad += len(tally.bad)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
