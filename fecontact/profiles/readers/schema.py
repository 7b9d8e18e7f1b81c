"""Schema of a profile file in TOML; any other key is an error."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from fecontact.profiles.curve import LARGEST_COORDINATE_MM

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Coordinate = Annotated[float, Field(ge=-LARGEST_COORDINATE_MM, le=LARGEST_COORDINATE_MM, allow_inf_nan=False)]
Point = tuple[Coordinate, Coordinate]


class _StrictModel(BaseModel):
    """Model without additional keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=False)


class LineEntry(_StrictModel):
    """Straight segment between two points."""

    type: Literal["line"]
    from_: Point = Field(alias="from")
    to: Point


class ArcEntry(_StrictModel):
    """Arc shorter than a half circle between two points."""

    type: Literal["arc"]
    from_: Point = Field(alias="from")
    to: Point
    centre: Point
    radius: Positive


class PolynomialEntry(_StrictModel):
    """Segment z = sum_k coefficients[k] y^k."""

    type: Literal["polynomial"]
    y_from: Coordinate
    y_to: Coordinate
    coefficients: Annotated[list[Finite], Field(min_length=1)]

    @model_validator(mode="after")
    def _check_order(self) -> PolynomialEntry:
        if not self.y_from < self.y_to:
            raise ValueError(f"y_from = {self.y_from:g} must be smaller than y_to = {self.y_to:g}")
        return self


Entry = LineEntry | ArcEntry | PolynomialEntry
Entries = list[Annotated[Entry, Field(discriminator="type")]]


class Head(_StrictModel):
    """Symmetric rail head of tangent arcs with straight sides and its crown at (0, 0)."""

    radii: Annotated[list[Positive], Field(min_length=1)]
    half_widths: list[Positive]
    side_one_in: Annotated[float, Field(gt=0.0)]
    side_to_z: Coordinate

    @model_validator(mode="after")
    def _check_joints(self) -> Head:
        if len(self.half_widths) != len(self.radii) - 1:
            raise ValueError(
                f"{len(self.radii)} radii need {len(self.radii) - 1} half_widths, but there are {len(self.half_widths)}"
            )
        return self


class ProfileFile(_StrictModel):
    """Complete profile file."""

    kind: Literal["rail", "wheel"]
    units: Literal["mm"]
    group: str = ""
    source: str = ""
    certainty: str = ""
    notes: list[str] = []
    doubtful_y_mm: Point | None = None
    head: Head | None = None
    surface: Entries = []
    body: Entries = []

    @model_validator(mode="after")
    def _check_doubtful_range(self) -> ProfileFile:
        if self.doubtful_y_mm is not None and not self.doubtful_y_mm[0] < self.doubtful_y_mm[1]:
            raise ValueError(
                f"doubtful_y_mm = {list(self.doubtful_y_mm)}: give the smaller y first, then the larger y, in mm"
            )
        return self

    @model_validator(mode="after")
    def _check_surface(self) -> ProfileFile:
        if (self.head is None) == (not self.surface):
            raise ValueError("give the running surface once, either as [head] or as [[surface]] segments")
        if self.head is not None and self.kind != "rail":
            raise ValueError("[head] describes a rail; give a wheel as [[surface]] segments")
        return self
