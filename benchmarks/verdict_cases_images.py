"""Cases for verdicts as surveys from images give them: units of synthetic towns under a surface with the errors of dense matching.

Every town has its own pixels and its own errors, and every roof its own noise: texture, sun and the number of images differ from roof to roof
more than from survey to survey. The ranges are those of two towns that were matched from images of 12 cm (`matched_noise.py`). Points are those
that the stage `surface` leaves for buildings; free-standing units have outlines with an error, as found ones have.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from affine import Affine
from rasterio.features import rasterize
from shapely import LineString

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.grid import Grid
from cityflow.core.points import BUILDING, GROUND, HIGH_VEGETATION, PointCloud
from cityflow.core.reconstruction import HeightRaster
from cityflow.geometry.straight_edges import wall_edges
from cityflow.surface.image_surface import THINNED_M
from cityflow.surface.overview import thinned_cells
from cityflow.synthetic.caster import NOTHING, Scene
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_truth import without
from cityflow.synthetic.town_units import Unit
from scenes.drawn_frames import FOLIAGE, NADIR_NOISE, UPRIGHT_SHARE
from scenes.drawn_heights import FLAT, LEAVES, UPRIGHT, HeightNoise, TrueView, matched_heights
from scenes.drawn_noise import smooth_noise
from verdict_cases import RELIEFS, STREET_TREES, Case, Survey, town_cases

EDGE_M, OVER_M = 150.0, 10.0
GSD_M, NOISE_GSD, WIDENED, ROUNDED = (0.06, 0.18), (0.15, 0.6), (0.4, 1.6), (0.5, 2.0)
"""Of surveys: pixels on the ground, metres; noise on the middle roof, GSD; edges stand too far out and creases are rounded, cells."""
COARSE_SHARE = 0.8
"""Of the noise's variance, what neighbouring squares share."""
ROOF_SPREAD = 0.6
"""Standard deviation of the logarithm of a roof's noise by that of the survey's middle roof."""
OUTLINE_SIGMA_M = 0.3
OVERLOOKED, PATCH_CELLS = -1.0, 10.0
"""Foliage is taken for a building in patches: where a normal number is below this."""
WALL_SEEN, WALL_PER_M2, WALL_BIAS_M, WALL_NOISE_M = 0.75, 8.0, 0.06, 0.1
"""Of façades: the share that images see, points per square metre, and errors that the points of one share and that each has (standard deviations)."""
BUILT_M = 1.0
"""What stands this high and is no foliage passes for a building."""


def image_cases(seed: int) -> Iterator[Case]:
    """The cases of a town that was matched, the same for the same seed."""
    town, survey, _ = image_survey(seed)
    yield from town_cases(town, seed, survey)


def image_survey(seed: int) -> tuple[Town, Survey, float]:
    """A town, its matched surface, and its pixels on the ground, metres."""
    land = np.random.default_rng([seed, 94])
    relief, trees = float(land.choice(RELIEFS)), float(land.choice(STREET_TREES))
    town = make_town(seed, TownParameters(width_m=EDGE_M, height_m=EDGE_M, relief=relief, street_tree_share=trees))
    gsd = float(land.uniform(*GSD_M))
    ranges = {"level_gsd": NOISE_GSD, "widened_cells": WIDENED, "rounded_cells": ROUNDED}
    drawn = {k: float(land.uniform(*r)) for k, r in ranges.items()}
    noise = NADIR_NOISE.model_copy(update={"coarse_share": COARSE_SHARE, **drawn})
    return town, _survey(town, seed, gsd, noise), gsd


def _survey(town: Town, seed: int, gsd_m: float, noise: HeightNoise) -> Survey:
    """Points of the matched surface, one per square, with their classes."""
    grid = Grid.covering(town.bounds, gsd_m)
    true, part = _seen_from_above(town, grid)
    heights = _matched(true, noise, town, seed)
    block = max(round(THINNED_M / gsd_m), 1)
    row, col = np.nonzero(thinned_cells(heights, np.isfinite(heights), (0, 0), block))
    xyz = np.column_stack([grid.x_centres()[col], grid.y_centres()[row], heights[row, col].astype(np.float64)])
    green = _known_foliage(grid, np.isin(part, [int(p) for p in FOLIAGE]), seed)[row, col]
    above = xyz[:, 2] - town.dtm(xyz[:, 0], xyz[:, 1]) > BUILT_M
    classes = np.where(green, HIGH_VEGETATION, np.where(above, BUILDING, GROUND)).astype(np.uint8)
    density = 1.0 / (block * gsd_m) ** 2
    walls = joined_walls([_facades(unit, town.units, seed) for unit in town.units])
    x, y = (a.ravel() for a in grid.centres())
    rasters = HeightRaster(grid, heights.astype(np.float64), np.asarray(town.dtm(x, y), np.float64).reshape(grid.shape))
    return Survey(PointCloud.of(xyz, classes), classes, density, (density,), OUTLINE_SIGMA_M, walls, True, rasters)


def _matched(true: TrueView, noise: HeightNoise, town: Town, seed: int) -> Float32Array:
    """(rows, cols) heights whose noise is as many times that of the survey as each roof's own number says."""
    usual, quiet = (matched_heights(true, n, seed) for n in (noise, noise.model_copy(update={"level_gsd": 0.0})))
    more = np.random.default_rng([seed, 97]).normal(0.0, ROOF_SPREAD, len(town.units))
    roofs = [(u.roof_outline, float(np.exp(m))) for u, m in zip(town.units, more, strict=True)]
    times = rasterize(roofs, true.grid.shape, fill=1.0, transform=Affine(*true.grid.transform), dtype="float32")
    return np.asarray(quiet + times * (usual - quiet), np.float32)


def _facades(unit: Unit, units: Sequence[Unit], seed: int) -> WallPoints:
    """Points on the walls that images see: each wall is seen or not, and has an error that its points share."""
    rng = np.random.default_rng([seed, unit.index, 96])
    near = [
        u.wall_outline for u in units if u.id != unit.id and shapely.dwithin(u.wall_outline, unit.wall_outline, 1e-6)
    ]
    party = [shapely.intersection(unit.wall_outline.boundary, w.buffer(0.05)) for w in near]
    lines = [p for g in party for p in shapely.get_parts(g) if isinstance(p, LineString)]
    spots, normals = [np.empty((0, 3))], [np.empty((0, 2))]
    for edge in wall_edges(unit.wall_outline, lines):
        if edge.party or rng.random() > WALL_SEEN:
            continue
        count = int(edge.length * (unit.eave_m - unit.floor_m) * WALL_PER_M2)
        across = rng.normal(0, WALL_BIAS_M) + rng.normal(0, WALL_NOISE_M, count)
        xy = edge.start + rng.uniform(0, edge.length, count)[:, None] * edge.along + across[:, None] * edge.outward
        spots.append(np.column_stack([xy, rng.uniform(unit.floor_m, unit.eave_m, count)]))
        normals.append(np.tile(edge.outward, (count, 1)))
    xyz = np.concatenate(spots)
    sigma = np.full(len(xyz), WALL_NOISE_M, np.float32)
    return WallPoints(xyz, np.concatenate(normals).astype(np.float32), sigma, np.full(len(xyz), 3, np.uint8))


def _known_foliage(grid: Grid, foliage: BoolArray, seed: int) -> BoolArray:
    """(rows, cols) foliage that is not taken for a building: all but some patches."""
    return np.asarray(foliage & (smooth_noise(grid, seed + 90, PATCH_CELLS) > OVERLOOKED))


def _seen_from_above(town: Town, grid: Grid) -> tuple[TrueView, ByteArray]:
    """What stands highest at each cell: its height, with and without foliage, and its part of the town."""
    mesh = town.mesh(grid.bounds)
    scene = Scene(mesh)
    height, triangle = _cast(scene, grid)
    behind, _ = _cast(Scene(without(mesh, FOLIAGE)), grid)
    part = np.where(triangle == NOTHING, int(Part.GROUND), scene.surfaces.part[triangle]).astype(np.uint8)
    upright = np.abs(scene.surfaces.normal[:, 2]) < UPRIGHT_SHARE
    kind = np.where(upright[triangle] & (triangle != NOTHING), UPRIGHT, FLAT).astype(np.uint8)
    kind[np.isin(part, [int(p) for p in FOLIAGE])] = LEAVES
    bright: BoolArray = np.zeros(grid.shape, bool)
    return TrueView(grid, height, behind, kind, bright, np.full(grid.shape, 100.0, np.float32)), part


def _cast(scene: Scene, grid: Grid) -> tuple[FloatArray, np.ndarray]:
    """(rows, cols) height and triangle that a ray from above meets first."""
    top = float(scene.mesh.vertices[:, 2].max()) + OVER_M
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    start = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, top)]) - scene.origin
    triangle, length = scene.first_hits(start, np.broadcast_to(np.array([0.0, 0.0, -1.0]), start.shape))
    return np.where(np.isfinite(length), top - length, np.nan).reshape(grid.shape), triangle.reshape(grid.shape)
