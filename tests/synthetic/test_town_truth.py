"""Truth rasters and layers of the synthetic town."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from cityflow.core.grid import Grid
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.town import Town, make_town
from cityflow.synthetic.town_cuts import cut_lines
from cityflow.synthetic.town_truth import TruthRasters, height_steps, judged_cells, town_truth, truth_rasters


@pytest.fixture(scope="module")
def town() -> Town:
    return make_town(2)


@pytest.fixture(scope="module")
def truth(town: Town) -> TruthRasters:
    return truth_rasters(town, Grid.covering(town.bounds, 0.5))


def test_surface_is_the_planes_of_the_units(town: Town, truth: TruthRasters) -> None:
    x, y = np.meshgrid(truth.grid.x_centres(), truth.grid.y_centres())
    worst, cells = [], 0
    for unit in town.units:
        row, col = truth.grid.indices(*np.array(unit.roof_outline.bounds).reshape(2, 2).T)
        window = np.s_[row[1] : row[0] + 1, col[0] : col[1] + 1]
        z = unit.z(x[window], y[window])
        mine = np.isfinite(z) & (truth.unit[window] == unit.index) & (truth.part[window] == Part.ROOF)
        cells += mine.sum()
        worst.append(np.abs(truth.dsm[window] - z)[mine].max())
        covered = np.isfinite(z)
        assert np.quantile(np.abs(truth.dsm_bare[window] - z)[covered], 0.98) < 1e-3
    assert cells > 30_000
    assert max(worst) < 1e-3


def test_ground_is_the_dtm_and_trees_only_add(truth: TruthRasters) -> None:
    ground = np.isin(truth.part, (Part.GROUND, Part.STREET))
    assert ground.mean() > 0.5
    assert np.abs(truth.dsm - truth.dtm)[ground].max() < 1e-4
    assert np.isfinite(truth.dsm).all()
    assert (truth.dsm >= truth.dsm_bare - 1e-4).all()
    assert (truth.dsm_bare >= truth.dtm - 1e-4).all()
    leaves = truth.part == Part.FOLIAGE
    assert (truth.dsm - truth.dsm_bare)[leaves].min() > -1e-4
    assert 0.01 < leaves.mean() < 0.3


def test_roof_planes_tile_the_roof_outlines(town: Town) -> None:
    for unit in town.units:
        area = sum(f.polygon.area for f in unit.roof_planes)
        assert area == pytest.approx(unit.roof_outline.area, abs=1e-3)


def test_judged_cells_keep_away_from_steps(truth: TruthRasters) -> None:
    judged = judged_cells(truth)
    assert 0.6 < judged.open_cells.mean() < 0.95
    assert 0.05 < judged.rim.mean() < 0.5
    steps = height_steps(truth.dsm, truth.grid.cell)
    assert not (judged.open_cells & steps).any()
    assert np.isin(truth.part[judged.open_cells], (Part.GROUND, Part.STREET, Part.ROOF)).all()
    assert not np.isin(truth.part[judged.rim], (Part.FOLIAGE, Part.TRUNK, Part.CAR)).any()


def test_height_steps_of_a_ramp_and_a_wall() -> None:
    ramp = np.tile(np.arange(20) * 0.1, (20, 1))  # 45° at 0.1 m cells
    assert not height_steps(ramp, 0.1).any()
    ramp[:, 10:] += 3.0
    assert height_steps(ramp, 0.1)[:, 9:11].all()
    assert not height_steps(ramp, 0.1)[:, [7, 12]].any()


def test_cut_lines_tell_what_shows(town: Town) -> None:
    cuts = cut_lines(town.units, town.gaps)
    assert len(cuts) > 40
    assert sum(c.gap for c in cuts) == len(town.gaps)
    by_pair = {c.units: c for c in cuts}
    for unit in town.units:
        cut = by_pair.get((unit.twin_of, unit.index))
        if cut is not None:
            assert cut.facade
            assert not cut.height
            assert not cut.roof
            assert not cut.gap
    for cut in cuts:
        a, b = (town.units[k].wall_outline for k in cut.units)
        apart = 1.01 if cut.gap else 1e-5
        assert cut.line.distance(a) < apart
        assert cut.line.distance(b) < apart
        assert cut.none == (not (cut.height or cut.roof or cut.facade or cut.gap))


def test_some_borders_show_nothing() -> None:
    cuts = [c for seed in (1, 3, 4) for t in [make_town(seed)] for c in cut_lines(t.units, t.gaps)]
    assert any(c.none for c in cuts)
    assert any(c.height for c in cuts)


def test_layers_are_complete_and_plain(town: Town) -> None:
    layers = town_truth(town)
    needed = {"units", "wall_outlines", "roof_outlines", "roof_planes", "windows", "cut_lines", "blocks"}
    assert needed <= set(layers)
    assert len(layers["units"]) == len(town.units)
    for records in layers.values():
        assert records
        for geometry, values in records:
            assert not geometry.is_empty
            assert all(v is None or isinstance(v, bool | int | float | str) for v in values.values())


def test_blocks_hold_their_units_and_the_gaps_with_trees(town: Town) -> None:
    blocks = town_truth(town)["blocks"]
    assert sum(values["count"] for _, values in blocks) == len(town.units)
    union = shapely.union_all([u.wall_outline for u in town.units])
    filled = sum(g.polygon.area for g in town.gaps if g.tree)
    assert sum(outline.area for outline, _ in blocks) == pytest.approx(union.area + filled, rel=1e-4)
    assert all(outline.is_valid for outline, _ in blocks)
    assert max(values["count"] for _, values in blocks) >= 6
