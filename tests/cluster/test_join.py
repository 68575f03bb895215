"""``cityflow join``: what it writes is what a small city has at once; a large city has tables in its place."""

from __future__ import annotations

from pathlib import Path

import geopandas
import pyogrio
import pytest
import shapely

from cluster.small_city import Commands, SmallCity, make_city, scene


def layers(path: Path) -> dict[str, geopandas.GeoDataFrame]:
    """By name, with rows and columns sorted."""
    found = {str(name): geopandas.read_file(path, layer=name) for name, _ in pyogrio.list_layers(path)}
    keys = {name: next(c for c in ("id", "outline", "unit") if c in t) for name, t in found.items()}
    return {n: t[sorted(t)].sort_values(keys[n], kind="stable").reset_index(drop=True) for n, t in found.items()}


def test_it_writes_what_a_small_city_has_at_once(cityflow: Commands, small_run: Path, tmp_path: Path) -> None:
    products = small_run / "products"
    cityflow("join", small_run, "--out", tmp_path / "all.gpkg")
    whole, joined = layers(products / "outlines.gpkg"), layers(tmp_path / "all.gpkg")
    assert list(joined) == list(whole)
    for name, table in whole.items():
        assert joined[name].dtypes.equals(table.dtypes)
        assert joined[name].equals(table)
        assert joined[name].crs == table.crs
    cityflow("join", small_run, "--out", tmp_path / "all.city.jsonl")
    assert (tmp_path / "all.city.jsonl").read_bytes() == (products / "city.city.jsonl").read_bytes()


def test_some_tiles_alone_and_what_it_refuses(cityflow: Commands, small_run: Path, tmp_path: Path) -> None:
    tile = sorted((small_run / "products/cityjson").iterdir())[0].name.removesuffix(".city.jsonl")
    cityflow("join", small_run, "--out", tmp_path / "one.city.jsonl", "--tiles", tile)
    own = (small_run / f"products/cityjson/{tile}.city.jsonl").read_bytes().splitlines()
    assert (tmp_path / "one.city.jsonl").read_bytes().splitlines()[1:] == own[1:]
    for out, more, why in (("a.gpkg", ("--tiles", "1_1"), "no tile '1_1'"), ("a.zip", (), "no such format")):
        assert why in cityflow("join", small_run, "--out", tmp_path / out, *more).text
    assert sorted(p.name for p in tmp_path.iterdir()) == ["one.city.jsonl"]


def test_a_city_of_many_tiles_has_tables(
    cityflow: Commands, small_city: SmallCity, small_run: Path, copied_run: Path
) -> None:
    cityflow.run(small_city, copied_run, "--set", "export.join_up_to_tiles=0")
    products = copied_run / "products"
    assert not (products / "outlines.gpkg").exists()
    assert not (products / "city.city.jsonl").exists()
    units = geopandas.read_file(small_run / "products/outlines.gpkg", layer="units").set_index("id").sort_index()
    tables = [geopandas.read_parquet(path) for path in sorted((products / "units").iterdir())]
    found = geopandas.pd.concat(tables).set_index("id").sort_index()
    assert found.index.tolist() == units.index.tolist()
    assert found.geometry.geom_equals(units.geometry).all()
    assert found["ground_height_m"].tolist() == pytest.approx(units["cityflow_ground_height_m"].tolist())
    status = geopandas.read_file(small_run / "products/outlines.gpkg", layer="status").set_index("id")
    index = geopandas.read_parquet(products / "index").set_index("id")
    assert index["status"].to_dict() == {u: status["status"][u] for u in index.index}


def test_within_an_area_what_is_refused_elsewhere_is_left_out_too(cityflow: Commands, tmp_path: Path) -> None:
    far = ("far away", shapely.box(185_500, 447_050, 185_510, 447_060))
    city, run = make_city(tmp_path / "town", [*scene().outlines.items(), far]), tmp_path / "run"
    cityflow.run(city, run, "--aoi", "85000,447000,85060,447060")
    cityflow("join", run, "--out", tmp_path / "all.gpkg")
    whole, joined = (
        geopandas.read_file(path, layer="status") for path in (run / "products/outlines.gpkg", tmp_path / "all.gpkg")
    )
    assert len(whole)
    assert sorted(joined["id"]) == sorted(whole["id"])
