"""A mapped block, adjusted with GNSS positions and control points as observations: what a similarity cannot undo, bends above all, goes.

Rotations are free, as the mapping knows them no better than the ties do. Positions have standard deviations of their own; by how much these are too small or
too large is estimated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cityflow.adjustment.block import Block, residuals
from cityflow.adjustment.bundle import Adjusted, AdjustmentParameters, Held, adjusted, sound
from cityflow.adjustment.control import Control, control_of
from cityflow.adjustment.control_check import TO_CHECK, Doubt
from cityflow.adjustment.control_residuals import ControlFigures, point_residuals
from cityflow.adjustment.given_poses import LENS_SIGMA, Exactness
from cityflow.adjustment.kept_out_ties import gained
from cityflow.adjustment.mounts import Mounts, mounts_of
from cityflow.adjustment.refinement import CELLS, KEPT_OUT, Refinement, in_pixels, weak_images
from cityflow.adjustment.tracks import Ties, spread
from cityflow.adjustment.triangulation import triangulated
from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.control_points import ControlPoint

PLAIN_M, VERTICAL = 2.0, 1.5
"""Of a position whose standard deviations are not stated: what a plain receiver reaches in plan, and how much worse its heights are (a rule of thumb)."""
FEW_POSITIONS = 10
"""Fewer do not tell how exact they are: what is stated holds; set by hand, as are those below."""
OPEN_FOCAL = 0.005
"""A focal length that is less certain than this share is held."""
HELD_SIGMA = 1e-7
"""Of what is held."""
ROLL_SIGMA_DEG = 1.0
"""Of rotations where positions on one line leave the roll about it to gimbal angles or to level ground."""
SURE_ARM, LEAST_ARM_M, FEW_ON_ARM = 5.0, 0.02, 8
"""An antenna's arm is an unknown where it is off by so many standard deviations and so far, for heads with so many positions."""
RIDGE = 1e-3
"""Added to the normal equations of an arm: a thousandth of what one position adds."""
LIKELY = 1.0
"""Heads are held by their mount where ties that were kept out fit better by so many standard deviations: that a mount is firm is what one expects."""
WORSE = 1.1
"""Tie points that were kept out may fit the adjusted block worse than the mapped one by this factor; beyond it contradicts the images."""
FAR_OFF = 5.0
"""A position further off than so many standard deviations is named."""


@dataclass(frozen=True, slots=True, eq=False)
class Positions:
    """GNSS positions of the images of a block.

    Attributes
    ----------
    xyz : (N, 3) world metres; NaN where none is known or it is not used
    sigmas_m : (N, 3) standard deviations as stated; NaN where they are not
    arm : (3,) metres from the projection centre to the antenna in the frame of the camera (x right in the picture, y down, z ahead); None: not given
    on_line : whether they lie on one line
    stations : of the images, None where it is not known; images of one station were taken together by heads on one mount; empty: none is known
    """

    xyz: FloatArray
    sigmas_m: FloatArray
    arm: FloatArray | None = None
    on_line: bool = False
    stations: tuple[int | None, ...] = ()

    @property
    def known(self) -> BoolArray:
        """(N,) which images have one."""
        return np.asarray(np.isfinite(self.xyz).all(axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class Georeferenced:
    """The outcome.

    Attributes
    ----------
    refinement : images, covariances and figures; `is_taken` of it does not matter here
    is_taken : whether the images are the adjusted ones: not where these contradict ties that were kept out
    held_focals : numbers of the block's cameras whose focal length the scene leaves open
    used : (N,) which images' positions were observations;  far : names of those that are far off
    xyz : (P, 3) all tie points, world metres;  lengths : (P,) images that show each;  errors_px : (P,) mean reprojection error of each
    mounts : what holds heads of one station together; None: nothing does, or tie points that were kept out do not fit better with it
    """

    refinement: Refinement
    is_taken: bool
    held_focals: tuple[int, ...]
    used: BoolArray
    far: tuple[str, ...]
    xyz: FloatArray
    lengths: IntArray
    errors_px: FloatArray
    mounts: Mounts | None


def georeferenced(
    images: Sequence[OrientedImage],
    ties: Ties,
    positions: Positions,
    points: Sequence[ControlPoint] = (),
    wrong: Mapping[str, str] | None = None,
) -> Georeferenced:
    """Adjust a block that a similarity has placed.

    Parameters
    ----------
    images : placed; images of one head have one camera
    ties : of the mapping
    points : control and check points, whose marks name the images
    wrong : names of points that are not used → why

    Raises
    ------
    ValueError
        The ties hold no block, or neither positions nor control points do.
    """
    origin = np.asarray(np.round(np.mean([i.centre for i in images], axis=0)), np.float64)
    block = Block.of(images, origin)
    parameters = AdjustmentParameters(calibrate=True, least_angle_deg=1.0)
    chosen = spread(ties, [(i.camera.width, i.camera.height) for i in images], CELLS)
    out = np.arange(chosen.points) % KEPT_OUT == KEPT_OUT - 1
    kept_out = chosen.of_points(out)
    start, used_ties = sound(block, chosen.of_points(~out), parameters)
    names = [i.name for i in images]
    control = control_of(points, {name: k for k, name in enumerate(names)}, origin)
    good = np.array([name not in (wrong or {}) for name in control.names], bool)
    holding = control.of_points(control.holds & good) if (control.holds & good).any() else None
    if holding is None and not positions.known.any():
        raise ValueError("neither positions nor control points hold the block")
    given, exact, parameters = _observed(block, positions, origin, parameters)
    held = Held(holding, start, _first_shift(given, start, positions, holding))
    found, open_ones = _calibrated(given, used_ties, parameters, held, exact)
    if positions.arm is None and (arms := _arms(given, found, exact)) is not None:
        other = _again(given, found, parameters, held, _holding(replace(exact, arms=arms, arms_open=True), open_ones))
        found = other if _are_sure(other.arms, other.arm_sigmas).any() else found
    if (mounts := mounts_of(found.block, found.covariances, positions.stations)) is not None:
        mounted = replace(
            exact, positions=_of_stations(exact.positions, mounts), arms=found.arms,
            arms_open=bool(found.arm_sigmas.any()), mounts=mounts,
        )  # fmt: skip
        together = _again(given, found, parameters, held, _holding(mounted, open_ones))
        better = gained(found.block, together.block, kept_out)
        mounts = mounts if better.after_px < better.before_px and better.score >= LIKELY else None
        # arms of heads whose positions do not count twice stay as they were found
        sure = np.minimum(together.arm_sigmas, found.arm_sigmas)
        found = replace(together, arm_sigmas=sure) if mounts is not None else found
    gain = gained(block, found.block, kept_out)
    taken = gain.after_px <= WORSE * gain.before_px
    doubts = [Doubt(n, why, "correct it") for n, why in sorted((wrong or {}).items()) if n in control.names]
    figures = None
    if control.names:
        residual = point_residuals(control, good, found.block, doubts, names)
        figures = ControlFigures(residual, found.shift, held.shift is not None)
    observations = np.bincount(found.ties.image, minlength=len(images))
    sigma = in_pixels(found)
    weak = weak_images(names, observations, sigma)
    poses = tuple(found.block.image(k, name, origin) for k, name in enumerate(names)) if taken else tuple(images)
    refinement = Refinement(
        tuple(images), poses, found.covariances, gain, found, origin, observations, sigma, weak, figures
    )
    normed = np.abs(found.away[:, 3:]) / (found.position_sigma_m * exact.positions)
    far = tuple(n for n, off in zip(names, normed.max(axis=1), strict=True) if off > FAR_OFF)
    every = triangulated(found.block if taken else block, ties)
    errors = np.bincount(ties.point, np.linalg.norm(residuals(every, ties)[0], axis=1)) / ties.lengths
    return Georeferenced(
        refinement, taken, open_ones, positions.known, far, every.xyz + origin, ties.lengths, errors, mounts
    )


def _observed(
    block: Block, positions: Positions, origin: FloatArray, parameters: AdjustmentParameters
) -> tuple[Block, Exactness, AdjustmentParameters]:
    """Positions in the place of centres; how exact they are among themselves, and what of that is known."""
    known = positions.known
    stated = np.isfinite(positions.sigmas_m).all(axis=1) & known
    sigmas = np.where(stated[:, None], positions.sigmas_m, PLAIN_M * np.array([1.0, 1.0, VERTICAL]))
    middle = float(np.median(sigmas[known, :2])) if known.any() else PLAIN_M
    relative = np.where(known[:, None], np.maximum(sigmas, 1e-3) / middle, np.inf)
    cameras = len(block.cameras)
    arm = np.zeros(3) if positions.arm is None else positions.arm
    angles = np.full(len(known), 1.0 if positions.on_line else np.inf)
    exact = Exactness(relative, angles, np.tile(LENS_SIGMA, (cameras, 1)), np.tile(arm, (cameras, 1)), start_m=middle)
    fixed: dict[str, float] = {"angle_sigma_deg": ROLL_SIGMA_DEG}
    if known.sum() < FEW_POSITIONS:
        fixed["position_sigma_m"] = middle
    centres = np.where(known[:, None], positions.xyz - origin, block.centres)
    return replace(block, centres=centres), exact, parameters.model_copy(update=fixed)


def _of_stations(positions: FloatArray, mounts: Mounts) -> FloatArray:
    """(N, 3) standard deviations, infinite for heads that a mount ties to one whose position counts: a station has one antenna, and one error of it."""
    held, by = mounts.images.T
    counts = np.isfinite(positions[by]).all(axis=1)
    result = positions.copy()
    result[held[counts]] = np.inf
    return result


def _first_shift(given: Block, start: Block, positions: Positions, holding: Control | None) -> FloatArray | None:
    """Of all positions against the control points, where there are enough of both."""
    if holding is None or positions.known.sum() < TO_CHECK:
        return None
    if int(np.isfinite(holding.xyz).all(axis=1).sum()) < TO_CHECK:
        return None
    return np.asarray(np.median((start.centres - given.centres)[positions.known], axis=0))


def _calibrated(
    given: Block, ties: Ties, parameters: AdjustmentParameters, held: Held, exact: Exactness
) -> tuple[Adjusted, tuple[int, ...]]:
    """The adjusted block; focal lengths that stay open are held, and their cameras' numbers are told."""
    found = adjusted(given, ties, parameters, held, exact)
    open_ones = tuple(np.flatnonzero(found.interior_sigmas[:, 0] > OPEN_FOCAL).tolist())
    if not open_ones:
        return found, ()
    return adjusted(given, ties, parameters, held, _holding(exact, open_ones)), open_ones


def _holding(exact: Exactness, cameras: Sequence[int]) -> Exactness:
    lens = exact.lens.copy()
    lens[list(cameras), 0] = HELD_SIGMA
    return replace(exact, lens=lens)


def _again(given: Block, found: Adjusted, parameters: AdjustmentParameters, held: Held, exact: Exactness) -> Adjusted:
    """Once more from where the block is."""
    start = Held(held.control, found.block, None if held.shift is None else found.shift)
    return adjusted(given, found.ties, parameters, start, exact)


def _arms(given: Block, found: Adjusted, exact: Exactness) -> FloatArray | None:
    """(K, 3) arms that residuals of positions tell, where any is significant; those of other heads are zeros."""
    arms, sigmas = np.zeros_like(exact.arms), np.full(exact.arms.shape, np.inf)
    known = np.isfinite(exact.positions).all(axis=1)
    for k in range(len(given.cameras)):
        mine = np.flatnonzero((given.camera == k) & known)
        if len(mine) < FEW_ON_ARM:
            continue
        # places of antennas less projection centres turn with the camera, a common shift does not
        back = np.swapaxes(found.block.rotations[mine], 1, 2)
        weight = 1.0 / exact.positions[mine]
        rows = np.concatenate([back, np.broadcast_to(np.eye(3), back.shape)], axis=2) * weight[:, :, None]
        rows, right = rows.reshape(-1, 6), (-found.away[mine, 3:] * weight).reshape(-1)
        # what turns of the cameras do not tell apart stays near zero
        inverse = np.linalg.inv(rows.T @ rows + RIDGE * np.eye(6))
        fitted = inverse @ (rows.T @ right)
        spare = len(right) - rows.shape[1]
        arms[k] = fitted[:3]
        sigmas[k] = np.sqrt(np.sum((right - rows @ fitted) ** 2) / spare * np.diagonal(inverse)[:3])
    sure = _are_sure(arms, sigmas)
    return arms if sure.any() else None


def _are_sure(arms: FloatArray, sigmas: FloatArray) -> BoolArray:
    """(K,) which heads have a significant arm."""
    return np.asarray(((np.abs(arms) > SURE_ARM * sigmas) & (np.abs(arms) > LEAST_ARM_M)).any(axis=1))
