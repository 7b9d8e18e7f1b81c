"""Identity of a profile in results.

A file is identified by its name and its content, independent of its folder. All other texts stay as written.
"""

import hashlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.files import hash_file
from fecontact.profiles.library import list_names, load_library_profile, profile_file, profile_identity, toml_text
from fecontact.profiles.resolve import resolve_rail, resolve_wheel

NO_FILES = [*list_names(), "60e1", "s1002", "circle:300", "CIRCLE:300", "arcs:300/80@2.5", "cylinder:460", "circle:abc"]
ODD = ["", ".", "..", "/", "~", "nul\0.toml", "x" * 5000, "\ud800.txt", "con", "C:", "a\nb", "/etc/passwd/x.txt"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(path, content="1 2\n"):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content, "utf-8")
    return path


@pytest.mark.parametrize("spec", NO_FILES)
def test_names_and_short_forms_stand_for_themselves(folder, spec):
    assert profile_file(spec) is None
    assert profile_identity(spec) == spec


@pytest.mark.parametrize("spec", ["60E1", "60e1", "circle:300", "Cylinder:460"])
def test_a_file_of_the_same_name_does_not_hide_what_the_text_means(folder, spec):
    write(folder / spec)
    assert profile_file(spec) is None
    assert profile_identity(spec) == spec
    # with its folder, the text means the file, also on the command line
    assert profile_file(f"./{spec}") == Path(spec)
    assert profile_identity(f"./{spec}") == f"{spec}@{hash_file(folder / spec)[:8]}"


def test_a_file_named_like_a_library_profile_is_read_only_with_its_folder(folder):
    z = load_library_profile("54E1").height([y / 2 for y in range(-60, 61)])
    write(folder / "60E1", "".join(f"{y / 2} {height}\n" for y, height in zip(range(-60, 61), z, strict=True)))
    assert resolve_rail("60E1") is load_library_profile("60E1")
    assert resolve_rail("./60E1").notes


def test_the_folder_does_not_count_and_the_content_does(folder):
    path, other_path = write(folder / "one/mine.toml"), write(folder / "other/mine.toml")
    assert profile_identity(str(path)) == profile_identity(str(other_path)) == profile_identity("one/mine.toml")
    before = profile_identity(str(other_path))
    write(other_path, "1 3\n")
    assert profile_identity(str(other_path)) != before
    assert profile_identity(str(other_path)).partition("@")[0] == "mine.toml"


def test_the_name_counts_with_its_ending(folder):
    # the ending decides how the content is read
    identities = {profile_identity(str(write(folder / name))) for name in ("a.txt", "b.txt", "a.toml", "A.txt", "a")}
    assert len({identity.partition("@")[2] for identity in identities}) == 1
    assert len(identities) == 5


def test_the_hash_is_that_of_the_bytes(folder):
    path = folder / "mine.toml"
    path.write_bytes(toml_text("60E1").encode())
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    assert hash_file(path) == hash_file(Path("mine.toml")) == digest
    assert profile_identity("mine.toml") == f"mine.toml@{digest[:8]}"
    path.write_bytes(toml_text("60E1").replace("\n", "\r\n").encode())
    assert profile_identity("mine.toml") != f"mine.toml@{digest[:8]}"


@pytest.mark.parametrize(
    "name", ["Schiene 60E1 (neu).TXT", "轨道.txt", "Prüfling.toml", "a@b.txt", "COM1.txt", "trailing.", "-x.csv", "%20"]
)
def test_names_of_every_kind(folder, name):
    path = write(folder / "some folder" / name)
    assert profile_file(str(path)) == path
    assert profile_identity(str(path)) == f"{name}@{hash_file(path)[:8]}"


@pytest.mark.parametrize(
    ("spec", "name"),
    [
        ("/nowhere/mine.toml", "mine.toml"),
        (r"C:\Profile\Schiene (neu).txt", "Schiene (neu).txt"),
        (r"\\server\share\mine.csv", "mine.csv"),
        ("mine.txt", "mine.txt"),
        ("60E3", "60E3"),
    ],
)
def test_a_file_that_is_not_there_is_its_name(folder, spec, name):
    assert profile_file(spec) is None
    assert profile_identity(spec) == name


def test_a_folder_is_no_file(folder):
    (folder / "mine.toml").mkdir()
    assert profile_file("mine.toml") is None
    assert profile_identity(str(folder / "mine.toml")) == "mine.toml"


def test_a_file_that_cannot_be_read_is_its_name(folder, monkeypatch):
    path = write(folder / "mine.toml")

    def refuse(self, mode):
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(Path, "open", refuse)
    assert profile_file(str(path)) == path
    assert profile_identity(str(path)) == "mine.toml"
    with pytest.raises(OSError, match="Permission denied"):
        hash_file(path)


@pytest.mark.parametrize("spec", ODD)
def test_odd_texts_name_no_file(folder, spec):
    assert profile_file(spec) is None
    assert isinstance(profile_identity(spec), str)


@given(st.text(st.characters()))
def test_any_text_has_an_identity(spec):
    profile_file(spec)
    assert isinstance(profile_identity(spec), str)


@pytest.mark.parametrize(
    ("body", "name", "near"),
    [("rail", "60E3", "60E2"), ("wheel", "S1003", "S1002"), ("opposite_wheel", "S1003", "S1002")],
)
def test_a_name_that_no_profile_has_is_refused_at_once_and_a_file_once_it_is_used(
    body, name, near, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(
        InputError,
        match=rf"there is no profile '{name}'; did you mean {near} or .* \(give a file with its ending",
    ):
        Case().with_profiles({body: name})
    # a file of a different machine or beside a result is recognised by its ending, its folder or its hash
    for later in ("mine.csv", "./mine", "measured\\mine", "mine@0123abcd"):
        case = Case().with_profiles({body: later})
        assert case.profiles[body] == later
        with pytest.raises(InputError, match="there is no file"):
            (resolve_rail if body == "rail" else resolve_wheel)(later)
    (tmp_path / "mine").write_text("", "utf-8")
    assert Case().with_profiles({body: "mine"}).profiles[body] == "mine"
