"""The surroundings of a unit, prepared for rays: columns of the surface and triangles of the models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit
from cityflow.geometry.polyhedron import triangulate
from cityflow.geometry.ray_march import Columns, columns_over, meets_column, tops_from
from cityflow.texture.visibility.obstacle_heights import obstacle_heights
from cityflow.texture.visibility.triangle_tree import TriangleTree, meets_triangle, triangle_tree
from cityflow.texture.visibility.visibility_parameters import VisibilityParameters

BIAS_M = 0.02
"""Rays start this far in front of the face; set by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Columns and triangles, in metres from `origin`; made once for a unit.

    Attributes
    ----------
    columns : of the surface
    tree : triangles of the unit itself, of its overhangs, and of its neighbours
    parameters : what counts as standing in the way
    """

    origin: FloatArray
    columns: Columns
    tree: TriangleTree
    parameters: VisibilityParameters

    @classmethod
    def of(
        cls,
        heights: FloatArray,
        grid: Grid,
        own: Sequence[Polyhedron],
        others: Sequence[Polyhedron] = (),
        parameters: VisibilityParameters | None = None,
    ) -> Scene:
        """A unit's surroundings.

        Parameters
        ----------
        heights : (rows, cols) the surface on `grid`, world metres; NaN where it is not known, and hides nothing
        own : the unit's solid, and what stands beyond its walls
        others : the same of its neighbours
        """
        p = parameters or VisibilityParameters()
        origin = np.array(
            [grid.x_min + grid.cols * grid.cell / 2, grid.y_max - grid.rows * grid.cell / 2, _middle(own)]
        )
        tops = obstacle_heights(heights, grid, own, others, p)
        corners = [_corners(shell, origin) for shell in (*own, *others)]
        tree = triangle_tree(np.concatenate([np.empty((0, 3, 3)), *corners]))
        return cls(origin, columns_over(grid, tops_from(tops, origin[2]), origin), tree, p)

    def visible(self, xyz: FloatArray, normal: FloatArray, centre: FloatArray) -> BoolArray:
        """Which points of a face a camera sees, whatever its frame is.

        Parameters
        ----------
        xyz : (N, 3) world metres
        normal : (3,) outward unit normal of the face
        centre : (3,) projection centre, world metres
        """
        points = np.ascontiguousarray(np.asarray(xyz, np.float64) - self.origin)
        camera = np.asarray(centre, np.float64) - self.origin
        p = self.parameters
        return np.asarray(
            _visible(points, np.asarray(normal, np.float64), camera, self.columns, self.tree, (BIAS_M, p.dip_m))
        )


def _middle(shells: Sequence[Polyhedron]) -> float:
    """A height amid the shells."""
    heights = [shell.vertices[:, 2].mean() for shell in shells if len(shell.vertices)]
    return float(np.mean(heights)) if heights else 0.0


def _corners(shell: Polyhedron, origin: FloatArray) -> FloatArray:
    mesh = triangulate(shell)
    return np.asarray((mesh.vertices - origin)[mesh.triangles].reshape(-1, 3, 3))


@njit(cache=True, nogil=True)
def _visible(points, normal, camera, columns, tree, allowed):  # type: ignore[no-untyped-def]
    bias, dip = allowed
    out = np.zeros(points.shape[0], np.bool_)
    start, towards = np.empty(3), np.empty(3)
    last = -1
    for i in range(points.shape[0]):
        length, facing = 0.0, 0.0
        for k in range(3):
            start[k] = points[i, k] + bias * normal[k]
            towards[k] = camera[k] - start[k]
            length += towards[k] * towards[k]
            facing += towards[k] * normal[k]
        length = np.sqrt(length)
        if facing <= 0.0 or length <= 0.0:
            continue
        for k in range(3):
            towards[k] /= length
        met = meets_triangle(tree, start, towards, length, last)
        if met >= 0:
            last = met
            continue
        start[2] += dip
        out[i] = not meets_column(columns, start, towards, length)
    return out
