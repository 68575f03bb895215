"""Holes of the surface beside a roof, slopes towards a neighbour's roof, and steps at a shared wall count by their share of rim and roof."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import LineString, affinity

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.grid import Grid, grown
from cityflow.core.reconstruction import Evidence, HeightRaster
from cityflow.geometry.roof_distances import roof_hits
from cityflow.reconstruction.choose import ReconstructParameters, choose
from cityflow.reconstruction.verdicts.beside_outline import Borders, borders_of
from cityflow.reconstruction.verdicts.figures import roof_places
from roof_scenes import ORIGIN, OUTLINE, scan

CELL_M, ROOF_M, HIGHER_M, STRIP_M = 0.125, 6.0, 1.5, 0.6
WALL = LineString([(ORIGIN[0], ORIGIN[1]), (ORIGIN[0], ORIGIN[1] + 8.0)])
"""The west wall of the unit, beside which a neighbour stands that is higher by `HIGHER_M`."""


def flat(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.full_like(x, ROOF_M)


def with_ramp(x: FloatArray, y: FloatArray) -> FloatArray:
    """Flat, and a strip along the west wall that is half as high as the neighbour."""
    return np.where(x < STRIP_M, ROOF_M + HIGHER_M / 2, ROOF_M)


def unit(neighbour_m: float) -> Evidence:
    """A flat roof with a neighbour in the west, so much higher."""
    evidence = scan(flat, OUTLINE, 30.0, 0.01, 1)
    outline = affinity.translate(OUTLINE, *ORIGIN[:2])
    grid = Grid.covering(grown(outline.bounds, 3.0), CELL_M)
    x, y = (a - o for a, o in zip(grid.centres(), ORIGIN[:2], strict=True))
    dsm = np.where((x > 0) & (x < 12) & (y > 0) & (y < 8), ROOF_M, 0.0)
    dsm[(x < 0) & (y > 0) & (y < 8)] = ROOF_M + neighbour_m
    heights = HeightRaster(grid, dsm + ORIGIN[2], np.full(grid.shape, ORIGIN[2]))
    return replace(evidence, matched=True, heights=heights, party=(WALL,))


def borders(evidence: Evidence, solid: Polyhedron) -> Borders:
    places = roof_places(evidence.outline)
    face = roof_hits(solid, np.column_stack([places, np.zeros(len(places))]))[0]
    return borders_of(solid, evidence, face, places)


def model_of(evidence: Evidence) -> Polyhedron:
    solid = choose(evidence, ReconstructParameters()).candidate.solid
    assert solid is not None
    return solid


@pytest.mark.parametrize(("neighbour_m", "share"), [(HIGHER_M, 0.2 / 12.0), (-HIGHER_M, 0.2 / 12.0), (0.1, 0.0)])
def test_a_roof_is_in_doubt_beside_one_of_another_height(neighbour_m: float, share: float) -> None:
    evidence = unit(neighbour_m)
    found = borders(evidence, model_of(evidence))
    assert found.stepped == pytest.approx(share, abs=0.012)
    assert found.ramped == 0.0
    assert found.holed == 0.0


def test_a_strip_towards_the_neighbour_is_a_ramp_and_one_away_from_it_is_none() -> None:
    ramp = model_of(scan(with_ramp, OUTLINE, 30.0, 0.01, 1))
    assert borders(unit(HIGHER_M), ramp).ramped == pytest.approx(STRIP_M / 12.0, abs=0.02)
    assert borders(unit(-HIGHER_M), ramp).ramped == 0.0


def test_holes_beside_the_free_rim_count() -> None:
    """All along the east wall, 8 m of some 30 m that no other unit touches."""
    evidence = unit(0.0)
    assert evidence.heights is not None
    x, _ = evidence.heights.grid.centres()
    evidence.heights.dsm[x > ORIGIN[0] + 12.0] = np.nan
    assert borders(evidence, model_of(evidence)).holed == pytest.approx(8.0 / 30.0, abs=0.05)


def test_without_a_surface_nothing_is_said() -> None:
    evidence = unit(HIGHER_M)
    assert borders(replace(evidence, heights=None), model_of(evidence)) == Borders()
