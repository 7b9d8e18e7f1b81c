"""Cost of a fleet before it is screened, and access to a screened fleet."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from fecontact.arrays import Floats
from fecontact.case import Case, describe_unusual_inputs
from fecontact.errors import InputError
from fecontact.features.fleet.model import Fleet, ScreeningTheory, read_fleet
from fecontact.features.fleet.packages import import_parquet
from fecontact.features.fleet.paired_profiles import read_paired_profiles
from fecontact.features.fleet.population import (
    BODIES,
    Candidate,
    describe_tables,
    list_candidates,
)
from fecontact.features.fleet.profile_files import (
    check_profile,
    list_reasons,
    mark_unusable,
    select_reading,
    with_radius,
)
from fecontact.features.fleet.screening_rows import Row
from fecontact.features.fleet.sealed_folder import (
    FLEET_FILE,
    describe_rerun,
    read_record,
)
from fecontact.features.fleet.table_columns import (
    ACCEPTED_COLUMN,
    OPPOSITE_FILE,
    OPPOSITE_HASH,
    OPPOSITE_OPTIONS,
    OPPOSITE_RADIUS,
    READ,
    REFUSED,
    SUSPICIOUS,
    UNUSED,
    Body,
    select_case_values,
    select_reading_values,
    set_case_values,
    set_opposite,
)
from fecontact.features.fleet.tables import read_profile_rows
from fecontact.files import hash_file
from fecontact.inputs.texts import count_text
from fecontact.profiles.reading import DEFAULT_READING, Reading
from fecontact.profiles.resolve import read_profile_content, select_used_options

# CPU seconds per file of 600 points, per pair, and per shift of a pair on each profile variant; MB per worker, kB per
# pair in the process that distributes the pairs. Pairs of 1 to 50 positions took 0.067 to 1.53 s by strips.
_FILE_S, _PAIR_S, _PLACE_S, _WORKER_MB, _PAIR_KB = 0.35, 0.025, 0.006, 270.0, 4.0
# CPU seconds per position of a pair on each profile variant.
_POSITION_S: Mapping[ScreeningTheory, float] = {"strip": 0.013, "half_space": 0.07}
# Seconds before the first result of each worker and after the last: a process imports the program in 2 s, once for the
# files and once for the pairs; its first pair takes 1 s more; tables and the end take 1 s.
_START_S = 6.0
# A solved case of a sample with its fields and pictures: 5.2 MB in the mean of five positions of worn examples, 7.4 MB
# for measured profiles with two patches.
_SAMPLE_MB = (5.0, 7.5)


# Expected number of profile variants of a position, without and with a declared filter. It is 3 to 9, and 1 to 5.
_USUAL_VARIANTS, _VARIANTS_WITH_FILTER = 6, 3


@dataclass(frozen=True, kw_only=True)
class FleetCost:
    """Size and cost of a fleet, before its files are smoothed.

    Attributes
    ----------
    wheels, rails, pairs, positions
        Numbers of usable profiles, of pairs, and of positions of all pairs.
    cpu_seconds
        CPU time of reading and screening, without the start of processes.
    memory_MB
        Memory of a worker.
    tables
        Sentence on the columns of each table: inputs, metadata, and names that may be a mistake.
    copies
        Sentence on the copies of each body, such as "10000 wheel files, of which 9999 are copies of other files".
    unusable
        Reasons and remedies of the files that cannot be used, without copies, by body and name.
    notes
        Unusual inputs that all positions have.
    unused
        Number of files that are not read because they are in no pair.
    """

    wheels: int
    rails: int
    pairs: int
    positions: int
    cpu_seconds: float
    memory_MB: float
    tables: tuple[str, ...] = ()
    copies: tuple[str, ...] = ()
    unusable: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    unused: int = 0

    def estimate_seconds(self, workers: int) -> float:
        """Expected time of a run on an idle machine, in s.

        Parameters
        ----------
        workers
            Number of processes, at most one for each core.

        Returns
        -------
        float
            Time from this estimate to the end of the run, with the start of the processes, without a report.
        """
        return _START_S + self.cpu_seconds / min(workers, max(1, self.pairs))

    @property
    def words(self) -> str:
        """Numbers and memory in a sentence, without the time."""
        counts = {"wheel": self.wheels, "rail": self.rails, "pair": self.pairs, "position": self.positions}
        numbers = ", ".join(count_text(number, noun) for noun, number in counts.items())
        unused = f"; {count_text(self.unused, 'file')} in no pair, not read" if self.unused else ""
        return f"{numbers}{unused}; about {self.memory_MB:.0f} MB per worker"


def check_fleet(fleet: str | Path) -> FleetCost:
    """Estimate the positions of a fleet, and their time and memory.

    All tables and the points of all files are read; nothing is smoothed.

    Parameters
    ----------
    fleet
        File of the fleet (TOML).

    Returns
    -------
    FleetCost
        Numbers, CPU time in s and memory in MB.

    Raises
    ------
    InputError
        As `run_fleet` does, for errors that can be found without smoothing a profile.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import fecontact
    >>> from fecontact.features.fleet.examples import write_fleet
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     cost = fecontact.check_fleet(write_fleet(Path(folder), wheels=2, rails=3))
    >>> cost.wheels, cost.rails, cost.pairs
    (2, 3, 6)
    """
    definition = read_fleet(Path(fleet))
    import_parquet()
    candidates = [
        mark_unusable(definition, with_radius(definition, candidate)) for candidate in list_candidates(definition)
    ]
    paired = read_paired_profiles(
        definition, candidates, lambda some: [check_profile(definition, candidate) for candidate in some]
    )
    profiles, pairs = paired.profiles, len(paired.pairs)
    counts = Counter(profile.candidate.body for profile in profiles if profile.record["status"] == READ)
    opposites = [
        profile.candidate.opposite
        for profile in profiles
        if profile.candidate.opposite is not None and profile.record["status"] != UNUSED
    ]
    opposite_files = {opposite.spec for opposite in opposites if not opposite.has_row}
    positions = len(definition.positions)
    return FleetCost(
        wheels=counts["wheel"],
        rails=counts["rail"],
        pairs=pairs,
        positions=pairs * positions,
        cpu_seconds=estimate_screening_seconds(
            definition.theory,
            has_filter=definition.filter_mm is not None,
            files=counts.total() + len(opposite_files),
            pairs=pairs,
            shifts=len(definition.shifts_mm),
            positions=positions,
        ),
        memory_MB=_WORKER_MB + 1e-3 * _PAIR_KB * pairs,
        tables=tuple(describe_tables(definition)),
        copies=tuple(_describe_copies(candidates)),
        unused=paired.count_files(UNUSED),
        unusable=list_reasons([profile for profile in profiles if not profile.candidate.copy_of], REFUSED, SUSPICIOUS),
        notes=describe_unusual_inputs([definition.case]),
    )


def estimate_screening_seconds(
    theory: ScreeningTheory, *, has_filter: bool, files: int, pairs: int, shifts: int, positions: int
) -> float:
    """Estimate the CPU time of reading and screening, without the start of processes.

    Parameters
    ----------
    theory
        Theory of the screening.
    has_filter
        Whether a filter is declared.
    files, pairs
        Numbers of files, and of pairs.
    shifts, positions
        Numbers of shifts, and of positions, of each pair.

    Returns
    -------
    float
        Time in s.
    """
    variants = _VARIANTS_WITH_FILTER if has_filter else _USUAL_VARIANTS
    pair_seconds = _PAIR_S + variants * (shifts * _PLACE_S + positions * _POSITION_S[theory])
    return files * _FILE_S + pairs * pair_seconds


def describe_sample_size() -> str:
    """Disk space of a sample by finite elements, in a sentence.

    Returns
    -------
    str
        Sentence without a full stop.
    """
    low, high = _SAMPLE_MB
    return (
        f"a sample by finite elements (fecontact fleet sample) takes about {low:g} to {high:g} MB of disk space per"
        f" position, {0.3 * low:.1f} to {0.3 * high:.1f} GB for 300 positions"
    )


def _describe_copies(candidates: Sequence[Candidate]) -> Iterator[str]:
    """Yield a sentence for each body with copies of files."""
    for body in BODIES:
        body_candidates = [candidate for candidate in candidates if candidate.body == body]
        originals = [candidate.copy_of for candidate in body_candidates if candidate.copy_of]
        if originals:
            count, verb = len(set(originals)), "is a copy" if len(originals) == 1 else "are copies"
            source = originals[0] if count == 1 else f"{count} files"
            yield (
                f"{count_text(len(body_candidates), f'{body} file')}, of which {len(originals)} {verb} of {source} and"
                " not used; list each file once, with the sum of the weights"
            )


@dataclass(frozen=True, kw_only=True)
class ScreenedFleet:
    """A screened fleet, for further work with its positions.

    Attributes
    ----------
    out
        Folder of the results.
    fleet
        Definition of the fleet.
    record
        Content of `fleet.json`.
    """

    out: Path
    fleet: Fleet
    record: Mapping[str, Any]
    _rows: Mapping[tuple[str, str], Row]
    _unchanged_files: set[str] = field(default_factory=set)

    def case(self, wheel: str, rail: str, shift_mm: float, load_kN: float) -> Case:
        """Case of a position.

        Parameters
        ----------
        wheel, rail
            Names in `profiles.parquet`.
        shift_mm, load_kN
            Lateral shift and wheel load.

        Returns
        -------
        Case
            Case with the profiles, reading options and wheel radius of the fleet.

        Raises
        ------
        InputError
            If a value is out of the range of a case, or the file of a profile was changed after it was screened.
        """
        profile_inputs: dict[str, Any] = {}
        case_values: dict[str, Any] = {}
        opposite_specs: dict[Body, str] = {}
        opposite_readings: dict[Body, Reading] = {}
        opposite_radius_mm: float | None = None
        for body, profile_name in zip(BODIES, (wheel, rail), strict=True):
            row = self._rows[body, profile_name]
            self._refuse_changed_file(row["file"], row["content_hash"])
            candidate = Candidate(body=body, name=profile_name, spec=row["file"], known=_select_known(row))
            specs, reading = [candidate.spec], select_reading(self.fleet, candidate)
            if opposite_spec := row.get(OPPOSITE_FILE):
                self._refuse_changed_file(opposite_spec, row[OPPOSITE_HASH])
                opposite_specs[body] = opposite_spec
                opposite = replace(candidate, spec=opposite_spec, known=_select_opposite_known(row))
                opposite_reading = select_reading(self.fleet, opposite)
                if opposite_reading == reading:
                    specs.append(opposite_spec)
                else:
                    opposite_readings[body] = select_used_options(opposite_spec, opposite_reading)
            profile_inputs |= {body: row["file"], f"{body}_file": _join_used_options(specs, reading)}
            case_values |= select_case_values(row)
            opposite_radius_mm = row.get(OPPOSITE_RADIUS) if body == "wheel" else opposite_radius_mm
        case = set_case_values(self.fleet.case, case_values)
        case = set_opposite(case, opposite_specs, opposite_radius_mm, opposite_readings)
        return replace(case, **profile_inputs, lateral_shift_mm=shift_mm, load_N=1e3 * load_kN)

    @property
    def profile_rows(self) -> tuple[Row, ...]:
        """Rows of `profiles.parquet`."""
        return tuple(self._rows.values())

    def read_points(self, body: Body, name: str) -> Floats:
        """Points of the file of a profile, without a check of their order.

        Parameters
        ----------
        body, name
            Wheel or rail, and its name in `profiles.parquet`.

        Returns
        -------
        ndarray
            Points (n, 2) in mm.

        Raises
        ------
        InputError
            If the file cannot be read, has no points, or was changed after it was screened.
        """
        row = self._rows[body, name]
        self._refuse_changed_file(row["file"], row["content_hash"])
        candidate = Candidate(body=body, name=name, spec=row["file"], known=_select_known(row))
        content = read_profile_content(row["file"], body, select_reading(self.fleet, candidate))
        if content.points is None:
            raise InputError(f"{row['file']} has no points; give a file of points")
        return content.points

    def _refuse_changed_file(self, file: str, checksum: str) -> None:
        """Raise InputError if the file of a profile was changed after it was screened."""
        if not checksum or file in self._unchanged_files:
            return
        try:
            is_unchanged = hash_file(Path(file)) == checksum
        except OSError as error:
            raise InputError(f"{file} cannot be read ({error.strerror}); restore the file") from error
        if not is_unchanged:
            raise InputError(f"{file} was changed after it was screened; {describe_rerun(self.out)}")
        self._unchanged_files.add(file)


def _join_used_options(specs: Sequence[str], reading: Reading) -> Reading:
    """Options that the profiles of both sides use, with defaults for all unused options."""
    used_options: dict[str, Any] = {}
    for spec in specs:
        spec_reading = select_used_options(spec, reading)
        used_options |= {
            option.name: getattr(spec_reading, option.name)
            for option in fields(Reading)
            if getattr(spec_reading, option.name) == getattr(reading, option.name)
        }
    return replace(DEFAULT_READING, **used_options)


def _select_known(row: Row) -> dict[str, Any]:
    """Values of a row that determine how its file is read."""
    return {**select_reading_values(row), ACCEPTED_COLUMN: row.get(ACCEPTED_COLUMN)}


def _select_opposite_known(row: Row) -> dict[str, Any]:
    """Values that determine how the file of the other side is read."""
    if not row.keys() >= OPPOSITE_OPTIONS.keys():
        # earlier versions allowed only equal options of both sides
        return _select_known(row)
    return {name: row[column] for column, name in OPPOSITE_OPTIONS.items()}


def open_fleet(out: str | Path) -> ScreenedFleet:
    """Open a fleet that `run_fleet` has screened.

    Parameters
    ----------
    out
        Folder of the results.

    Returns
    -------
    ScreenedFleet
        Definition, record and profiles of the fleet.

    Raises
    ------
    InputError
        If the folder has no screened fleet, or a table was changed.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import fecontact
    >>> from fecontact.features.fleet.examples import write_fleet
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     screening = fecontact.run_fleet(write_fleet(Path(folder), wheels=1, rails=1), Path(folder) / "out")
    ...     fleet = fecontact.open_fleet(Path(folder) / "out")
    >>> fleet.record["pairs"]
    1
    """
    folder = Path(out)
    record = read_record(folder)
    return ScreenedFleet(
        out=folder,
        fleet=read_fleet(folder / FLEET_FILE, Path(record["folder"])),
        record=record,
        _rows={(row["body"], row["name"]): row for row in read_profile_rows(folder)},
    )
