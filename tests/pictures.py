"""Runs without pictures: those of a case take seconds, and are looked at by tests of their own."""

from pathlib import Path

import pytest


def draw_nothing(patch: pytest.MonkeyPatch, *, of_studies: bool = False) -> None:
    """Leave out the pictures of cases and reports, and those of studies if they are not asked for."""
    patch.setattr("fecontact.outputs.figures.case.case_figure", _empty_files)
    patch.setattr("fecontact.runs.study.study_pair", lambda study, rows, out: None)
    patch.setattr("fecontact.runs.study.report_study", lambda study, rows, out, criteria, conclusion, shown: None)
    if not of_studies:
        patch.setattr("fecontact.runs.study.study_figures", lambda rows, out, rail, criteria: ())


def draw_no_scenes(patch: pytest.MonkeyPatch) -> None:
    """Leave out the pictures in three dimensions, each a process of its own."""
    patch.setattr("fecontact.outputs.paraview.scene.write_scene", lambda *arguments, **more: "left out")


def _empty_files(result: object, path: Path) -> Path:
    for ending in (".png", ".svg"):
        path.with_suffix(ending).touch()
    return path
