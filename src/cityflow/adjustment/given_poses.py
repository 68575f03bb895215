"""Given poses, cameras and places as observations of a block: how exact they are, how far the block is from them, and how that changes with its unknowns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array, vstack

from cityflow.adjustment.block import INTERIOR, Block, interior_change, vector_of
from cityflow.adjustment.control import Control, place_weights
from cityflow.adjustment.mounts import Mounts
from cityflow.adjustment.normal_equations import Prior
from cityflow.core.arrays import FloatArray

LENS_SIGMA = np.array([0.01, 0.01, 0.01, 0.1, 0.1, 0.01, 0.01, 0.1])
"""What a given camera may be off where it is calibrated: focal length and principal point (shares of the focal length), distortion."""
ARM_SIGMA_M = 1.0
"""What an antenna's place may be off where it is an unknown: antennas are not farther from cameras."""


@dataclass(frozen=True, slots=True, eq=False)
class Exactness:
    """How exact given poses and cameras are among themselves.

    Attributes
    ----------
    positions : (N, 3) standard deviations of positions over those of all of them; infinite: none is given
    angles : (N,) the same of rotations
    lens : (K, 8) what given cameras may be off where they are calibrated, see `with_interior`
    arms : (K, 3) metres in the frame of each camera (x right in the picture, y down, z ahead) from the projection centre to the antenna, whose places given
        positions are; zeros: they are projection centres
    arms_open : whether `arms` are unknowns, and only a start
    start_m : standard deviation of positions before it is known, metres; None: by what poses are mostly off
    mounts : what holds heads of one station together, a start; None: nothing does
    """

    positions: FloatArray
    angles: FloatArray
    lens: FloatArray
    arms: FloatArray
    arms_open: bool = False
    start_m: float | None = None
    mounts: Mounts | None = None

    @staticmethod
    def alike(block: Block) -> Exactness:
        """All poses and cameras are given, and equally exact; positions are projection centres."""
        images, cameras = len(block.centres), len(block.cameras)
        return Exactness(
            np.ones((images, 3)), np.ones(images), np.tile(LENS_SIGMA, (cameras, 1)), np.zeros((cameras, 3))
        )


@dataclass(frozen=True, slots=True, eq=False)
class Unknowns:
    """What an adjustment changes: the block, (3,) a common shift of given positions, metres, None: it is none, and (K, 3) arms and mounts of `Exactness`."""

    block: Block
    shift: FloatArray | None
    arms: FloatArray
    mounts: Mounts | None = None

    def stepped(self, step: FloatArray, points: FloatArray, arms_open: bool) -> Unknowns:
        """After (D,) a step of poses, cameras, shift, arms and mounts, and (P, 3) of points."""
        poses = 6 * len(self.block.centres)
        arms, shift, mounts = self.arms, self.shift, self.mounts
        if mounts is not None:
            mounts, step = mounts.stepped(step[-mounts.unknowns :]), step[: -mounts.unknowns]
        if arms_open:
            arms, step = arms + step[-arms.size :].reshape(-1, 3), step[: -arms.size]
        if shift is not None:
            shift, step = shift + step[-3:], step[:-3]
        lens = step[poses:] if len(step) > poses else np.zeros(INTERIOR * len(self.block.cameras))
        block = self.block.moved(step[:poses].reshape(-1, 6), points, lens.reshape(-1, INTERIOR))
        return Unknowns(block, shift, arms, mounts)

    def away(self, given: Block) -> FloatArray:
        """(N, 6) the poses less those given: rotation vectors in the camera frames, places of antennas without their common shift."""
        block = self.block
        turns = block.rotations @ np.swapaxes(given.rotations, 1, 2)
        antennas = block.centres + np.einsum("nji,nj->ni", block.rotations, self.arms[block.camera])
        return np.concatenate(
            [vector_of(turns), antennas - given.centres - (0.0 if self.shift is None else self.shift)], axis=1
        )


def prior_of(
    given: Block,
    now: Unknowns,
    sigmas: tuple[float, float],
    exact: Exactness,
    control: Control | None,
    calibrated: bool,
) -> Prior:
    """Given poses, cameras and known places as observations; single poses and places that are far off lose their weight.

    Parameters
    ----------
    sigmas : standard deviations of positions (metres) and rotations (radians) of which `exact` has the shares
    """
    block, away = now.block, now.away(given)
    weights = np.empty_like(away)
    for columns, sigma in (
        (slice(3, 6), sigmas[0] * exact.positions),
        (slice(0, 3), sigmas[1] * exact.angles[:, None]),
    ):
        normed = np.sum((away[:, columns] / sigma) ** 2, axis=1) / 3
        weights[:, columns] = 1.0 / sigma**2 / np.maximum(normed / 9.0, 1.0)[:, None]
    lens = len(block.cameras) if calibrated else 0
    change = [interior_change(then, now) for now, then in zip(block.cameras[:lens], given.cameras[:lens], strict=True)]
    points, points_away = np.zeros_like(block.xyz), np.zeros_like(block.xyz)
    if control is not None:
        first = len(block.xyz) - len(control.names)
        off = np.where(np.isfinite(control.xyz), block.xyz[first:] - control.xyz, 0.0)
        points[first:], points_away[first:] = place_weights(off, control), off
    arms = now.arms if exact.arms_open else np.empty((0, 3))
    held = np.empty((0, 6)) if now.mounts is None else now.mounts.away(block)
    firm = np.empty(0) if now.mounts is None else now.mounts.weights(held).reshape(-1)
    return Prior(
        _rows(now, lens, exact.arms_open),
        np.concatenate(
            [
                weights.reshape(-1), 1.0 / exact.lens[:lens].reshape(-1) ** 2, np.full(arms.size, ARM_SIGMA_M**-2), firm
            ]
        ),
        np.concatenate([away.reshape(-1), *change, (arms - exact.arms[: len(arms)]).reshape(-1), held.reshape(-1)]),
        points, points_away,
    )  # fmt: skip


def _rows(now: Unknowns, lens: int, arms_open: bool) -> csr_array:
    """How the observations change with the unknowns: each is one of these; positions lie off by the shift, and turn with the antenna's arm; then mounts."""
    block, images = now.block, len(now.block.centres)
    own = 6 * images + INTERIOR * lens
    shifts, arms = 0 if now.shift is None else 3, now.arms.size if arms_open else 0
    entries = [(np.arange(own), np.arange(own), np.ones(own))]
    centre = 6 * np.arange(images)[:, None] + np.arange(3, 6)
    if shifts:
        entries.append((centre.reshape(-1), own + np.tile(np.arange(3), images), np.full(3 * images, -1.0)))
    if arms_open or now.arms.any():
        back = np.swapaxes(block.rotations, 1, 2)
        turned = np.cross(now.arms[block.camera][:, None, :], np.eye(3)[None])  # rows: arm × axis
        of_turn = back @ np.swapaxes(turned, 1, 2)
        rows = np.broadcast_to(centre[:, :, None], of_turn.shape)
        turn = np.broadcast_to(6 * np.arange(images)[:, None, None] + np.arange(3), of_turn.shape)
        entries.append((rows.reshape(-1), turn.reshape(-1), of_turn.reshape(-1)))
        if arms_open:
            arm = own + shifts + 3 * block.camera[:, None, None] + np.arange(3)
            arm = np.broadcast_to(arm, of_turn.shape)
            entries.append((rows.reshape(-1), arm.reshape(-1), back.reshape(-1)))
            entries.append((own + np.arange(arms), own + shifts + np.arange(arms), np.ones(arms)))
    row, column, value = (np.concatenate(part) for part in zip(*entries, strict=True))
    before = own + shifts + arms
    if now.mounts is None:
        return csr_array(coo_array((value, (row, column)), shape=(own + arms, before)))
    size = before + now.mounts.unknowns
    alone = coo_array((value, (row, column)), shape=(own + arms, size))
    return csr_array(vstack([alone, now.mounts.rows(block, before)]))
