"""The files of the page: where things are, what they say, what is kept, and that the same run gives the same bytes."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pytest
import shapely
from rich.console import Console

from browser import painted_run as town
from cityflow.core.arrays import FloatArray
from cityflow.core.building import Status
from cityflow.core.grid import Bounds, Grid
from cityflow.errors import RunError
from cityflow.flow.store import Store
from cityflow.io.crs import resolve
from cityflow.reporting import view, view_units
from cityflow.reporting.run_report import report_data, with_settings
from cityflow.reporting.unit_pages import page_path
from cityflow.reporting.view import state_of
from cityflow.reporting.view_cuts import ABOVE_ROOF_M, Ridges, Roofs
from cityflow.reporting.view_frame import PageFrame
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import describe_run
from cityflow.viewer.report_rows import UnitRow
from cityflow.workflow.serve import bring_up_to_date, reader
from small_pictures import small_pictures  # noqa: F401  # for every test here

BOUNDS = (80000.0, 440000.0, 90000.0, 450000.0)


@pytest.fixture(scope="module")
def made(painted_copy: town.Made) -> town.Made:
    town.write_view(*painted_copy)
    return painted_copy


def _tree(run: Prepared, name: str) -> Any:
    return json.loads(run.store.read_bytes(f"view/data/{name}"))


def _table(run: Prepared, tile: str) -> dict[str, dict[str, Any]]:
    """The table of a tile: building → its row."""
    table = _tree(run, f"index/{tile}.json")
    return {row[0]: dict(zip(table["fields"], row, strict=True)) for row in table["rows"]}


@pytest.mark.parametrize("code", ["EPSG:7415", "EPSG:28992", "local"])
def test_positions_come_back_from_the_frame_of_the_page(code: str) -> None:
    reference = resolve(code)
    frame = PageFrame.over(reference, BOUNDS)
    rng = np.random.default_rng(2)
    world = np.column_stack(
        [rng.uniform(80000, 90000, 200), rng.uniform(440000, 450000, 200), rng.uniform(-5, 60, 200)]
    )
    e, n, u = frame.local(world).T
    back = np.column_stack([np.ones_like(e), e, n, u, e * e, e * n, n * n, e * u, n * u]) @ frame.to_world.T
    assert np.abs(back - world).max() < 0.01
    assert frame.worst_m < 0.01
    assert abs(np.median(u - world[:, 2])) < 5.0, "heights are the survey's but for the earth's curvature"


def test_the_index_has_every_building_at_its_place(made: town.Made) -> None:
    run, _ = made
    about, index = _tree(run, "city.json"), _tree(run, "index.json")
    tiles = {row[0]: dict(zip(index["fields"], row, strict=True)) for row in index["rows"]}
    rows = {unit: row for tile in tiles for unit, row in _table(run, tile).items()}
    assert {tile: said["units"] for tile, said in tiles.items()} == {"900_4600": 3, "901_4600": 2, "_": 1}
    assert {r["status"] for r in rows.values()} == {"done", "failed", "refused"}
    e, n, u = rows[town.FLAT]["place"]
    world = np.array(about["world"]) @ [1, e, n, u, e * e, e * n, n * n, e * u, n * u]
    middle = town.OUTLINES[town.FLAT].centroid
    assert world == pytest.approx([middle.x, middle.y, (town.TOPS[town.FLAT] + town.GROUND) / 2], abs=0.05)
    assert about["counts"] == {"done": 4, "degraded": 0, "failed": 1, "refused": 1}
    assert about["layers"] == {"points": True, "dsm": True, "cuts": True, "failures": True}


def test_what_is_known_of_a_building(made: town.Made) -> None:
    run, _ = made
    known = _tree(run, "units/900_4600.json")[town.FLAT]
    assert known["attributes"]["roof_type"] == "flat"
    kept = known["scores"][known["kept"]]
    assert kept["method"].split("/")[0] == known["method"]
    assert sum(kept["parts"].values()) == pytest.approx(kept["penalty"], abs=1e-4)
    assert _tree(run, f"images/{known['atlas_cell']}.json")[town.FLAT] == [["ortho", 1.0]]


def test_a_building_with_a_page_in_the_report_leads_there(
    made: town.Made,
) -> None:
    run, records = made
    path = page_path(town.FLAT)
    run.store.write_bytes(path, b"page")
    try:
        town.write_view(run, records)
        units = _tree(run, "units/900_4600.json")
        assert unquote(units[town.FLAT]["page"]) == path
        assert [u for u, known in units.items() if "page" in known] == [town.FLAT]
    finally:
        run.store.remove(path)
        town.write_view(run, records)


def test_a_page_of_another_version_is_out_of_date(made: town.Made, monkeypatch: pytest.MonkeyPatch) -> None:
    before = state_of(made[1])
    assert before == state_of(made[1])
    monkeypatch.setattr(view, "page_version", lambda: "another")
    assert state_of(made[1]) != before


def test_points_and_surface_are_the_survey_s(made: town.Made) -> None:
    run, _ = made
    about = _tree(run, "city.json")
    tile = next(t for t in about["tiles"] if t["name"] == "900_4600")
    count = tile["points"]["count"]
    data = run.store.read_bytes("view/data/points/900_4600.bin")
    xyz = np.frombuffer(data[: 12 * count], "<f4").reshape(-1, 3) + tile["points"]["origin"]
    classes = np.frombuffer(data[12 * count :], np.uint8)
    assert len(classes) == count == tile["points"]["of"]
    assert set(np.unique(classes)) == {2, 6}
    assert np.median(xyz[classes == 2, 2]) == pytest.approx(town.GROUND, abs=0.05)
    said = tile["dsm"]
    heights = np.frombuffer(run.store.read_bytes("view/data/dsm/900_4600.bin"), "<f4").reshape(
        said["rows"], said["cols"]
    )
    assert np.nanmax(heights) == pytest.approx(town.TOPS[town.GABLE], abs=0.4)
    spot = (
        np.array(said["origin"])
        + np.array(said["right"]) * said["cols"] / 2
        + np.array(said["down"]) * said["rows"] / 2
    )
    e, n = spot
    world = np.array(about["world"]) @ [1, e, n, 3.0, e * e, e * n, n * n, 3 * e, 3 * n]
    assert world[:2] == pytest.approx([town.X + 50, town.Y + 50], abs=1.0)


def test_the_same_run_gives_the_same_page_and_what_is_right_is_kept(made: town.Made) -> None:
    run, records = made
    root = Path(run.store.root)
    before = {p: (p.read_bytes(), p.stat().st_mtime_ns) for p in sorted((root / "view").rglob("*")) if p.is_file()}
    (root / "view/data/points/left_over.bin").write_bytes(b"x")
    town.write_view(run, records)
    after = {p: (p.read_bytes(), p.stat().st_mtime_ns) for p in sorted((root / "view").rglob("*")) if p.is_file()}
    assert {p: data for p, (data, _) in after.items()} == {p: data for p, (data, _) in before.items()}
    kept = [p.parent.name for p in after if after[p][1] == before[p][1]]
    assert set(kept) == {"points", "dsm", "images", "index", "units"}


def test_what_is_kept_is_found_in_one_listing(made: town.Made, monkeypatch: pytest.MonkeyPatch) -> None:
    """An object store takes its time for every question."""
    run, records = made
    asked: list[str] = []
    exists, find = Store.exists, Store.find

    def noted_exists(store: Store, path: str) -> bool:
        asked.append(path)
        return exists(store, path)

    def noted_find(store: Store, prefix: str = "") -> list[str]:
        asked.append(f"list {prefix}")
        return find(store, prefix)

    monkeypatch.setattr(Store, "exists", noted_exists)
    monkeypatch.setattr(Store, "find", noted_find)
    town.write_view(run, records)
    assert [a for a in asked if a.startswith("view/")] == []
    assert asked.count("list view/data") == 1


def test_a_large_city_has_the_same_page_made_tile_by_tile(made: town.Made, tmp_path: Path) -> None:
    run, records = made
    shutil.copytree(run.store.root, tmp_path / "run")
    shutil.rmtree(tmp_path / "run/view")
    copy = Prepared(run.workflow, run.catalog, run.area, Store.open(tmp_path / "run"))
    large = with_settings(copy, ["report.rows=0"])
    data = report_data(large, records)
    assert data.whole is not None
    view.write_run_view(large, records, data)
    for folder in ("index", "units", "ids", "index.json"):
        for path in (p for p in (Path(run.store.root) / "view/data" / folder).rglob("*") if p.is_file()):
            name = path.relative_to(Path(run.store.root) / "view/data")
            assert (tmp_path / "run/view/data" / name).read_bytes() == path.read_bytes(), name
    whole, small = (
        json.loads((root / "view/data/city.json").read_text()) for root in (tmp_path / "run", Path(run.store.root))
    )
    same = ("verdict", "counts", "verdicts", "bounds", "heights", "layers", "notes", "layer_notes", "state")
    assert {key: whole[key] for key in same} == {key: small[key] for key in same}


def test_only_the_tile_of_a_building_that_was_made_again_is_written_anew(made: town.Made, tmp_path: Path) -> None:
    run, records = made
    shutil.copytree(run.store.root, tmp_path / "run")
    copy = Prepared(run.workflow, run.catalog, run.area, Store.open(tmp_path / "run"))
    stage = {r.unit: r for r in records.of("reconstruct")}
    stage[town.FLAT] = replace(stage[town.FLAT], attempt=2, result={**stage[town.FLAT].result, "nmad": 0.5})
    changed = CurrentRecords({**records.by_stage, "reconstruct": [stage[u] for u in sorted(stage)]})
    files = {p: p.stat().st_mtime_ns for p in (tmp_path / "run/view/data").rglob("*.json")}
    town.write_view(copy, changed)
    new = {str(p.relative_to(tmp_path / "run/view/data")) for p, at in files.items() if p.stat().st_mtime_ns != at}
    assert new == {"index/900_4600.json", "units/900_4600.json", "ids/0.json", "index.json", "city.json", "made.json"}
    assert _table(copy, "900_4600")[town.FLAT]["nmad"] == 0.5


def test_ids_are_sorted_as_a_browser_compares_them_and_parted() -> None:
    ids = ["b", "A", "a2", "Ä", "\uff00", "\U00010400", *(f"n{k:05}" for k in range(view_units.IDS_AT_ONCE))]
    parts = list(view_units.id_parts({"west": ids[::2], "east": ids[1::2]}))
    assert [len(rows) for _, rows in parts] == [view_units.IDS_AT_ONCE, 6]
    assert [first for first, _ in parts] == [rows[0][0].lower() for _, rows in parts]
    rows = [row for _, part in parts for row in part]
    assert [u for u, _ in rows][:3] == ["A", "a2", "b"]
    assert [u for u, _ in rows][-2:] == ["\U00010400", "\uff00"], "by halves of surrogate pairs, as scripts do"
    assert dict(rows) == {**dict.fromkeys(ids[::2], "west"), **dict.fromkeys(ids[1::2], "east")}


def test_ends_of_tiles_are_those_of_the_whole() -> None:
    rng = np.random.default_rng(4)
    rows = [[f"{k}", list(rng.uniform(-500, 500, 3)), float(rng.uniform(5, 20))] for k in range(90)]
    tiles = [view_units.ends_of(rows[k::3]) for k in range(3)]
    assert view_units.farthest([*tiles, []]) == view_units.ends_of(rows)
    assert len(view_units.ends_of(rows)) == 32


def test_nothing_in_it_names_this_machine(made: town.Made) -> None:
    run, _ = made
    root = Path(run.store.root)
    for path in (root / "view").rglob("*"):
        if path.is_file() and path.name != "view.js":
            assert str(root.parent).encode() not in path.read_bytes(), path


def test_a_run_that_has_only_begun_has_a_page(made: town.Made, tmp_path: Path) -> None:
    run, _ = made
    early = Prepared(run.workflow, run.catalog, run.area, Store.open(tmp_path))
    describe_run(early)
    town.write_view(early, CurrentRecords({}))
    about = json.loads((tmp_path / "view/data/city.json").read_text())
    assert about["sets"] == {"rectified": None, "raw": None}
    assert not any(about["layers"].values())
    assert (tmp_path / "view/index.html").is_file()


def test_a_page_is_written_where_there_is_none_and_left_alone_where_it_is_right(
    made: town.Made,
) -> None:
    run, _ = made
    root = Path(run.store.root)
    stamp = (root / "view/index.html").stat().st_mtime_ns
    console = Console(quiet=True)
    bring_up_to_date(str(root), console)
    assert (root / "view/index.html").stat().st_mtime_ns == stamp
    (root / "view/index.html").unlink()
    bring_up_to_date(str(root), console)
    assert (root / "view/index.html").is_file()
    with pytest.raises(RunError, match="no run here"):
        bring_up_to_date(str(root / "products"), console)


def test_a_run_before_its_last_export_shows_the_tiles_that_are_there(made: town.Made, tmp_path: Path) -> None:
    run, records = made
    shutil.copytree(run.store.root, tmp_path / "run")
    for name in ("tileset.json", "tileset_raw.json"):
        (tmp_path / "run/products/tiles3d" / name).unlink()
    early = {stage: [r for r in records.of(stage) if r.unit != "city"] for stage in records.stages()}
    early["export"] = early["export"][:1]
    town.write_view(Prepared(run.workflow, run.catalog, run.area, Store.open(tmp_path / "run")), CurrentRecords(early))
    about = json.loads((tmp_path / "run/view/data/city.json").read_text())
    assert about["notes"] == ["1 ground tile with buildings is not exported yet"]
    sets = about["sets"]
    assert sets == {"rectified": "view/data/tileset.json", "raw": "view/data/tileset_raw.json"}
    for path in sets.values():
        root = json.loads((tmp_path / "run" / path).read_text())["root"]
        uris = [tile["content"]["uri"] for tile in root.get("children", [root])]
        assert len(uris) == 1
        assert all((tmp_path / "run" / path).parent.joinpath(uri).resolve().is_file() for uri in uris)


def test_points_that_somebody_has_damaged_are_left_out(made: town.Made, tmp_path: Path) -> None:
    run, records = made
    shutil.copytree(run.store.root, tmp_path / "run")
    shutil.rmtree(tmp_path / "run/view")
    for path in (tmp_path / "run/work/ingest/flight").rglob("*.laz"):
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    for path in (tmp_path / "run/products/textures").glob("*.index.png"):
        path.unlink()
    town.write_view(Prepared(run.workflow, run.catalog, run.area, Store.open(tmp_path / "run")), records)
    about = json.loads((tmp_path / "run/view/data/city.json").read_text())
    assert about["layers"] == {"points": False, "dsm": True, "cuts": True, "failures": True}


def test_pages_come_from_an_object_store_as_well() -> None:
    store = Store.open("memory://view-reader")
    store.write_bytes("view/index.html", b"page")
    read = reader(store)
    assert read("view/index.html") == b"page"
    assert read("products/missing.glb") is None


def test_the_reader_gives_files_and_nothing_for_folders(made: town.Made) -> None:
    run, _ = made
    read = reader(run.store)
    script, page = read("view/view.js"), read("view/index.html")
    assert script is not None
    assert script.startswith(b"/* Built")
    assert page is not None
    assert read("products") is None
    assert read("products/none.glb") is None


def test_a_cut_line_lies_at_the_higher_roof_beside_it() -> None:
    def row(name: str, x: float) -> UnitRow:
        ring = np.array([(x, 0), (x + 10, 0), (x + 10, 10), (x, 10), (x, 0)], float)
        return UnitRow(name, "0_0", Status.DONE, rings=(ring,))

    rows = (row("low", 0), row("high", 10), row("tower", 20))
    ridges = Ridges.of(rows, {"low": (0.0, 5.0), "high": (0.0, 8.0), "tower": (0.0, 60.0)})
    assert ridges.beside(shapely.LineString([(10, 0), (10, 10)]), 0.0) == 8.0
    assert ridges.beside(shapely.LineString([(5, 1), (5, 9)]), 0.0) == 5.0
    assert ridges.beside(shapely.LineString([(-3, 0), (-3, 9)]), 0.0) == 5.0, "the nearest where it touches none"
    assert Ridges.of((), {}).beside(shapely.LineString([(5, 1), (5, 9)]), 2.0) == 2.0


def test_a_cut_line_follows_the_roof_from_eaves_to_ridge() -> None:
    """Of a gable of 45° whose ridge is 10 m high, over a line across it; eaves and ground are beyond its ends."""
    ring = np.array([(0, 0), (10, 0), (10, 10), (0, 10), (0, 0)], float)
    rows = (UnitRow("gable", "0_0", Status.DONE, rings=(ring,)),)
    ridges = Ridges.of(rows, {"gable": (0.0, 10.0)})

    def surface(bounds: Bounds) -> tuple[Grid, FloatArray]:
        grid = Grid.covering(bounds, 0.25)
        x, y = grid.centres()
        inside = (x > 0) & (x < 10) & (y > 0) & (y < 10)
        # a chimney stands on the ridge, and a patch is not known
        roof = np.where((np.abs(y - 5) < 0.6) & (np.abs(x - 4.5) < 0.3), 12.0, 10 - np.abs(y - 5))
        return grid, np.where((y > 7.6) & (y < 8.4), np.nan, np.where(inside, roof, 0.0))

    found = Roofs(ridges, 6.0, surface).along(shapely.LineString([(5, 0), (5, 10)]))
    assert np.allclose(found[:, :2], [(5, y) for y in range(11)])
    true = 10 - np.abs(found[:, 1] - 5)
    known = found[:, 1] != 8
    assert np.abs(found[known, 2] - true[known] - ABOVE_ROOF_M).max() < 0.7, "half a metre from its ends it ends"
    assert np.abs(found[1:-1][known[1:-1], 2] - true[1:-1][known[1:-1]] - ABOVE_ROOF_M).max() < 0.15
    assert found[~known, 2] == 10 + ABOVE_ROOF_M
    assert found[:, 2].max() <= 10 + ABOVE_ROOF_M
    bare = Roofs(ridges, 6.0, lambda _: None).along(shapely.LineString([(5, 0), (5, 10)]))
    assert (bare[:, 2] == 10 + ABOVE_ROOF_M).all()
