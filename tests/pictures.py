"""Runs without pictures.

The pictures of a case take seconds, and have separate tests.
"""

from pathlib import Path

import pytest


def draw_nothing(patch: pytest.MonkeyPatch, *, of_studies: bool = False) -> None:
    """Leave out the pictures of cases and reports.

    Pictures of studies are left out if they are not requested.
    """
    patch.setattr("fecontact.outputs.figures.case.write_case_figure", _empty_files)
    patch.setattr("fecontact.runs.study.study_pair", lambda study, rows: None)
    patch.setattr(
        "fecontact.runs.study.report_study", lambda study, rows, out, criteria, conclusion, wants_pictures: None
    )
    if not of_studies:
        patch.setattr("fecontact.runs.study.study_figures", lambda rows, out, rail, criteria: ())


def _empty_files(result: object, path: Path, *, svg: bool = True) -> Path:
    for ending in (".png", ".svg") if svg else (".png",):
        path.with_suffix(ending).touch()
    return path
