"""A small part of `make fuzz`: mutated files and command lines end in a refusal or in a line, and in nothing else."""

import random

import pytest
from fuzz_commands import fuzz_commands
from fuzz_extremes import fuzz_extremes
from fuzz_fleets import fuzz_inputs
from fuzz_inputs import KINDS, fuzz_input
from fuzz_paths import COMMANDS, fuzz_names, fuzz_paths
from fuzz_profiles import FORMATS, HOSTILE, fuzz, kind_of, mutated, originals

from fecontact.errors import InputError
from fecontact.profiles.readers.formats import parse_toml
from fecontact.profiles.resolve import resolve_rail, resolve_wheel


@pytest.mark.parametrize("ending", FORMATS)
def test_mutated_files_are_refused_or_read(ending):
    count = fuzz(ending, 20, seed=3, hertz_every=15)
    assert count.failures == []
    # both happen, so that the test sees both
    assert count.refused > 4
    assert count.taken > 0


def test_command_lines_at_random_end_with_an_exit_code():
    endings, failures = fuzz_commands(60, seed=7)
    assert failures == []
    # both happen, so that the test sees both
    assert endings["exit code 2"] > 10
    assert endings["exit code 0"] > 3


def test_damaged_fleets_are_refused_or_used():
    tally = fuzz_inputs(12, seed=2, screen_every=6)
    assert tally.bad == []
    # both happen, so that the test sees both
    assert tally.endings["refused"] > 2
    assert tally.endings["used"] > 2


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_inputs_are_refused_or_used(kind):
    tally = fuzz_input(KINDS[kind], 10, seed=1)
    assert tally.bad == []
    assert tally.endings["refused"] > 2


@pytest.mark.parametrize("command", ["hertz", "place"])
def test_inputs_at_the_ends_of_their_ranges_are_refused_or_used(command):
    endings, failures = fuzz_extremes(8, seed=1, command=command)
    assert failures == []
    assert endings["exit code 0"] > 0


@pytest.mark.parametrize("command", ["place", "init", "check", "compare"])
def test_hostile_things_at_the_paths_of_a_command_are_refused_or_stay(command):
    commands = {command: COMMANDS[command]}
    for fuzz_command, draws in ((fuzz_paths, 6), (fuzz_names, 4)):
        tally = fuzz_command(commands, 3, draw_limit=draws)[command]
        assert tally.bad == []
        assert tally.tried == draws


@pytest.mark.parametrize("ending", FORMATS)
def test_the_originals_are_read(tmp_path, ending):
    path = tmp_path / f"good{ending}"
    path.write_text(originals()[ending], "utf-8")
    profile = resolve_rail(str(path)) if kind_of(ending) == "rail" else resolve_wheel(str(path)).profile
    assert profile.kind == kind_of(ending)


def test_mutations_come_again_from_their_seed():
    text = originals()[".csv"]
    first, again = ([mutated(text, random.Random(5)) for _ in range(3)] for _ in range(2))
    assert first == again
    assert first[0] != text


@pytest.mark.parametrize(
    "value",
    [
        "[" * 900 + "]" * 900,
        "[" * 90_000,
        "9" * 5000,
        "0x" + "f" * 5000,
        "1e999",
        "-" + "9" * 400,
        '"' + "x" * 9000 + '"',
        "{" + "a.b.c = 1, " * 300 + "}",
    ],
)
@pytest.mark.parametrize("key", ["units", "radii", "kind", "unknown"])
def test_hostile_values_in_toml_are_refused_in_a_line(key, value):
    text = f"[head]\n{key} = {value}\n" if key == "radii" else f"{key} = {value}\n"
    with pytest.raises(InputError) as refused:
        parse_toml(text, name="hostile")
    assert len(str(refused.value)) < 1200


@pytest.mark.parametrize("text", HOSTILE)
@pytest.mark.parametrize("ending", FORMATS)
def test_hostile_text_alone_is_refused(tmp_path, ending, text):
    path = tmp_path / f"hostile{ending}"
    path.write_text(text, "utf-8")
    with pytest.raises(InputError) as refused:
        resolve_rail(str(path))
    assert len(str(refused.value)) < 1200
