"""A block that a scan holds, as JSON: its poses with their covariances, how it moved, and figures for the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cityflow.adjustment.survey_hold import SurveyHeld
from cityflow.core.arrays import FloatArray
from cityflow.core.json_values import rounded
from cityflow.flow.task import Json
from cityflow.geometry.similarity import Similarity
from cityflow.handover.oriented import to_json
from cityflow.handover.refined_block import RefinedPose, decode_poses
from cityflow.handover.registration_file import RegistrationResult, move_figures, upper_of


@dataclass(frozen=True, slots=True)
class HeldBlock:
    """Name → pose in the survey; how the given block moves there, as a registration."""

    poses: Mapping[str, RefinedPose]
    registration: RegistrationResult


def whole_move(found: SurveyHeld, before: Similarity) -> Similarity:
    """From where a block was given to where a scan holds it; `before`: as of `encode_held`."""
    move = found.move
    return Similarity(move.scale * before.scale, move.rotation @ before.rotation, move.moved(before.shift[None])[0])


def encode_held(
    found: SurveyHeld, names: Sequence[str], before: Similarity, origin: FloatArray, *, stays: bool = False
) -> dict[str, Any]:
    """As a tree.

    Parameters
    ----------
    found : in the survey's frame less `origin`
    before : from where the block was given to the frame of `found` before the adjustment
    stays : whether the scan does not contradict where it was given, and `found` is there
    """
    own = whole_move(found, before)
    by = Similarity(own.scale, own.rotation, own.shift + origin)
    middle = found.middle + origin
    images: list[Json] = [
        {**to_json(found.block.image(k, name, origin)), "covariance": list(upper_of(found.covariances[k]))}
        for k, name in enumerate(names)
    ]
    variances = np.einsum("nii->ni", found.covariances)
    held: dict[str, Json] = {
        "patches": [int(v) for v in found.used], "off_m": [rounded(float(v), 4) for v in found.off_m],
        "set_back_m": rounded(found.set_back_m, 4), "scale_free": found.scale_free, "stays": stays,
        "position_sigma_m": rounded(float(np.sqrt(np.mean(np.sum(variances[:, 3:], axis=1)))), 4),
        "angle_sigma_deg": rounded(float(np.degrees(np.sqrt(np.mean(np.sum(variances[:, :3], axis=1))))), 5),
    }  # fmt: skip
    return {
        "images": images, "scale": by.scale, "rotation": by.rotation.tolist(), "shift": by.shift.tolist(), "middle": middle.tolist(),
        "covariance": found.move_covariance.tolist(), "figures": {**move_figures(by, middle, found.move_covariance), "held": held},
    }  # fmt: skip


def decode_held(tree: Mapping[str, Any], before: RegistrationResult) -> HeldBlock:
    """What `encode_held` made; figures of the registration `before` it stay but for those that it has, too."""
    by = Similarity(float(tree["scale"]), np.array(tree["rotation"], np.float64), np.array(tree["shift"], np.float64))
    registration = replace(
        before, similarity=by, middle=np.array(tree["middle"]), covariance=np.array(tree["covariance"]),
        figures={**before.figures, **tree["figures"]},
    )  # fmt: skip
    return HeldBlock(decode_poses(tree), registration)
