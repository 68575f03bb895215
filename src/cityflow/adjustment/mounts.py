"""Heads that fire together: the pose of each from that of the first one of its station is the same at all stations, up to what the mount gives way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array

from cityflow.adjustment.block import Block, rotation_of, vector_of
from cityflow.core.arrays import FloatArray, IntArray

FEW_STATIONS = 4
"""Stations that two heads must share; set by hand, as are those below."""
LEAST_ANGLE_PX, LEAST_OFFSET_M = 0.05, 0.002
"""No mount is held more firmly than this."""
FAR = 9.0
"""Squares of relations, in standard deviations, from which on they lose weight."""


@dataclass(frozen=True, slots=True, eq=False)
class Mounts:
    """Relations between images of one station.

    Attributes
    ----------
    images : (E, 2) numbers of an image, and of the one of its station that it is related to
    mount : (E,) number of the relation's mount
    rotations : (H, 3, 3) the image's camera frame from the other's;  offsets : (H, 3) its projection centre in the other's camera frame, metres
    sigmas : of rotations (radians) and of offsets (metres), per axis
    """

    images: IntArray
    mount: IntArray
    rotations: FloatArray
    offsets: FloatArray
    sigmas: tuple[float, float]

    @property
    def unknowns(self) -> int:
        return 6 * len(self.offsets)

    def stepped(self, step: FloatArray) -> Mounts:
        """After (6 H,) rotation vectors and offsets."""
        parts = step.reshape(-1, 6)
        return replace(self, rotations=rotation_of(parts[:, :3]) @ self.rotations, offsets=self.offsets + parts[:, 3:])

    def away(self, block: Block) -> FloatArray:
        """(E, 6) relations as the block has them less those of their mounts: rotation vectors, metres."""
        turns, offsets = _relations(block, self.images)
        return np.concatenate(
            [
                vector_of(turns @ np.swapaxes(self.rotations[self.mount], 1, 2)), offsets - self.offsets[self.mount],
            ], axis=1,
        )  # fmt: skip

    def weights(self, away: FloatArray) -> FloatArray:
        """(E, 6) 1 / variance; relations that are far off lose theirs."""
        sigma = np.repeat(self.sigmas, 3)
        normed = np.sum((away / sigma) ** 2, axis=1) / 6.0
        return np.asarray(1.0 / sigma**2 / np.maximum(normed / FAR, 1.0)[:, None])

    def rows(self, block: Block, first: int) -> coo_array:
        """(6 E, first + 6 H) how they change with poses and mounts; `first`: unknowns before those of mounts."""
        one, other = self.images.T
        turns, offsets = _relations(block, self.images)
        identity = np.broadcast_to(np.eye(3), turns.shape)
        zero = np.zeros_like(turns)
        back = block.rotations[other]
        across = np.zeros_like(turns)
        # ω × offset = -[offset]× ω
        across[:, 0, 1], across[:, 0, 2], across[:, 1, 2] = offsets[:, 2], -offsets[:, 1], offsets[:, 0]
        across = across - np.swapaxes(across, 1, 2)
        of_one = np.block([[identity, zero], [zero, back]])
        of_other = np.block([[-turns, zero], [across, -back]])
        of_mount = np.broadcast_to(-np.eye(6), of_one.shape)
        row = np.broadcast_to(6 * np.arange(len(one))[:, None, None] + np.arange(6)[None, :, None], of_one.shape)
        starts = (6 * one, 6 * other, first + 6 * self.mount)
        columns = [np.broadcast_to(s[:, None, None] + np.arange(6), of_one.shape).reshape(-1) for s in starts]
        values = [v.reshape(-1) for v in (of_one, of_other, of_mount)]
        return coo_array(
            (np.concatenate(values), (np.tile(row.reshape(-1), 3), np.concatenate(columns))),
            shape=(6 * len(one), first + self.unknowns),
        )


def mounts_of(block: Block, covariances: FloatArray, stations: Sequence[int | None]) -> Mounts | None:
    """Mounts as a block without them has them, and what these give way beyond what poses are uncertain by; None where no two heads share enough stations.

    Parameters
    ----------
    covariances : (N, 6, 6) of the poses;  stations : of each image, None where it belongs to none
    """
    members: dict[int, list[int]] = {}
    for number, station in enumerate(stations):
        if station is not None:
            members.setdefault(station, []).append(number)
    pairs: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for group in members.values():
        order = sorted(group, key=lambda k: int(block.camera[k]))
        for k in order[1:]:
            pairs.setdefault((int(block.camera[k]), int(block.camera[order[0]])), []).append((k, order[0]))
    kept = [p for _, p in sorted(pairs.items()) if len(p) >= FEW_STATIONS]
    if not kept:
        return None
    rotations, offsets, excess = [], [], []
    for each in kept:
        images = np.array(each)
        turns, off = _relations(block, images)
        mean = turns[0]
        for _ in range(3):
            mean = rotation_of(np.median(vector_of(turns @ mean.T), axis=0)[None])[0] @ mean
        rotations.append(mean)
        offsets.append(np.median(off, axis=0))
        left = np.concatenate([vector_of(turns @ mean.T), off - offsets[-1]], axis=1)
        one, other = (np.einsum("nii->ni", covariances[images[:, k]]) for k in range(2))
        excess.append((1.4826 * np.median(np.abs(left), axis=0)) ** 2 - np.median(one + other, axis=0))
    focal = float(np.median([np.sqrt(c.fx * c.fy) for c in block.cameras]))
    middle = np.median(np.array(excess), axis=0)
    angle, offset = (float(np.sqrt(max(np.mean(part), 0.0))) for part in (middle[:3], middle[3:]))
    numbers = np.concatenate([np.full(len(p), k) for k, p in enumerate(kept)])
    return Mounts(
        np.concatenate([np.array(p) for p in kept]), numbers, np.array(rotations), np.array(offsets),
        (max(angle, LEAST_ANGLE_PX / focal), max(offset, LEAST_OFFSET_M)),
    )  # fmt: skip


def _relations(block: Block, images: IntArray) -> tuple[FloatArray, FloatArray]:
    """(E, 3, 3) one camera frame from the other, (E, 3) one projection centre in the other's frame."""
    one, other = images.T
    turns = block.rotations[one] @ np.swapaxes(block.rotations[other], 1, 2)
    return turns, np.einsum("eij,ej->ei", block.rotations[other], block.centres[one] - block.centres[other])
