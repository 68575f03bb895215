"""How much of its building an outline misses: true ones nothing, whatever the eaves; moved and turned ones what they do miss; few points leave doubt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import LineString, Polygon, box
from shapely.affinity import rotate, translate

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.reconstruction.choose import ReconstructParameters, choose
from cityflow.reconstruction.verdicts.placement import placement_of
from cityflow.reconstruction.verdicts.roof_fit import fit_of
from cityflow.reconstruction.verdicts.surroundings import surroundings_of
from cityflow.reconstruction.verdicts.traces import traces_of
from roof_scenes import ORIGIN, OUTLINE, gable, scan


def facades(count: int, rng: np.random.Generator) -> FloatArray:
    """(4 · count, 3) echoes of the four walls of `OUTLINE`, local."""
    s, z = rng.uniform(0, 1, (4, count)), rng.uniform(1.6, 4.5, 4 * count)
    x = np.concatenate([12 * s[0], 12 * s[1], np.zeros(count), np.full(count, 12.0)])
    y = np.concatenate([np.zeros(count), np.full(count, 8.0), 8 * s[2], 8 * s[3]])
    return np.column_stack([x, y, z]) + rng.normal(0, 0.05, (4 * count, 3))


def seen_facades(count: int) -> WallPoints:
    """The four walls of `OUTLINE` as images show them, world: their points face outwards, and are all 5 cm too far out."""
    rng, parts = np.random.default_rng(2), []
    for wall, outward in (
        ((0, 0, 12, 0), (0, -1)),
        ((12, 8, 0, 8), (0, 1)),
        ((0, 8, 0, 0), (-1, 0)),
        ((12, 0, 12, 8), (1, 0)),
    ):
        a, b = np.array(wall, float).reshape(2, 2)
        xy = a + rng.uniform(0, 1, count)[:, None] * (b - a) + rng.normal(0.05, 0.1, count)[:, None] * np.array(outward)
        xyz = np.column_stack([xy, rng.uniform(1.6, 4.5, count)]) + ORIGIN
        normal = np.tile(np.array(outward, np.float32), (count, 1))
        parts.append(WallPoints(xyz, normal, np.full(count, 0.1, np.float32), np.full(count, 3, np.uint8)))
    return joined_walls(parts)


def missed(outline: Polygon, eaves: float, density: float, walls: int = 0, seen: WallPoints | None = None) -> float:
    """The figure for a gable over `OUTLINE`, whose roof stands out evenly, with a local outline given for it."""
    whole = scan(gable, box(*OUTLINE.bounds).buffer(eaves, join_style="mitre"), density, 0.02, 3).points
    around = PointCloud.of(np.concatenate([whole.xyz, facades(walls, np.random.default_rng(1)) + ORIGIN]), BUILDING)
    placed = translate(outline, *ORIGIN[:2])
    x, y = whole.xyz[:, :2].T
    b = placed.bounds
    inside = whole.take((x > b[0]) & (x < b[2]) & (y > b[1]) & (y < b[3]))
    evidence = Evidence("unit", placed, inside, ORIGIN[2], around=around, walls=seen or joined_walls(()))
    solid = choose(evidence, ReconstructParameters()).candidate.solid
    assert isinstance(solid, Polyhedron)
    fit = fit_of(solid, evidence)
    return placement_of(placed, traces_of(evidence, surroundings_of(solid, evidence, fit), fit.density)).missed


@pytest.mark.parametrize("eaves", [0.0, 0.4, 0.9])
def test_eaves_that_stand_out_evenly_are_no_doubt(eaves: float) -> None:
    assert missed(OUTLINE, eaves, 8.0) < 0.012


@pytest.mark.parametrize("eaves", [0.0, 0.5])
def test_what_a_moved_outline_misses_is_told(eaves: float) -> None:
    moved = translate(OUTLINE, 0.8, 0.6)
    truth = 1 - moved.intersection(OUTLINE).area / OUTLINE.area
    assert missed(moved, eaves, 8.0) == pytest.approx(truth, abs=0.045)


def test_facades_that_images_show_take_doubt_away() -> None:
    """Few roof points leave doubt where the outline is true, and see little of it where it is moved."""
    moved = translate(OUTLINE, 0.5, 0.0)
    seen = seen_facades(200)
    assert missed(OUTLINE, 0.0, 0.7, seen=seen) < 0.5 * missed(OUTLINE, 0.0, 0.7)
    assert missed(moved, 0.0, 0.7, seen=seen) > 2 * missed(OUTLINE, 0.0, 0.7, seen=seen)


def test_a_turned_outline_is_told() -> None:
    assert missed(rotate(OUTLINE, 10), 0.4, 8.0) > 0.05


def test_facades_tell_where_eaves_hide_it() -> None:
    """Too small an outline looks as one with wider eaves, until echoes of the walls are seen."""
    moved = translate(OUTLINE, 0.0, 0.5)
    assert missed(moved, 0.5, 4.0, walls=25) > max(0.035, missed(OUTLINE, 0.5, 4.0, walls=25) + 0.03)


def test_few_points_leave_some_doubt() -> None:
    sure, doubtful = missed(OUTLINE, 0.4, 8.0), missed(OUTLINE, 0.4, 0.7)
    assert sure < doubtful < 0.05


def test_edges_that_touch_a_neighbour_are_not_missed() -> None:
    """A unit between two others: its roof goes on over theirs."""
    ends = tuple(
        LineString(np.array([(x, 0.0), (x, 8.0)]) + ORIGIN[:2]) for x in (OUTLINE.bounds[0], OUTLINE.bounds[2])
    )
    row = scan(gable, box(-4, 0, 16, 8), 8.0, 0.02, 3).points
    placed = translate(OUTLINE, *ORIGIN[:2])
    x = row.xyz[:, 0] - ORIGIN[0]
    near = row.take((x > -2) & (x < 14))
    evidence = Evidence("unit", placed, row.take((x > 0) & (x < 12)), ORIGIN[2], around=near, party=ends)
    solid = choose(evidence, ReconstructParameters()).candidate.solid
    assert isinstance(solid, Polyhedron)
    fit = fit_of(solid, evidence)
    alone = replace(evidence, party=())
    told = [
        placement_of(placed, traces_of(e, surroundings_of(solid, e, fit), fit.density)).missed
        for e in (evidence, alone)
    ]
    assert told[0] < 0.012 < told[1]
