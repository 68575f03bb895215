"""Normal equations of a bundle block, with the tie points eliminated (Schur complement; Brown 1976, Triggs 2000 §6)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import bsr_array, csr_array
from scipy.sparse.linalg import splu

from cityflow.adjustment.block import INTERIOR, Block, slopes
from cityflow.adjustment.tracks import Ties
from cityflow.adjustment.triangulation import summed
from cityflow.core.arrays import FloatArray

DENSE = 9000
"""Unknowns up to which the reduced equations are solved densely (650 MB); set by hand, as is the next."""
SOLVED_AT_ONCE = 240
"""Columns of the inverse that are made at once."""


@dataclass(frozen=True, slots=True)
class Prior:
    """What is known beside the images: O observations of the D unknowns, and of the P points' places.

    Unknowns are radians and metres of N poses, then 8 of each camera where cameras are calibrated, then 3 metres of the common shift of given positions
    where there is one, then 3 metres of each antenna's arm where these are unknown, then 6 of each
    mount where heads are held together.

    Attributes
    ----------
    rows : (O, D) how each observation changes with the unknowns
    weights : (O,) 1 / variance;  away : (O,) the block less what is observed
    of_points : (P, 3) weights of known places, 0 where nothing is known;  points_away : (P, 3) the block less these, metres
    on_planes : (P, 3) normals of the planes that points lie on, times the roots of their weights, 0 where they lie on none; None: none does
    planes_away : (P,) distances from these planes, times the roots of the weights
    """

    rows: csr_array
    weights: FloatArray
    away: FloatArray
    of_points: FloatArray
    points_away: FloatArray
    on_planes: FloatArray | None = None
    planes_away: FloatArray | None = None


class Normal:
    """One linearisation.

    Parameters
    ----------
    left : (M, 2) residuals, pixels;  weight : (M,) 1 / px²
    calibrated : whether cameras are unknowns, too
    """

    def __init__(
        self, block: Block, ties: Ties, left: FloatArray, weight: FloatArray, prior: Prior, *, calibrated: bool
    ) -> None:
        of_pose, of_point, of_camera = slopes(block, ties)
        images, root = len(block.centres), np.sqrt(weight)
        self._ties, self._images = ties, images
        self._size = prior.rows.shape[1]
        self._cameras = len(block.cameras) if calibrated else 0
        jacobian = self._jacobian(block, of_pose, of_camera, root, calibrated)
        points = of_point * root[:, None, None]
        seen = (left * root[:, None]).reshape(-1)
        own = summed(np.einsum("mki,mkj->mij", points, points), ties)
        own += prior.of_points[:, :, None] * np.eye(3)
        if prior.on_planes is not None:
            own += prior.on_planes[:, :, None] * prior.on_planes[:, None, :]
        own += (1e-9 * np.trace(own, axis1=1, axis2=2) + 1e-12)[:, None, None] * np.eye(3)
        self._inverse = np.linalg.inv(own)
        rows = np.arange(len(ties.point) + 1)
        jacobian_of_points = bsr_array((points, ties.point, rows), shape=(2 * len(ties.point), 3 * ties.points)).tocsr()
        self._mixed = csr_array(jacobian.T @ jacobian_of_points)
        blocks = np.arange(ties.points + 1)
        inverse = bsr_array((self._inverse, blocks[:-1], blocks), shape=(3 * ties.points,) * 2).tocsr()
        self._right_of_points = jacobian_of_points.T @ seen - (prior.of_points * prior.points_away).reshape(-1)
        if prior.on_planes is not None and prior.planes_away is not None:
            self._right_of_points -= (prior.on_planes * prior.planes_away[:, None]).reshape(-1)
        reduced = jacobian.T @ jacobian - self._mixed @ inverse @ self._mixed.T
        self._right = jacobian.T @ seen - self._mixed @ (inverse @ self._right_of_points)
        weighted = prior.rows.multiply(prior.weights[:, None]).tocsr()
        self._right -= weighted.T @ prior.away
        self._reduced = csr_array(reduced + prior.rows.T @ weighted)
        self._factor: Any = None

    def _jacobian(
        self, block: Block, of_pose: FloatArray, of_camera: FloatArray, root: FloatArray, calibrated: bool
    ) -> csr_array:
        """(2M, D) of poses and cameras."""
        image = self._ties.image
        columns = 6 * image[:, None] + np.arange(6)
        values = of_pose
        if calibrated:
            interior = 6 * self._images + INTERIOR * block.camera[image][:, None] + np.arange(INTERIOR)
            columns = np.concatenate([columns, interior], axis=1)
            values = np.concatenate([of_pose, of_camera], axis=2)
        values = values * root[:, None, None]
        starts = np.arange(0, values.size + 1, values.shape[2])
        return csr_array(
            (values.reshape(-1), np.repeat(columns, 2, axis=0).reshape(-1), starts), shape=(2 * len(image), self._size)
        )

    def step(self) -> tuple[FloatArray, FloatArray]:
        """(D,) of poses, cameras and the shift, (P, 3) of the points."""
        poses = self._solve(self._right)
        points = self._right_of_points - self._mixed.T @ poses
        return poses, np.einsum("pij,pj->pi", self._inverse, points.reshape(-1, 3))

    def pose_columns(self) -> Iterator[tuple[int, FloatArray]]:
        """First image and (6N, 6K) columns of the inverse for it and the K - 1 that follow: covariances of all poses with theirs, radians and metres."""
        for first in range(0, self._images, SOLVED_AT_ONCE // 6):
            last = min(first + SOLVED_AT_ONCE // 6, self._images)
            unit = np.zeros((self._size, 6 * (last - first)))
            unit[np.arange(6 * first, 6 * last), np.arange(unit.shape[1])] = 1.0
            yield first, self._solve(unit)[: 6 * self._images]

    def covariances(self) -> FloatArray:
        """(N, 6, 6) of the poses: radians and metres, for the weights as given."""
        result = np.empty((self._images, 6, 6))
        for first, columns in self.pose_columns():
            for k in range(first, first + columns.shape[1] // 6):
                result[k] = columns[6 * k : 6 * k + 6, 6 * (k - first) : 6 * (k - first) + 6]
        return result

    def interior_covariances(self) -> FloatArray:
        """(K, 8, 8) of the cameras, where they are calibrated."""
        first = 6 * self._images
        unit = np.zeros((self._size, INTERIOR * self._cameras))
        unit[first + np.arange(unit.shape[1]), np.arange(unit.shape[1])] = 1.0
        columns = self._solve(unit)[first : first + unit.shape[1]]
        return np.array(
            [columns[k : k + INTERIOR, k : k + INTERIOR] for k in range(0, len(columns), INTERIOR)]
        ).reshape(-1, INTERIOR, INTERIOR)

    def last_covariance(self, count: int) -> FloatArray:
        """(count, count) of the last unknowns."""
        unit = np.zeros((self._size, count))
        unit[np.arange(self._size - count, self._size), np.arange(count)] = 1.0
        return self._solve(unit)[self._size - count :]

    def _solve(self, right: FloatArray) -> FloatArray:
        if self._factor is None:
            self._factor = (
                cho_factor(self._reduced.toarray(), lower=True, overwrite_a=True)
                if self._size <= DENSE
                else splu(self._reduced.tocsc())
            )
        if isinstance(self._factor, tuple):
            return np.asarray(cho_solve(self._factor, right))
        return np.asarray(self._factor.solve(right))
