# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import warnings

import dask.array as da
import numpy as np
import pytest
import xarray as xr

from cityflow.geometry.hill_shade import hill_shade
from cityflow.surface.lazy_city_raster import coarser, difference, relief

TILE = 20


def heights(seed: int, left: float, top: float, tiles: tuple[int, int], cell: float = 0.5) -> xr.DataArray:
    """A surface with gaps, a chunk per tile."""
    rng = np.random.default_rng(seed)
    rows, cols = tiles[0] * TILE, tiles[1] * TILE
    values = rng.normal(20, 5, (rows, cols)).astype(np.float32)
    values[rng.random(values.shape) < 0.3] = np.nan
    values[:8, :12] = np.nan
    y, x = top - (np.arange(rows) + 0.5) * cell, left + (np.arange(cols) + 0.5) * cell
    return xr.DataArray(da.from_array(values, chunks=TILE), {"y": y, "x": x}, ("y", "x"), "dsm")


@pytest.mark.parametrize("factor", [1, 2, 5, 20])
def test_coarser_cells_are_means_of_what_is_known(factor: int) -> None:
    fine = heights(1, 1000.0, 2000.0, (2, 3))
    found = coarser(fine, factor).compute()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        expected = fine.astype(float).coarsen(y=factor, x=factor).mean().compute()
    xr.testing.assert_allclose(found, expected.astype(np.float32), rtol=1e-6)
    assert found.dtype == np.float32


def test_a_factor_that_parts_a_tile_is_refused() -> None:
    with pytest.raises(ValueError, match="no multiple of 3"):
        coarser(heights(1, 0.0, 0.0, (1, 1)), 3)


def test_a_relief_has_no_seams_between_tiles() -> None:
    fine = heights(2, 0.0, 0.0, (2, 2))
    values = fine.values
    whole = np.where(np.isfinite(values), np.clip(hill_shade(values, 0.5) * 150, 1, 255), 0).astype(np.uint8)
    np.testing.assert_array_equal(relief(fine, 0.5).values, whole)


def test_two_epochs_of_other_extents_meet_on_their_common_cells() -> None:
    """The second is two tiles wider in the west and one in the north; a house of 3 m has gone."""
    now, before = heights(3, 1000.0, 2000.0, (2, 2)), heights(3, 980.0, 2010.0, (3, 4))
    old = before.values
    old[TILE:, 2 * TILE :] = now.values
    old[TILE + 10 : TILE + 15, 2 * TILE + 3 : 2 * TILE + 9] += 3.0
    before = before.copy(data=da.from_array(old, chunks=TILE))
    found = difference(now, before, 0.5).compute()
    assert found.shape == (2 * TILE, 2 * TILE)
    np.testing.assert_allclose(found["x"], now["x"], atol=1e-9)
    np.testing.assert_allclose(found["y"], now["y"], atol=1e-9)
    known = np.isfinite(now.values)
    np.testing.assert_array_equal(np.isfinite(found.values), known)
    expected = np.zeros(known.shape)
    expected[10:15, 3:9] = -3.0
    np.testing.assert_allclose(found.values[known], expected[known], atol=1e-5)


def test_what_has_nothing_in_common_is_refused() -> None:
    with pytest.raises(ValueError, match="no cell in common"):
        difference(heights(1, 0.0, 0.0, (1, 1)), heights(1, 500.0, 0.0, (1, 1)), 0.5)
    with pytest.raises(ValueError, match="do not begin at multiples"):
        difference(heights(1, 0.2, 0.0, (1, 1)), heights(1, 0.2, 0.0, (1, 1)), 0.5)
