"""A registration as JSON: the similarity, how sure it is, and figures for the report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cityflow.adjustment.block import vector_of
from cityflow.adjustment.registration import Registration
from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.json_values import rounded
from cityflow.flow.task import Json
from cityflow.geometry.similarity import Similarity

UPPER = np.triu_indices(6)


@dataclass(frozen=True, slots=True)
class RegistrationResult:
    """What a registration found.

    Attributes
    ----------
    similarity : from where the block had its points to the survey
    middle : (3,) of the points after it;  covariance : (7, 7) of the shift of that (metres), rotation about it (radians), share of scale
    figures : for the report
    """

    similarity: Similarity
    middle: FloatArray
    covariance: FloatArray
    figures: Mapping[str, Any]

    def covariance_of(self, image: OrientedImage, own: FloatArray) -> FloatArray:
        """(6, 6) of a moved image, rotation vector in the camera frame and centre: its own in the block, and the block's.

        Parameters
        ----------
        own : (6, 6) before the move
        """
        turn = np.eye(6)
        turn[3:, 3:] = self.similarity.scale * self.similarity.rotation
        off = image.centre - self.middle
        change = np.zeros((6, 7))
        change[:3, 3:6] = -image.rotation
        change[3:, :3] = np.eye(3)
        change[3:, 3:6] = np.array([[0.0, off[2], -off[1]], [-off[2], 0.0, off[0]], [off[1], -off[0], 0.0]])
        change[3:, 6] = off
        return np.asarray(turn @ own @ turn.T + change @ self.covariance @ change.T)


def encode_registration(found: Registration, origin: FloatArray, place: FloatArray) -> dict[str, Any]:
    """As a tree.

    Parameters
    ----------
    found : of points less `origin` to a survey less `place`
    """
    by, fit = found.similarity, found.fit
    shift = by.shift + place - by.scale * by.rotation @ origin
    whole = Similarity(by.scale, by.rotation, shift)
    middle = fit.middle + place
    figures = {
        **move_figures(whole, middle, fit.covariance),
        "matched": int(fit.matched.sum()), "distance_m": rounded(fit.sigma_m, 4), "overlap": rounded(found.overlap, 4),
        "raised": found.raised, "agreement": rounded(found.agreement, 4), "second": rounded(found.second, 4),
        "correlation": rounded(found.coarse, 4), "open_m": rounded(float(fit.openness_m[0]), 4),
    }  # fmt: skip
    return {
        "scale": whole.scale, "rotation": whole.rotation.tolist(), "shift": whole.shift.tolist(), "middle": middle.tolist(),
        "covariance": fit.covariance.tolist(), "figures": figures,
    }  # fmt: skip


def move_figures(by: Similarity, middle: FloatArray, covariance: FloatArray) -> dict[str, Json]:
    """How a block moves, at a (3,) place where it is afterwards, and how surely; `covariance` as of `RegistrationResult`."""
    before = np.linalg.solve(by.scale * by.rotation, middle - by.shift)
    sigmas = np.sqrt(np.diag(covariance))
    angle = np.degrees(np.linalg.norm(vector_of(by.rotation[None])))
    return {
        "shift_m": [rounded(float(v), 4) for v in middle - before],
        "turn_deg": rounded(float(angle), 5), "scale": rounded(by.scale, 7),
        "shift_sigmas_m": [rounded(float(v), 4) for v in sigmas[:3]],
        "turn_sigmas_deg": [rounded(float(np.degrees(v)), 5) for v in sigmas[3:6]], "scale_sigma": rounded(float(sigmas[6]), 7),
    }  # fmt: skip


def decode_registration(tree: Mapping[str, Any]) -> RegistrationResult:
    """What `encode_registration` made."""
    by = Similarity(float(tree["scale"]), np.array(tree["rotation"], np.float64), np.array(tree["shift"], np.float64))
    return RegistrationResult(by, np.array(tree["middle"]), np.array(tree["covariance"]), dict(tree["figures"]))


def upper_of(full: FloatArray) -> tuple[float, ...]:
    """(21,) of a (6, 6) matrix, as a catalog has it."""
    return tuple(float(v) for v in full[UPPER])


def covariance_matrix(upper: tuple[float, ...]) -> FloatArray:
    """(6, 6) of the (21,) upper triangle, rows first, as a catalog has it."""
    full = np.zeros((6, 6))
    full[UPPER] = upper
    return np.asarray(full + np.triu(full, 1).T)
