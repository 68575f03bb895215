"""Given poses, refined by tie points where those that were kept out of the adjustment agree better afterwards, and by control points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cityflow.adjustment.block import Block, residuals
from cityflow.adjustment.bundle import Adjusted, AdjustmentParameters, Held, pixel_on_ground
from cityflow.adjustment.calibration import calibrated_if_significant
from cityflow.adjustment.control import Control, control_of
from cityflow.adjustment.control_check import TO_CHECK, Agreement, agreement, placed
from cityflow.adjustment.control_residuals import ControlFigures, point_residuals
from cityflow.adjustment.kept_out_ties import Gain, gained
from cityflow.adjustment.placing import robust_fit
from cityflow.adjustment.tracks import Ties, spread
from cityflow.adjustment.triangulation import triangulated
from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.control_points import ControlPoint

KEPT_OUT = 5
"""Every so many-th tie point is kept out of the adjustment, to judge it; set by hand, as are those below."""
CELLS = 12
"""Of the grid in which the tie points of an image are spread, along its longer side."""
FEW_TIES = 20
"""An image with fewer observations is weak."""
WEAK_PX, WEAKER = 0.5, 2.0
"""And one whose pose stays less certain than this, in its pixels, and so many times less than most: what all share is the place of the block."""
LEAST_TOLERANCE_PX = 5.0
"""Control points may lie off a block that they do not hold yet by this, and three standard deviations of its positions."""


@dataclass(frozen=True, slots=True)
class Refinement:
    """The outcome.

    Attributes
    ----------
    given, images : in the same order, as they were and as they are now: the same where the gain is not significant
    covariances : (N, 6, 6) of `images`: rotation vectors in the camera frames (radians), centres (metres); of poses that stay, what the adjustment says
        of all given ones
    gain : on tie points that were kept out
    adjusted : the block;  origin : (3,) of its coordinates
    observations : (N,) of each image;  sigma_px : (N,) of each pose in its pixels, on the ground
    weak : names of images whose pose the ties do not hold
    control : how far known points lie off; None where there are none
    """

    given: tuple[OrientedImage, ...]
    images: tuple[OrientedImage, ...]
    covariances: FloatArray
    gain: Gain
    adjusted: Adjusted
    origin: FloatArray
    observations: IntArray
    sigma_px: FloatArray
    weak: tuple[str, ...]
    control: ControlFigures | None = None

    @property
    def is_taken(self) -> bool:
        """Whether `images` are the adjusted ones: where ties that were kept out agree better, or control points hold the block."""
        return self.gain.is_significant or bool(self.adjusted.held)

    @property
    def xyz(self) -> FloatArray:
        """(P, 3) tie points, world metres."""
        return self.adjusted.block.xyz + self.origin


def refined(
    images: Sequence[OrientedImage], ties: Ties, parameters: AdjustmentParameters, points: Sequence[ControlPoint] = ()
) -> Refinement:
    """Refine poses.

    Parameters
    ----------
    points : known points, in the world of the images, whose marks name these

    Raises
    ------
    ValueError
        The ties hold no block, or the control points contradict one another.
    """
    origin = np.asarray(np.round(np.mean([i.centre for i in images], axis=0)), np.float64)
    given = Block.of(images, origin)
    chosen = spread(ties, [(i.camera.width, i.camera.height) for i in images], CELLS)
    out = np.arange(chosen.points) % KEPT_OUT == KEPT_OUT - 1
    kept_out = chosen.of_points(out)
    found = calibrated_if_significant(given, chosen.of_points(~out), kept_out, parameters)
    names = [i.name for i in images]
    figures = None
    if points:
        control = control_of(points, {name: k for k, name in enumerate(names)}, origin)
        agreed = agreement(control, found.block, _tolerance_m(found))
        found, shift_known = _held(given, found, kept_out, parameters, control, agreed)
        residual = point_residuals(control, agreed.good, found.block, agreed.doubts, names)
        figures = ControlFigures(residual, found.shift, shift_known)
    elif found.calibrated and parameters.position_sigma_m is None:
        found = replace(found, block=on_given_ground(found.block, found.ties, given))
    gain = gained(given, found.block, kept_out)
    observations = np.bincount(found.ties.image, minlength=len(images))
    sigma = in_pixels(found)
    weak = weak_images(names, observations, sigma)
    poses, covariances = tuple(images), found.covariances
    if gain.is_significant or found.held:
        poses = tuple(found.block.image(k, name, origin) for k, name in enumerate(names))
    else:
        variances = np.repeat([found.angle_sigma_rad**2, found.position_sigma_m**2], 3)
        covariances = np.broadcast_to(np.diag(variances), covariances.shape)
    return Refinement(tuple(images), poses, covariances, gain, found, origin, observations, sigma, weak, figures)


def on_given_ground(adjusted: Block, ties: Ties, given: Block) -> Block:
    """The adjusted block, moved as a whole so that its tie points lie where the given poses have them: shifted, turned and scaled, robustly.

    Images alone hardly tell a principal point from a common tilt of cameras and ground, nor from a shift of one against the other. Outlines and control
    points that the given poses were adjusted to belong to the ground. Where it all moves by less than a pixel on the ground, it stays: no outline shows that.
    """
    pixel_m = pixel_on_ground(adjusted, ties)
    try:
        moved = placed(adjusted, robust_fit(adjusted.xyz, triangulated(given, ties).xyz, pixel_m).similarity)
    except ValueError:
        return adjusted
    if np.median(np.linalg.norm(moved.xyz - adjusted.xyz, axis=1)) < pixel_m:
        return adjusted
    return moved


def weak_images(names: Sequence[str], observations: IntArray, sigma_px: FloatArray) -> tuple[str, ...]:
    """Images that few observations hold, or whose poses are clearly less certain than most.

    Parameters
    ----------
    observations, sigma_px : (N,) as in `Refinement`
    """
    own = (observations < FEW_TIES) | (sigma_px > max(WEAK_PX, WEAKER * float(np.median(sigma_px))))
    return tuple(n for n, is_weak in zip(names, own, strict=True) if is_weak)


def _tolerance_m(found: Adjusted) -> float:
    return LEAST_TOLERANCE_PX * pixel_on_ground(found.block, found.ties) + 3.0 * found.position_sigma_m


def _held(
    given: Block, found: Adjusted, kept_out: Ties, parameters: AdjustmentParameters, control: Control, agreed: Agreement
) -> tuple[Adjusted, bool]:
    """The block, held by the control points that agree; whether these are enough to tell the shift of all given positions."""
    which = control.holds & agreed.good
    if not which.any():
        return found, False
    enough = int((which & np.isfinite(control.xyz).all(axis=1)).sum()) >= TO_CHECK
    start = placed(found.block, agreed.similarity) if enough else found.block
    shift = np.mean(start.centres - given.centres, axis=0) if enough else None
    chosen = parameters.model_copy(update={"calibrate": True}) if found.calibrated else parameters
    held = Held(control.of_points(which), start, shift)
    return calibrated_if_significant(given, found.ties, kept_out, chosen, held), enough


def in_pixels(found: Adjusted) -> FloatArray:
    """(N,) what the uncertainty of a pose moves its picture by: across the axis, at the depth of its ties, pixels."""
    block, ties = found.block, found.ties
    depth = residuals(block, ties)[1]
    result = np.full(len(block.centres), np.inf)
    for k in np.unique(ties.image).tolist():
        camera = block.cameras[block.camera[k]]
        d = float(np.median(depth[ties.image == k]))
        turn, move = np.zeros((2, 3)), block.rotations[k][:2] / d
        turn[0, 1], turn[1, 0] = 1.0, -1.0
        slope = np.concatenate([turn, -move], axis=1) * np.sqrt(camera.fx * camera.fy)
        result[k] = float(np.sqrt(np.trace(slope @ found.covariances[k] @ slope.T) / 2))
    return result
