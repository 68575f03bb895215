"""The fused surface against a town of known heights, and what must not change it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cityflow.core.depth_map import ImagePoints, joined
from cityflow.core.grid import Grid
from cityflow.surface.fuse import FuseParameters, fill_steps, fuse, fused_with_noise
from image_point_scenes import SIZE, depth_points, flight, moved, rotated, truth

CELL = 0.2
GRID = Grid.covering((0, 0, SIZE, SIZE), CELL)
INNER = np.s_[5:-5, 5:-5]


@cache
def points(seed: int = 0) -> ImagePoints:
    return flight(seed)


def level(noise: float = 0.0, height: float = 10.0, per_cell: int = 4, seed: int = 0) -> ImagePoints:
    """A level plane of 40 x 40 cells seen from above."""
    rng = np.random.default_rng(seed)
    n = 1600 * per_cell
    xyz = np.column_stack(
        [rng.uniform(0, 40 * CELL, (n, 2)), height + rng.normal(0, noise, n) if noise else np.full(n, height)]
    )
    sigma = np.full(n, max(noise, 0.02), np.float32)
    names, centres = ("a",), np.array([[4.0, 4.0, 400.0]])
    return ImagePoints(
        xyz, np.zeros((n, 3), np.uint8), np.zeros(n, np.int64), np.full(n, 2, np.uint8), sigma, names, centres
    )


@pytest.mark.parametrize("seed", [0, 1])
def test_town_within_half_a_cell_and_edges_sharp(seed: int) -> None:
    heights, part = truth(GRID)
    found = fuse(points(seed), GRID)
    wrong = np.abs(found.dsm - heights)
    step = np.ptp(np.stack([np.roll(heights, (i, j), (0, 1)) for i in range(-2, 3) for j in range(-2, 3)]), axis=0) > 1
    clear = ~step & (part != 7)
    measured = np.isfinite(found.dsm)
    assert measured[INNER][clear[INNER]].mean() > 0.99
    assert 1.4826 * np.nanmedian(wrong[INNER][clear[INNER]]) < 0.35 * CELL
    assert (wrong[clear & measured] < 3 * CELL).mean() > 0.997
    rim = step & (part != 7) & measured
    assert (wrong[rim] < 3 * CELL).mean() > 0.85, "of the two cells on either side of a step"


def test_order_of_points_does_not_matter() -> None:
    cloud = points()
    shuffled = cloud.take(np.random.default_rng(5).permutation(len(cloud)))
    a, b = fuse(cloud, GRID), fuse(shuffled, GRID)
    for name in ("dsm", "count", "sigma"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes()


def test_tiling_does_not_matter() -> None:
    cloud, p = moved(points(), 85_000.0, 447_000.0, 30.0), FuseParameters(fill_m=1.0, speck_cells=4)
    whole = Grid.covering((85_000, 447_000, 85_000 + SIZE, 447_000 + SIZE), CELL)
    part = Grid.covering((85_002, 447_003, 85_020, 447_023), CELL)
    a, b = fuse(cloud, whole, p), fuse(cloud, part, p)
    rows, cols = whole.slices(part)
    edge = p.halo_cells
    inner = np.s_[edge:-edge, edge:-edge]
    assert np.array_equal(a.dsm[rows, cols][inner], b.dsm[inner], equal_nan=True)
    assert np.array_equal(a.count[rows, cols], b.count)
    edge += round(p.fill_m / CELL)
    inner = np.s_[edge:-edge, edge:-edge]
    assert b.dsm[inner].size > 100
    assert np.array_equal(fill_steps(a, p)[rows, cols][inner], fill_steps(b, p)[inner], equal_nan=True)


def test_strips_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = fuse(points(), GRID)
    monkeypatch.setattr("cityflow.surface.fuse.STRIP_CELLS", 37 * GRID.cols)
    assert fuse(points(), GRID).dsm.tobytes() == whole.dsm.tobytes()


@pytest.mark.parametrize("strip", [1, 37])
def test_only_what_is_around_points_is_fused(monkeypatch: pytest.MonkeyPatch, strip: int) -> None:
    cloud = points()
    few = cloud.take((np.abs(cloud.xyz[:, 0] - 15.0) < 4.0) & (np.abs(cloud.xyz[:, 1] - 11.0) < 3.0))
    monkeypatch.setattr("cityflow.surface.fuse.STRIP_CELLS", GRID.rows // strip * GRID.cols)
    part = fused_with_noise(few, GRID, FuseParameters())
    monkeypatch.setattr("cityflow.surface.fuse.RIM_CELLS", GRID.rows)
    whole = fused_with_noise(few, GRID, FuseParameters())
    assert np.isfinite(part[0].dsm).any()
    for name in ("dsm", "count", "sigma"):
        assert getattr(part[0], name).tobytes() == getattr(whole[0], name).tobytes()
    assert part[1].tobytes() == whole[1].tobytes()


def test_noise_of_a_plane_is_averaged_and_its_precision_honest() -> None:
    found = fuse(level(0.1), Grid.covering((0, 0, 40 * CELL, 40 * CELL), CELL))
    assert np.nanstd(found.dsm) < 0.06
    assert np.nanmean(found.dsm) == pytest.approx(10.0, abs=0.01)
    assert np.nanmedian(found.sigma) == pytest.approx(0.1, rel=0.05), "one depth map: its errors may go together"
    several = level(0.1)
    images = np.arange(len(several)) % 4
    centres = np.repeat(several.centres, 4, axis=0)
    many = ImagePoints(several.xyz, several.colour, images, several.views, several.sigma, ("a", "b", "c", "d"), centres)
    steadier = fuse(many, Grid.covering((0, 0, 40 * CELL, 40 * CELL), CELL))
    assert np.nanmedian(steadier.sigma) == pytest.approx(0.05, rel=0.15)


def test_floaters_go_and_holes_stay_holes() -> None:
    cloud = level(0.02)
    x, y = cloud.xyz[:, 0], cloud.xyz[:, 1]
    cloud = cloud.take(~((x > 3) & (x < 4.4) & (y > 3) & (y < 4.4)))
    bird = np.column_stack([np.random.default_rng(1).uniform((3.7, 3.7), (3.8, 3.8), (30, 2)), np.full(30, 25.0)])
    cloud = joined([cloud, ImagePoints(
        bird, np.zeros((30, 3), np.uint8), np.zeros(30, np.int64), np.full(30, 2, np.uint8), np.full(30, 0.02, np.float32),
        ("a",), cloud.centres,
    )])  # fmt: skip
    found = fuse(cloud, Grid.covering((0, 0, 40 * CELL, 40 * CELL), CELL))
    assert not (found.dsm > 11).any()
    assert np.isnan(found.dsm[19:22, 16:21]).all()
    assert fill_steps(found)[19:22, 16:21] == pytest.approx(10.0, abs=0.05)


def test_a_cell_whose_surface_floats_chooses_again() -> None:
    """A few cells of grass that most of their points put into the air: those that are left say where it is."""
    cloud, grid = level(0.02), Grid.covering((0, 0, 40 * CELL, 40 * CELL), CELL)
    rng = np.random.default_rng(2)
    false = cloud.take(np.arange(240))
    false = replace(false, xyz=np.column_stack([rng.uniform(3.0, 3.6, (240, 2)), rng.normal(18.0, 0.02, 240)]))
    both = joined([cloud, false])
    assert (fuse(both, grid, FuseParameters(speck_cells=1)).dsm > 17).sum() >= 9, "more points say so than not"
    found = fuse(both, grid)
    assert np.isfinite(found.dsm).all()
    assert np.abs(found.dsm - 10.0).max() < 0.1


def test_a_tilted_frame_is_fused_like_the_world() -> None:
    """A plane at 45° seen along its normal is level in its frame."""
    s = np.sqrt(0.5)
    frame_from_world = np.array([[s, 0, s], [0, 1, 0], [-s, 0, s]])
    tilted = level(0.02)
    world = rotated(tilted, frame_from_world.T, np.zeros(3))
    found = fuse(rotated(world, frame_from_world, np.zeros(3)), Grid.covering((0, 0, 40 * CELL, 40 * CELL), CELL))
    assert np.nanmax(np.abs(found.dsm - 10)) < 0.1
    assert np.isfinite(found.dsm).mean() > 0.99


def test_occluded_ground_beside_a_wall_is_filled_with_ground() -> None:
    heights, _ = truth(GRID)
    dsm = heights.astype(np.float32)
    x, y = np.meshgrid(GRID.x_centres(), GRID.y_centres())
    hidden = (x > 9) & (x < 10.4) & (y > 13) & (y < 20)  # east of the block
    gap = (x > 5) & (x < 7) & (y > 15) & (y < 17)  # in its roof
    dsm[hidden | gap] = np.nan
    full = fuse(points(), GRID)
    filled = fill_steps(type(full)(GRID, dsm, full.count, full.sigma))
    assert np.abs(filled - heights)[hidden].max() < 0.2
    assert np.abs(filled - heights)[gap].max() < 1e-6
    assert np.array_equal(filled[~hidden & ~gap], dsm[~hidden & ~gap].astype(float))


def seen_from(
    lean: float, name: str, heights: dict[float, tuple[float, float]], per_cell: int, views: int = 2
) -> ImagePoints:
    """Points of one view over 8 x 8 m, whose camera leans by a tangent eastwards; height → the strip of x where it has points."""
    rng = np.random.default_rng(len(name))
    parts = []
    for z, (low, high) in heights.items():
        n = round((high - low) * 8 / CELL**2) * per_cell
        parts.append(np.column_stack([rng.uniform(low, high, n), rng.uniform(0, 8, n), z + rng.normal(0, 0.02, n)]))
    xyz = np.concatenate(parts)
    centre = np.array([[4.0 + 400.0 * lean, 4.0, 400.0]])
    return ImagePoints(
        xyz, np.zeros((len(xyz), 3), np.uint8), np.zeros(len(xyz), np.int64), np.full(len(xyz), views, np.uint8),
        np.full(len(xyz), 0.03, np.float32), (name,), centre,
    )  # fmt: skip


STRIP = Grid.covering((0, 0, 8, 8), CELL)
X = np.broadcast_to(STRIP.x_centres(), STRIP.shape)


def test_a_roof_that_one_view_draws_out_over_the_ground_ends_where_others_see_past_it() -> None:
    """Beside a roof that ends at 3 m, matching of the view from above has taken a metre and a half of lawn for roof; slanting views have the lawn."""
    above = seen_from(0.0, "above", {10.0: (0, 4.5), 0.0: (4.5, 8)}, 3)
    slanting = [seen_from(lean, name, {10.0: (0, 3), 0.0: (3, 8)}, 3, 3) for lean, name in ((1.0, "e"), (0.9, "east"))]
    found = fuse(joined([above, *slanting], 3), STRIP).dsm[INNER]
    x = X[INNER]
    assert np.abs(found[x < 2.8] - 10).max() < 0.1
    assert np.abs(found[x > 3 + 2.5 * CELL]).max() < 0.1


def test_a_crown_stands_whose_top_slanting_views_see_with_the_ground_beneath_it() -> None:
    above = seen_from(0.0, "above", {10.0: (2, 6), 0.0: (0, 2)}, 3)
    right = seen_from(0.0, "from above", {0.0: (6, 8)}, 3)
    slanting = [seen_from(lean, name, {10.0: (2, 6), 0.0: (0, 8)}, 5, 4) for lean, name in ((1.0, "e"), (-1.0, "west"))]
    found = fuse(joined([above, right, *slanting], 3), STRIP).dsm[INNER]
    x = X[INNER]
    assert np.abs(found[(x > 2.8) & (x < 5.2)] - 10).max() < 0.1
    assert np.abs(found[(x < 1.6) | (x > 6.4)]).max() < 0.1


def test_nothing_gives_holes() -> None:
    cloud = depth_points("a", (0.0, 0.0), 1.0, 0.1, np.random.default_rng(0))
    found = fuse(cloud.take(np.zeros(len(cloud), bool)), GRID)
    assert np.isnan(found.dsm).all()
    assert not found.count.any()
    assert np.isnan(fill_steps(found)).all()


def test_points_without_place_or_precision_do_no_harm() -> None:
    cloud = level(0.02)
    xyz, sigma, views = cloud.xyz.copy(), cloud.sigma.copy(), cloud.views.copy()
    xyz[::50, 2], xyz[1::50, 0] = np.nan, np.inf
    sigma[2::50], views[3::50] = np.nan, 0
    spoilt = ImagePoints(xyz, cloud.colour, cloud.image, views, sigma, cloud.names, cloud.centres)
    found = fuse(spoilt, Grid.covering((0, 0, 40 * CELL, 40 * CELL), CELL))
    assert np.nanmax(np.abs(found.dsm - 10)) < 0.1
    assert np.isfinite(found.dsm).mean() > 0.99
    assert np.isfinite(found.sigma[np.isfinite(found.dsm)]).all()


def test_how_exact_a_lone_point_would_be_makes_no_surface() -> None:
    """Over every point that many partners agree on, though not exactly, hangs one of a wide base that one partner alone has seen."""
    ground = level(0.05)
    n = len(ground)
    ground = replace(ground, views=np.full(n, 6, np.uint8), sigma=np.full(n, 0.5, np.float32))
    above = replace(
        ground, xyz=ground.xyz + np.array([0.0, 0.0, 19.0]), views=np.ones(n, np.uint8), sigma=np.full(n, 0.05, np.float32), names=("b",)
    )  # fmt: skip
    found = fuse(joined([ground, above]), Grid.covering((0, 0, 40 * CELL, 40 * CELL), CELL))
    inner = found.dsm[5:-5, 5:-5]
    assert np.nanmax(inner) < 12
    assert np.isfinite(inner).mean() > 0.99
