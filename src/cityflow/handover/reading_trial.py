"""Which reading of given rotations agrees with the pictures: ties of some pairs, found without poses, against the epipolar geometry of each reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.adjustment.descriptor_matching import mutual_matches
from cityflow.adjustment.pair_check import epipolar_errors
from cityflow.adjustment.pair_geometry import pair_geometry, pycolmap_camera
from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.errors import CityflowError
from cityflow.geometry.epipolar import intersections
from cityflow.handover.tie_sample import MATCHING, SeenImage, Star, points_of

LEAST_BASE = 0.02
"""Of a pair, over the height above the ground: heads that fire together say nothing of rotations. Set by hand, as are those below."""
LEAST_AHEAD = 0.8
"""Share of a pair's ties that must lie before both cameras."""
MOST_DEG = 2.0
"""Rotations whose ties lie off by more, seen from the camera, are not understood: angles of a small drone are off by a degree or two."""
BETTER = 3.0
"""A reading is clearly better than another one whose ties lie off by this times as much."""
SAME_PX = 0.25
"""And by this much more: exact poses under blurred pictures show half of it (`adjustment.relative_error`)."""
LEAST_PAIRS = 2
"""Of a trial that tells anything."""


@dataclass(frozen=True, slots=True, eq=False)
class VerifiedPair:
    """Two images whose matches agree with one epipolar geometry, whatever the poses say: their names, (N, 2) image coordinates in each, pixels."""

    first: str
    other: str
    uv: tuple[FloatArray, FloatArray]


@dataclass(frozen=True, slots=True)
class Verdict:
    """Of a trial.

    Attributes
    ----------
    chosen : number of the reading that the pictures agree with: the first, unless another one fits clearly better; None where none fits
    rivals : readings that fit about as well as the chosen one, though they move pictures
    errors_deg : of each reading by how much ties lie off their epipolar lines, seen from the camera: median of pairs; infinite where they lie behind
        the cameras
    errors_px : the same in pixels
    pairs, ties : that told it
    """

    chosen: int | None
    rivals: tuple[int, ...]
    errors_deg: tuple[float, ...]
    errors_px: tuple[float, ...]
    pairs: int
    ties: int


def verified_pairs(star: Star, most_px: int) -> tuple[VerifiedPair, ...]:
    """The first image of a star with each other one, where they show the same; who cannot be read is left out."""
    seen: list[SeenImage] = []
    for given in star.images:
        try:
            seen.append(points_of(given, most_px, checked=False))
        except (CityflowError, OSError):
            if not seen:
                return ()
    found = [_verified(seen[0], other) for other in seen[1:]]
    return tuple(pair for pair in found if pair is not None)


def _verified(one: SeenImage, other: SeenImage) -> VerifiedPair | None:
    matches = mutual_matches(one.features, other.features, MATCHING)
    cameras = pycolmap_camera(one.image.camera.pinhole, True), pycolmap_camera(other.image.camera.pinhole, True)
    geometry = pair_geometry(cameras, (_plain(one), _plain(other)), matches)
    if geometry is None:
        return None
    uv = one.features.uv[geometry.matches[:, 0]], other.features.uv[geometry.matches[:, 1]]
    return VerifiedPair(one.image.name, other.image.name, (uv[0] * 2.0**one.level, uv[1] * 2.0**other.level))


def _plain(seen: SeenImage) -> FloatArray:
    """(N, 2) where the points would lie without distortion, pixels."""
    camera = seen.image.camera
    return np.asarray(camera.undistort(seen.features.uv) * (camera.fx, camera.fy) + (camera.cx, camera.cy))


def verdict(readings: Sequence[Sequence[OrientedImage]], pairs: Sequence[VerifiedPair], ground_m: float) -> Verdict:
    """Compare readings of the same images.

    Parameters
    ----------
    readings : the images as each reading has them, in the same order; first as they were read
    ground_m : height of the ground
    """
    number = {image.name: k for k, image in enumerate(readings[0])}
    told = [p for p in pairs if _is_wide(readings[0][number[p.first]], readings[0][number[p.other]], ground_m)]
    errors = [_error([(r[number[p.first]], r[number[p.other]]) for p in told], told) for r in readings]
    degrees, pixels = tuple(e[0] for e in errors), tuple(e[1] for e in errors)
    ties = sum(len(p.uv[0]) for p in told)
    chosen = _chosen(pixels, degrees) if len(told) >= LEAST_PAIRS else None
    rivals = [
        k for k in range(len(readings))
        if chosen not in (None, k) and not _is_better(chosen, k, pixels) and not _are_alike(readings[chosen], readings[k], pixels[chosen])
    ]  # fmt: skip
    return Verdict(chosen, tuple(rivals), degrees, pixels, len(told), ties)


def _is_wide(one: OrientedImage, other: OrientedImage, ground_m: float) -> bool:
    height = max(float(min(one.centre[2], other.centre[2])) - ground_m, 1e-9)
    return float(np.linalg.norm(one.centre - other.centre)) > LEAST_BASE * height


def _error(images: Sequence[tuple[OrientedImage, OrientedImage]], pairs: Sequence[VerifiedPair]) -> tuple[float, float]:
    """Degrees and pixels by which ties lie off, median over the pairs; infinite where most pairs have them behind a camera."""
    found = []
    for pair, (one, other) in zip(pairs, images, strict=True):
        off = float(np.median(np.abs(epipolar_errors((one, other), pair.uv)[0])))
        ahead = _ahead((one, other), pair.uv) >= LEAST_AHEAD
        found.append((np.degrees(np.arctan(off / other.camera.fx)), off) if ahead else (np.inf, np.inf))
    table = np.array(found, np.float64).reshape(-1, 2)
    # not interpolated: infinite ones have no mean
    middle = np.sort(table, axis=0)[len(table) // 2] if len(table) else np.full(2, np.inf)
    return float(middle[0]), float(middle[1])


def _ahead(images: tuple[OrientedImage, OrientedImage], uv: tuple[FloatArray, FloatArray]) -> float:
    """Share of ties whose rays meet before both cameras."""
    count = len(uv[0])
    point, image = np.repeat(np.arange(count), 2), np.tile(np.array([0, 1]), count)
    met = intersections(images, point, image, np.stack(uv, axis=1).reshape(-1, 2))
    depths = [i.in_camera(met)[:, 2] for i in images]
    return float(np.mean((depths[0] > 0) & (depths[1] > 0)))


def _chosen(pixels: Sequence[float], degrees: Sequence[float]) -> int | None:
    """The best where its ties fit; the first where the best is not clearly better."""
    best = int(np.argmin(pixels))
    if not degrees[best] <= MOST_DEG:
        return None
    return best if _is_better(best, 0, pixels) else 0


def _is_better(one: int, other: int, pixels: Sequence[float]) -> bool:
    return pixels[other] > BETTER * pixels[one] and pixels[other] > pixels[one] + SAME_PX


def _are_alike(one: Sequence[OrientedImage], other: Sequence[OrientedImage], off_px: float) -> bool:
    """Whether two readings move no picture by more than ties lie off anyway."""
    moved = [np.linalg.norm(a.rotation - b.rotation, 2) * a.camera.fx for a, b in zip(one, other, strict=True)]
    return bool(max(moved) < max(SAME_PX, off_px))
