"""Given outlines read part after part, dealt out to tiles by chains and noded there: what all of them give in one piece, to the bit."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import geopandas
import numpy as np
import pytest
import shapely
from shapely import MultiPolygon, Polygon, affinity, box

from cityflow.core.building import Status
from cityflow.core.edits import DrawnOutline, Edits
from cityflow.core.reference import Reference
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Record, Task
from cityflow.flow.workspace import Workspace
from cityflow.handover.outline_lines import decode_all, lines, owned
from cityflow.io.catalog.stac_assets import Catalog, LidarAsset, OutlineAsset
from cityflow.io.crs import resolve
from cityflow.io.tables import vector
from cityflow.io.tables.outline_file import read_outlines
from cityflow.outlines.given.edited import apply_to_outlines
from cityflow.outlines.given.given import clean_outlines
from cityflow.outlines.noded.noding import noded_parts
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.stages import outline
from cityflow.stages.ingest import outline_accuracy, outlines_dealt, outlines_noded
from cityflow.survey.given_outlines import noded_tile, noding_unit
from cityflow.survey.survey import Survey

CORNER = (85000.0, 447500.0)
SIZE_M = 500.0
EDITS = Edits(
    outlines=(
        DrawnOutline(affinity.translate(box(61, 20.5, 70, 29), *CORNER), "u3"),
        DrawnOutline(affinity.translate(box(300, 470, 312, 481), *CORNER)),
    ),
    rejected=(shapely.Point(CORNER[0] + 122.5, CORNER[1] + 25),),
)


@lru_cache
def town() -> list[tuple[str, shapely.Geometry | None]]:
    """Rows across tiles, one of them through the whole town, every vertex with noise of 2 cm; twins, nameless and repeated ids, covers, ruins."""
    rng = np.random.default_rng(7)
    rows: list[Polygon] = [box(20 + 7 * k, 20, 27 + 7 * k, 30 + k % 3) for k in range(68)]
    for y in range(60, 480, 45):
        x = float(rng.uniform(5, 30))
        while x < 470:
            for _ in range(int(rng.integers(1, 9))):
                width = float(rng.uniform(5, 9))
                rows.append(box(x, y + float(rng.uniform(-2, 2)), x + width, y + float(rng.uniform(8, 14))))
                x += width
            x += float(rng.uniform(2, 12))
    shaken = [Polygon(np.array(p.exterior.coords)[:-1] + rng.uniform(-0.02, 0.02, (4, 2))) for p in rows]
    shapes = [affinity.translate(affinity.rotate(p, 3, origin=(250, 250)), *CORNER) for p in shaken]
    named: list[tuple[str, shapely.Geometry | None]] = [(f"u{i}" if i % 5 else "", p) for i, p in enumerate(shapes)]
    at = affinity.translate
    named += [("u3", shapes[2]), ("u3", at(box(480, 2, 490, 12), *CORNER)), ("", shapes[40])]
    named += [("two", MultiPolygon([at(box(x, 485, x + 8, 495), *CORNER) for x in (246.0, 380.0)]))]
    named += [("covered", at(box(350, 485, 360, 495), *CORNER))]
    named += [(f"cover{k}", at(box(350 + 5 * k, 485, 355 + 5 * k, 495), *CORNER)) for k in (0, 1)]
    named += [("cut", at(box(10, 485, 30, 490), *CORNER)), ("cutter", at(box(18, 484, 20, 492), *CORNER))]
    named += [("away", at(box(9000, 0, 9010, 10), *CORNER)), ("none", None), ("u4", at(box(0, 0, 0.1, 0.1), *CORNER))]
    named += [("rim", at(box(-20.5, 485, -0.5, 495), *CORNER)), ("rims", at(box(-0.5, 485, 6, 495), *CORNER))]
    return named


@dataclass(frozen=True)
class Dealt:
    """What the stages made of the town."""

    survey: Survey
    outcomes: Mapping[tuple[str, str], Outcome]
    digests: Mapping[tuple[str, str], str]
    files: Mapping[str, bytes]
    """Name of the tile → its outlines."""

    @property
    def polygons(self) -> dict[str, bytes]:
        return polygons_of(self.files)

    @property
    def refused(self) -> dict[str, str]:
        return {u: why for o in self.outcomes.values() for u, why in o.result.get("refused", [])}


def polygons_of(files: Mapping[str, bytes]) -> dict[str, bytes]:
    return {s.outline.id: s.outline.polygon.wkb for text in files.values() for s in decode_all(text)}


def gpkg(folder: Path, outlines: list[tuple[str, shapely.Geometry | None]]) -> Path:
    path = folder / "outlines.gpkg"
    columns = {"name": [n for n, _ in outlines], "floors": range(len(outlines))}
    geopandas.GeoDataFrame(columns, geometry=[g for _, g in outlines], crs="EPSG:28992").to_file(path)
    return path


def survey_of(path: Path, tile_m: float, edits: Edits) -> Survey:
    data = path.read_bytes()
    x, y = CORNER
    bounds = (x, y, x + SIZE_M, y + SIZE_M)
    files = (LidarAsset("f0", "f0.laz", "0" * 64, 1, bounds, (0.0, 9.0), 9),)
    asset = OutlineAsset(
        "outlines", str(path), hashlib.sha256(data).hexdigest(), len(data), bounds, 1, id_column="name"
    )
    asked = CityParameters.model_validate({"tiles": {"tile_m": tile_m}, "outline": {"walls_in": {"wanted": False}}})
    survey = Survey(Catalog("", "town", Reference("EPSG:28992", 28992, None, ""), "", "", files, asset), asked, {})
    survey.edits = edits
    return survey


def dealt(folder: Path, path: Path, tile_m: float, edits: Edits = EDITS) -> Dealt:
    """Every task of given outlines, one after another."""
    survey, store = survey_of(path, tile_m, edits), Store.open(str(folder / "run"))
    outcomes: dict[tuple[str, str], Outcome] = {}
    digests: dict[tuple[str, str], str] = {}

    def done(task: Task, function: object) -> None:
        outcome: Outcome = function(Workspace(store, task), task)  # type: ignore[operator]
        outcomes[task.stage, task.unit], digests[task.stage, task.unit] = outcome, task.digest
        survey.learn(record_of(task, outcome))

    done(outlines_dealt.task(survey), outlines_dealt.run)
    for tile in sorted({s for t in survey.lattice.tiles for s in survey.given.sources(t)}):
        done(outlines_noded.task(survey, tile), outlines_noded.run)
    for tile in survey.lattice.tiles:
        done(outline.task(survey, tile), outline.run_given)
    texts = {t: list(outcomes["outline", t].outputs) for t in survey.lattice.tiles}
    files = {t: store.read_bytes(p) for t, paths in texts.items() for p in paths if p.endswith(".jsonl")}
    return Dealt(survey, outcomes, digests, files)


def record_of(task: Task, outcome: Outcome) -> Record:
    return Record(
        task.stage, task.unit, 1, task.digest, task.version, outcome.status, outcome.reason, outcome.outputs,
        outcome.result, task.parameters, task.inputs,
    )  # fmt: skip


def in_one_piece(path: Path, survey: Survey) -> tuple[dict[str, bytes], dict[str, str]]:
    """The reference: all outlines cleaned, edited and noded together; the files of the tiles, and who is refused."""
    raw, _ = read_outlines(path, "name", None, resolve("EPSG:28992"))
    clean, refused = clean_outlines(raw)
    clean, rejected = apply_to_outlines(clean, survey.edits)
    parts = noded_parts(clean, 0.05)
    known = set(survey.lattice.tiles)
    by_tile = owned([o for left in parts for o in left], survey.lattice.tile_m, known)
    why = {o.id: outlines_noded.COVERED for o, left in zip(clean, parts, strict=True) if not left}
    why |= {s.outline.id: outlines_dealt.OUTSIDE for t in by_tile.keys() - known for s in by_tile[t]}
    told = [(r.id, r.reason) for r in (*refused, *rejected)]
    return {t: lines(by_tile[t]) for t in sorted(known & by_tile.keys())}, why | dict(told)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[float, Dealt]:
    """The town by tiles of 100 and of 250 m, read 100 rows at a time."""
    folder = tmp_path_factory.mktemp("town")
    path = gpkg(folder, town())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vector, "ROWS", 100)
        return {m: dealt(folder / f"{m}", path, m) for m in (100.0, 250.0)}


@pytest.mark.parametrize("tile_m", [100.0, 250.0])
def test_tiles_give_what_all_outlines_give_in_one_piece(whole: dict[float, Dealt], tile_m: float) -> None:
    made = whole[tile_m]
    asset = made.survey.catalog.outlines
    assert asset is not None
    files, refused = in_one_piece(Path(asset.href), made.survey)
    assert made.files == files
    assert len(files) == (25 if tile_m == 100 else 4)
    named = {name.partition("~")[0]: why for name, why in made.refused.items()}
    assert named == refused
    assert {"covered", "away", "rim", "none"} <= named.keys()
    assert not made.polygons.keys() & made.refused.keys()


def test_the_size_of_tiles_changes_no_vertex(whole: dict[float, Dealt]) -> None:
    assert whole[100.0].polygons == whole[250.0].polygons
    assert {n.partition("~")[0] for n in whole[100.0].refused} == {n.partition("~")[0] for n in whole[250.0].refused}


def test_the_sample_knows_no_tiles(whole: dict[float, Dealt]) -> None:
    assert whole[100.0].survey.given.sample[0] == whole[250.0].survey.given.sample[0] == "f0"
    assert whole[100.0].survey.given.sample[1][1] == whole[250.0].survey.given.sample[1][1]


def test_sampled_outlines_are_noded_with_their_chains_whatever_is_edited(
    tmp_path: Path, whole: dict[float, Dealt]
) -> None:
    made = dealt(tmp_path, gpkg(tmp_path, town()), 100.0, Edits())
    file, (path, digest) = made.survey.given.sample
    edited = whole[100.0].survey.given.sample
    assert (edited[0], edited[1][1]) == (file, digest)
    found = outline_accuracy.noded_sample(Store.open(str(tmp_path / "run")).read_bytes(path), 0.05)
    polygons = made.polygons
    assert len(found) > 300
    assert all(polygons[o.id] == o.polygon.wkb for o in found if o.id in polygons)
    assert sum(bool(o.party) for o in found) > 200


@pytest.mark.parametrize(("name", "noded", "tiles"), [("u63", 1, 1), ("two", 2, 2)])
def test_another_outline_makes_its_tiles_stale_and_no_others(
    tmp_path: Path, whole: dict[float, Dealt], name: str, noded: int, tiles: int
) -> None:
    """A house near the end of a row that is noded in one piece for five tiles; and one in two parts that stand alone in two tiles."""
    moved = [(n, affinity.translate(g, 0.01, 0.01) if n == name and g else g) for n, g in town()]
    before, after = whole[100.0], dealt(tmp_path, gpkg(tmp_path, moved), 100.0)
    stale = {node for node, digest in after.digests.items() if before.digests.get(node) != digest}
    assert {t for s, t in stale if s == "outline"} == {t for t in after.files if after.files[t] != before.files.get(t)}
    assert len([u for s, u in stale if s == "outline"]) == tiles
    assert len([u for s, u in stale if noded_tile(u) is not None]) == noded
    assert len(before.survey.given.reached("850_4475")) >= 5


def test_a_tile_whose_noding_failed_says_so(tmp_path: Path, whole: dict[float, Dealt]) -> None:
    survey = survey_of(Path(whole[250.0].survey.catalog.outlines.href), 250.0, EDITS)  # type: ignore[union-attr]
    for node, outcome in whole[250.0].outcomes.items():
        if node[0] == "ingest":
            survey.learn(Record(*node, 1, "", 1, outcome.status, "", outcome.outputs, outcome.result, {}, {}))
    tile = next(iter(survey.lattice.tiles))
    source = survey.given.sources(tile)[0]
    survey.learn(Record("ingest", noding_unit(source), 1, "", 1, Status.FAILED, "killed", {}, {}, {}, {}))
    task = outline.task(survey, tile)
    assert task.digest != outline.task(whole[250.0].survey, tile).digest
    store = Store.open(str(tmp_path))
    for file in (*survey.given.of(tile), *survey.given.refused_of(tile)):
        store.write_bytes(file.path, b"")
    outcome = outline.run_given(Workspace(store, task), task)
    assert outcome.status is Status.DEGRADED
    assert outcome.reason == f"without outlines.{source}: killed"


@pytest.mark.parametrize("tile_m", [100.0, 250.0])
def test_parts_of_a_cut_outline_get_no_name_that_stands_anywhere_in_the_file(tmp_path: Path, tile_m: float) -> None:
    """In another chain, in another tile, refused, outside of the survey; and another part is cut itself."""
    shapes = {
        "cut": box(10, 485, 30, 490), "cutter": box(18, 484, 20, 492), "cut-1": box(300, 10, 310, 20), "cut-2": box(9000, 0, 9010, 10),
        "cut-3": box(0, 0, 0.1, 0.1), "cut-5": box(410, 400, 430, 405), "cutter of 5": box(418, 399, 420, 407), "cut-x": box(40, 485, 45, 490),
    }  # fmt: skip
    town = [(name, affinity.translate(shape, *CORNER)) for name, shape in shapes.items()]
    found = dealt(tmp_path, gpkg(tmp_path, list(town)), tile_m, Edits())
    names = [s.outline.id for text in found.files.values() for s in decode_all(text)]
    assert sorted([*names, *found.refused]) == sorted(
        ["cut-4", "cut-6", "cutter", "cut-1", "cut-2", "cut-3", "cut-5-1", "cut-5-2", "cutter of 5", "cut-x"]
    )
