from __future__ import annotations

import numpy as np
import pytest
from shapely import box, get_coordinates

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.planes.plane_segments import PlaneSegments
from cityflow.reconstruction.volumetric_parts.hull_lines import outline_walls
from cityflow.reconstruction.volumetric_parts.nodes import (
    NodeParameters,
    find_nodes,
    neighbouring_surfaces,
    through_nodes,
    triplets_of,
)

DEFAULT = NodeParameters()
OUTLINE = box(0, 0, 8, 8)
PYRAMID = np.array([[0, 0.7, 5.0], [-0.7, 0, 10.6], [0, -0.7, 10.6], [0.7, 0, 5.0]])


def pyramid(noise: float, seed: int) -> PlaneSegments:
    """A pyramid 8 m square whose planes are fitted to noisy points, so that they do not quite meet in one point."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, 8, (1500, 2))
    z = xy @ PYRAMID[:, :2].T + PYRAMID[:, 2]
    label = np.argmin(z, axis=1)
    points = np.column_stack([xy, z.min(axis=1) + rng.normal(0, noise, len(xy))])
    planes = []
    for k in range(4):
        own = points[label == k]
        planes.append(np.linalg.lstsq(np.column_stack([own[:, :2], np.ones(len(own))]), own[:, 2], rcond=None)[0])
    return PlaneSegments((0, 0, 0), points, label, np.array(planes), np.zeros(4), noise)


def gap_at(planes: FloatArray, x: float, y: float) -> float:
    return float(np.ptp(planes @ (x, y, 1.0)))


@pytest.mark.parametrize("seed", range(5))
def test_apex_of_a_pyramid_is_one_node_of_four(seed: int) -> None:
    segments = pyramid(0.1, seed)
    nodes = find_nodes(segments, outline_walls(OUTLINE), get_coordinates(OUTLINE), DEFAULT)
    apex = [k for k, own in enumerate(nodes.surfaces) if own == (0, 1, 2, 3)]
    assert len(apex) == 1
    assert np.abs(nodes.position[apex[0]] - (4, 4, 7.8)).max() < 0.1
    planes, tied = through_nodes(segments, nodes, DEFAULT.tie)
    assert tied == 5  # apex, and two planes in each corner
    x, y = nodes.position[apex[0], :2]
    assert gap_at(segments.coefficients, x, y) > 1e-4
    assert gap_at(planes, x, y) < 1e-9
    assert gap_at(planes[[0, 3]], 0, 0) < 1e-9
    true = PYRAMID @ np.array([4, 4, 1.0])
    assert np.abs(planes @ (4, 4, 1.0) - true).max() < 0.05


def test_planes_too_far_apart_are_left_alone() -> None:
    segments = pyramid(0.01, 1)
    moved = segments.coefficients + np.array([[0, 0, 0.4], [0, 0, 0], [0, 0, 0], [0, 0, 0]])
    apart = PlaneSegments((0, 0, 0), segments.points, segments.labels, moved, np.zeros(4), 0.01)
    nodes = find_nodes(apart, [], np.empty((0, 2)), NodeParameters(merge=2.0))
    planes, tied = through_nodes(apart, nodes, 0.05)
    assert tied == 0
    assert np.array_equal(planes, moved)


def test_vertices_far_from_their_points_are_dropped() -> None:
    rng = np.random.default_rng(1)
    xy = rng.uniform(0, 4, (600, 2))
    label = (xy[:, 0] > 2).astype(np.int64)
    planes = np.array([[0.1, 0, 3.0], [-0.1, 0, 6.0]])  # they would meet at x = 15
    z = np.take_along_axis(xy @ planes[:, :2].T + planes[:, 2], label[:, None], 1)[:, 0]
    segments = PlaneSegments((0, 0, 0), np.column_stack([xy, z]), label, planes, np.zeros(2), 0.01)
    nodes = find_nodes(segments, outline_walls(box(0, 0, 4, 4)), get_coordinates(box(0, 0, 4, 4)), DEFAULT)
    assert len(nodes) == 0


def test_triplets_are_those_of_pairwise_neighbours() -> None:
    pairs = np.array([[0, 1], [0, 2], [1, 2], [2, 3], [3, 4]])
    assert triplets_of(pairs, 5).tolist() == [[0, 1, 2]]


def test_neighbours_are_found_across_cells() -> None:
    points = np.array([[0.1, 0.1, 0], [0.6, 0.1, 0], [0.4, 0.9, 0], [5.0, 5.0, 0], [5.4, 5.9, 0]])
    segments = PlaneSegments((0, 0, 0), points, np.arange(5), np.zeros((5, 3)), np.zeros(5), 0.01)
    assert neighbouring_surfaces(segments, 0.5).tolist() == [[0, 1], [0, 2], [1, 2], [3, 4]]
    assert neighbouring_surfaces(segments, 0.25).tolist() == []
