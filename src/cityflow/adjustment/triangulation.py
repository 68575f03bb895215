"""Tie points from the rays of known poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cityflow.adjustment.block import Block, residuals, slopes
from cityflow.adjustment.tracks import Ties
from cityflow.core.arrays import BoolArray, FloatArray

STEPS = 3
"""Of Gauss and Newton after the nearest point to all rays; set by hand, as is the next."""
DAMPING = 1e-9
"""Share of the trace that keeps points on parallel rays solvable."""


def triangulated(block: Block, ties: Ties) -> Block:
    """The block with each tie point where its reprojection errors are least, robustly, poses being held."""
    block = replace(block, xyz=_nearest(block, ties))
    for _ in range(STEPS):
        left, _ = residuals(block, ties)
        of_point = slopes(block, ties)[1]
        weight = robust_weights(left, ties.sigma, 1.0)
        normal = summed(np.einsum("mki,mkj,m->mij", of_point, of_point, weight), ties)
        right = summed(np.einsum("mki,mk,m->mi", of_point, left, weight), ties)
        block = replace(block, xyz=block.xyz + _solved(normal, right))
    return block


def well_placed(block: Block, ties: Ties, least_angle_rad: float) -> BoolArray:
    """(P,) which points lie before all cameras that show them, on rays that meet at an angle."""
    depth = residuals(block, ties)[1]
    before = np.ones(ties.points, bool)
    before[ties.point[depth <= 0]] = False
    rays = block.xyz[ties.point] - block.centres[ties.image]
    rays = rays / np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), 1e-12)
    mean = summed(rays, ties) / ties.lengths[:, None]
    # unit vectors that differ by an angle a in pairs have a mean of length cos(a / 2)
    return np.asarray(before & (np.linalg.norm(mean, axis=1) < np.cos(least_angle_rad / 2)))


def robust_weights(left: FloatArray, sigma: FloatArray, scale: float) -> FloatArray:
    """(M,) weights of observations, 1 / px²: Cauchy's loss, which halves them at two standard deviations.

    Parameters
    ----------
    left : (M, 2) residuals, pixels
    sigma : (M,) standard deviations among themselves;  scale : of all of them, pixels
    """
    normed = np.sum(left**2, axis=1) / (sigma * scale) ** 2
    return 1.0 / (sigma * scale) ** 2 / (1.0 + normed / 8.0)


def summed(values: FloatArray, ties: Ties) -> FloatArray:
    """(P, …) sums over the (M, …) observations of each point."""
    starts = np.searchsorted(ties.point, np.arange(ties.points))
    return np.add.reduceat(values, starts, axis=0) if len(values) else values


def _nearest(block: Block, ties: Ties) -> FloatArray:
    """(P, 3) the points nearest to all rays, metres from the local origin."""
    rays = np.empty((len(ties.point), 3))
    for number, camera in enumerate(block.cameras):
        rows = np.flatnonzero(block.camera[ties.image] == number)
        rays[rows] = np.column_stack([camera.undistort(ties.uv[rows]), np.ones(len(rows))])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    rays = np.einsum("mj,mji->mi", rays, block.rotations[ties.image])
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    right = np.einsum("mij,mj->mi", across, block.centres[ties.image])
    return _solved(summed(across, ties), summed(right, ties))


def _solved(normal: FloatArray, right: FloatArray) -> FloatArray:
    damped = normal + (DAMPING * np.trace(normal, axis1=1, axis2=2) + 1e-12)[:, None, None] * np.eye(3)
    return np.linalg.solve(damped, right[..., None])[..., 0]
