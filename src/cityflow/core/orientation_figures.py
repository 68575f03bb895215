"""What an orientation has found of its images, as far as a catalog keeps it: figures, names and doubts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

PHOTOGRAPHS, REFINEMENT = "photographs", "refinement"
"""Ways: poses found from photographs alone, given poses refined."""


@dataclass(frozen=True, slots=True)
class KnownPointFigures:
    """Known points of a kind that were used: their number, root mean square residuals in plan (both axes together) and in height, metres."""

    count: int
    plan_m: float
    height_m: float | None


@dataclass(frozen=True, slots=True)
class OrientationFigures:
    """An orientation.

    Attributes
    ----------
    way : `PHOTOGRAPHS` or `REFINEMENT`
    images, given : images that have a pose by it, and those that were there
    left_out : name of an image → why it has none;  weak : name of an image → why little holds its pose
    tie_points : their number;  observations : places where images show them
    track_length : images that show a tie point, mean
    reprojection_px : mean over tie points (photographs), or root mean square per axis over observations (refinement)
    before_px, after_px : refinement: root mean square on tie points that were kept out
    move_m : refinement: what centres moved by, median
    position_sigma_m, angle_sigma_deg : standard deviations of poses, per axis, median of the images; None where unknown
    control, check : known points, None where there are none
    found, doubts : sentences for people
    """

    way: str
    images: int
    given: int
    left_out: Mapping[str, str]
    weak: Mapping[str, str]
    tie_points: int
    observations: int
    track_length: float
    reprojection_px: float
    before_px: float | None = None
    after_px: float | None = None
    move_m: float | None = None
    position_sigma_m: float | None = None
    angle_sigma_deg: float | None = None
    control: KnownPointFigures | None = None
    check: KnownPointFigures | None = None
    found: tuple[str, ...] = ()
    doubts: tuple[str, ...] = field(default=())
