"""Rows split from points alone."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon, affinity, box

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import grown
from cityflow.core.points import PointCloud
from cityflow.core.splitting import SplitEvidence
from cityflow.splitting.lidar_surface import lidar_raster
from cityflow.splitting.split import SplitParameters, split

WIDTH_M, COUNT, DEPTH_M, TURN_DEG = 5.4, 5, 9.0, 21.0


def evidence_of(
    heights: FloatArray, gables: bool, walls_m: float = 0.0, seed: int = 4
) -> tuple[SplitEvidence, list[Polygon]]:
    """A row of houses with eaves of the heights given, and walls 0.4 m wide between them that rise above the roofs, under 8 points per m²."""
    rng = np.random.default_rng(seed)
    length = WIDTH_M * len(heights)
    outline = affinity.rotate(box(0, 0, length, DEPTH_M), TURN_DEG, origin=(0, 0))
    low_x, low_y, high_x, high_y = around = grown(outline.bounds, 3.0)
    xy = rng.uniform((low_x, low_y), (high_x, high_y), (int(8 * (high_x - low_x) * (high_y - low_y)), 2))
    c, s = np.cos(np.radians(TURN_DEG)), np.sin(np.radians(TURN_DEG))
    u, v = (xy @ np.array([[c, -s], [s, c]])).T
    house = np.clip((u / WIDTH_M).astype(int), 0, len(heights) - 1)
    off = np.abs(u % WIDTH_M - WIDTH_M / 2) if gables else np.abs(v - DEPTH_M / 2)
    roof = heights[house] + 0.8 * ((WIDTH_M if gables else DEPTH_M) / 2 - off)
    between = (np.abs(u - WIDTH_M * np.round(u / WIDTH_M)) < 0.2) & (u > 1) & (u < length - 1)
    roof = roof + np.where(between, walls_m, 0.0)
    inside = (u > 0) & (u < length) & (v > 0) & (v < DEPTH_M)
    z = np.where(inside, roof, 0.0) + rng.normal(0, 0.03, len(u))
    ones = np.ones(len(z), np.uint8)
    points = PointCloud(np.column_stack([xy, z]), 0 * ones, ones, ones)
    frame = lidar_raster(points.xyz, around, 0.5, 1.6)
    units = [
        affinity.rotate(box(k * WIDTH_M, 0, (k + 1) * WIDTH_M, DEPTH_M), TURN_DEG, origin=(0, 0))
        for k in range(len(heights))
    ]
    return SplitEvidence("row", outline, (frame,), 0.0, points), units


def assert_split_into(evidence: SplitEvidence, units: list[Polygon]) -> None:
    found = split(evidence, SplitParameters()).units
    assert len(found) == len(units)
    for unit in units:
        assert max(shapely.intersection(unit, f).area / shapely.union(unit, f).area for f in found) > 0.93


def test_equal_gables_side_by_side() -> None:
    assert_split_into(*evidence_of(np.full(COUNT, 6.0), gables=True))


def test_eaves_of_different_heights() -> None:
    assert_split_into(*evidence_of(np.array([6.0, 6.6, 5.9, 6.4, 5.6]), gables=False))


def test_firewalls_between_roofs_of_one_height() -> None:
    assert_split_into(*evidence_of(np.full(COUNT, 6.0), gables=False, walls_m=0.6))


def test_one_long_roof_stays_whole() -> None:
    evidence, _ = evidence_of(np.full(COUNT, 6.0), gables=False)
    assert len(split(evidence, SplitParameters()).units) == 1
