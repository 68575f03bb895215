"""Merges of exports: the same files whatever the order; a changed tile rewrites what is above it, and nothing else; city steps stay small."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterable
from importlib import import_module
from io import BytesIO
from pathlib import Path

import geopandas
import numpy as np
import pystac
import pytest
import rasterio
import shapely
from PIL import Image

from cityflow.core.building import Outline, Status
from cityflow.core.coarse import Blocks, Coarse
from cityflow.core.grid import Grid
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task, digest_of
from cityflow.flow.workspace import Workspace
from cityflow.handover.export_rows import ROWS, encode_rows
from cityflow.handover.export_summary import decode_summary
from cityflow.io.catalog.stac_assets import Catalog, LidarAsset, OutlineAsset
from cityflow.io.city_models.coarse_merge import PLAIN
from cityflow.io.city_models.tiles3d import FOLDER as TILES3D
from cityflow.io.city_models.tiles3d import Content, FarContent, stated, write_tileset
from cityflow.io.crs import resolve
from cityflow.io.export_formats.tiles3d import about_tiles
from cityflow.io.globe import globe_of
from cityflow.io.globe_frame import frame_at
from cityflow.io.rasters.raster import write_cog
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.stages import export
from cityflow.stages.export.merge import parent_of, summary_of
from cityflow.stages.export.table import index_path, table_of, table_path
from cityflow.stages.export.tile_summary import leave_summary
from cityflow.survey.city import City
from cityflow.survey.districts import CITY
from glb_reading import Glb

SIDE, TILE_M, CELL_M = 9, 250.0, 10.0
RED = (200, 20, 20)
X, Y = 80_000.0, 440_000.0
"""Corner of a town of 9 × 9 tiles: it lies on four districts of 8 × 8."""


class Town:
    """A town whose tiles have a house each, as far as merges see it."""

    def __init__(self, folder: Path) -> None:
        self.store, self.folder = Store.open(folder), folder
        reference = resolve("EPSG:7415")
        box = (X, Y, X + SIDE * TILE_M - 1, Y + SIDE * TILE_M - 1)
        file = LidarAsset("f", "f.laz", "1" * 64, 1, box, (0.0, 9.0), 9)
        outlines = OutlineAsset("outlines", "o.gpkg", "9" * 64, 1, box, SIDE**2)
        parameters = CityParameters.model_validate({"surface": {"cell_m": CELL_M}})
        self.city = City(Catalog("", "town", reference, "", "", (file,), outlines), parameters)
        self.globe = globe_of(reference, self.city.survey.lattice.bounds)
        self.about = about_tiles("town", "", "", reference, self.globe)
        self.done: dict[str, str] = {}
        self.records: list[Record] = []

    def copy(self, folder: Path) -> Town:
        """The same town in another folder."""
        shutil.copytree(self.folder, folder)
        other = Town(folder)
        other.done = dict(self.done)
        for found in self.records:
            other.learn(found)
        return other

    def learn(self, found: Record) -> None:
        self.records.append(found)
        self.city.learn(found)

    def leave(self, tile: str, verdict: str = "good", height: float = 20.0) -> None:
        """What surface and export of a tile leave."""
        bounds = self.city.survey.lattice.tiles[tile].bounds
        raster = f"products/dsm/{tile}.tif"
        grid = Grid.covering(bounds, CELL_M)
        self.store.write_bytes(raster, write_cog(np.full(grid.shape, height, np.float32), grid, resolve("EPSG:7415")))
        self.learn(record("surface", tile, {raster: digest_of(height)}))
        workspace = Workspace(self.store, Task(export.NAME, tile, "", 1, inputs={"verdict": verdict}))
        rows = {f"h{tile}": {"status": "done", "reason": "", "attributes": {"verdict": verdict}}}
        corner = np.full(3, TILE_M / 2)
        contents = [Content("terrain.glb", -corner, np.array([*corner[:2], height]))]
        frame = frame_at(self.globe, ((bounds[0] + bounds[2]) / 2, (bounds[1] + bounds[3]) / 2, 0.0))
        workspace.publish(
            f"{TILES3D}/{tile}/tileset.json",
            write_tileset(contents, frame, self.about, FarContent(contents[0], TILE_M / 64)),
        )
        workspace.write(ROWS, encode_rows(rows))
        outline = Outline(f"h{tile}", shapely.box(*bounds).buffer(-10.0), {}, "")
        workspace.publish(table_path(tile), table_of(tile, [outline], rows, "EPSG:7415"))
        others, said = {raster: digest_of(height)}, self.city.survey.product_metadata()
        leave_summary(
            workspace,
            tile,
            bounds,
            rows,
            others,
            said,
            parent_of(self.city, tile),
            coarse_of(tile, bounds, 0.75 * height),
        )
        self.learn(record(export.NAME, tile, workspace.outputs))

    def merge(self) -> list[str]:
        """Run the merges that are not done as they are now; their names."""
        ran = []
        for unit in [*self.city.districts.names, CITY]:
            task = export.STAGE.task(self.city, unit)
            assert task is not None
            if self.done.get(unit) != task.digest:
                module, _, name = task.function.partition(":")
                outcome = getattr(import_module(module), name)(Workspace(self.store, task), task)
                self.learn(record(export.NAME, unit, outcome.outputs))
                self.done[unit] = task.digest
                ran.append(unit)
        return ran

    def contents(self) -> dict[str, bytes]:
        return {str(p.relative_to(self.folder)): p.read_bytes() for p in self.folder.rglob("*") if p.is_file()}


def coarse_of(tile: str, bounds: tuple[float, float, float, float], height: float) -> Coarse:
    """Level ground, and a red block of 60 m in its middle."""
    x_0, y_0, x_1, y_1 = bounds
    corners = np.array([[x_0, y_0, 0.0], [x_1, y_0, 0.0], [x_0, y_1, 0.0], [x_1, y_1, 0.0]])
    plan = shapely.Point((x_0 + x_1) / 2, (y_0 + y_1) / 2).buffer(30.0, cap_style="square")
    colours = np.array([[RED, (200, 200, 200)]], np.uint8)
    blocks = Blocks(
        (f"h{tile}",), ("done",), ("good",), np.full((1, 2), np.nan), (plan,), np.array([[0.0, height]]), colours
    )
    return Coarse(bounds, corners, np.array([[0, 1, 2], [1, 3, 2]]), None, bounds, blocks, TILE_M / 64)


def record(stage: str, unit: str, outputs: object) -> Record:
    assert isinstance(outputs, dict)
    return Record(stage, unit, 1, "", 1, Status.DONE, "", outputs, {"digest": unit}, {}, {})


def made(folder: Path, order: Iterable[int]) -> Town:
    """Every third tile is higher and poor."""
    town = Town(folder)
    for i in order:
        town.leave(town.city.tiles[i], *(("good", 20.0) if i % 3 else ("poor", 30.0)))
    town.merge()
    return town


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> Town:
    """Whoever changes it takes a copy."""
    return made(tmp_path_factory.mktemp("merge") / "town", range(SIDE**2))


def test_the_order_of_tiles_changes_no_byte(town: Town, tmp_path: Path) -> None:
    other = made(tmp_path / "other", np.random.default_rng(3).permutation(SIDE**2).tolist())
    assert other.contents() == town.contents()


def test_a_changed_tile_rewrites_what_is_above_it_and_nothing_else(town: Town, tmp_path: Path) -> None:
    town = town.copy(tmp_path / "town")
    before, times = town.contents(), {p: p.stat().st_mtime_ns for p in town.folder.rglob("*.json")}
    tile = town.city.tiles[0]
    town.leave(tile, "look", height=40.0)
    above = town.city.districts.parent[tile]
    assert town.merge() == [above, CITY]
    assert town.merge() == []
    products = {p for p, data in town.contents().items() if before.get(p) != data and p.startswith("products")}
    far = {p for p in products if p.startswith(f"{TILES3D}/coarse/")}
    assert sorted(p for p in far if "city" in p) == [f"{TILES3D}/coarse/city.glb"]
    assert 1 <= len(far) <= 4, "a node of each level above the tile"
    assert all(p.split("/")[-1].startswith(("city", above)) for p in far)
    assert products - far == {
        table_path(tile), index_path(above), f"products/dsm/{tile}.tif", f"products/items/p-{tile}.json", f"{TILES3D}/{tile}/tileset.json",
        f"{TILES3D}/{above}.json", f"products/items/p-{above}.json", f"{TILES3D}/tileset.json", "products/items/p-city.json",
    }  # fmt: skip
    untouched = [d for d in town.city.districts.names if d != above]
    assert len(untouched) == 3
    for district in untouched:
        for path in town.folder.rglob(f"*{district}*.json"):
            assert path.stat().st_mtime_ns == times[path]


def test_rasters_on_other_cells_are_merged_anew(town: Town) -> None:
    """Their names, and the summaries of the tiles, may be what they were."""
    city, before = town.city, [export.STAGE.task(town.city, unit) for unit in (*town.city.districts.names, CITY)]
    other = City(city.survey.catalog, CityParameters.model_validate({"surface": {"cell_m": CELL_M / 2}}))
    for found in town.records:
        other.learn(found)
    for task in before:
        assert task is not None
        now = export.STAGE.task(other, task.unit)
        assert now is not None
        assert now.digest != task.digest


def test_counts_of_the_city_are_those_of_its_tiles(town: Town) -> None:
    path, _ = summary_of(town.city.survey.results, CITY)
    summary = decode_summary(town.store.read_bytes(path), path)
    assert summary.tiles == SIDE**2
    assert summary.counts["status"] == {"done": SIDE**2}
    assert summary.counts["verdict"] == {"good": 54, "poor": 27}
    assert [w.id for w in summary.worst] == sorted(f"h{t}" for i, t in enumerate(town.city.tiles) if i % 3 == 0)


def test_indexes_of_the_districts_read_as_one_table(town: Town) -> None:
    table = geopandas.read_parquet(town.folder / "products/index")
    assert sorted(table["tile"]) == sorted(town.city.tiles)
    assert table["verdict"].value_counts().to_dict() == {"good": 54, "poor": 27}
    assert table.crs == "EPSG:28992"
    one = table[table["tile"] == town.city.tiles[0]]
    whole = geopandas.read_parquet(town.folder / table_path(town.city.tiles[0]))
    assert one.geometry.iloc[0].equals(whole.geometry.iloc[0])
    (x_min, *_) = town.city.survey.lattice.tiles[town.city.tiles[0]].bounds
    inside = geopandas.read_parquet(town.folder / "products/index", bbox=(x_min, Y, x_min + 20.0, Y + 20.0))
    assert inside["tile"].tolist() == [town.city.tiles[0]]


def test_every_tile_is_reached_in_tilesets_catalog_and_raster(town: Town) -> None:
    tiles = set(town.city.tiles)
    assert {uri.removesuffix("/tileset.json") for uri in contents_of(town.folder / TILES3D, "tileset.json")} == tiles
    catalog = pystac.Catalog.from_file(str(town.folder / "products/catalog.json"))
    items = {item.properties["title"] for item in catalog.get_items(recursive=True)}
    assert items == tiles | {CITY, *town.city.districts.names}
    with rasterio.open(town.folder / "products/dsm.vrt") as raster:
        assert raster.shape == (SIDE * TILE_M / CELL_M,) * 2
        heights, counts = np.unique(raster.read(1), return_counts=True)
    assert heights.tolist() == [20.0, 30.0]
    assert counts[1] == 27 * (TILE_M / CELL_M) ** 2


def test_an_export_that_failed_leaves_its_raster_and_no_hole_elsewhere(town: Town, tmp_path: Path) -> None:
    town = town.copy(tmp_path / "town")
    first, *rest = town.city.tiles
    town.learn(Record(export.NAME, first, 2, "", 1, Status.FAILED, "killed", {}, {}, {}, {}))
    town.merge()
    uris = contents_of(town.folder / TILES3D, "tileset.json")
    assert {uri.removesuffix("/tileset.json") for uri in uris} == set(rest)
    with rasterio.open(town.folder / "products/dsm.vrt") as raster:
        assert (raster.read(1) >= 20.0).all()


def test_every_node_shows_what_is_below_it_from_far_away(town: Town) -> None:
    """Terrain without gaps, blocks that are higher than the error, the others painted; boxes hold it; bounded whatever is below."""
    folder, seen = town.folder / TILES3D, []
    for name in ("tileset.json", *(f"{district}.json" for district in town.city.districts.names)):
        left = [json.loads((folder / name).read_text())["root"]]
        while left:
            node = left.pop()
            left += node.get("children", [])
            if "children" not in node:
                continue
            assert node["refine"] == "REPLACE"
            glb = Glb.of((folder / node["content"]["uri"]).read_bytes())
            matrix = np.array(glb.document["nodes"][0]["matrix"]).reshape(4, 4).T
            xyz = np.concatenate([glb.attributes(p)["POSITION"] for p in glb.primitives]).astype(float)
            x, y, z = (xyz @ matrix[:3, :3].T + matrix[:3, 3]).T
            box = np.array(node["boundingVolume"]["box"])
            sides = box[3:].reshape(3, 3)
            away = (np.column_stack([x, -z, y]) - box[:3]) @ sides.T / (sides**2).sum(axis=1)
            assert np.abs(away).max() <= 1
            blocks = sum(len(glb.triangles(p)) for p in glb.primitives[1:])
            ground = glb.primitives[0]
            a, b, c = (glb.attributes(ground)["POSITION"][glb.triangles(ground)[:, i]] for i in range(3))
            area = np.abs(np.cross(b - a, c - a)[:, 1]).sum() / 2
            seen.append((node["geometricError"], area, blocks))
    errors, areas, blocks = np.array(seen).T
    assert areas.max() == pytest.approx((SIDE * TILE_M) ** 2, rel=2e-3)
    assert errors.max() == pytest.approx(stated(SIDE * TILE_M / 64), abs=0.05)
    assert blocks[np.argmax(errors)] == 10 * 27, "of the city those that are 22.5 m high"
    low = errors < stated(8.0)
    assert (blocks[low] == 10 * np.rint(areas[low] / TILE_M**2)).all()
    root = json.loads((folder / "tileset.json").read_text())["root"]
    glb = Glb.of((folder / root["content"]["uri"]).read_bytes())
    image = glb.document["images"][0]
    picture = np.asarray(Image.open(BytesIO(glb.view(image["bufferView"]))), float)
    share = (60 / TILE_M) ** 2
    found = (picture[..., 0].mean() - PLAIN[0]) / (RED[0] - float(PLAIN[0]))
    assert found == pytest.approx(share, abs=0.02), "as much roof is painted as there is"


def contents_of(folder: Path, name: str) -> list[str]:
    """URIs of all tilesets of tiles below a tileset, each parent holding its parts; errors never grow on the way down."""
    tree = json.loads((folder / name).read_text())
    found, left = [], [tree["root"]]
    while left:
        node = left.pop()
        uri = node.get("content", {}).get("uri", "")
        for child in node.get("children", ()):
            assert child["geometricError"] <= node["geometricError"]
            left.append(child)
        if uri.endswith(".glb"):
            continue
        if "/" in uri:
            found.append(uri)
        elif uri:
            below = json.loads((folder / uri).read_text())["root"]
            assert below["geometricError"] <= node["geometricError"]
            assert below["boundingVolume"] == node["boundingVolume"]
            found += contents_of(folder, uri)
    return found
