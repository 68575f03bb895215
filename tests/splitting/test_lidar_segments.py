from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from shapely import Polygon

from cityflow.core.grid import Grid
from cityflow.core.local_frame import LocalFrame
from cityflow.core.points import HIGH_NOISE, PointCloud, concatenate
from cityflow.core.splitting import SURFACE, FrameRasters, Segments, SplitEvidence
from cityflow.splitting.directions.principal import principal_directions
from cityflow.splitting.lidar_surface import from_points
from cityflow.splitting.segments.segments import find_segments
from house_row import HouseRow, nadir, rasters, scanned

ROW = HouseRow(eaves=(6.0, 6.5, 6.2, 5.0), facades=(100,) * 4, roofs=(100,) * 4, turn_deg=23.0)


BLIND = FrameRasters(
    LocalFrame("nadir", np.eye(3), np.zeros(3)),
    Grid(85000.0, 447080.0, 0.5, 160, 160),
    np.full((160, 160), np.nan, np.float32),
)
"""The surface of a run, of which points know more."""


def evidence(points: PointCloud, outline: Polygon = ROW.outline) -> SplitEvidence:
    return SplitEvidence("row", outline, (BLIND,), 0.0, points)


def lidar_segments(given: SplitEvidence) -> Segments:
    return find_segments(replace(given, frames=(from_points(given),)))


@cache
def found(density: float, seed: int) -> Segments:
    return lidar_segments(evidence(scanned(ROW, density, seed)))


def test_the_direction_of_the_row_is_found() -> None:
    s = found(10.0, 0)
    assert len(s) >= 12
    assert set(s.layer.tolist()) == {SURFACE}
    p = principal_directions(s)
    assert min(abs(a.degrees - 23) for a in p.aspects) < 0.5


def test_houses_in_one_plane_have_no_border() -> None:
    row = replace(ROW, eaves=(6.0, 6.0, 6.0))
    s = lidar_segments(evidence(scanned(row, 10.0, 3), row.outline))
    u = (0.5 * (s.start + s.end)[:, :2] - row.at) @ row.along
    across = np.abs((s.aspect_deg - 113 + 90) % 180 - 90) < 20
    assert not (across & (u > 1) & (u < 17)).any()


def test_birds_raise_no_segment() -> None:
    cloud = scanned(ROW, 10.0, 0)
    rng = np.random.default_rng(1)
    x_min, y_min, x_max, y_max = ROW.outline.bounds
    birds = PointCloud.of(rng.uniform([x_min, y_min, 20], [x_max, y_max, 40], (40, 3)), HIGH_NOISE)
    s = lidar_segments(evidence(concatenate([cloud, birds])))
    assert s.start.tobytes() == found(10.0, 0).start.tobytes()


def test_with_pictures_the_surface_is_that_of_the_run() -> None:
    seen = rasters(ROW, nadir(), 0.1)
    assert from_points(SplitEvidence("row", ROW.outline, (seen,), 0.0, scanned(ROW, 10.0, 0))) is seen


@pytest.mark.parametrize("count", [0, 1, 3, 50])
def test_few_points_raise_nothing(count: int) -> None:
    cloud = scanned(ROW, 10.0, 0).take(np.arange(count))
    assert len(lidar_segments(evidence(cloud))) == 0


def test_points_on_one_line_raise_nothing() -> None:
    t = np.linspace(0, 24, 4000)
    xyz = np.column_stack([ROW.at[0] + t * ROW.along[0], ROW.at[1] + t * ROW.along[1], np.full(len(t), 6.0)])
    assert len(lidar_segments(evidence(PointCloud.of(xyz)))) == 0


def test_without_points_there_is_nothing() -> None:
    assert len(lidar_segments(SplitEvidence("row", ROW.outline, (BLIND,), 0.0))) == 0
