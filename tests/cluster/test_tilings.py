"""What must not depend on how the world is cut, or on the area asked for. Other cells of the index: `test_interrupted`."""

from __future__ import annotations

from pathlib import Path

import geopandas
import numpy as np
import pytest
import shapely

from cityflow.flow.store import Store
from cityflow.io.rasters.surface_dataset import chunked_surface
from cluster.small_city import SCENE, Commands, SmallCity, contents, newest, status_layer

pytestmark = pytest.mark.cluster

Heights = tuple[np.ndarray, np.ndarray, np.ndarray]


def hulls(run: Path) -> dict[str, tuple[str, ...]]:
    """Unit → digests of the contents of its hull."""
    return {unit: tuple(record["outputs"].values()) for unit, record in newest(run, "reconstruct").items()}


def surface(run: Path) -> Heights:
    """DSM, DTM and classes over the synthetic town, south side down, from any grid that covers it."""
    city = chunked_surface(Store.open(run).zarr_store("surface.zarr"))
    x, y = slice(SCENE.origin_x, SCENE.origin_x + SCENE.width_m), slice(SCENE.origin_y + SCENE.height_m, SCENE.origin_y)
    dsm, dtm, classes = (city[name].sel(x=x, y=y).to_numpy() for name in ("dsm", "dtm", "class"))
    return dsm, dtm, classes


def assert_same_surface(mine: Heights, other: Heights) -> None:
    for a, b in zip(mine[:2], other[:2], strict=True):
        assert a.shape == b.shape
        alike = (np.abs(a - b) <= 0.001) | (np.isnan(a) & np.isnan(b))
        assert alike.mean() >= 0.999
    assert (mine[2] == other[2]).mean() >= 0.999


def test_other_tiles_and_index_cells_give_the_same_hulls_and_heights(small_run: Path, fifty_run: Path) -> None:
    assert hulls(fifty_run) == hulls(small_run)
    assert_same_surface(surface(fifty_run), surface(small_run))


BOWTIE = shapely.Polygon([(85000, 447000), (85070, 447120), (85070, 447000), (85000, 447120)])


def test_a_run_grows_from_area_to_area_to_the_whole_city(
    cityflow: Commands, small_city: SmallCity, small_run: Path, tmp_path: Path
) -> None:
    """The second area is a broken polygon in another CRS; each leaves what the whole run leaves there."""
    run, polygon = tmp_path / "run", tmp_path / "area.geojson"
    geopandas.GeoDataFrame(geometry=[BOWTIE], crs="EPSG:28992").to_crs("EPSG:4326").to_file(polygon)
    cityflow.run(small_city, run, "--aoi", "85000,447000,85040,447120")
    whole, first = hulls(small_run), hulls(run)
    assert 3 < len(first) < len(whole)
    assert first.items() <= whole.items()
    on_the_map = status_layer(run, tmp_path)
    assert on_the_map.keys() <= first.keys()
    assert set(on_the_map.values()) == {"done"}
    cityflow.run(small_city, run, "--aoi", polygon)
    second = hulls(run)
    assert len(first) < len(second) < len(whole)
    assert second.items() <= whole.items()
    cityflow.run(small_city, run)
    assert contents(run) == contents(small_run)
