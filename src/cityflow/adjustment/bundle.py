"""Bundle adjustment with given poses as observations, whose standard deviations are estimated where nobody knows them.

Variance components (Förstner and Wrobel 2016, §4.2.4) weigh three groups against each other: image coordinates, positions, rotations. So poses that were
exact stay, and poses that were bad follow the images.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field
from scipy.sparse import coo_array, csr_array, eye_array, hstack

from cityflow.adjustment.block import INTERIOR, Block, interior_change, residuals, vector_of
from cityflow.adjustment.control import Control, joined, mark_weights, place_weights, seen_places
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
    least_angle_deg: float = Field(2.0, ge=0, le=30, description="rays of a tie point meet at this angle at least")


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
    held: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Held:
    """Control points that hold a block, and the block near to where they have it.

    Attributes
    ----------
    control : the points;  start : the block, with the tie points
    shift : (3,) of all given positions against the points, metres; None where there are too few points to tell
    """

    control: Control
    start: Block
    shift: FloatArray | None


def adjusted(given: Block, ties: Ties, parameters: AdjustmentParameters, held: Held | None = None) -> Adjusted:
    """Adjust poses and tie points; poses of images without ties stay as given.

    Parameters
    ----------
    given : with the poses that are observations
    held : with the ties of `held.start` only

    Raises
    ------
    ValueError
        No tie points are left, or their equations have no solution.
    """
    if held is None:
        block, ties = _sound(given, ties, parameters)
    else:
        known_xyz = np.where(np.isfinite(held.control.xyz), held.control.xyz, seen_places(held.start, held.control)[0])
        block = replace(held.start, xyz=np.concatenate([held.start.xyz, known_xyz]))
    control, shift = (held.control, held.shift) if held is not None else (None, None)
    footprint = pixel_on_ground(block, joined(ties, control))
    focal = float(np.median([np.sqrt(c.fx * c.fy) for c in block.cameras]))
    known = parameters.position_sigma_m, parameters.angle_sigma_deg
    sigma_px = FIRST_SIGMA_PX
    position = known[0] or FIRST_POSE_PX * footprint
    angle = float(np.radians(known[1])) if known[1] else FIRST_POSE_PX / focal
    covariances = np.zeros((len(block.centres), 6, 6))
    calibrated = bool(parameters.calibrate)
    for number in range(ROUNDS):
        sigmas, count = (position, angle), len(ties.point)
        every = joined(ties, control)
        for _ in range(STEPS):
            left, _ = residuals(block, every)
            weight = np.concatenate(
                [robust_weights(left[:count], ties.sigma, sigma_px), mark_weights(left[count:], every.sigma[count:])]
            )
            prior = _prior(given, block, sigmas, shift, control, calibrated)
            normal = Normal(block, every, left, weight, prior, calibrated=calibrated)
            block, shift = _stepped(block, shift, *normal.step())
        covariances = normal.covariances()
        away = _away(given, block, shift)
        firm = prior.weights[: away.size].reshape(away.shape)
        free = 1.0 - np.einsum("nii->ni", covariances) * firm
        lost = 0.0 if shift is None else 3.0
        redundancy = [max(float(free[:, k : k + 3].sum()) - less, 1e-3) for k, less in ((3, lost), (0, 0.0))]
        spare = max(2 * len(ties.point) - 3 * ties.points - sum(redundancy), 1.0)
        left_of_all = residuals(block, every)[0]
        left = left_of_all[:count]
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
    with_lens = Normal(
        block, every, left_of_all, weight, _prior(given, block, sigmas, shift, control, True), calibrated=True
    )
    lens = slice(6 * len(block.centres), 6 * len(block.centres) + INTERIOR * len(block.cameras))
    interior_sigmas = np.sqrt(np.einsum("kii->ki", with_lens.interior_covariances()))
    return Adjusted(
        replace(block, xyz=block.xyz[: ties.points]), ties, covariances, sigma_px, position, angle, calibrated,
        with_lens.step()[0][lens].reshape(-1, INTERIOR), interior_sigmas,
        np.zeros(3) if shift is None else shift, control.names if control is not None else (),
    )  # fmt: skip


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


def _away(given: Block, block: Block, shift: FloatArray | None) -> FloatArray:
    """(N, 6) the poses less those given: rotation vectors in the camera frames, centres without their common shift."""
    turns = block.rotations @ np.swapaxes(given.rotations, 1, 2)
    moved = block.centres - given.centres - (0.0 if shift is None else shift)
    return np.concatenate([vector_of(turns), moved], axis=1)


def _prior(
    given: Block,
    block: Block,
    sigmas: tuple[float, float],
    shift: FloatArray | None,
    control: Control | None,
    calibrated: bool,
) -> Prior:
    """Given poses, cameras and known places as observations; single poses and places that are far off lose their weight."""
    away = _away(given, block, shift)
    weights = np.empty_like(away)
    for columns, sigma in ((slice(3, 6), sigmas[0]), (slice(0, 3), sigmas[1])):
        normed = np.sum(away[:, columns] ** 2, axis=1) / (3 * sigma**2)
        weights[:, columns] = (1.0 / sigma**2 / np.maximum(normed / 9.0, 1.0))[:, None]
    lens = len(block.cameras) if calibrated else 0
    change = [interior_change(then, now) for now, then in zip(block.cameras[:lens], given.cameras[:lens], strict=True)]
    points, points_away = np.zeros_like(block.xyz), np.zeros_like(block.xyz)
    if control is not None:
        first = len(block.xyz) - len(control.names)
        off = np.where(np.isfinite(control.xyz), block.xyz[first:] - control.xyz, 0.0)
        points[first:], points_away[first:] = place_weights(off, control), off
    return Prior(
        _observed(len(away), lens, shift is not None),
        np.concatenate([weights.reshape(-1), np.tile(1.0 / LENS_SIGMA**2, lens)]),
        np.concatenate([away.reshape(-1), *change]), points, points_away,
    )  # fmt: skip


def _observed(images: int, cameras: int, shifted: bool) -> csr_array:
    """How `_prior`'s observations change with the unknowns: each is one of them, and positions lie off by the shift."""
    own = 6 * images + INTERIOR * cameras
    rows = eye_array(own, format="csr")
    if not shifted:
        return csr_array(rows)
    centre = 6 * np.arange(images)[:, None] + np.arange(3, 6)
    axis = np.tile(np.arange(3), images)
    minus = coo_array((np.full(3 * images, -1.0), (centre.reshape(-1), axis)), shape=(own, 3))
    return csr_array(hstack([rows, minus]))


def _stepped(
    block: Block, shift: FloatArray | None, step: FloatArray, points: FloatArray
) -> tuple[Block, FloatArray | None]:
    poses, lens = 6 * len(block.centres), INTERIOR * len(block.cameras)
    if shift is not None:
        shift, step = shift + step[-3:], step[:-3]
    interior = step[poses:] if len(step) > poses else np.zeros(lens)
    return block.moved(step[:poses].reshape(-1, 6), points, interior.reshape(-1, INTERIOR)), shift
