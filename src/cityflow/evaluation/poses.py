"""Orientations against true ones: projection centres, rotations, cameras."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.geometry.similarity import similarity_between


@dataclass(frozen=True, slots=True)
class PoseFigures:
    """Differences of found from true poses.

    Attributes
    ----------
    images : that both have;  missing : true ones that were not found
    centre_rmse_m, centre_median_m : distances of centres in space;  plan_rmse_m, height_rmse_m : in plan, and in height
    angle_rmse_deg, angle_median_deg : of the rotation between both
    scale : of the similarity that the found ones were moved by; 1 without one
    focal_percent : greatest difference of focal lengths, percent of the true one;  principal_px : greatest distance of principal points
    """

    images: int
    missing: int
    centre_rmse_m: float
    centre_median_m: float
    plan_rmse_m: float
    height_rmse_m: float
    angle_rmse_deg: float
    angle_median_deg: float
    scale: float
    focal_percent: float
    principal_px: float


def pose_figures(
    found: Sequence[OrientedImage], truth: Sequence[OrientedImage], with_similarity: bool = False
) -> PoseFigures:
    """Compare images by name.

    Parameters
    ----------
    found, truth : world metres; images that only `found` has are not looked at
    with_similarity : move the found ones onto the true centres first (seven parameters), as befits a frame of its own

    Raises
    ------
    ValueError
        No image is in both; or a similarity is asked for, and the centres determine none.
    """
    by_name = {i.name: i for i in found}
    pairs = [(by_name[t.name], t) for t in truth if t.name in by_name]
    if not pairs:
        raise ValueError("no image is in both orientations")
    true = [t for _, t in pairs]
    moved, scale = [f for f, _ in pairs], 1.0
    if with_similarity:
        moved, scale = _aligned(moved, true)
    off = np.array([f.centre - t.centre for f, t in zip(moved, true, strict=True)])
    angle = np.array([angle_deg(f.rotation, t.rotation) for f, t in zip(moved, true, strict=True)])
    distance = np.linalg.norm(off, axis=1)
    interior = np.array([_interior(f.camera, t.camera) for f, t in zip(moved, true, strict=True)])
    return PoseFigures(
        len(pairs), len(truth) - len(pairs), _rms(distance), float(np.median(distance)), _rms(np.hypot(off[:, 0], off[:, 1])),
        _rms(off[:, 2]), _rms(angle), float(np.median(angle)), scale, *interior.max(axis=0).tolist(),
    )  # fmt: skip


def angle_deg(a: FloatArray, b: FloatArray) -> float:
    """Angle of the rotation between two (3, 3) rotations, degrees; exact for small ones."""
    sine = float(np.linalg.norm(a - b)) / np.sqrt(8.0)
    return float(np.degrees(2.0 * np.arcsin(min(sine, 1.0))))


def _aligned(found: Sequence[OrientedImage], true: Sequence[OrientedImage]) -> tuple[list[OrientedImage], float]:
    move = similarity_between(np.array([f.centre for f in found]), np.array([t.centre for t in true]))
    return [move.moved_image(f) for f in found], move.scale


def _interior(found: Camera, true: Camera) -> tuple[float, float]:
    """Difference of the focal lengths in percent, and distance of the principal points in pixels."""
    focal = max(abs(found.fx / true.fx - 1.0), abs(found.fy / true.fy - 1.0))
    return 100.0 * focal, float(np.hypot(found.cx - true.cx, found.cy - true.cy))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
