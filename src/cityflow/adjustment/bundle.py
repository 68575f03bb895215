"""Bundle adjustment with given poses as observations, whose standard deviations are estimated where nobody knows them.

Variance components (Förstner and Wrobel 2016, §4.2.4) weigh three groups against each other: image coordinates, positions, rotations. So poses that were
exact stay, and poses that were bad follow the images.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field

from cityflow.adjustment.block import INTERIOR, Block, interior_change, residuals, vector_of
from cityflow.adjustment.normal_equations import Normal, Prior
from cityflow.adjustment.tracks import Ties
from cityflow.adjustment.triangulation import robust_weights, triangulated, well_placed
from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.parameters import Parameters

FIRST_SIGMA_PX = 0.5
"""Of image coordinates, before they are known; set by hand, as are those below."""
FIRST_POSE_PX = 2.0
"""What poses may be off in the images, before that is known."""
LEAST_POSE_PX = 0.005
"""No pose is held more firmly than this, in the images."""
REJECTED = 4.0
"""Observations with larger residuals are left out, in standard deviations."""
GROSS_PX = 4.0
"""What is left out before anything is adjusted: further off than this plus four times what most are."""
LENS_SIGMA = np.array([0.01, 0.01, 0.01, 0.1, 0.1, 0.01, 0.01, 0.1])
"""What a given camera may be off where it is calibrated: focal length and principal point (shares of the focal length), distortion."""
ROUNDS, STEPS = 6, 3


class AdjustmentParameters(Parameters):
    """What is known of the poses, and what else is unknown."""

    position_sigma_m: float | None = Field(
        None, gt=0, le=100, description="standard deviation of given positions per axis, metres; null: estimated"
    )
    angle_sigma_deg: float | None = Field(
        None, gt=0, le=30, description="standard deviation of given rotations about each axis, degrees; null: estimated"
    )
    calibrate: bool = Field(False, description="adjust focal length, principal point and distortion of each camera")
    least_angle_deg: float = Field(2.0, ge=0, le=30, description="rays of a tie point meet at this angle at least")


@dataclass(frozen=True, slots=True)
class Adjusted:
    """A block after its adjustment.

    Attributes
    ----------
    block, ties : adjusted; what was left out of the ties is gone
    covariances : (N, 6, 6) rotation vectors in the camera frames (radians), centres (metres)
    sigma_px : of image coordinates;  position_sigma_m, angle_sigma_rad : of given poses
    """

    block: Block
    ties: Ties
    covariances: FloatArray
    sigma_px: float
    position_sigma_m: float
    angle_sigma_rad: float


def adjusted(given: Block, ties: Ties, parameters: AdjustmentParameters) -> Adjusted:
    """Adjust poses and tie points; poses of images without ties stay as given.

    Raises
    ------
    ValueError
        No tie points are left, or their equations have no solution.
    """
    block, ties = _sound(given, ties, parameters)
    footprint = _pixel_on_ground(block, ties)
    focal = float(np.median([np.sqrt(c.fx * c.fy) for c in block.cameras]))
    known = parameters.position_sigma_m, parameters.angle_sigma_deg
    sigma_px = FIRST_SIGMA_PX
    position = known[0] or FIRST_POSE_PX * footprint
    angle = float(np.radians(known[1])) if known[1] else FIRST_POSE_PX / focal
    covariances = np.zeros((len(block.centres), 6, 6))
    for number in range(ROUNDS):
        sigmas = position, angle
        for _ in range(STEPS):
            left, _ = residuals(block, ties)
            weight = robust_weights(left, ties.sigma, sigma_px)
            prior = _prior(given, block, sigmas)
            normal = Normal(block, ties, left, weight, prior, calibrated=parameters.calibrate)
            block = _stepped(block, *normal.step())
        covariances = normal.covariances()
        away = _away(given, block)
        firm = prior.weights[: away.size].reshape(away.shape)
        free = 1.0 - np.einsum("nii->ni", covariances) * firm
        redundancy = [max(float(free[:, k : k + 3].sum()), 1e-3) for k in (3, 0)]
        spare = max(2 * len(ties.point) - 3 * ties.points - sum(redundancy), 1.0)
        left, _ = residuals(block, ties)
        normed = np.abs(left / ties.sigma[:, None])
        sigma_px = 1.4826 * float(np.median(normed)) * float(np.sqrt(2 * len(ties.point) / spare))
        position, angle = (
            float(np.sqrt(np.sum(away[:, k : k + 3] ** 2 * firm[:, k : k + 3] * old**2) / r)) if known is None else old
            for k, r, old, known in zip((3, 0), redundancy, sigmas, known, strict=True)
        )
        position, angle = max(position, LEAST_POSE_PX * footprint), max(angle, LEAST_POSE_PX / focal)
        if number < ROUNDS - 1:
            ties, block = _without(ties, block, np.linalg.norm(left, axis=1) < REJECTED * sigma_px * ties.sigma)
    if not np.isfinite(block.centres).all() or not np.isfinite(sigma_px):
        raise ValueError("the equations of the tie points have no solution")
    return Adjusted(block, ties, covariances, sigma_px, position, angle)


def _sound(given: Block, ties: Ties, parameters: AdjustmentParameters) -> tuple[Block, Ties]:
    """Ties whose rays meet before the cameras and at an angle, without gross errors."""
    for _ in range(2):
        block = triangulated(given, ties)
        left = np.linalg.norm(residuals(block, ties)[0], axis=1)
        fit = left < GROSS_PX + 4.0 * np.median(left) if len(left) else np.zeros(0, bool)
        placed = well_placed(block, ties, float(np.radians(parameters.least_angle_deg)))
        ties = ties.some(fit & placed[ties.point])
        if not ties.points:
            raise ValueError("no tie points are left: the images show nothing in common where their poses have it")
    return triangulated(given, ties), ties


def _without(ties: Ties, block: Block, kept: BoolArray) -> tuple[Ties, Block]:
    enough = np.bincount(ties.point[kept], minlength=ties.points) >= 2
    if not enough.any():
        raise ValueError("no tie points are left: the images contradict one another")
    return ties.some(kept), replace(block, xyz=block.xyz[enough])


def _pixel_on_ground(block: Block, ties: Ties) -> float:
    """What a pixel measures where tie points are, metres, in the median."""
    depth = residuals(block, ties)[1]
    focal = np.array([np.sqrt(c.fx * c.fy) for c in block.cameras])[block.camera[ties.image]]
    return float(np.median(depth / focal))


def _away(given: Block, block: Block) -> FloatArray:
    """(N, 6) the poses less those given: rotation vectors in the camera frames, centres."""
    turns = block.rotations @ np.swapaxes(given.rotations, 1, 2)
    return np.concatenate([vector_of(turns), block.centres - given.centres], axis=1)


def _prior(given: Block, block: Block, sigmas: tuple[float, float]) -> Prior:
    """Given poses as observations; single ones that are far off lose their weight."""
    away = _away(given, block)
    weights = np.empty_like(away)
    for columns, sigma in ((slice(3, 6), sigmas[0]), (slice(0, 3), sigmas[1])):
        normed = np.sum(away[:, columns] ** 2, axis=1) / (3 * sigma**2)
        weights[:, columns] = (1.0 / sigma**2 / np.maximum(normed / 9.0, 1.0))[:, None]
    lens = np.tile(1.0 / LENS_SIGMA**2, len(block.cameras))
    change = np.zeros(INTERIOR * len(block.cameras))
    for k, (now, then) in enumerate(zip(block.cameras, given.cameras, strict=True)):
        change[INTERIOR * k : INTERIOR * (k + 1)] = interior_change(then, now)
    return Prior(np.concatenate([weights.reshape(-1), lens]), np.concatenate([away.reshape(-1), change]))


def _stepped(block: Block, step: FloatArray, points: FloatArray) -> Block:
    poses = 6 * len(block.centres)
    interior = step[poses:].reshape(-1, INTERIOR) if len(step) > poses else np.zeros((len(block.cameras), INTERIOR))
    return block.moved(step[:poses].reshape(-1, 6), points, interior)
