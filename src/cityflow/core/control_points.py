"""Points on the ground with known coordinates, and where photographs show them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from cityflow.core.arrays import FloatArray


class Role(StrEnum):
    """What a point is for: it holds the block, or it is kept out and tells how good the block is."""

    CONTROL = "control"
    CHECK = "check"


@dataclass(frozen=True, slots=True)
class Mark:
    """Where an image shows a point.

    Attributes
    ----------
    image : name of the file, as its source writes it
    col, row : image coordinates in pixels; (0, 0) is the corner of the first pixel, so its centre is (0.5, 0.5)
    sigma_px : standard deviation of each coordinate; None where it is not stated
    """

    image: str
    col: float
    row: float
    sigma_px: float | None = None


@dataclass(frozen=True, slots=True)
class ControlPoint:
    """A point with known coordinates.

    Attributes
    ----------
    name : unique in its set
    xyz : (3,) float64, in the set's CRS: east, north (or longitude, latitude in degrees), height, NaN where that is unknown
    sigmas_m : standard deviations of the three, metres; None where they are not stated
    role : control or check
    marks : in the order of images, each image once
    """

    name: str
    xyz: FloatArray = field(repr=False)
    sigmas_m: tuple[float, float, float] | None = None
    role: Role = Role.CONTROL
    marks: tuple[Mark, ...] = ()


@dataclass(frozen=True, slots=True)
class ControlPoints:
    """The points of a survey.

    Attributes
    ----------
    points : in the order of names, each once
    crs_wkt : of the coordinates; None where their source does not state it
    notes : what a user should know of them
    """

    points: tuple[ControlPoint, ...]
    crs_wkt: str | None = None
    notes: tuple[str, ...] = ()

    @property
    def coordinates(self) -> FloatArray:
        """(N, 3) float64 coordinates of the points."""
        return np.array([p.xyz for p in self.points], np.float64).reshape(-1, 3)

    def of_role(self, role: Role) -> tuple[ControlPoint, ...]:
        return tuple(p for p in self.points if p.role is role)

    def at(self, coordinates: FloatArray, crs_wkt: str | None, *notes: str) -> ControlPoints:
        """The same points with (N, 3) other coordinates of another CRS, and further notes."""
        moved = tuple(replace(p, xyz=xyz) for p, xyz in zip(self.points, coordinates, strict=True))
        return ControlPoints(moved, crs_wkt, (*self.notes, *notes))
