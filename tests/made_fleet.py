"""A screened fleet without any contact: Parquet files of the layout that a screen writes, and the truth beside them.

Verdicts follow from a number of each wheel and each rail, the shift and the load. The screen sees them with an error;
finite elements, as they stand here, see them without.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow
from pyarrow.parquet import write_table

from fecontact.case import Case
from fecontact.features.fleet.sealed_folder import write_record
from fecontact.files import SEAL_KEY, read_json

SHIFTS_MM = (-6.0, -3.0, 0.0, 3.0, 6.0)
LOADS_KN = (40.0, 80.0, 120.0)


@dataclass(frozen=True, kw_only=True)
class Made:
    """A folder with a made fleet, and the planted answer of finite elements for each position."""

    folder: Path
    truth: dict[tuple[str, str, float, float], str]
    weights: dict[tuple[str, str, float, float], float]
    profile_rows: tuple = ()

    @property
    def share(self) -> float:
        """The share of the weight at which Hertz holds."""
        return sum(self.weights[key] for key, answer in self.truth.items() if answer == "HOLDS")

    def answer(self, case: Case) -> str:
        """Planted answer of finite elements for a case of the made fleet."""
        wheel, rail = (int(name.partition(":")[2]) for name in (case.wheel, case.rail))
        return self.truth[f"w{wheel - 400}", f"r{rail - 300}", case.lateral_shift_mm, case.load_N / 1e3]

    @staticmethod
    def case(wheel: str, rail: str, shift_mm: float, load_kN: float) -> Case:
        """A case with the numbers of both profiles in its radii.

        So each position is a different case.
        """
        return Case(
            wheel=f"cylinder:{400 + int(wheel[1:])}",
            rail=f"circle:{300 + int(rail[1:])}",
            inclination_rad=0.0,
            lateral_shift_mm=shift_mm,
            load_N=1e3 * load_kN,
        )


def profiles(count: int, body: str, random: np.random.Generator) -> list[dict]:
    """Rows of read profiles of a body, and of a refused profile."""
    letter = body[0]
    rows = [
        {
            "body": body,
            "name": f"{letter}{number}",
            "file": f"{body}s/{letter}{number}.csv",
            "content_hash": f"{letter}{number}",
            "status": "read",
            "reason": None,
            "remedy": None,
            "noise_um": 10.0,
            "filter_mm": "4, 8",
            "nominal": "S1002" if body == "wheel" else "60E1",
            "wear_mm": float(random.gamma(2.0, 0.5)),
            "weight": float(random.lognormal(0.0, 0.5)),
            "line": f"line {'AB'[number % 2]}" if body == "rail" else None,
            "mileage_km": float(random.uniform(0.0, 3e5)) if body == "wheel" else None,
        }
        for number in range(count)
    ]
    lost = rows[0] | {"name": f"{letter}_lost", "file": f"{body}s/lost.csv", "status": "refused"}
    return [*rows, lost | {"reason": "it has 12 points", "remedy": "give 50 or more", "wear_mm": None, "line": None}]


def made_fleet(folder: Path, wheels: int = 12, rails: int = 10, *, seed: int = 1, parts: int = 3) -> Made:
    """Write the Parquet files of a fleet into a folder."""
    random = np.random.default_rng(seed)
    bodies = {body: profiles(count, body, random) for body, count in (("wheel", wheels), ("rail", rails))}
    write(folder / "profiles.parquet", [*bodies["wheel"], *bodies["rail"]])
    good = {body: [row for row in rows if row["status"] == "read"] for body, rows in bodies.items()}
    totals = {body: sum(row["weight"] for row in rows) for body, rows in good.items()}
    loads = dict(zip(LOADS_KN, (0.2, 0.5, 0.3), strict=True))
    rows, truth, weights = [], {}, {}
    for wheel in good["wheel"]:
        for rail in good["rail"]:
            for shift in SHIFTS_MM:
                for load, share in loads.items():
                    key = (wheel["name"], rail["name"], shift, load)
                    true = 4.0 - 0.7 * abs(shift) - load / 40.0 + 1.2 * wheel["wear_mm"] + random.normal(0.0, 1.0)
                    observed = true + random.normal(0.0, 0.7)
                    verdict = "OPEN" if abs(observed) < 1.0 else "HOLDS" if observed > 0.0 else "FAILS"
                    refused = random.random() < 0.02
                    weights[key] = wheel["weight"] / totals["wheel"] * rail["weight"] / totals["rail"] * share / 5.0
                    answer = "OPEN" if abs(true) < 0.15 else "HOLDS" if true > 0.0 else "FAILS"
                    truth[key] = "UNSOLVED" if refused and random.random() < 0.9 else answer
                    rows.append(
                        dict(zip(("wheel", "rail", "shift_mm", "load_kN"), key, strict=True))
                        | {
                            "weight": weights[key],
                            "p_max_percent": 5.0 - observed,
                            "hertz_p_max_MPa": 1400.0 - 60.0 * observed + 2.0 * load,
                            "verdict": "REFUSED" if refused else verdict,
                            "margin": None if refused else observed,
                            "variants": None if refused else 1.0,
                            "cause": "curvature changes in the patch" if verdict == "FAILS" and not refused else None,
                            "cheapest_theory": None
                            if refused
                            else "hertz"
                            if verdict == "HOLDS"
                            else "strip"
                            if observed < -2.0
                            else "OPEN",
                            "reason": "the wheel does not run on the rail" if refused else None,
                        }
                    )
    for number in range(parts):
        write(folder / "screen" / f"part-{number}.parquet", rows[number::parts])
    (folder / "fleet.toml").write_text("# a made fleet has no file\n", "utf-8")
    population = f"{wheels} wheels on {rails} rails, all pairs by their weights, 5 shifts and 3 loads"
    about = {"population": population, "theory": "strip", "filter_mm": None, "folder": str(folder)}
    seal(folder, about)
    return Made(folder=folder, truth=truth, weights=weights)


def seal(folder: Path, record: dict | None = None) -> None:
    """Write the checksums of the present tables, and a new record if it is given."""
    record = record or {key: value for key, value in read_json(folder / "fleet.json").items() if key != SEAL_KEY}
    write_record(folder, record, [path.name for path in (folder / "screen").iterdir()])


def write(path: Path, rows: list[dict]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_table(pyarrow.table({name: [row[name] for row in rows] for name in rows[0]}), path)
