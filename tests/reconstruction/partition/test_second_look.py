from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.roof_distances import distances_to_roof, summarise
from cityflow.reconstruction.orientation_histogram import OrientationHistogramParameters, reconstruct
from cityflow.reconstruction.partition.partition_values import single_cell
from cityflow.reconstruction.partition.second_look import Patch, lines_around, missed_patches
from cityflow.reconstruction.planes.plane_segments import PlaneSegments

LEVEL, RAISED = (0.0, 0.0, 6.0), (0.0, 0.0, 7.0)


def house_with_annex(width: float, neck: float, slanted: bool = False) -> Polygon:
    """A house of 10 × 8 m, an annex of 5 × 4 m, and a slit between that leaves a neck, metres."""
    beyond = 10.0 if slanted else 10.0 + width
    house = [(10 + width, 2 + neck), (10, 2 + neck), (9.99, 8) if slanted else (10, 8), (0, 8), (0, 0), (10, 0)]
    return Polygon([(10, 2), (15, 2), (15, 6), (beyond, 6), (beyond, 5.9), *house])


@pytest.mark.parametrize("slanted", [False, True])
@pytest.mark.parametrize(("width", "neck"), [(0.09, 0.1), (0.09, 0.02), (0.09, 1.5), (0.01, 0.3)])
def test_a_slit_in_an_outline_cuts_off_no_annex(width: float, neck: float, slanted: bool) -> None:
    rng = np.random.default_rng(3)
    outline = house_with_annex(width, neck, slanted)
    xy = rng.uniform((0, 0), (16, 8), (1500, 2))
    z = np.where(xy[:, 0] < 10, 8 + 0.5 * np.minimum(xy[:, 1], 8 - xy[:, 1]), 4.0) + rng.normal(0, 0.03, 1500)
    xyz = np.column_stack([xy, z])[shapely.contains_xy(outline, *xy.T)]
    candidate = reconstruct(Evidence("a", outline, PointCloud.of(xyz, BUILDING), 0.0), OrientationHistogramParameters())
    assert candidate.solid is not None
    assert summarise(distances_to_roof(candidate.solid, xyz)).within_20cm > 0.99


def raised_square(seed: int) -> PlaneSegments:
    """A level roof with a square of 3 m raised by a metre at 4 to 7, 3 to 6."""
    xy = np.random.default_rng(seed).uniform((0, 0), (12, 9), (900, 2))
    on = shapely.contains_xy(box(4, 3, 7, 6), *xy.T)
    planes = np.array([LEVEL, RAISED])
    return PlaneSegments((0, 0, 0), np.column_stack([xy, 6.0 + on]), on.astype(np.int64), planes, np.zeros(2), 0.03)


def test_what_a_roof_misses_is_found_and_nothing_else() -> None:
    segments = raised_square(1)
    roof = single_cell(box(0, 0, 12, 9))
    (patch,) = missed_patches(roof, segments.coefficients, segments, (0.15, 6.0, 1.0))
    assert patch.plane == 1
    assert len(patch.xy) == np.count_nonzero(segments.labels == 1)
    assert patch.above == pytest.approx(1.0)
    assert missed_patches(roof, segments.coefficients, segments, (0.15, 1e4, 1.0)) == []


@pytest.mark.parametrize("turn", [0.0, 0.4, 1.2])
def test_lines_run_around_a_patch(turn: float) -> None:
    xy = np.random.default_rng(0).uniform((-2, -1), (2, 1), (800, 2))
    c, s = math.cos(turn), math.sin(turn)
    patch = Patch(0, xy @ np.array([[c, s], [-s, c]]), 1.0)
    lines = lines_around(patch, (0.0, 0.4, 1.2), 0.0)
    corners = np.array([line.at(t) for line in lines for t in (line.start, line.end)])
    found = shapely.MultiPoint(corners).convex_hull
    true = shapely.affinity.rotate(box(-2, -1, 2, 1), turn, origin=(0, 0), use_radians=True)
    assert found.symmetric_difference(true).area < 0.1 * true.area
    assert sorted(line.end - line.start for line in lines) == pytest.approx([2, 2, 4, 4], rel=0.08)


def test_a_plane_without_a_face_is_named() -> None:
    xy = np.random.default_rng(4).uniform((0, 0), (12, 9), (900, 2))
    z = 6.0 + shapely.contains_xy(box(4, 3, 7, 6), *xy.T)
    evidence = Evidence("a", box(0, 0, 12, 9), PointCloud.of(np.column_stack([xy, z]), BUILDING), 0.0)
    plain = OrientationHistogramParameters()
    dear = plain.model_copy(update={"partition": plain.partition.model_copy(update={"number_cost": 7.0})})
    assert "missed" not in reconstruct(evidence, plain).notes
    notes = reconstruct(evidence, dear).notes
    assert notes["missed_patches"] == 1
    assert str(notes["missed"]).endswith("points +1.0 m")
