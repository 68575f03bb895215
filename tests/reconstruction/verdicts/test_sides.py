"""Which side of an outline is off, by how much, and what says so; even eaves are no doubt."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import LineString, Polygon, box
from shapely.affinity import translate

from cityflow.core.building import OutlineEdge, Polyhedron
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.grid import Grid
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence, HeightRaster
from cityflow.reconstruction.choose import ReconstructParameters, choose
from cityflow.reconstruction.verdicts.roof_fit import fit_of
from cityflow.reconstruction.verdicts.sides import Sides, sides_of
from cityflow.reconstruction.verdicts.surroundings import surroundings_of
from cityflow.reconstruction.verdicts.traces import traces_of
from roof_scenes import ORIGIN, OUTLINE, gable, scan

CELL_M, MARGIN_M, HIDDEN_M = 0.25, 4.0, 5.4


def rasters(outline: Polygon, roof: Polygon) -> HeightRaster:
    """Ground around a roof of 6 m, world."""
    x_0, y_0, x_1, y_1 = outline.buffer(MARGIN_M).bounds
    grid = Grid.covering((x_0 + ORIGIN[0], y_0 + ORIGIN[1], x_1 + ORIGIN[0], y_1 + ORIGIN[1]), CELL_M)
    x, y = grid.centres()
    a, b, c, d = translate(roof, *ORIGIN[:2]).bounds
    dtm = np.full(grid.shape, ORIGIN[2])
    return HeightRaster(grid, dtm + np.where((x > a) & (x < c) & (y > b) & (y < d), 6.0, 0.0), dtm)


def northern_facade(y: float) -> WallPoints:
    """Points of a wall that looks north, at such a local y."""
    rng = np.random.default_rng(2)
    xyz = np.column_stack([rng.uniform(0, 12, 300), rng.normal(y, 0.08, 300), rng.uniform(1, 4.5, 300)]) + ORIGIN
    normal = np.tile(np.array((0.0, 1.0), np.float32), (300, 1))
    return WallPoints(xyz, normal, np.full(300, 0.1, np.float32), np.full(300, 3, np.uint8))


def sides(
    outline: Polygon,
    eaves: float = 0.0,
    seen: WallPoints | None = None,
    more: float = 0.0,
    *,
    tree: bool = False,
    rim: bool = False,
) -> Sides:
    """The figure for a gable over `OUTLINE` with a local outline given for it.

    The roof stands out evenly, and `more` metres more in the north; a `tree` hides its northern third; the northern side is known by its `rim`.
    """
    x_0, y_0, x_1, y_1 = OUTLINE.buffer(eaves, join_style="mitre").bounds
    roof = box(x_0, y_0, x_1, y_1 + more)
    whole = scan(gable, roof, 12.0, 0.02, 3).points
    a, b, c, d = outline.bounds
    x, y = (whole.xyz[:, k] - ORIGIN[k] for k in (0, 1))
    inside, near = ((x > a - m) & (x < c + m) & (y > b - m) & (y < d + m) for m in (0.0, 2.0))
    if tree:
        inside, near = (m & (y < HIDDEN_M) for m in (inside, near))
    placed = translate(outline, *ORIGIN[:2])
    north = LineString(translate(LineString([(a, d), (c, d)]), *ORIGIN[:2]).coords)
    evidence = Evidence(
        "unit", placed, whole.take(inside), ORIGIN[2], around=PointCloud.of(whole.xyz[near], BUILDING),
        walls=seen or joined_walls(()), heights=rasters(outline, roof), matched=True,
        edges=(OutlineEdge(north, "roof"),) if rim else (),
    )  # fmt: skip
    solid = choose(evidence, ReconstructParameters()).candidate.solid
    assert isinstance(solid, Polyhedron)
    fit = fit_of(solid, evidence)
    return sides_of(placed, traces_of(evidence, surroundings_of(solid, evidence, fit), fit.density))


@pytest.mark.parametrize("eaves", [0.0, 0.4, 0.8])
def test_even_eaves_are_no_doubt(eaves: float) -> None:
    assert sides(OUTLINE, eaves).missed < 0.02


def test_an_outline_cut_within_its_roof_is_told() -> None:
    """1.6 m of 8 are cut off in the north: a fifth of the roof."""
    found = sides(box(0, 0, 12, 6.4))
    assert found.missed > 0.1
    assert found.worst.startswith("north side, 12 m: roof-high surface goes on 1.")


def test_a_side_over_ground_is_told() -> None:
    """The roof ends further in than the points just inside the side are looked at."""
    found = sides(box(0, 0, 12, 9.8))
    assert found.missed > 0.08
    assert found.worst.startswith("north side, 12 m: the roof ends ")
    assert "inside it" in found.worst


def test_a_facade_under_a_wide_roof_is_told() -> None:
    """The outline follows the rim of the roof, which stands out by 1.2 m in the north alone: only the façade says so."""
    rim = box(0, 0, 12, 9.2)
    unknown, known = (sides(rim, more=1.2, seen=s) for s in (None, northern_facade(8.0)))
    assert known.missed > max(0.04, 2 * unknown.missed)
    assert known.worst.startswith("north side, 12 m: its façade stands 1.")
    right = sides(OUTLINE, more=1.2, seen=northern_facade(8.0))
    assert right.missed < 0.02
    assert right.worst == ""


def test_a_tree_outside_hides_how_a_roof_goes_on() -> None:
    """An outline cut where the tree begins: without a façade only the rim of the seen roof made it; ground outside would have confirmed it."""
    cut = box(0, 0, 12, HIDDEN_M)
    assert sides(cut, tree=True, rim=True).astray > 0.2
    assert sides(OUTLINE, rim=True).astray < 0.05
