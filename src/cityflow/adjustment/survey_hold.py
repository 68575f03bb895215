"""A block held by a scan: images, given poses and planes of the scan in one adjustment (hybrid orientation, Glira, Pfeifer and Mandlburger 2019).

Given poses are observations up to one move of all of them (shift, rotation; size, too, where the scan contradicts theirs), so that a block keeps its
inner shape where no scan is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array, csr_array

from cityflow.adjustment.block import Block, residuals, rotation_of, slopes, vector_of
from cityflow.adjustment.normal_equations import Normal, Prior
from cityflow.adjustment.point_to_plane import spread_about_zero
from cityflow.adjustment.survey_patches import Kind
from cityflow.adjustment.tracks import Ties
from cityflow.adjustment.triangulation import robust_weights, summed, triangulated
from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.geometry.similarity import Similarity

PATCH_SIGMA = 2.0
"""Image coordinates of patches, in those of the smallest features; set by hand, as are those below."""
LEAST_PX, MOST_PX = 0.1, 0.5
"""A patch's own reprojection error counts as this at least; with a larger one it is left out."""
PLANE_M = (0.006, 0.008, 0.04)
"""What a patch's plane is off along its normal at least, by `Kind`: noise of the scan; windows set back from walls."""
OUTLYING = 4.0
"""Patches with larger distances have no weight, in standard deviations."""
GROUP_M = 10.0
"""Patches of a kind and direction in a square of this edge are off alike: one roof, one wall."""
FEWEST_GROUPS = 4
"""Groups that tell how far they are off alike."""
FIRM_SCALE = 2e-5
"""Standard deviation of the size that given poses have, where it is held."""
SIGNIFICANT = 3.0
"""Standard deviations by which the scan must contradict that size to free it; and by more than windows that are set back from walls all around."""
CONTRADICTED = 22.5
"""Squared distance of a block from where it was given, in standard deviations of its move, that one of a thousand sound blocks has (chi-square of six)."""
ROUNDS, STEPS = 6, 3
MOVES = 7
FEW_PATCHES = 40
"""Patches below which a scan holds nothing: the block stays where the similarity has it."""


@dataclass(frozen=True, slots=True)
class Planes:
    """Tie points on planes of a scan.

    Attributes
    ----------
    ties : of points 0 to P - 1
    xyz, normals : (P, 3) places on the planes, metres; unit normals towards the pictures
    kind : (P,) `Kind`
    """

    ties: Ties
    xyz: FloatArray
    normals: FloatArray
    kind: IntArray


@dataclass(frozen=True, slots=True)
class Sigmas:
    """How exact image coordinates (pixels), given positions (metres) and rotations (radians) are."""

    image: float
    position: float
    angle: float


@dataclass(frozen=True, slots=True)
class SurveyHeld:
    """A block that a scan holds.

    Attributes
    ----------
    block : with the tie points;  covariances : (N, 6, 6) as of `Adjusted`
    move : of the given poses, from where they stood before;  scale_free : whether their size was adjusted
    middle : (3,) of the patches;  move_covariance : (7, 7) of the shift of that (metres), rotation about it (radians), share of size
    used : (3,) patches by kind that count;  off_m : (3,) robust standard deviations of their distances, metres;  set_back_m : of walls in pictures
    """

    block: Block
    covariances: FloatArray
    move: Similarity
    scale_free: bool
    middle: FloatArray
    move_covariance: FloatArray
    used: IntArray
    off_m: FloatArray
    set_back_m: float


def held_by_survey(
    given: Block, start: Block, ties: Ties, planes: Planes, sigmas: Sigmas, *, scale_free: bool = False
) -> SurveyHeld | None:
    """Adjust a block to a scan.

    Parameters
    ----------
    given : poses that are observations up to a move, near the scan
    start : adjusted poses and tie points, near the scan
    scale_free : whether it is known that given poses have another size; else that is found out

    Returns
    -------
    None where too few patches are usable.
    """
    if planes.ties.points < FEW_PATCHES:
        return None
    hold = _Hold(given, start, ties, planes, sigmas)
    if hold.sound.sum() < FEW_PATCHES:
        return None
    if scale_free:
        return hold.solved(1.0)
    found = hold.solved(FIRM_SCALE)
    free = hold.solved(1.0, rounds=2, after=found)
    radius = float(np.sqrt(np.mean(np.sum((planes.xyz - hold.middle) ** 2, axis=1))))
    least = max(SIGNIFICANT * float(np.sqrt(free.move_covariance[6, 6])), PLANE_M[Kind.WALL] / radius)
    return hold.solved(1.0) if abs(free.move.scale - 1.0) > least else found


def contradicts(found: SurveyHeld, by: Similarity) -> bool:
    """Whether a scan contradicts where a block was given, significantly.

    Parameters
    ----------
    by : from there to where the scan holds it, both in the frame of `found`
    """
    before = np.linalg.solve(by.scale * by.rotation, found.middle - by.shift)
    away = np.concatenate([found.middle - before, vector_of(by.rotation[None])[0], [by.scale - 1.0]])
    some = slice(0, MOVES if found.scale_free else MOVES - 1)
    return bool(away[some] @ np.linalg.solve(found.move_covariance[some, some], away[some]) > CONTRADICTED)


class _Hold:
    """What is the same in all steps."""

    def __init__(self, given: Block, start: Block, ties: Ties, planes: Planes, sigmas: Sigmas) -> None:
        own, self.count = planes.ties, ties.points
        placed = triangulated(replace(start, xyz=np.empty((0, 3))), own)
        left = residuals(placed, own)[0]
        spare = np.maximum(2 * own.lengths - 3, 1)
        self.error_px = np.sqrt(np.bincount(own.point, np.sum(left**2, axis=1), minlength=own.points) / spare)
        self.sound = self.error_px < MOST_PX
        slope = slopes(placed, own)[1]
        normal = summed(np.einsum("mki,mkj->mij", slope, slope), own)
        spread = np.linalg.inv(normal + 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(3))
        along = np.einsum("pi,pij,pj->p", planes.normals, spread, planes.normals)
        self.sigma = np.hypot(
            np.sqrt(along) * np.maximum(self.error_px, LEAST_PX), np.array(PLANE_M)[planes.kind.astype(np.int64)]
        )
        self.given, self.planes, self.sigmas = given, planes, sigmas
        self.start = replace(start, xyz=np.concatenate([start.xyz, placed.xyz]))
        self.ties = Ties(
            np.concatenate([ties.point, self.count + own.point]), np.concatenate([ties.image, own.image]),
            np.concatenate([ties.feature, own.feature]), np.concatenate([ties.uv, own.uv]),
            np.concatenate([ties.sigma, np.full(len(own.point), PATCH_SIGMA)]),
        )  # fmt: skip
        self.group = _groups(planes)
        self.middle = planes.xyz.mean(axis=0)

    def solved(self, scale_sigma: float, rounds: int = ROUNDS, after: SurveyHeld | None = None) -> SurveyHeld:
        """Gauss and Newton, with weights of the step before; from the start, or from what was found, whose points are made anew."""
        now, given, move, back = self.start, self.given, np.zeros(MOVES), 0.0
        if after is not None:
            own = triangulated(replace(after.block, xyz=np.empty((0, 3))), self.planes.ties)
            now = replace(after.block, xyz=np.concatenate([after.block.xyz, own.xyz]))
            given, back = _moved(given, after.move), after.set_back_m
            move[6] = after.move.scale - 1.0
        total = Similarity(1.0, np.eye(3), np.zeros(3)) if after is None else after.move
        images = len(given.centres)
        for _ in range(rounds * STEPS):
            left = residuals(now, self.ties)[0]
            weight = robust_weights(left, self.ties.sigma, self.sigmas.image)
            root, off = self._plane_weights(now, back)
            prior = self._prior(now, given, move, scale_sigma, root, off)
            normal = Normal(now, self.ties, left, weight, prior, calibrated=False)
            step, points = normal.step()
            now = now.moved(step[: 6 * images].reshape(-1, 6), points, np.zeros((len(now.cameras), 8)))
            change = step[6 * images :]
            by = Similarity.about(self.middle, 1.0 + float(change[6]), rotation_of(change[None, 3:6])[0], change[:3])
            given, move = _moved(given, by), move + change
            total = Similarity(by.scale * total.scale, by.rotation @ total.rotation, by.moved(total.shift[None])[0])
            wall = self.planes.kind == Kind.WALL
            if wall.any() and np.sum(root[wall]) > 0:
                away = self._distances(now)
                back = float(np.sum(root[wall] ** 2 * away[wall]) / np.sum(root[wall] ** 2))
        counts = np.array([np.sum((self.planes.kind == k) & (root > 0)) for k in Kind])
        spread = np.array([spread_about_zero(off[(self.planes.kind == k) & (root > 0)]) for k in Kind])
        block = replace(now, xyz=now.xyz[: self.count])
        return SurveyHeld(
            block, normal.covariances(), total, scale_sigma > FIRM_SCALE, self.middle,
            normal.last_covariance(MOVES), counts, spread, back,
        )  # fmt: skip

    def _distances(self, now: Block) -> FloatArray:
        """(P,) of patches from their planes, metres."""
        return np.asarray(np.sum((now.xyz[self.count :] - self.planes.xyz) * self.planes.normals, axis=1))

    def _plane_weights(self, now: Block, back: float) -> tuple[FloatArray, FloatArray]:
        """(P,) roots of the weights, and distances (of walls: from where most of them are), metres."""
        off = self._distances(now) - back * (self.planes.kind == Kind.WALL)
        sigma = self.sigma.copy()
        for kind in Kind:
            own = (self.planes.kind == kind) & self.sound
            if not own.any():
                continue
            sigma[own] *= max(spread_about_zero(off[own] / self.sigma[own]), 1.0)
            sigma[own] = np.hypot(sigma[own], self._common(off, sigma, own))
        share = np.clip(1.0 - (off / (OUTLYING * sigma)) ** 2, 0.0, 1.0) * self.sound
        return np.asarray(share / sigma), off

    def _common(self, off: FloatArray, sigma: FloatArray, own: BoolArray) -> FloatArray:
        """(K,) what those of a group are off alike, as if it were each one's own: times the root of their number."""
        good = own & (np.abs(off) < OUTLYING * sigma)
        number = np.unique(self.group[own], return_inverse=True)[1].reshape(-1)
        held = good[own]
        counts = np.bincount(number, held.astype(np.float64))
        if np.sum(counts > 1) < FEWEST_GROUPS:
            return np.zeros(int(own.sum()))
        full = np.maximum(counts, 1.0)
        mean = np.bincount(number, off[own] * held) / full
        noise = np.bincount(number, sigma[own] ** 2 * held) / full**2
        some = counts > 1
        alike = max(float(np.mean((mean**2 - noise)[some])), 0.0)
        return np.asarray(np.sqrt(alike * full)[number])

    def _prior(
        self, now: Block, given: Block, move: FloatArray, scale_sigma: float, root: FloatArray, off: FloatArray
    ) -> Prior:
        images = len(given.centres)
        away = np.concatenate(
            [vector_of(now.rotations @ np.swapaxes(given.rotations, 1, 2)), now.centres - given.centres], axis=1
        )
        weights = np.empty_like(away)
        for columns, sigma in ((slice(0, 3), self.sigmas.angle), (slice(3, 6), self.sigmas.position)):
            normed = np.sum((away[:, columns] / sigma) ** 2, axis=1) / 3
            weights[:, columns] = (1.0 / sigma**2 / np.maximum(normed / 9.0, 1.0))[:, None]
        of_move = np.zeros((images, 6, MOVES))
        arm = given.centres - self.middle
        of_move[:, :3, 3:6] = given.rotations
        of_move[:, 3:, :3] = -np.eye(3)
        of_move[:, 3:, 3:6] = np.cross(arm[:, None, :], np.eye(3)[None])
        of_move[:, 3:, 3:6] = np.swapaxes(of_move[:, 3:, 3:6], 1, 2)
        of_move[:, 3:, 6] = -arm
        poses, last = 6 * images, 6 * images + MOVES - 1
        row = np.concatenate([np.arange(poses), np.repeat(np.arange(poses), MOVES), [poses]])
        column = np.concatenate([np.arange(poses), np.tile(poses + np.arange(MOVES), poses), [last]])
        value = np.concatenate([np.ones(poses), of_move.reshape(-1), [1.0]])
        rows = csr_array(coo_array((value, (row, column)), shape=(poses + 1, poses + MOVES)))
        nothing = np.zeros_like(now.xyz)
        on_planes, planes_away = nothing.copy(), np.zeros(len(now.xyz))
        on_planes[self.count :], planes_away[self.count :] = root[:, None] * self.planes.normals, root * off
        return Prior(
            rows, np.concatenate([weights.reshape(-1), [scale_sigma**-2]]), np.concatenate([away.reshape(-1), [move[6]]]),
            nothing, nothing, on_planes, planes_away,
        )  # fmt: skip


def _moved(given: Block, by: Similarity) -> Block:
    return replace(given, centres=by.moved(given.centres), rotations=given.rotations @ by.rotation.T)


def _groups(planes: Planes) -> IntArray:
    """(P,) numbers of squares, kinds and directions that patches share."""
    turn = np.round(np.arctan2(planes.normals[:, 1], planes.normals[:, 0]) / (np.pi / 4)) % 8
    turn = np.where(planes.kind == Kind.LEVEL, 0, turn)
    key = np.column_stack([np.floor(planes.xyz[:, :2] / GROUP_M), planes.kind, turn])
    return np.asarray(np.unique(key, axis=0, return_inverse=True)[1].reshape(-1), np.int64)
