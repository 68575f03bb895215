"""An adjusted block as JSON: poses with their covariances, cameras, known points, and how good they are."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cityflow.adjustment.block import interior_change, residuals
from cityflow.adjustment.calibration import effect_px, is_doubtful
from cityflow.adjustment.control_residuals import ControlFigures, PointResidual
from cityflow.adjustment.refinement import Refinement
from cityflow.adjustment.tracks import Ties
from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.json_values import rounded
from cityflow.flow.task import Json
from cityflow.handover.oriented import of_json, to_json

UPPER = np.triu_indices(6)


@dataclass(frozen=True, slots=True)
class RefinedPose:
    """An image; `covariance`: (21,) the upper triangle, rows first, of its rotation vector in the camera frame (radians) and centre (metres)."""

    image: OrientedImage
    covariance: tuple[float, ...]


def encode_refinement(found: Refinement) -> tuple[dict[str, Json], dict[str, Json]]:
    """All poses, cameras and known points; and the figures of the whole."""
    block, ties, gain = found.adjusted.block, found.adjusted.ties, found.gain
    left = residuals(block, ties)[0]
    moves = [float(np.linalg.norm(block.centres[k] + found.origin - i.centre)) for k, i in enumerate(found.given)]
    summary: dict[str, Json] = {
        "refined": found.is_taken,
        "better": gain.is_significant,
        "calibrated": found.adjusted.calibrated,
        "cameras_doubtful": not found.adjusted.calibrated and is_doubtful(found.adjusted),
        "images": len(found.images),
        "tie_points": ties.points,
        "observations": len(ties.point),
        "track_lengths": np.bincount(ties.lengths).tolist(),
        "check_before_px": rounded(gain.before_px, 4), "check_after_px": rounded(gain.after_px, 4),
        "error_of_given_poses_px": rounded(gain.error_px, 4), "score": rounded(gain.score, 2),
        "reprojection_px": rounded(float(np.sqrt(np.mean(left**2))), 4),
        "sigma_px": rounded(found.adjusted.sigma_px, 4),
        "position_sigma_m": rounded(found.adjusted.position_sigma_m, 5),
        "angle_sigma_deg": rounded(float(np.degrees(found.adjusted.angle_sigma_rad)), 6),
        "median_move_m": rounded(float(np.median(moves)), 4),
        "weak": list(found.weak),
    }  # fmt: skip
    if found.control is not None:
        summary["control"] = _control(found.control)
    return {"images": _images(found, left), "cameras": _cameras(found)}, summary


def _images(found: Refinement, left: FloatArray) -> list[Json]:
    ties = found.adjusted.ties
    squares = np.bincount(ties.image, np.sum(left**2, axis=1), minlength=len(found.images))
    each = np.sqrt(squares / np.maximum(2 * found.observations, 1))
    sigmas = np.sqrt(np.einsum("nii->ni", found.covariances))
    return [
        {
            **to_json(image),
            "covariance": [float(v) for v in found.covariances[k][UPPER]],
            "position_sigmas_m": [rounded(float(v), 4) for v in sigmas[k, 3:]],
            "angle_sigmas_deg": [rounded(float(np.degrees(v)), 5) for v in sigmas[k, :3]],
            "sigma_px": rounded(float(found.sigma_px[k]), 3),
            "observations": int(found.observations[k]),
            "reprojection_px": rounded(float(each[k]), 4),
        }
        for k, image in enumerate(found.images)
    ]  # fmt: skip


def _cameras(found: Refinement) -> list[Json]:
    """As given and as adjusted, with standard deviations of focal length and principal point in pixels; of cameras that were held, what the ties say."""
    block, adjusted = found.adjusted.block, found.adjusted
    rows: list[Json] = []
    for k, camera in enumerate(block.cameras):
        mine = np.flatnonzero(block.camera == k)
        first = found.given[int(mine[0])]
        change = interior_change(first.camera, camera) if adjusted.calibrated else adjusted.interior_step[k]
        rows.append(
            {
                "head": first.head, "images": len(mine), "given": _interior(first.camera), "adjusted": _interior(camera),
                "focal_change_percent": rounded(float(change[0]) * 100, 4),
                "focal_sigma_percent": rounded(float(adjusted.interior_sigmas[k, 0]) * 100, 4),
                "principal_sigma_px": [rounded(float(v) * camera.fx, 3) for v in adjusted.interior_sigmas[k, 1:3]],
                "corner_change_px": rounded(effect_px(first.camera, change), 3),
            }
        )  # fmt: skip
    return rows


def _interior(camera: Camera) -> dict[str, Json]:
    return {
        "fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy, "distortion": list(camera.distortion), "kind": camera.kind
    }  # fmt: skip


def _control(figures: ControlFigures) -> dict[str, Json]:
    rms = {}
    for name, holds in (("control", True), ("check", False)):
        found = figures.rms(holds=holds)
        rms[f"{name}_rms_m"] = None if found is None else [rounded(v, 4) for v in found]
    return {
        **rms,
        "shift_of_given_positions_m": [rounded(float(v), 4) for v in figures.shift] if figures.shift_known else None,
        "points": [_point(p) for p in figures.points],
    }


def _point(point: PointResidual) -> dict[str, Json]:
    row: dict[str, Json] = {
        "name": point.name, "role": "control" if point.holds else "check", "used": point.used, "marks": point.marks,
        "off_m": [rounded(float(v), 4) for v in point.off], "sigmas_m": [rounded(float(v), 4) for v in point.sigmas],
        "mark_px": rounded(point.mark_px, 3),
    }  # fmt: skip
    return row | ({"problem": point.problem, "remedy": point.remedy} if point.problem else {})


def encode_points(found: Refinement) -> bytes:
    """(P, 5) float64 as numpy's file: tie points in world metres, how many images show each, and its reprojection error in pixels (root mean square)."""
    ties = found.adjusted.ties
    squares = np.sum(residuals(found.adjusted.block, ties)[0] ** 2, axis=1)
    errors = np.sqrt(np.bincount(ties.point, squares, minlength=ties.points) / np.maximum(ties.lengths, 1))
    data = io.BytesIO()
    np.save(data, np.column_stack([found.xyz, ties.lengths, errors]), allow_pickle=False)
    return data.getvalue()


def decode_points(data: bytes) -> FloatArray:
    """What `encode_points` wrote; (P, 4), without errors, by an older version."""
    return np.asarray(np.load(io.BytesIO(data), allow_pickle=False), np.float64)


def encode_block_ties(found: Refinement) -> bytes:
    """(M, 5) float64 as numpy's file: of each observation that was used, numbers of its tie point and image, image coordinates in pixels, and `Ties.sigma`."""
    ties = found.adjusted.ties
    data = io.BytesIO()
    np.save(data, np.column_stack([ties.point, ties.image, ties.uv, ties.sigma]), allow_pickle=False)
    return data.getvalue()


def decode_block_ties(data: bytes) -> Ties:
    """What `encode_block_ties` wrote."""
    table = np.asarray(np.load(io.BytesIO(data), allow_pickle=False), np.float64)
    whole = table[:, :2].astype(np.int64)
    return Ties(whole[:, 0], whole[:, 1], np.full(len(table), -1), table[:, 2:4], table[:, 4])


def decode_poses(tree: Mapping[str, Any]) -> dict[str, RefinedPose]:
    """Name → pose, of what `encode_refinement` wrote."""
    return {
        one["name"]: RefinedPose(of_json(one), tuple(float(v) for v in one["covariance"])) for one in tree["images"]
    }
