"""Pieces of the monolithic method against cases worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import LineString, Polygon, box

from cityflow.reconstruction.monolithic_parts.cell_grid import CellGrid, CellPoints, plane_of_sums, spacing
from cityflow.reconstruction.monolithic_parts.contour_scan import Contour, scan_contour
from cityflow.reconstruction.monolithic_parts.crossing_lines import crossing_line, meeting_point, shortest_connection
from cityflow.reconstruction.monolithic_parts.facade_cells import find_facade_cells
from cityflow.reconstruction.monolithic_parts.facade_lines import FacadeLineParameters, close_contour, facade_lines
from cityflow.reconstruction.monolithic_parts.roof_cells import OUTSIDE
from cityflow.reconstruction.monolithic_parts.tied_planes import through_ties
from cityflow.reconstruction.monolithic_parts.topology import SurfaceImage, contracted, find_topology, flipped

O = OUTSIDE  # noqa: E741
HIP = np.array(
    [
        [O, O, O, O, O, O, O, O],
        [O, 3, 0, 0, 0, 0, 1, O],
        [O, 3, 3, 0, 0, 1, 1, O],
        [O, 3, 3, 2, 2, 1, 1, O],
        [O, 3, 2, 2, 2, 2, 1, O],
        [O, O, O, O, O, O, O, O],
    ],
    np.int64,
)
"""Row 0 is the southernmost: 0 south, 1 east, 2 north, 3 west."""


def hip_image() -> SurfaceImage:
    return SurfaceImage(HIP, [0, 1, 2, 3])


def test_window_finds_the_nodes_and_edges_of_a_hip_roof() -> None:
    """Six nodes: four arrises where hips reach the contour, two ends of the ridge; five edges inside, four along the contour."""
    topology = find_topology(hip_image())
    assert len(topology.nodes) == 6
    inner = sorted(e.pair() for e in topology.edges if e.inner())
    assert inner == [(0, 1), (0, 2), (0, 3), (1, 2), (2, 3)]
    assert sum(not e.inner() for e in topology.edges) == 4
    ends = [n for n in topology.nodes if not topology.on_contour(n)]
    assert sorted(topology.surfaces(n) for n in ends) == [[0, 1, 2], [0, 2, 3]]
    assert topology.loops == []


def test_left_and_right_of_an_edge_are_those_of_the_picture() -> None:
    """The ridge runs east-west: going east, north is on the left."""
    topology = find_topology(hip_image())
    ridge = next(e for e in topology.edges if e.pair() == (0, 2))
    eastwards = topology.nodes[ridge.end][1] > topology.nodes[ridge.start][1]
    assert (ridge.left, ridge.right) == ((2, 0) if eastwards else (0, 2))


def test_a_surface_within_another_is_a_loop() -> None:
    labels = np.full((7, 7), OUTSIDE)
    labels[1:6, 1:6] = 0
    labels[3, 3] = 1
    topology = find_topology(SurfaceImage(labels, [0, 1]))
    assert (0, 1) in topology.loops
    assert not [e for e in topology.edges if e.inner()]


def test_a_flipped_edge_lets_the_surfaces_at_its_ends_meet() -> None:
    topology = find_topology(hip_image())
    ridge = next(e for e in topology.edges if e.pair() == (0, 2))
    nodes = ridge.start, ridge.end
    assert flipped(topology, ridge)
    assert ridge.pair() == (1, 3)
    assert sorted(topology.surfaces(n) for n in nodes) == [[0, 1, 3], [1, 2, 3]]
    for node in nodes:
        sides = [s for e in topology.at[node] for s in (e.left, e.right)]
        assert all(sides.count(s) == 2 for s in set(sides))


def test_a_contracted_edge_leaves_one_node() -> None:
    topology = find_topology(hip_image())
    contracted(topology, next(e for e in topology.edges if e.pair() == (0, 2)))
    apex = [n for n in topology.nodes if not topology.on_contour(n)]
    assert [topology.surfaces(n) for n in apex] == [[0, 1, 2, 3]]


def test_scan_sees_each_hip_at_its_corner() -> None:
    grid = CellGrid(0.0, 0.0, 1.0, 6, 8)
    contour = Contour.of(box(1, 1, 7, 5))
    found = [a for a in scan_contour(contour, HIP, grid) if a.corner >= 0]
    corners = {tuple(contour.vertices[a.corner]): a.pair for a in found}
    assert corners == {(1.0, 1.0): (0, 3), (7.0, 1.0): (0, 1), (7.0, 5.0): (1, 2), (1.0, 5.0): (2, 3)}


def test_contour_knows_its_inside_whatever_its_direction() -> None:
    yard = [(4, 2), (6, 2), (6, 4), (4, 4)]
    for shell in ([(0, 0), (9, 0), (9, 6), (0, 6)], [(0, 6), (9, 6), (9, 0), (0, 0)]):
        outline = Polygon(shell, [yard])
        contour = Contour.of(outline)
        middles = (contour.vertices + contour.vertices[contour.following]) / 2
        for point in middles + 0.1 * contour.inward:
            assert outline.contains(Polygon(point + np.array([[0, 0], [0.01, 0], [0, 0.01]])))


def test_skew_lines_meet_in_the_middle_of_their_shortest_connection() -> None:
    x_axis = np.zeros(3), np.array([1.0, 0.0, 0.0])
    above = np.array([2.0, 5.0, 0.4]), np.array([0.0, 1.0, 0.0])
    found = shortest_connection(x_axis, above)
    assert found is not None
    np.testing.assert_allclose(found[0], [2.0, 0.0, 0.2], atol=1e-12)
    assert found[1] == pytest.approx(0.4)
    assert shortest_connection(x_axis, (np.array([0.0, 1.0, 0.0]), x_axis[1])) is None


def test_three_planes_meet_in_one_point() -> None:
    planes = np.array([[0.5, 0.0, 1.0], [-0.4, 0.1, 6.0], [0.0, -0.6, 5.0]])
    lines = [crossing_line(planes[i], planes[j]) for i, j in ((0, 1), (1, 2), (0, 2))]
    met = meeting_point([line for line in lines if line is not None])
    assert met is not None
    point, spread = met
    np.testing.assert_allclose(planes[:, :2] @ point[:2] + planes[:, 2], point[2], atol=1e-9)
    assert spread < 1e-9


def test_tied_planes_pass_through_the_node_and_hardly_move() -> None:
    rng = np.random.default_rng(2)
    planes = np.array([[0.0, 0.7, 1.0], [-0.7, 0.0, 8.02], [0.0, -0.7, 8.0], [0.7, 0.0, 0.99]])
    sums = []
    for plane in planes:
        xy = rng.uniform(0, 10, (500, 2))
        z = xy @ plane[:2] + plane[2]
        sums.append(CellPoints.of(CellGrid(0, 0, 20.0, 1, 1), np.column_stack([xy, z])).sums[0])
    node = np.array([5.0, 5.0])
    tied = through_ties(planes, np.array(sums), [(node, [0, 1, 2, 3])])
    assert np.ptp(tied[:, :2] @ node + tied[:, 2]) < 1e-9
    corners = np.array([[0, 0, 1], [10, 0, 1], [0, 10, 1], [10, 10, 1]])
    assert np.abs((tied - planes) @ corners.T).max() < 0.05


def test_planes_of_sums_are_those_of_least_squares() -> None:
    rng = np.random.default_rng(0)
    xy = rng.uniform(0, 3, (200, 2))
    z = xy @ [0.3, -0.8] + 4 + rng.normal(0, 0.05, 200)
    out = np.empty(4)
    assert plane_of_sums(CellPoints.of(CellGrid(0, 0, 5.0, 1, 1), np.column_stack([xy, z])).sums[0], out)
    expected = np.linalg.lstsq(np.column_stack([xy, np.ones(200)]), z, rcond=None)[0]
    np.testing.assert_allclose(out[:3], expected, atol=1e-9)


def test_spacing_grows_with_noise_and_shrinks_with_density() -> None:
    assert spacing(10, 0.1, 0.08, 6) > spacing(10, 0.03, 0.08, 6)
    assert spacing(10, 0.03, 0.08, 6) > spacing(60, 0.03, 0.08, 6)
    assert 0.25 <= spacing(1e6, 1e-6, 0.08, 6) <= spacing(1e-6, 10, 0.08, 6) <= 1.5


def facade_points(ring: np.ndarray, sigma: float, seed: int) -> np.ndarray:
    """25 points per m² of walls of 6 m, and a level roof on them."""
    rng = np.random.default_rng(seed)
    parts = []
    for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        count = int(25 * 6 * np.hypot(*(b - a)))
        spots = a + rng.uniform(0, 1, (count, 1)) * (b - a) + rng.normal(0, sigma, (count, 2))
        parts.append(np.column_stack([spots, rng.uniform(0, 6, count)]))
    x, y = rng.uniform(0, 12, 4000), rng.uniform(0, 9, 4000)
    roof = np.column_stack([x, y, 6 + rng.normal(0, 0.03, 4000)])
    return np.concatenate([*parts, roof[(x < 6) | (y < 5)]])


@pytest.mark.parametrize(("sigma", "tolerance"), [(0.03, 0.02), (0.12, 0.3)])
@pytest.mark.parametrize("turn_deg", [0.0, 23.0])
def test_facades_close_the_contour(sigma: float, tolerance: float, turn_deg: float) -> None:
    """The given outline is off by 0.3 m: the façades tell the true one, but for the wall that nobody sees."""
    true = np.array([(0, 0), (12, 0), (12, 5), (6, 5), (6, 9), (0, 9)], float)
    angle = np.radians(turn_deg)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    xyz = facade_points(true, sigma, 1)
    hidden = (xyz[:, 0] < 1) & (xyz[:, 2] < 5.8)
    xyz = np.column_stack([xyz[~hidden, :2] @ turn, xyz[~hidden, 2]])
    outline = Polygon(true @ turn + [0.2, 0.2])
    parameters = FacadeLineParameters()
    found, _ = find_facade_cells(xyz, (-20.0, -20.0, 30.0, 30.0), parameters.cells)
    contour = close_contour(facade_lines(found, parameters), outline, [], parameters)
    assert contour.source == ("facade",) * 5 + ("outline",)
    seen_corners = contour.ring[1:5]
    assert np.hypot(*(seen_corners - (true @ turn)[1:5]).T).max() < tolerance
    assert contour.seen > 0.45


def test_edges_that_a_neighbour_shares_are_never_replaced() -> None:
    true = np.array([(0, 0), (12, 0), (12, 5), (6, 5), (6, 9), (0, 9)], float)
    parameters = FacadeLineParameters()
    found, _ = find_facade_cells(facade_points(true, 0.03, 3), (-2.0, -2.0, 14.0, 11.0), parameters.cells)
    party = [LineString([(12, 0), (12, 5)])]
    contour = close_contour(facade_lines(found, parameters), Polygon(true), party, parameters)
    assert contour.source[1] == "party"
    assert contour.source.count("facade") == 5
