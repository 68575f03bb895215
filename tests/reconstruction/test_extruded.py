from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, box

from cityflow.core.building import Lod, Status
from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.polyhedron import volume
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.extruded import ExtrudedParameters, extrude, reconstruct

OUTLINE = Polygon([(85000.5, 447000.25), (85010.5, 447000.25), (85010.5, 447008.25), (85000.5, 447008.25)])


def evidence(z: list[float], ground: float = 1.0) -> Evidence:
    points = np.column_stack([np.full(len(z), 85005.0), np.full(len(z), 447004.0), np.array(z)])
    return Evidence("a", OUTLINE, PointCloud.of(points), ground)


def test_top_is_the_percentile_of_the_points() -> None:
    candidate = reconstruct(evidence(list(np.arange(2.0, 13.0))), ExtrudedParameters(percentile=70))
    assert candidate.solid is not None
    assert candidate.status is Status.DEGRADED
    assert candidate.reason
    assert check_polyhedron(candidate.solid) == []
    assert volume(candidate.solid) == pytest.approx(80 * 8.0)
    assert set(candidate.blocks) == {Lod.LOD12, Lod.LOD13}
    assert candidate.planes[0].z(np.array([85001.0]), np.array([447001.0])) == pytest.approx(9.0)


@pytest.mark.parametrize("heights", [[], [float("nan")]])
def test_no_heights_give_no_solid(heights: list[float]) -> None:
    candidate = reconstruct(evidence(heights), ExtrudedParameters())
    assert candidate.solid is None
    assert candidate.status is Status.FAILED
    assert "0 roof points" in candidate.reason


def test_points_below_the_ground_give_a_low_block() -> None:
    candidate = reconstruct(evidence([-3.0, -2.0]), ExtrudedParameters())
    assert candidate.solid is not None
    assert check_polyhedron(candidate.solid) == []


def test_holes_and_all_vertices_are_kept() -> None:
    court = Polygon(box(0.1, 0.2, 20.3, 16.7).exterior.coords, [box(6, 6, 14, 10).exterior.coords])
    solid = extrude(court, 0.3, 5.1)
    assert check_polyhedron(solid) == []
    assert volume(solid) == pytest.approx(court.area * 4.8)
    plan = {tuple(v) for v in solid.vertices[:, :2].tolist()}
    assert plan == {v for ring in (court.exterior, *court.interiors) for v in ring.coords}
