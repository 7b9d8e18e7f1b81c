"""`solve --out` with yielding, friction, yaw, irregularities and evidence: all files are written."""

import json

import pytest
import pyvista
from marks import slow_but

from fecontact.cli import call

YIELDS = ["--yield-mpa", "400", "--tangent-mpa", "4200"]
WAVE = "sine:wavelength_mm=60,amplitude_um=10"


@pytest.mark.parametrize(
    ("shift", "load", "options"),
    slow_but(
        [
            ("3", "60", YIELDS),
            ("3", "60", [*YIELDS, "--friction", "0.3"]),
            ("3", "60", [*YIELDS, "--yaw-mrad", "5"]),
            ("3", "60", [*YIELDS, "--wheel-irregularity", WAVE]),
            ("3", "60", [*YIELDS, "--refine", "evidence"]),
            ("0", "80", ["--yield-mpa", "500", "--tangent-mpa", "4200", "--friction", "0.3"]),
            ("3", "60", ["--friction", "0.3", "--yaw-mrad", "5", "--rail-irregularity", WAVE]),
            ("3", "60", ["--refine", "evidence"]),
        ]
    ),
)
def test_each_feature_writes_its_files(shift, load, options, tmp_path, capsys):
    assert call(["solve", "--shift", shift, "--load-kn", load, *options, "--out", str(tmp_path)]) == 0
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    for name in ("case.png", "case.svg", "report.html", "result.json", "row.json", "pressure.vtp", "rail.vtu"):
        assert (tmp_path / name).stat().st_size > 0, name
    record, surface = json.loads((tmp_path / "result.json").read_text()), pyvista.read(tmp_path / "pressure.vtp")
    # both files have the same peak of elastic bodies
    elastic = float(surface.point_data["contact_pressure_MPa"].max())
    assert elastic == pytest.approx(record["fe"]["p_max_MPa"], rel=0.01)
    if "--yield-mpa" in options:
        assert 0.0 < float(surface.point_data["plastic_pressure_MPa"].max()) < elastic
