from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from cityflow.core.building import Polyhedron
from cityflow.geometry.polyhedron import volume
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.partition.partition_values import RoofPartition
from cityflow.reconstruction.partition.plane_energy import PartitionParameters
from cityflow.reconstruction.partition.roof_partition import partition_roof
from cityflow.reconstruction.planes.plane_segments import PlaneSegments
from cityflow.reconstruction.solids.assemble import assemble
from roof_cases import ORIGIN, RoofCase, lattice, roof_cases, top_heights

CASES = roof_cases()
DEFAULT = PartitionParameters()


def _solid(case: RoofCase, segments: PlaneSegments) -> tuple[RoofPartition, Polyhedron]:
    partition, _ = partition_roof(case.outline, segments, DEFAULT)
    return partition, assemble(partition, segments.coefficients, 1.0, ORIGIN)


@pytest.mark.parametrize("name", sorted(CASES))
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_finds_the_true_roof(name: str, seed: int) -> None:
    case = CASES[name]
    partition, solid = _solid(case, case.segments(seed, gap=0.1))
    assert check_polyhedron(solid) == []
    x, y = lattice(case.outline)
    miss = np.abs(top_heights(solid, x + ORIGIN[0], y + ORIGIN[1]) - case.heights(x, y))
    # Step edges are known to a point spacing: a strip along them may belong to the other side.
    assert np.mean(miss < 0.02) > 0.95
    assert volume(solid) == pytest.approx(case.volume(1.0), rel=0.02)
    assert len(partition.cells) == len(case.regions)


@pytest.mark.parametrize("name", ["gable", "hip", "mansard", "ell", "tee", "courtyard"])
def test_intersections_are_exact_whatever_the_points(name: str) -> None:
    """Where the roof is made of intersections only, its volume does not depend on where the points fell."""
    case = CASES[name]
    _, solid = _solid(case, case.segments(5, density=8.0))
    assert volume(solid) == pytest.approx(case.volume(1.0), rel=1e-5)


@pytest.mark.parametrize("name", ["hip", "pyramid", "ell", "tee", "courtyard", "gables crosswise"])
@pytest.mark.parametrize("seed", range(6))
def test_planes_a_little_off_keep_the_partition(name: str, seed: int) -> None:
    """Lines that should meet in one point pass each other by millimetres or centimetres: no polygon is lost by it."""
    case = CASES[name]
    exact = case.segments(seed)
    off = np.random.default_rng(seed).normal(0, (0.002, 0.002, 0.01), exact.coefficients.shape)
    segments = PlaneSegments(ORIGIN, exact.points, exact.labels, exact.coefficients + off, exact.rmse, exact.noise)
    partition, solid = _solid(case, segments)
    assert check_polyhedron(solid) == []
    assert len(partition.cells) == len(case.regions)
    assert volume(solid) == pytest.approx(case.volume(1.0), rel=0.02)


@pytest.mark.parametrize("name", sorted(CASES))
def test_cells_cover_the_outline_without_overlap(name: str) -> None:
    case = CASES[name]
    partition, _ = partition_roof(case.outline, case.segments(3, noise=0.05), DEFAULT)
    polygons = [partition.polygon(cell) for cell in partition.cells]
    assert all(p.is_valid for p in polygons)
    assert sum(p.area for p in polygons) == pytest.approx(case.outline.area, rel=1e-9)
    assert shapely.union_all(polygons).symmetric_difference(case.outline).area < 1e-6
    outline = shapely.get_coordinates(case.outline.exterior)[:-1]
    assert np.array_equal(partition.vertices[: len(outline)], outline)


def test_same_input_gives_the_same_bytes() -> None:
    segments = CASES["tee"].segments(1)
    first, second = (partition_roof(CASES["tee"].outline, segments, DEFAULT)[0] for _ in range(2))
    assert first.cells == second.cells
    assert first.vertices.tobytes() == second.vertices.tobytes()


def test_narrow_strip_without_points_joins_its_neighbour() -> None:
    """Two planes whose points leave a strip between parallel lines: no sliver of either remains."""
    case = CASES["step"]
    partition, _ = partition_roof(case.outline, case.segments(0, gap=0.6), DEFAULT)
    assert min(partition.polygon(cell).buffer(-0.2).area for cell in partition.cells) > 1


def test_stretch_without_points_goes_to_a_neighbour() -> None:
    """No points in a third of the house: the roof goes on, closed and without a wild height."""
    case = CASES["gable"]
    segments = case.segments(0)
    seen = segments.points[:, 0] < 8
    thinned = PlaneSegments(
        ORIGIN, segments.points[seen], segments.labels[seen], segments.coefficients, segments.rmse, segments.noise
    )
    _, solid = _solid(case, thinned)
    assert volume(solid) == pytest.approx(case.volume(1.0), rel=1e-5)


def test_clutter_makes_no_roof_polygons() -> None:
    case = CASES["flat"]
    segments = case.segments(0)
    points = segments.points.copy()
    rng = np.random.default_rng(0)
    points[rng.choice(len(points), 150, replace=False), 2] += rng.uniform(0.5, 3, 150)
    planes = np.array([[0, 0, 6.0], [0.3, 0.1, 7.0], [-0.2, 0.4, 6.5]])
    labels = segments.labels.copy()
    labels[np.abs(points[:, 2] - 6.0) > 0.3] = -1
    cluttered = PlaneSegments(ORIGIN, points, labels, planes, np.full(3, 0.02), 0.02)
    partition, _ = partition_roof(case.outline, cluttered, DEFAULT)
    assert [cell.plane for cell in partition.cells] == [0]


@pytest.mark.parametrize("noise", [0.05, 0.15])
def test_noisy_cloud_keeps_the_number_of_parts(noise: float) -> None:
    for name in ("hip", "corner step", "gable beside flat"):
        case = CASES[name]
        partition, solid = _solid(case, case.segments(4, density=60.0, noise=noise))
        assert check_polyhedron(solid) == []
        assert len(partition.cells) == len(case.regions)


def test_round_outline_with_many_vertices() -> None:
    angle = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    outline = Polygon(np.column_stack([10 + 8 * np.cos(angle), 10 + 8 * np.sin(angle)]).round(3))
    rng = np.random.default_rng(1)
    xy = rng.uniform(2, 18, (3000, 2))
    xy = xy[shapely.contains_xy(outline, xy[:, 0], xy[:, 1])]
    labels = (np.hypot(*(xy - 10).T) < 4).astype(np.int64)
    planes = np.array([[0.0, 0.0, 6.0], [0.0, 0.0, 12.0]])
    segments = PlaneSegments(ORIGIN, np.column_stack([xy, planes[labels, 2]]), labels, planes, np.zeros(2), 0.02)
    partition, _ = partition_roof(outline, segments, DEFAULT)
    solid = assemble(partition, planes, 0.0, ORIGIN)
    assert check_polyhedron(solid) == []
    assert volume(solid) == pytest.approx(outline.area * 6 + np.pi * 16 * 6, rel=0.05)


def test_number_of_cells_is_bounded() -> None:
    rng = np.random.default_rng(2)
    outline = box(0, 0, 60, 40)
    planes = np.column_stack([rng.normal(0, 0.4, (40, 2)), rng.uniform(5, 30, 40)])
    xy = rng.uniform((0, 0), (60, 40), (6000, 2))
    centres = rng.uniform((0, 0), (60, 40), (40, 2))
    labels = np.argmin(np.hypot(*(xy[:, None] - centres).transpose(2, 0, 1)), axis=1)
    z = np.einsum("ij,ij->i", np.column_stack([xy, np.ones(len(xy))]), planes[labels])
    segments = PlaneSegments(ORIGIN, np.column_stack([xy, z]), labels, planes, np.full(40, 0.02), 0.02)
    partition, _ = partition_roof(outline, segments, PartitionParameters(max_cells=60))
    assert len(partition.cells) <= 60
    assert sum(partition.polygon(c).area for c in partition.cells) == pytest.approx(2400)


def test_needs_a_plane() -> None:
    empty = PlaneSegments(ORIGIN, np.empty((0, 3)), np.empty(0, np.int64), np.empty((0, 3)), np.empty(0), 0.02)
    with pytest.raises(ValueError, match="at least one plane"):
        partition_roof(box(0, 0, 1, 1), empty, DEFAULT)
