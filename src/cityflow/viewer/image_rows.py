"""Rows of the report for a survey from oriented images, and for check points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class DirectionRow:
    """One look direction.

    Attributes
    ----------
    name : of the direction, as ``nadir`` or ``east_45``
    images, left_out : how many look there, and how many of them could not be read
    tilt_deg : mean angle to the vertical;  tilts_deg : least and greatest
    references : reference images matched for this direction;  points : depths found in them
    pairs, refused : pairs matched and pairs not used
    parallax_px, parallax_rest_px : medians over the pairs used: of the offset between their rows, and of what single patches miss after
        its correction; None where not measured
    """

    name: str
    images: int
    left_out: int
    tilt_deg: float
    tilts_deg: tuple[float, float]
    references: int
    points: int
    pairs: int
    refused: int
    parallax_px: float | None
    parallax_rest_px: float | None


@dataclass(frozen=True, slots=True)
class RefusedPairs:
    """Pairs of images that were not used for the same kind of reason.

    Attributes
    ----------
    reason : of the first of them;  count : how many
    pairs : names of reference image and partner, each pair once, sorted
    """

    reason: str
    count: int
    pairs: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class TileRow:
    """The surface of one ground tile.

    Attributes
    ----------
    completeness, seen : shares of the surveyed ground, 0 to 1, with a height and with a colour in the ortho; None where not known
    sigma : median of the tile, metres
    surveyed_m2 : ground that enough images see
    """

    tile: str
    completeness: float | None
    seen: float | None
    sigma: float | None
    points: int
    surveyed_m2: float = 0.0


@dataclass(frozen=True, slots=True)
class ImageFigures:
    """All that a report says of images.

    Attributes
    ----------
    images, left_out : in the catalog, and of these not read;  unused : read, but in no pair
    asked_m2, shown_share : the area that was asked for, and how much of it enough images see, 0 to 1; None where not known
    match_seconds, sgm_seconds : of all matching, and of this inside the library's matcher
    parallaxes_px : vertical parallax of every pair used
    """

    images: int
    left_out: tuple[str, ...]
    unused: int
    directions: tuple[DirectionRow, ...]
    refused: tuple[RefusedPairs, ...]
    tiles: tuple[TileRow, ...]
    parallaxes_px: tuple[float, ...]
    match_seconds: float
    sgm_seconds: float
    asked_m2: float | None = None
    shown_share: float | None = None


@dataclass(frozen=True, slots=True)
class CheckpointRow:
    """Residuals of a product at points of known position: metres, and their number; None where not measured."""

    product: str
    count: int | None
    bias: float | None
    rmse: float | None
    le95: float | None


@dataclass(frozen=True, slots=True)
class PosesRow:
    """What a run found out about the poses of its images before it matched them.

    Attributes
    ----------
    refined : whether adjusted poses are used;  lines : for people
    sample, summary : figures of the sample of pairs, and of the adjustment; None where there was none
    left_out : images that could not be read
    """

    refined: bool
    lines: tuple[str, ...]
    sample: Mapping[str, Any] | None
    summary: Mapping[str, Any] | None
    left_out: tuple[str, ...]
