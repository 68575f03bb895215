"""Where two roof faces part beyond the walls: hips and valleys end in corners of the rim, and no strips are left beside steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import EdgeOverhang, Polyhedron, Semantic
from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.polyhedron import rings_of
from cityflow.geometry.straight_edges import wall_edges
from cityflow.geometry.validity import check_polygons, check_polyhedron
from cityflow.reconstruction.overhangs.overhang_solid import with_overhangs
from cityflow.reconstruction.partition.partition_values import RoofCell, RoofPartition
from cityflow.reconstruction.solids.assemble import assemble

FLOOR = 10.0
ORIGIN = (1000.0, 2000.0, 0.0)
NARROW_M = 0.1
Cells = Sequence[tuple[Sequence[int], tuple[float, float, float]]]


def rotated(xy: FloatArray, angle_deg: float) -> FloatArray:
    a = np.radians(angle_deg)
    return np.asarray(xy @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]))


def solid_of(
    outline: Sequence[tuple[float, float]], inner: Sequence[tuple[float, float]], cells: Cells, angle_deg: float
) -> tuple[Candidate, Polygon]:
    """A solid from roof polygons and their planes z = a·x + b·y + c, turned about the origin."""
    vertices = np.round(rotated(np.array([*outline, *inner]), angle_deg), 4)
    planes = np.array([p for _, p in cells])
    planes[:, :2] = rotated(planes[:, :2], angle_deg)
    partition = RoofPartition(vertices, len(outline), tuple(RoofCell((tuple(r),), k) for k, (r, _) in enumerate(cells)))
    world = Polygon(vertices[: len(outline)] + ORIGIN[:2])
    solid = assemble(partition, planes, FLOOR, ORIGIN, world)
    assert check_polyhedron(solid) == []
    return Candidate("test", solid), world


def pyramid(noise_m: float, slip_m: float, angle_deg: float) -> tuple[Candidate, Polygon]:
    """Slopes that differ a little; the hip to the south-east ends so far beside its corner, with a step."""
    outline = [(0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)]
    cells = [
        ((0, 5, 4), (0.0, 0.84, 13.0)), ((5, 1, 2, 4), (-0.80, 0.0, 19.4 + noise_m)),
        ((2, 3, 4), (0.0, -0.83, 19.64)), ((3, 0, 4), (0.82, 0.0, 13.0)),
    ]  # fmt: skip
    return solid_of(outline, [(4.0, 4.0), (8.0 - slip_m, 0.0)], cells, angle_deg)


def wing(past_m: float, angle_deg: float) -> tuple[Candidate, Polygon]:
    """A wing whose slope is lower than the main roof where this ends at the wing's wall, so far from the inner corner."""
    outline = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (9.0, 4.0), (9.0, 9.0), (0.0, 9.0)]
    inner = [(0.0, 6.75), (3.0, 3.75), (4.0, 4.0 - past_m)]
    cells = [
        ((2, 3, 4, 5, 6, 7, 8), (0.0, 0.8, 9.8)),
        ((0, 1, 8, 7, 6), (-0.8, 0.0, 15.2)),
    ]  # fmt: skip
    return solid_of(outline, inner, cells, angle_deg)


def roofs_beyond(
    candidate: Candidate, outline: Polygon, reaches: Sequence[float], party: Sequence[LineString] = ()
) -> list[FloatArray]:
    """Rings of the roof beyond the walls; every edge stands out as wanted and the solid is valid."""
    edges = wall_edges(outline, party)
    wanted = [EdgeOverhang(e.line, 0.0 if e.party else reaches[k % len(reaches)]) for k, e in enumerate(edges)]
    evidence = Evidence("u", outline, PointCloud.empty(), FLOOR, party=tuple(party))
    done = with_overhangs(candidate, wanted, evidence)
    assert done.notes["overhangs_left"] == 0
    assert done.solid is not None
    assert check_polyhedron(done.solid) == []
    beyond: Polyhedron | None = done.beyond
    assert beyond is not None
    assert check_polygons(rings_of(beyond)) == []
    return [beyond.ring(f.rings[0]) - (*outline.exterior.coords[0], 0.0) for f in beyond.of_semantic(Semantic.ROOF)]


def rim_corners(rings: Sequence[FloatArray]) -> FloatArray:
    """Corners of what the roofs cover together."""
    around = shapely.get_coordinates(shapely.union_all([Polygon(r[:, :2]) for r in rings]).exterior)[:-1]
    first = int(np.argmax(np.hypot(*(around - around.mean(axis=0)).T)))
    return np.asarray(
        shapely.get_coordinates(shapely.simplify(shapely.LinearRing(np.roll(around, -first, axis=0)), 0.02))[:-1]
    )


def narrow_area(rings: Sequence[FloatArray]) -> float:
    """Area of the roofs' parts that are narrower than allowed."""
    lost = 0.0
    for ring in rings:
        polygon = Polygon(ring[:, :2])
        opened = polygon.buffer(-NARROW_M / 2, join_style="mitre").buffer(NARROW_M / 2, join_style="mitre")
        lost += polygon.difference(opened).area
    return lost


@pytest.mark.parametrize("reaches", [(0.3,), (0.5, 0.42, 0.55, 0.47), (0.32, 0.29, 0.31, 0.36)])
@pytest.mark.parametrize(("noise_m", "slip_m"), [(0.0, 0.1), (0.1, 0.1), (-0.08, 0.15), (0.02, 0.03)])
@pytest.mark.parametrize("angle_deg", [0.0, 17.0])
def test_hips_end_in_the_corners_of_the_rim(
    reaches: Sequence[float], noise_m: float, slip_m: float, angle_deg: float
) -> None:
    candidate, outline = pyramid(noise_m, slip_m, angle_deg)
    rings = roofs_beyond(candidate, outline, reaches)
    corners = rim_corners(rings)
    assert len(corners) == 4
    for corner in corners:
        there = [r[np.hypot(*(r[:, :2] - corner).T) < 0.02, 2] for r in rings]
        heights = [z.mean() for z in there if len(z)]
        assert len(heights) == 2
        assert abs(heights[0] - heights[1]) < 0.025


@pytest.mark.parametrize("reach", [0.6, 0.8, 0.72])
@pytest.mark.parametrize("past_m", [0.55, 0.66, 0.75, 0.78])
@pytest.mark.parametrize("angle_deg", [0.0, 17.0])
def test_no_strip_of_the_wings_slope_runs_along_the_main_eave(reach: float, past_m: float, angle_deg: float) -> None:
    candidate, outline = wing(past_m, angle_deg)
    rings = roofs_beyond(candidate, outline, (reach,))
    assert narrow_area(rings) < 0.015
    lowest = min(r[:, 2].min() for r in rings)
    assert lowest > 12.0 - 0.8 * reach - 0.05


@pytest.mark.parametrize("shared", [0, 1, 2, 3])
def test_hips_beside_a_shared_wall_leave_no_strips(shared: int) -> None:
    candidate, outline = pyramid(0.1, 0.1, 17.0)
    ring = shapely.get_coordinates(outline.exterior)
    wall = LineString(ring[shared : shared + 2])
    rings = roofs_beyond(candidate, outline, (0.5, 0.42, 0.55), [wall])
    assert narrow_area(rings) < 0.02
    assert all(shapely.area(shapely.intersection(Polygon(r[:, :2]), _behind(wall, outline))) < 1e-3 for r in rings)


def _behind(wall: LineString, outline: Polygon) -> Polygon:
    """What lies behind a shared wall, relative to the outline's first vertex."""
    (x1, y1), (x2, y2) = wall.coords
    out = np.array([y2 - y1, x1 - x2]) / wall.length
    out = out if not shapely.contains_xy(outline, *(np.array(wall.centroid.coords[0]) + 0.1 * out)) else -out
    ends = np.array([[x1, y1], [x2, y2]]) - outline.exterior.coords[0]
    return Polygon([*ends, *(ends + out)[::-1]])
