from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import shapely
from shapely import Polygon

from cityflow.core.splitting import ORTHO, SURFACE, FrameRasters, Segments
from cityflow.splitting.segments.segments import find_segments
from cityflow.splitting.strips.raster_windows import covered
from house_row import HouseRow, evidence, found_share, nadir, rasters, tilted

CELL, OBLIQUE_CELL = 0.08, 0.12
ROW = HouseRow(eaves=(6.0, 6.15, 6.15, 5.6), facades=(60, 120, 200, 80), roofs=(90, 150, 150, 60), turn_deg=23.0)
STEEP = HouseRow(eaves=(6.0, 6.15, 6.0), facades=(100,) * 3, roofs=(120,) * 3, rise=float(np.tan(np.radians(50))))


@cache
def frames(seed: int) -> tuple[FrameRasters, ...]:
    looks = (nadir(), tilted("north_45", 0), tilted("south_45", 180))
    return tuple(rasters(ROW, f, CELL if f.name == "nadir" else OBLIQUE_CELL, seed) for f in looks)


@cache
def found(seed: int) -> Segments:
    return find_segments(evidence(ROW, *frames(seed)))


def share(segments: Segments, first: tuple[float, float, float], second: tuple[float, float, float]) -> float:
    return found_share(ROW.edge(first, second), segments.start, segments.end, 2 * CELL, 2.0)


@pytest.mark.parametrize("seed", [0, 1])
def test_ridges_and_eaves_are_found_in_space(seed: int) -> None:
    for k in range(4):
        u0, u1 = 6.0 * k + 0.3, 6.0 * k + 5.7
        assert share(found(seed), (u0, 0, ROW.ridge(k)), (u1, 0, ROW.ridge(k))) > 0.8
        assert share(found(seed), (u0, -5, ROW.eaves[k]), (u1, -5, ROW.eaves[k])) > 0.8


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("border", [1, 3])
def test_borders_on_the_roof_are_found_as_sloped_lines(side: float, border: int) -> None:
    upper = max(border - 1, border, key=lambda k: ROW.eaves[k])
    low, high = (
        (6.0 * border, side * 4.7, ROW.eaves[upper] + 0.3 * 0.8),
        (6.0 * border, side * 0.3, ROW.ridge(upper) - 0.24),
    )
    assert share(found(0), low, high) > 0.8


@pytest.mark.parametrize("border", [1, 2])
def test_borders_on_facades_are_found_as_upright_lines_in_tilted_orthos(border: int) -> None:
    upright = found(0).take((found(0).layer == ORTHO) & (found(0).frame > 0))
    edge = ROW.edge((6.0 * border, -5, 0.5), (6.0 * border, -5, 5.5))
    assert found_share(edge, upright.start, upright.end, 2 * OBLIQUE_CELL, 3.0) > 0.8


def test_a_low_step_on_a_steep_roof_is_a_line_of_the_surface() -> None:
    s = find_segments(evidence(STEEP, rasters(STEEP, nadir(), CELL, 3)))
    s = s.take(s.layer == SURFACE)
    rise = STEEP.rise
    for border in (1, 2):
        edge = STEEP.edge((6.0 * border, -4.5, 6.15 + 0.5 * rise), (6.0 * border, -0.5, 6.15 + 4.5 * rise))
        assert found_share(edge, s.start, s.end, 2.5 * CELL, 2.0) > 0.6


def test_shade_does_not_hide_a_border() -> None:
    north = frames(0)[2]
    assert north.ortho is not None
    dark = replace(north, ortho=np.rint(north.ortho * 0.2).astype(np.uint8))
    s = find_segments(evidence(ROW, frames(0)[0], dark))
    edge = ROW.edge((6.0, 5, 0.5), (6.0, 5, 5.5))
    assert found_share(edge, s.start, s.end, 2 * OBLIQUE_CELL, 3.0) > 0.8


def test_all_lie_at_the_outline_and_above_the_ground() -> None:
    near = ROW.outline.buffer(1.01, join_style="mitre")
    s = found(0)
    assert len(s) > 50
    assert shapely.contains_xy(near, *(0.5 * (s.start + s.end))[:, :2].T).all()
    assert s.start[:, 2].min() > -1.01
    assert s.frames == ("nadir", "north_45", "south_45")


def test_most_lie_on_what_is_there() -> None:
    long = found(0).take(found(0).length > 2)
    borders = [(0, 0), (1, 1), (2, 2), (3, 3), (4, 3)]
    edges = [ROW.edge((0, v, 0), (24, v, 0)) for v in (-5.0, 5.0)]
    for u, k in borders:
        edges += [ROW.edge((6.0 * u, v, ROW.eaves[k]), (6.0 * u, 0, ROW.ridge(k))) for v in (-5.0, 5.0)]
        edges += [ROW.edge((6.0 * u, v, 0), (6.0 * u, v, 6)) for v in (-5.0, 5.0)]
    for k in range(4):
        edges += [
            ROW.edge((6.0 * k, v, z), (6.0 * k + 6, v, z))
            for v, z in ((-5, ROW.eaves[k]), (0, ROW.ridge(k)), (5, ROW.eaves[k]))
        ]
    plan = np.array(edges)[:, :, :2]
    middle = 0.5 * (long.start + long.end)[:, :2]
    d = plan[:, 1] - plan[:, 0]
    length = np.linalg.norm(d, axis=1)
    flat = length > 0.1
    t = np.einsum("nei,ei->ne", middle[:, None] - plan[None, flat, 0], d[flat]) / length[flat] ** 2
    foot = plan[None, flat, 0] + np.clip(t, 0, 1)[..., None] * d[None, flat]
    assert np.mean(np.linalg.norm(middle[:, None] - foot, axis=2).min(axis=1) < 0.3) > 0.8


def test_the_same_input_gives_the_same_bytes() -> None:
    again = find_segments(evidence(ROW, *frames(0)))
    assert again.start.tobytes() == found(0).start.tobytes()
    assert again.end.tobytes() == found(0).end.tobytes()


def test_a_surface_that_tells_nothing_gives_no_segment() -> None:
    first = frames(0)[0]
    rough = replace(first, dsm=(np.random.default_rng(0).normal(5, 3, first.dsm.shape)).astype(np.float32))
    assert len(find_segments(evidence(ROW, rough))) == 0
    unknown = replace(first, dsm=np.full_like(first.dsm, np.nan))
    assert len(find_segments(evidence(ROW, unknown))) == 0


def test_what_is_not_seen_has_no_segments() -> None:
    first = frames(0)[0]
    assert first.seen is not None
    x, y = np.meshgrid(first.grid.x_centres() + 85000.0, first.grid.y_centres() + 447000.0)
    u = (x - ROW.at[0]) * ROW.along[0] + (y - ROW.at[1]) * ROW.along[1]
    half = replace(first, seen=u < 12.0, dsm=np.where(u < 12.0, first.dsm, np.nan).astype(np.float32))
    s = find_segments(evidence(ROW, half))
    middle = (0.5 * (s.start + s.end)[:, :2] - ROW.at) @ ROW.along
    assert len(s) > 5
    assert middle.max() < 11.9


@pytest.mark.parametrize(
    "outline",
    [
        Polygon(),
        Polygon([(85030, 447030), (85030.5, 447030), (85030.2, 447030.1)]),
        ROW.outline.difference(shapely.Point(ROW.world(9, 0, 0)[:2]).buffer(1)),
        shapely.Point(85030, 447025).buffer(8, quad_segs=500),
        Polygon([(90000, 440000), (90010, 440000), (90010, 440010)]),
    ],
    ids=["empty", "sliver", "hole", "round", "elsewhere"],
)
def test_odd_outlines_raise_nothing(outline: Polygon) -> None:
    s = find_segments(replace(evidence(ROW, *frames(0)), outline=outline))
    assert np.isfinite(s.start).all()


def test_without_frames_there_is_nothing() -> None:
    assert len(find_segments(evidence(ROW))) == 0


def test_one_band_of_sixteen_bits_serves() -> None:
    first = frames(0)[0]
    assert first.ortho is not None
    grey = replace(first, ortho=(first.ortho[:1].astype(np.uint16) * 40))
    s = find_segments(evidence(ROW, grey))
    assert share(s, (0.3, 0, ROW.ridge(0)), (5.7, 0, ROW.ridge(0))) > 0.6


def test_the_prism_over_the_outline_is_covered_and_no_more() -> None:
    raster = frames(0)[1]
    prism = covered(raster, ROW.outline, (0.0, 11.0), 0.0)
    for rim in (prism[0], prism[-1], prism[:, 0], prism[:, -1]):
        assert not rim.any()
    for z in (0.0, 11.0):
        row, col = raster.grid.indices(*raster.frame.from_world(np.array([ROW.world(12, 0, z)]))[:, :2].T)
        assert prism[row[0], col[0]]
    row, col = raster.grid.indices(*raster.frame.from_world(np.array([ROW.world(-4, 0, 0)]))[:, :2].T)
    assert not prism[row[0], col[0]]
