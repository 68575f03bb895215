"""What a unit sees of the run's rasters: the same cells as before a window is cut, each group opened once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from cityflow.core.building import Outline
from cityflow.core.grid import Grid, grown
from cityflow.core.points import HIGH_VEGETATION, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.flow.store import Store
from cityflow.handover.surfaces import Surfaces
from cityflow.io.crs import resolve
from cityflow.io.rasters import surface_dataset, surface_zarr
from cityflow.io.rasters.surface_zarr import LAYERS, create, image_layers, write_tile
from cityflow.stages.reconstruct import evidence as unit_evidence
from cityflow.survey.surface_source import OVERVIEW, ZARR

HOUSE = shapely.box(1010.3, 2015.2, 1022.9, 2024.7)
FINE, COARSE = Grid(1000, 2050, 0.1, 500, 500), Grid(1000, 2050, 0.5, 100, 100)
AT_EDGE = shapely.box(1000.2, 2000.4, 1008.0, 2007.0)


def filled(store: Store, group: str, grid: Grid, layers: dict[str, Any]) -> None:
    create(store.zarr_store(group), grid, grid.rows, resolve("EPSG:28992"), layers)
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    values: dict[str, Any] = {
        "dsm": x + 2 * y, "dtm": 0.01 * (x - 1000) + 5, "class": (x.astype(int) % 7).astype(np.uint8),
        "ortho": np.broadcast_to(x.astype(np.uint8), (3, *grid.shape)), "ortho_seen": x > 1000,
    }  # fmt: skip
    write_tile(store.zarr_store(group), grid, grid, {k: v for k, v in values.items() if k in layers})


GIVEN = unit_evidence.EvidenceInputs(
    pieces=(), unread=(), walls=(), failed_surfaces=(), surfaces=Surfaces(COARSE, ZARR, COARSE), own_orthos=False, given_orthos=(),
    crs="EPSG:28992", classified=False, uneven=0.0, matched=False, alike_m=0.0,
)  # fmt: skip


def seen_by(store: Store, house: shapely.Polygon, images: bool) -> Evidence:
    fine, city = (FINE, COARSE) if images else (COARSE, COARSE)
    surfaces = Surfaces(city, OVERVIEW if images else ZARR, fine)
    return unit_evidence.read_evidence(store, replace(GIVEN, surfaces=surfaces, own_orthos=images), Outline("u", house))


@pytest.mark.parametrize(("images", "groups"), [(False, 1), (True, 2)])
@pytest.mark.parametrize("house", [HOUSE, AT_EDGE])
def test_every_group_is_opened_once(
    images: bool, groups: int, house: shapely.Polygon, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store.open(tmp_path)
    if images:
        filled(store, ZARR, FINE, image_layers(3, "uint8"))
        filled(store, OVERVIEW, COARSE, dict(LAYERS))
    else:
        filled(store, ZARR, COARSE, dict(LAYERS))
    opened: list[object] = []
    monkeypatch.setattr(surface_dataset, "_dataset", _counted(surface_dataset._dataset, opened))
    evidence = seen_by(store, house, images)
    assert len(opened) == groups
    seen_by(store, house, images)
    assert len(opened) == groups, "once per process"
    fine = FINE if images else COARSE
    window = surface_zarr.window_of(fine, grown(house.bounds, unit_evidence.RASTER_MARGIN_M))
    x, y = np.meshgrid(window.x_centres(), window.y_centres())
    assert evidence.heights is not None
    assert evidence.heights.grid == window
    assert np.allclose(evidence.heights.dsm, x + 2 * y, atol=1e-3)
    assert evidence.ground_height == np.floor((0.01 * (house.bounds[0] - 1000) + 5) * 100) / 100
    assert [p.pixels.shape for p in evidence.pictures] == ([(3, *window.shape)] if images else [])


def _counted(function: Any, calls: list[object]) -> Any:
    def counted(*arguments: Any, **more: Any) -> Any:
        calls.append(arguments)
        return function(*arguments, **more)

    return counted


@pytest.mark.parametrize("points", [90, 10])
def test_a_shed_whose_cells_were_taken_for_vegetation_keeps_its_roof(points: int) -> None:
    rng = np.random.default_rng(points)
    shed = shapely.box(1010.0, 2015.0, 1012.5, 2018.2)
    roof = np.column_stack([rng.uniform((1010, 2015), (1012.5, 2018.2), (points, 2)), rng.normal(2.3, 0.02, points)])
    leaves = rng.uniform((1010, 2015, 2.5), (1012.5, 2018.2, 5.0), (points // 4, 3))
    number = np.ones(len(roof) + len(leaves), np.uint8)
    of = np.r_[np.ones(len(roof), np.uint8), np.full(len(leaves), 2, np.uint8)]
    cloud = PointCloud(np.concatenate([roof, leaves]), 0 * number, number, of)
    grid = Grid(1005, 2025, 0.5, 30, 30)
    layers: dict[str, Any] = {
        "dtm": np.zeros(grid.shape, np.float32),
        "class": np.full(grid.shape, HIGH_VEGETATION, np.uint8),
    }
    kept = unit_evidence.roof_points(cloud, grid, layers, GIVEN.classified, 0.2)
    assert shapely.contains_xy(shed, *kept.xyz[:, :2].T).all()
    on_roof = kept.xyz[:, 2] < 2.45
    assert on_roof.sum() >= 0.9 * points
    assert (~on_roof).sum() <= 0.12 * points
