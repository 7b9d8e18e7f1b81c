"""The command `fecontact curve`: positions, angles of attack, guiding forces of all wheels; no finite elements."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from fecontact.console.messages import telling_replaced
from fecontact.console.options import CaseOptions, takes
from fecontact.console.progress import many
from fecontact.errors import InputError
from fecontact.inputs.texts import parse_numbers
from fecontact.jobs.remaining import duration
from fecontact.outputs.terminal import answer, count


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class CurveOptions:
    """A vehicle, and the curves that it runs through.

    Attributes
    ----------
    vehicle
        wheelset (free, 60 kN a wheel), manchester, metro, or a TOML file like those.
    bogie
        The leading or the trailing one of the vehicle.
    radii
        Radii in m: numbers and ranges FROM:TO:STEP, separated by commas; positive to the right, where the left wheels
        are the outer ones, negative to the left.
    theory
        Of the normal force: overlap (strips that carry their own overlap), or any of `fecontact theories` but
        hertz_gauge; several with commas between, each of which is held against the last.
    friction
        Coefficient of friction, > 0.
    cant_mm
        Cant in mm over 1500 mm.
    unbalanced_m_s2
        Lateral acceleration in the plane of the track that cant leaves over, outwards, in m/s2; makes the speed.
    speed_km_h
        Speed in km/h, instead of that.
    shares
        Share of the way that each radius has, separated by commas, for what is told of the map; else equal ones.
    map
        Folder of a map of the same pair: where all wheels are on it, and which cheap theory holds there.
    workers
        Processes, one a theory.
    """

    vehicle: str = "manchester"
    bogie: str = "leading"
    radii: Annotated[str, Parameter(allow_leading_hyphen=True)] = "300,500,1000,3000"
    theory: str = "overlap"
    friction: float = 0.3
    cant_mm: float = 100.0
    unbalanced_m_s2: Annotated[float, Parameter(name="--unbalanced-m-s2", allow_leading_hyphen=True)] = 0.0
    speed_km_h: Annotated[float | None, Parameter(name="--speed-km-h")] = None
    shares: str = ""
    map: Path | None = None
    workers: int = 1

    def shared_radii(self) -> dict[float, float] | tuple[float, ...]:
        """Radii in m with the share of the way that each has; radii alone where one is there twice.

        Raises
        ------
        InputError
            If there are not as many shares as radii.
        """
        every = parse_numbers(self.radii, "radii")
        parts = parse_numbers(self.shares, "shares") if self.shares else [1.0] * len(every)
        if len(parts) != len(every):
            raise InputError(f"there are {len(parts)} shares for {len(every)} radii; give one number >= 0 for each")
        return dict(zip(every, parts, strict=True)) if len(set(every)) == len(every) else every


_AS_USUAL = CurveOptions()
# A curve by a theory, with its part of straight track.
_SECONDS, _MOST_SECONDS = {"overlap": 2.0, "kik_piotrowski": 2.0, "strip": 3.0}, 7.0


@takes("pair", "profiles", "material")
def curve(*, options: CaseOptions, asked: CurveOptions = _AS_USUAL, json: bool = False, out: Path | None = None) -> int:
    """Steady running of a wheelset or a bogie in curves: shift, yaw, forces of all wheels, critical speed (no mesh).

    Parameters
    ----------
    json
        Print the result as JSON and nothing else.
    out
        Folder for curve.csv, curve.json, pictures, and positions.csv for a fleet.
    """
    from fecontact.features.curves.curve import Conditions
    from fecontact.features.curves.pictures import curves_figure, visits_figure
    from fecontact.features.curves.records import curve_rows, curves_record, position_rows
    from fecontact.features.curves.running import curve as run_curves
    from fecontact.features.curves.terminal import curves_lines
    from fecontact.files import write_json
    from fecontact.outputs.tables import write_csv

    radii, theories = asked.shared_radii(), asked.theory.split(",")
    seconds = len(radii) * sum(_SECONDS.get(name, _MOST_SECONDS) for name in theories)
    what = "curves" if 1 in (len(theories), asked.workers) else "theories"
    with many(what, before=lambda _: f"{count(len(radii), 'curve')}: about {duration(seconds)}") as progress:
        found = run_curves(
            asked.vehicle,
            radii,
            case=options.case(),
            conditions=Conditions(
                friction=asked.friction,
                cant_mm=asked.cant_mm,
                unbalanced_m_s2=asked.unbalanced_m_s2,
                speed_km_h=asked.speed_km_h,
            ),
            theories=theories,
            bogie=asked.bogie,
            map_folder=asked.map,
            workers=asked.workers,
            progress=progress,
        )
    record = curves_record(found)
    if out is not None:
        with telling_replaced(out):
            write_csv(curve_rows(found), out / "curve.csv")
            write_csv(position_rows(found), out / "positions.csv")
            write_json(out / "curve.json", record)
            curves_figure(found, out / "curve.png")
            if found.columns:
                visits_figure(found, out / "curve_map.png")
    answer(record, lambda _: curves_lines(found), json=json, written=out)
    return 0 if all(run.status == "equilibrium" for runs in found.runs.values() for run in runs) else 3
