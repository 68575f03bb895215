from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from shapely import Polygon

from cityflow.core.points import HIGH_NOISE, PointCloud, concatenate
from cityflow.core.splitting import POINTS, Segments, SplitEvidence
from cityflow.splitting.directions.principal import principal_directions
from cityflow.splitting.segments.lidar_segments import lidar_segments
from cityflow.splitting.segments.segments import find_segments
from house_row import HouseRow, found_share, nadir, rasters, scanned

ROW = HouseRow(eaves=(6.0, 6.5, 6.2, 5.0), facades=(100,) * 4, roofs=(100,) * 4, turn_deg=23.0)


def evidence(points: PointCloud, outline: Polygon = ROW.outline) -> SplitEvidence:
    return SplitEvidence("row", outline, (), 0.0, points)


@cache
def found(density: float, seed: int) -> Segments:
    return lidar_segments(evidence(scanned(ROW, density, seed)))


def share(s: Segments, first: tuple[float, float, float], second: tuple[float, float, float]) -> float:
    return found_share(ROW.edge(first, second), s.start, s.end, 0.25, 4.0)


@pytest.mark.parametrize("density", [8.0, 14.0])
@pytest.mark.parametrize("seed", [0, 1])
def test_ridges_are_where_the_roofs_meet(density: float, seed: int) -> None:
    shares = [
        share(found(density, seed), (6 * k + 0.5, 0, ROW.ridge(k)), (6 * k + 5.5, 0, ROW.ridge(k))) for k in range(4)
    ]
    assert np.mean(shares) > 0.85


@pytest.mark.parametrize("density", [8.0, 14.0])
@pytest.mark.parametrize("seed", [0, 1])
def test_steps_between_houses_are_found(density: float, seed: int) -> None:
    shares = []
    for border in (1, 2, 3):
        high = max(ROW.eaves[border - 1], ROW.eaves[border])
        for side in (-1, 1):
            low, up = (6 * border, side * 4.5, high + 0.5 * 0.8), (6 * border, side * 0.5, high + 4.5 * 0.8)
            shares.append(share(found(density, seed), low, up))
    assert np.mean(shares) > 0.7


def test_eaves_are_found() -> None:
    shares = [
        share(found(10.0, 0), (6 * k + 0.5, side * 5, ROW.eaves[k]), (6 * k + 5.5, side * 5, ROW.eaves[k]))
        for k in range(4) for side in (-1, 1)
    ]  # fmt: skip
    assert np.mean(shares) > 0.7


def test_what_is_found_is_there_and_tells_the_direction() -> None:
    s = found(10.0, 0)
    assert len(s) >= 12
    assert set(s.layer.tolist()) == {POINTS}
    p = principal_directions(s)
    assert p.good, p.reason
    assert min(abs(a.degrees - 23) for a in p.aspects) < 0.5
    along = np.abs((s.aspect_deg - 23 + 45) % 90 - 45)
    assert np.average(along < 4, weights=s.length) > 0.85


def test_a_firewall_between_roofs_of_one_height_is_found() -> None:
    row = replace(ROW, eaves=(6.0, 6.0, 6.0))
    cloud = scanned(row, 10.0, 2)
    rng = np.random.default_rng(0)
    n = 60
    v = rng.uniform(-4.8, 4.8, n)
    wall = np.array([row.world(u, w, 0) for u, w in zip(rng.uniform(5.85, 6.15, n), v, strict=True)])
    wall[:, 2] = 6 + 0.8 * (5 - np.abs(v)) + 0.45 + rng.normal(0, 0.03, n)
    s = lidar_segments(evidence(concatenate([cloud, PointCloud.of(wall)]), row.outline))
    for side in (-1, 1):
        edge = row.edge((6, side * 4.5, 6.4), (6, side * 0.5, 9.6))
        assert found_share(edge, s.start, s.end, 0.7, 6.0) > 0.6


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


def test_pictures_are_looked_at_before_points_are() -> None:
    cloud = scanned(ROW, 10.0, 0)
    seen = rasters(ROW, nadir(), 0.1)
    blind = replace(seen, ortho=None, seen=None)
    with_ortho = find_segments(SplitEvidence("row", ROW.outline, (seen,), 0.0, cloud))
    without = find_segments(SplitEvidence("row", ROW.outline, (blind,), 0.0, cloud))
    assert POINTS not in with_ortho.layer
    assert set(without.layer.tolist()) == {POINTS}
    assert without.frames == ("nadir",)


@pytest.mark.parametrize("count", [0, 1, 3, 50])
def test_few_points_raise_nothing(count: int) -> None:
    cloud = scanned(ROW, 10.0, 0).take(np.arange(count))
    assert len(lidar_segments(evidence(cloud))) == 0


def test_points_on_one_line_raise_nothing() -> None:
    t = np.linspace(0, 24, 4000)
    xyz = np.column_stack([ROW.at[0] + t * ROW.along[0], ROW.at[1] + t * ROW.along[1], np.full(len(t), 6.0)])
    assert len(lidar_segments(evidence(PointCloud.of(xyz)))) == 0


def test_without_points_there_is_nothing() -> None:
    assert len(lidar_segments(SplitEvidence("row", ROW.outline, (), 0.0))) == 0
