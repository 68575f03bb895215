"""Bundle adjustment with given poses as observations, whose standard deviations are estimated where nobody knows them.

Variance components (Förstner and Wrobel 2016, §4.2.4) weigh three groups against each other: image coordinates, positions, rotations. So poses that were
exact stay, and poses that were bad follow the images.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field

from cityflow.adjustment.block import INTERIOR, Block, residuals
from cityflow.adjustment.control import Control, joined, mark_weights, seen_places
from cityflow.adjustment.given_poses import Exactness, Unknowns, prior_of
from cityflow.adjustment.normal_equations import Normal
from cityflow.adjustment.tracks import Ties
from cityflow.adjustment.triangulation import robust_weights, triangulated, well_placed
from cityflow.adjustment.variance_components import Balance, balance, pixel_sigma, redundancy_of, variance_factors
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
ROUNDS, STEPS = 6, 3
"""Rounds, each with weights and standard deviations of the one before, and steps of Gauss and Newton in each; set by hand."""


class AdjustmentParameters(Parameters):
    """What is known of the poses, and what else is unknown."""

    position_sigma_m: float | None = Field(
        None, gt=0, le=100, description="standard deviation of given positions per axis, metres; null: estimated"
    )
    angle_sigma_deg: float | None = Field(
        None, gt=0, le=30, description="standard deviation of given rotations about each axis, degrees; null: estimated"
    )
    calibrate: bool | None = Field(
        None,
        description="adjust focal length, principal point and distortion of each camera; null: where that is significant",
    )
    least_angle_deg: float = Field(2.0, ge=0, le=30, description="least angle between the rays of a tie point, degrees")


@dataclass(frozen=True, slots=True)
class Adjusted:
    """A block after its adjustment.

    Attributes
    ----------
    block, ties : adjusted; what was left out of the ties is gone. Points are those of the ties
    covariances : (N, 6, 6) rotation vectors in the camera frames (radians), centres (metres)
    sigma_px : of image coordinates;  position_sigma_m, angle_sigma_rad : of given poses
    calibrated : whether cameras were adjusted
    interior_step, interior_sigmas : (K, 8) by how much adjusting the cameras changes them yet, see `with_interior`, and how surely: much where they
        were held and should not have been
    shift : (3,) by which all given positions lie off the control points together, metres; zeros where nothing tells
    held : names of the control points that hold the block
    arms, arm_sigmas : (K, 3) places of antennas in the frames of the cameras, metres, see `Exactness`, and how surely they are known: 0 where they are
        no unknowns
    away : (N, 6) the poses less those given, see `Unknowns`
    """

    block: Block
    ties: Ties
    covariances: FloatArray
    sigma_px: float
    position_sigma_m: float
    angle_sigma_rad: float
    calibrated: bool
    interior_step: FloatArray
    interior_sigmas: FloatArray
    shift: FloatArray
    held: tuple[str, ...]
    arms: FloatArray
    arm_sigmas: FloatArray
    away: FloatArray


@dataclass(frozen=True, slots=True)
class Held:
    """Control points that hold a block, and the block near to where they have it.

    Attributes
    ----------
    control : the points; None: given positions alone hold it;  start : the block, with the tie points
    shift : (3,) of all given positions against the points, metres; None where there are too few points to tell
    """

    control: Control | None
    start: Block
    shift: FloatArray | None


def adjusted(
    given: Block,
    ties: Ties,
    parameters: AdjustmentParameters,
    held: Held | None = None,
    exact: Exactness | None = None,
) -> Adjusted:
    """Adjust poses and tie points; poses of images without ties stay as given.

    Parameters
    ----------
    given : with the poses that are observations
    held : with the ties of `held.start` only
    exact : how exact given poses are among themselves; None: alike

    Raises
    ------
    ValueError
        No tie points are left, or their equations have no solution.
    """
    exact = exact or Exactness.alike(given)
    control, shift = (held.control, held.shift) if held is not None else (None, None)
    if held is None:
        block, ties = sound(given, ties, parameters)
    else:
        block = _with_places(held.start, control)
    now = Unknowns(block, shift, exact.arms, exact.mounts)
    footprint = pixel_on_ground(block, joined(ties, control))
    focal = float(np.median([np.sqrt(c.fx * c.fy) for c in block.cameras]))
    known = parameters.position_sigma_m, parameters.angle_sigma_deg
    sigma_px = FIRST_SIGMA_PX
    position = known[0] or exact.start_m or FIRST_POSE_PX * footprint
    angle = float(np.radians(known[1])) if known[1] else FIRST_POSE_PX / focal
    by, kept_poses = Balance(1.0, 1.0), 0.0
    calibrated = bool(parameters.calibrate)
    for number in range(ROUNDS):
        sigmas, count = (position, angle), len(ties.point)
        every = joined(ties, control)
        if number:
            by = balance(residuals(block, ties)[0], ties, sigma_px, kept_poses)
        for _ in range(STEPS):
            left, _ = residuals(block, every)
            weight = np.concatenate(
                [
                    by.weights * robust_weights(left[:count], ties.sigma, sigma_px),
                    mark_weights(left[count:], every.sigma[count:]),
                ]
            )
            left[:count] *= by.residuals
            prior = prior_of(given, now, sigmas, exact, control, calibrated)
            normal = Normal(block, every, left, weight, prior, calibrated=calibrated)
            now = now.stepped(*normal.step(), exact.arms_open)
            block = now.block
        away = now.away(given)
        firm = prior.weights[: away.size].reshape(away.shape)
        lost = (0 if shift is None else 3) + (exact.arms.size if exact.arms_open else 0)
        found = redundancy_of(normal, firm, lost)
        kept_poses = float(found.shares.sum()) + int((firm <= 0).sum())
        left_of_all = residuals(block, every)[0]
        left = left_of_all[:count]
        sigma_px = pixel_sigma(left, ties, kept_poses)
        factors = variance_factors(away, firm, found, np.array([k is None for k in known]))
        position, angle = (
            max(old * float(np.sqrt(factor)), least)
            for old, factor, least in zip(
                sigmas, factors, (LEAST_POSE_PX * footprint, LEAST_POSE_PX / focal), strict=True
            )
        )
        if number < ROUNDS - 1:
            ties, block = _without(ties, block, np.linalg.norm(left, axis=1) < REJECTED * sigma_px * ties.sigma)
            now = replace(now, block=block)
    if not np.isfinite(block.centres).all() or not np.isfinite(sigma_px):
        raise ValueError("the equations of the tie points have no solution")
    left_of_all[:count] *= by.residuals
    with_lens = Normal(
        block, every, left_of_all, weight, prior_of(given, now, sigmas, exact, control, True), calibrated=True
    )
    lens = slice(6 * len(block.centres), 6 * len(block.centres) + INTERIOR * len(block.cameras))
    interior_sigmas = np.sqrt(np.einsum("kii->ki", with_lens.interior_covariances()))
    arm_sigmas = np.zeros_like(now.arms)
    if exact.arms_open:
        last = now.arms.size + (0 if now.mounts is None else now.mounts.unknowns)
        arm_sigmas = np.sqrt(np.diagonal(normal.last_covariance(last))[: now.arms.size]).reshape(-1, 3)
    return Adjusted(
        replace(block, xyz=block.xyz[: ties.points]), ties, found.covariances, sigma_px, position, angle, calibrated,
        with_lens.step()[0][lens].reshape(-1, INTERIOR), interior_sigmas,
        np.zeros(3) if now.shift is None else now.shift, control.names if control is not None else (),
        now.arms, arm_sigmas, away,
    )  # fmt: skip


def _with_places(start: Block, control: Control | None) -> Block:
    """The block with known points behind its tie points."""
    if control is None:
        return start
    known = np.where(np.isfinite(control.xyz), control.xyz, seen_places(start, control)[0])
    return replace(start, xyz=np.concatenate([start.xyz, known]))


def sound(given: Block, ties: Ties, parameters: AdjustmentParameters) -> tuple[Block, Ties]:
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
    """Points beyond those of the ties are known ones, and stay."""
    enough = np.bincount(ties.point[kept], minlength=ties.points) >= 2
    if not enough.any():
        raise ValueError("no tie points are left: the images contradict one another")
    others = np.ones(len(block.xyz) - ties.points, bool)
    return ties.some(kept), replace(block, xyz=block.xyz[np.concatenate([enough, others])])


def pixel_on_ground(block: Block, ties: Ties) -> float:
    """What a pixel measures where tie points are, metres, in the median."""
    depth = residuals(block, ties)[1]
    focal = np.array([np.sqrt(c.fx * c.fy) for c in block.cameras])[block.camera[ties.image]]
    return float(np.median(depth / focal))
