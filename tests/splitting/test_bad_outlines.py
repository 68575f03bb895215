"""Whatever the outline and whatever is known over it: a result, valid units, and a reason where it stays whole."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import shapely
from shapely import Polygon, affinity, box

from cityflow.core.arrays import Float32Array
from cityflow.core.grid import Grid, grown
from cityflow.core.local_frame import LocalFrame
from cityflow.core.points import PointCloud
from cityflow.core.splitting import FrameRasters, SplitEvidence, Splitting
from cityflow.splitting.split import SplitParameters, split

NADIR = LocalFrame("nadir", np.eye(3), np.zeros(3))
EAST = LocalFrame(
    "east_45", np.array([[0.0, 1, 0], [-np.sqrt(0.5), 0, np.sqrt(0.5)], [np.sqrt(0.5), 0, np.sqrt(0.5)]]), np.zeros(3)
)
X, Y, GROUND, EAVES = 100.0, 200.0, 2.0, 8.0
CELL_M = 0.2


def _wavy(vertices: int) -> Polygon:
    """A row of 40 m × 10 m, drawn by a shaking hand."""
    g = np.random.default_rng(4)
    smooth = shapely.get_coordinates(shapely.segmentize(box(0, 0, 40, 10).exterior, 100 / vertices))[:-1]
    return shapely.make_valid(Polygon(smooth + g.normal(0, 0.01, smooth.shape))).buffer(0)


def _arc(sweep_deg: float, inner: float, depth: float) -> Polygon:
    """A curved row of houses."""
    t = np.radians(np.linspace(0, sweep_deg, 60))
    ring = np.column_stack([np.cos(t), np.sin(t)])
    return Polygon(np.concatenate([(inner + depth) * ring, inner * ring[::-1]]))


_SHELL = [(0, 0), (10, 0), (30, 0), (30, 20), (0, 20)]
OUTLINES: dict[str, Polygon] = {
    "thousands of vertices": max(shapely.get_parts(_wavy(2500)), key=lambda p: p.area),
    "a spike out": Polygon([(0, 0), (30, 0), (30, 10), (15.001, 10), (15.0, 40), (14.999, 10), (0, 10)]),
    "a spike in": Polygon([(0, 0), (30, 0), (30, 10), (15.001, 10), (15.0, 1), (14.999, 10), (0, 10)]),
    "a spike of no width": Polygon([(0, 0), (30, 0), (30, 10), (15, 10), (15, 30), (15, 10), (0, 10)]),
    "a hole that touches the shell": Polygon(_SHELL, [[(10, 0), (15, 8), (5, 8)]]),
    "a hole that runs along the shell": Polygon(_SHELL, [[(10, 0), (20, 0), (20, 8), (10, 8)]]),
    "two holes that touch": Polygon(_SHELL, [[(5, 5), (15, 10), (5, 15)], [(15, 10), (25, 5), (25, 15)]]),
    "a courtyard": Polygon(box(0, 0, 50, 50).exterior, [box(10, 10, 40, 40).exterior]),
    "a bow tie": Polygon([(0, 0), (20, 20), (20, 0), (0, 20)]),
    "under 10 m²": box(0, 0, 3, 3),
    "under 20 m²": box(0, 0, 4, 4),
    "under 40 m²": box(0, 0, 6, 6),
    "tiny": box(0, 0, 0.05, 0.05),
    "a line": Polygon([(0, 0), (10, 0), (20, 0)]),
    "nothing": Polygon(),
    "long and thin": box(0, 0, 120, 0.6),
    "a sliver": Polygon([(0, 0), (80, 0.3), (80, 1.0)]),
    "round": shapely.Point(0, 0).buffer(12, quad_segs=64),
    "a ring": shapely.Point(0, 0).buffer(20).difference(shapely.Point(0, 0).buffer(11)),
    "a curved row": _arc(100, 40, 10),
    "a horseshoe": _arc(300, 15, 9),
    "a star": Polygon([(r * np.cos(a), r * np.sin(a)) for a, r in zip(np.linspace(0, 6.0, 14), [25, 6] * 7, strict=True)]),
    "a comb": shapely.union_all([box(0, 0, 60, 8), *(box(x, 0, x + 4, 25) for x in range(0, 60, 8))]),
    "a triangle": Polygon([(0, 0), (30, 0), (0, 18)]),
    "a large hall": box(0, 0, 80, 50),
}  # fmt: skip


def _placed(shape: Polygon) -> Polygon:
    return affinity.translate(affinity.rotate(shape, 23.0, origin=(0, 0)), X, Y) if not shape.is_empty else shape


def _heights(outline: Polygon, grid: Grid) -> Float32Array:
    """Houses 6 m wide under flat roofs that differ by up to a metre."""
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    inside = shapely.contains_xy(shapely.make_valid(outline), x, y)
    along = (x - X) * np.cos(np.radians(23)) + (y - Y) * np.sin(np.radians(23))
    step = np.sin(12.9898 * np.floor(along / 6.0)) * 0.5
    noise = np.random.default_rng(1).normal(0, 0.03, x.shape)
    return np.where(inside, EAVES + step, GROUND).astype(np.float32) + noise.astype(np.float32)


def _evidence(outline: Polygon, pictures: bool = True, points: bool = False) -> SplitEvidence:
    bounds = grown(outline.bounds, 2.0) if not outline.is_empty else (X, Y, X + 5, Y + 5)
    # four points per m² over the largest are enough; twelve took most of the time of these tests
    grid = Grid.covering(bounds, CELL_M if bounds[2] - bounds[0] < (60 if points else 100) else 0.5)
    dsm = _heights(outline, grid)
    grey = np.clip(60 * (dsm - GROUND) / 2 + 20, 0, 255).astype(np.uint8)
    ortho = np.repeat(grey[None], 3, axis=0) if pictures else None
    seen = np.ones(grid.shape, bool) if pictures else None
    frames = [FrameRasters(NADIR, grid, dsm, ortho, seen)]
    if pictures:
        frames.append(_oblique(outline))
    return SplitEvidence("bad", outline, tuple(frames), GROUND, _points(grid, dsm) if points else None)


def _oblique(outline: Polygon) -> FrameRasters:
    """A look from the east with no more in it than noise."""
    xy = shapely.get_coordinates(outline) if not outline.is_empty else np.array([[X, Y]])
    corners = np.concatenate([np.column_stack([xy, np.full(len(xy), z)]) for z in (GROUND, EAVES)])
    seen = EAST.from_world(corners)[:, :2]
    grid = Grid.covering(grown((*seen.min(axis=0).tolist(), *seen.max(axis=0).tolist()), 2.0), 0.4)
    g = np.random.default_rng(2)
    dsm = g.normal(0, 0.05, grid.shape).astype(np.float32) + np.float32(
        EAST.from_world(np.array([[X, Y, EAVES]]))[0, 2]
    )
    return FrameRasters(
        EAST, grid, dsm, g.integers(0, 255, (3, *grid.shape), dtype=np.uint8), np.ones(grid.shape, bool)
    )


def _points(grid: Grid, dsm: Float32Array) -> PointCloud:
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    chosen = np.random.default_rng(3).random(x.shape) < min(12 * grid.cell**2, 1.0)
    return PointCloud.of(np.column_stack([x[chosen], y[chosen], dsm[chosen]]).astype(np.float64))


def _assert_sound(result: Splitting, outline: Polygon) -> None:
    assert len(result.units) >= 1
    if len(result.units) == 1:
        assert result.reason
        assert not [c for c in result.cut_lines if c.kind == "cut"]
        return
    units = np.array(result.units, object)
    assert shapely.is_valid(units).all()
    assert all(isinstance(u, Polygon) and u.exterior.is_ccw and u.area >= 20 for u in result.units)
    assert shapely.area(units).sum() <= shapely.make_valid(outline).area * (1 + 1e-6) + 2.5e-5 * outline.length
    assert shapely.area(shapely.union_all(units)) == pytest.approx(shapely.area(units).sum(), rel=1e-6)
    assert all(0 <= c.confidence <= 1 and not c.line.is_empty for c in (*result.cut_lines, *result.rejected))


@cache
def _result(name: str, source: str) -> Splitting:
    return split(_evidence(_placed(OUTLINES[name]), source == "pictures", source == "points"), SplitParameters())


@pytest.mark.parametrize("name", OUTLINES)
@pytest.mark.parametrize("source", ["pictures", "surface", "points"])
def test_every_outline_has_a_result(name: str, source: str) -> None:
    _assert_sound(_result(name, source), _placed(OUTLINES[name]))


@pytest.mark.parametrize("name", ["under 10 m²", "under 20 m²", "tiny", "a line", "nothing", "round", "a bow tie"])
def test_some_are_never_split(name: str) -> None:
    result = _result(name, "pictures")
    assert (result.units, result.cut_lines) == ((_placed(OUTLINES[name]),), ())
    assert result.reason


@pytest.mark.parametrize("name", ["a spike in", "a courtyard", "a curved row"])
def test_nothing_known_over_it(name: str) -> None:
    outline = _placed(OUTLINES[name])
    full = _evidence(outline)
    grid = full.frames[0].grid
    nothing, grey = np.zeros((3, *grid.shape), np.uint8), np.full((3, *grid.shape), 99, np.uint8)
    blind = FrameRasters(NADIR, grid, np.full(grid.shape, np.nan, np.float32), nothing, np.zeros(grid.shape, bool))
    level = FrameRasters(NADIR, grid, np.full(grid.shape, EAVES, np.float32), grey, np.ones(grid.shape, bool))
    for frames in ((), (blind,), (level,), (level, blind)):
        result = split(SplitEvidence("bad", outline, frames, GROUND), SplitParameters())
        assert (len(result.units), result.cut_lines) == (1, ())
        assert result.reason


@pytest.mark.parametrize("count", [0, 1, 3, 50])
def test_hardly_any_points(count: int) -> None:
    outline = _placed(box(0, 0, 40, 10))
    full = _evidence(outline, pictures=False)
    g = np.random.default_rng(0)
    xyz = np.column_stack([g.uniform(X, X + 40, count), g.uniform(Y, Y + 20, count), g.uniform(2, 9, count)])
    empty = FrameRasters(NADIR, full.frames[0].grid, np.full(full.frames[0].grid.shape, np.nan, np.float32))
    result = split(SplitEvidence("bad", outline, (empty,), GROUND, PointCloud.of(xyz)), SplitParameters())
    _assert_sound(result, outline)
