"""An adjusted block as JSON: poses with their covariances, cameras, and how good they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cityflow.adjustment.block import residuals
from cityflow.adjustment.refinement import Refinement
from cityflow.core.camera import OrientedImage
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
    """All poses; and the figures of the whole."""
    block, ties, gain = found.adjusted.block, found.adjusted.ties, found.gain
    left = residuals(block, ties)[0]
    squares = np.bincount(ties.image, np.sum(left**2, axis=1), minlength=len(found.images))
    each = np.sqrt(squares / np.maximum(2 * found.observations, 1))
    moves = [float(np.linalg.norm(block.centres[k] + found.origin - i.centre)) for k, i in enumerate(found.given)]
    summary: dict[str, Json] = {
        "refined": gain.is_significant,
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
    poses = [
        {
            **to_json(image),
            "covariance": [float(v) for v in found.covariances[k][UPPER]],
            "observations": int(found.observations[k]),
            "reprojection_px": rounded(float(each[k]), 4),
        }
        for k, image in enumerate(found.images)
    ]
    return {"images": poses}, summary


def decode_poses(tree: Mapping[str, Any]) -> dict[str, RefinedPose]:
    """Name → pose, of what `encode_refinement` wrote."""
    return {
        one["name"]: RefinedPose(of_json(one), tuple(float(v) for v in one["covariance"])) for one in tree["images"]
    }
