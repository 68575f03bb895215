"""The city as a source of tasks: every task once, none before what it reads, nothing left waiting."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely

from cityflow.core.building import Status
from cityflow.core.grid import bounds_meet, tile_at
from cityflow.core.reference import Reference
from cityflow.flow.task import Record, Task
from cityflow.io.catalog.stac import Catalog, LidarAsset, OutlineAsset
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.stages import reconstruct, split
from cityflow.stages.reconstruct import evidence as unit_evidence
from cityflow.survey.area import EVERYWHERE, Area
from cityflow.survey.given_outlines import ACCURACY, noded_tile, noding_unit
from cityflow.survey.results import HULL
from cityflow.survey.tile_lattice import SEEN_AROUND_M
from cityflow.survey.unit_entry import UnitEntry

TILE = 250.0
ROWS_OF_HOUSES = 3


def houses() -> dict[str, dict[str, Any]]:
    """Rows of houses 40 m apart, each sharing walls with the next, across tile borders."""
    found = {}
    for row in range(ROWS_OF_HOUSES):
        for i in range(20):
            x, y = 20.0 + 40 * i, 60.0 + 240 * row
            near = [f"h{row}_{j}" for j in (i - 1, i + 1) if 0 <= j < 20]
            found[f"h{row}_{i}"] = {"bounds": [x, y, x + 40, y + 15], "point": [x + 20, y + 7.5], "neighbours": near}
    return found


HOUSES = houses()


def owner(house: str) -> str:
    x, y = HOUSES[house]["point"]
    return tile_at(x, y, TILE).name


def beside(tile: str) -> set[str]:
    """Tiles whose houses touch ones of a tile."""
    return {owner(n) for h, about in HOUSES.items() if owner(h) == tile for n in about["neighbours"]} - {tile}


def halves() -> dict[str, dict[str, Any]]:
    """What the houses are split into: a western and an eastern half each."""
    found = {}
    for house, about in HOUSES.items():
        x_min, y_min, x_max, y_max = about["bounds"]
        row, i = house[1:].split("_")
        west = [f"h{row}_{int(i) - 1}.b"] if f"h{row}_{int(i) - 1}" in HOUSES else []
        east = [f"h{row}_{int(i) + 1}.a"] if f"h{row}_{int(i) + 1}" in HOUSES else []
        middle, y = (x_min + x_max) / 2, y_min + 7.5
        found[f"{house}.a"] = {
            "bounds": [x_min, y_min, middle, y_max],
            "point": [x_min + 10, y],
            "neighbours": [*west, f"{house}.b"],
        }
        found[f"{house}.b"] = {
            "bounds": [middle, y_min, x_max, y_max],
            "point": [x_max - 10, y],
            "neighbours": [f"{house}.a", *east],
        }
    return found


HALVES = halves()


def catalog(given: bool) -> Catalog:
    bounds = [(0.0, 0.0, 400.0, 760.0), (400.0, 0.0, 840.0, 400.0), (400.0, 400.0, 840.0, 760.0)]
    files = tuple(LidarAsset(f"f{i}", f"f{i}.laz", f"{i}" * 64, 1, b, (0.0, 9.0), 9) for i, b in enumerate(bounds))
    outlines = OutlineAsset("outlines", "o.gpkg", "9" * 64, 1, (0.0, 0.0, 840.0, 760.0), len(HOUSES))
    reference = Reference("EPSG:28992", 28992, None, "")
    return Catalog("", "town", reference, "", "", files, outlines if given else None)


def record_of(task: Task) -> Record:
    """What the task would have left."""
    outputs, result = (
        {f"work/{task.stage}/{task.unit}/out": "d" * 64},
        dict[str, Any](digest=f"{task.stage} {task.unit}"),
    )
    if task.stage == "ingest" and task.unit not in ("outlines", ACCURACY) and noded_tile(task.unit) is None:
        outputs = {f"work/ingest/{task.unit}/{c}_{r}.laz": "p" * 64 for c in range(17) for r in range(16)}
    if (task.stage, task.unit) == ("ingest", "outlines"):
        tiles = sorted({owner(h) for h in HOUSES})
        outputs = {f"work/ingest/outlines/{name}.jsonl": "d" * 64 for name in (*tiles, "sample")}
        result |= {"sampled_from": "f1", "reached": {t: sorted({t, *beside(t)}) for t in tiles}}
    if (tile := noded_tile(task.unit)) is not None:
        outputs = {f"work/ingest/{task.unit}/{tile}.jsonl": "d" * 64}
        result["beside"] = {tile: sorted(beside(tile))}
    if task.stage == "outline":
        entry = {"path": f"work/outline/{task.unit}/out", "start": 0, "length": 1}
        result["units"] = [
            {**entry, "id": h, "digest": h, **v, "neighbour_tiles": sorted({owner(n) for n in v["neighbours"]})}
            for h, v in HOUSES.items()
            if owner(h) == task.unit
        ]
    if task.stage == "units":
        entry = {"path": f"work/units/{task.unit}/out", "start": 0, "length": 1}
        result["units"] = [
            {**entry, "id": u, "digest": u, **v, "neighbour_tiles": sorted({owner(n[:-2]) for n in v["neighbours"]})}
            for u, v in HALVES.items()
            if u[:-2] in task.arguments["own"]
        ]
    return Record(
        task.stage,
        task.unit,
        1,
        task.digest,
        task.version,
        Status.DONE,
        "",
        outputs,
        result,
        task.parameters,
        task.inputs,
    )


def run_through(source: CitySource, order: np.random.Generator) -> list[Task]:
    """Tasks in the order in which they end, chosen at random among those that are ready."""
    ready, ended = list(source.initial()), list[Task]()
    while ready:
        task = ready.pop(int(order.integers(len(ready))))
        ended.append(task)
        ready.extend(source.after(task, record_of(task)))
    return ended


@pytest.mark.parametrize("given", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_every_task_once_and_after_what_it_reads(given: bool, seed: int) -> None:
    ended = run_through(CitySource(catalog(given), CityParameters()), np.random.default_rng(seed))
    names = [(t.stage, t.unit) for t in ended]
    assert len(names) == len(set(names))
    place = {name: i for i, name in enumerate(names)}
    tiles = {u for s, u in names if s == "surface"}
    assert len(tiles) == 16
    units = HOUSES if given else HALVES
    assert {u for s, u in names if s == "reconstruct"} == set(units)
    assert {u for s, u in names if s == "split"} == (set() if given else set(HOUSES))
    assert {u for s, u in names if s == "export"} == tiles | {"city"}
    assert place["export", "city"] == len(names) - 1
    for unit, about in units.items():
        house = unit if given else unit[:-2]
        x_min, y_min, x_max, y_max = about["bounds"]
        under = {tile_at(x, y, TILE).name for x in (x_min - 1, x_max + 1) for y in (y_min - 1, y_max + 1)} & tiles
        assert all(place["surface", t] < place["reconstruct", unit] for t in under)
        assert place["outline", owner(house)] < place["reconstruct", unit]
        assert all(place["reconstruct", n] < place["export", owner(house)] for n in [unit, *about["neighbours"]])
        if given:
            assert place["ingest", "f1"] < place["ingest", ACCURACY] < place["outline", owner(house)]
            noding = [place["ingest", noding_unit(t)] for t in (owner(house), *beside(owner(house)))]
            assert all(place["ingest", "outlines"] < n < place["outline", owner(house)] for n in noding)
        else:
            assert place["outline", owner(house)] < place["split", house] < place["units", owner(house)]
            assert all(place["split", n] < place["units", owner(house)] for n in HOUSES[house]["neighbours"])
            assert place["units", owner(house)] < place["reconstruct", unit]
    assert all(place["ingest", "f0"] < place["surface", t] for t in tiles if t.startswith("0_"))


@pytest.mark.parametrize("given", [True, False])
def test_the_order_of_events_changes_no_task(given: bool) -> None:
    runs = [run_through(CitySource(catalog(given), CityParameters()), np.random.default_rng(s)) for s in range(5)]
    digests = [{(t.stage, t.unit): t.digest for t in run} for run in runs]
    assert all(d == digests[0] for d in digests[1:])


@pytest.mark.parametrize("given", [True, False])
def test_a_laser_survey_that_may_be_drafted_is_the_same(given: bool) -> None:
    """The driver knows its index of points: nothing of it is drafted, and nothing is left out."""
    plain, ahead = (CitySource(catalog(given), CityParameters()) for _ in range(2))
    ahead.walk.ahead = True
    found = [{t.name: t for t in run_through(source, np.random.default_rng(3))} for source in (plain, ahead)]
    assert found[0] == found[1]


@pytest.mark.parametrize("given", [True, False])
def test_lidar_beyond_the_edge_changes_no_task_but_those_that_its_points_reach(given: bool) -> None:
    """A file south-west of the survey, with a gap of two tiles, and one that touches its eastern edge: the bounding box grows in all directions."""
    known, parameters = catalog(given), CityParameters()
    far = LidarAsset("far", "far.laz", "7" * 64, 1, (-800.0, -900.0, -600.0, -700.0), (0.0, 9.0), 9)
    east = LidarAsset("east", "east.laz", "8" * 64, 1, (840.0, 100.0, 1300.0, 200.0), (0.0, 9.0), 9)
    grown_city = CitySource(replace(known, lidar=(*known.lidar, far, east)), parameters, EVERYWHERE)
    before = {
        (t.stage, t.unit): t for t in run_through(CitySource(known, parameters, EVERYWHERE), np.random.default_rng(1))
    }
    after = {(t.stage, t.unit): t for t in run_through(grown_city, np.random.default_rng(2))}
    assert before.keys() < after.keys()
    changed = {node for node, task in before.items() if after[node].digest != task.digest}
    halo = parameters.surface.halo_m
    reached = {
        name for name, tile in grown_city.survey.lattice.tiles.items()
        for file in (far, east) if bounds_meet(tile.buffered(halo), file.bounds)
    }  # fmt: skip
    rows = {unit for stage, unit in changed if stage == "surface"}
    assert rows == reached & {unit for stage, unit in before if stage == "surface"}
    assert len(rows) == 2
    near = {t for name in reached for t in grown_city.survey.lattice.ring(name)}
    tiled = {(stage, unit) for stage, unit in changed if unit in grown_city.survey.lattice.tiles}
    assert {unit for _, unit in tiled} <= near
    # what dealt out the given outlines, and what is one for the whole city
    assert {n for n in changed - tiled if n[0] not in ("reconstruct", "split")} <= {
        ("ingest", "outlines"),
        ("export", "city"),
    }
    units = {unit.split(".")[0] for stage, unit in changed if stage in ("reconstruct", "split")}
    assert {owner(u) for u in units} <= near


def test_an_area_takes_its_units_with_their_neighbours_and_asks_for_no_more_surface() -> None:
    area = Area(shapely.box(0, 0, 130, 100))
    ended = run_through(CitySource(catalog(True), CityParameters(), area), np.random.default_rng(1))
    units = {t.unit for t in ended if t.stage == "reconstruct"}
    assert units == {"h0_0", "h0_1", "h0_2", "h0_3"}
    exported = {u for t in ended if t.stage == "export" and t.unit != "city" for u in t.arguments["own"]}
    assert exported == {"h0_0", "h0_1", "h0_2"}
    whole = {
        t.name: t.digest for t in run_through(CitySource(catalog(True), CityParameters()), np.random.default_rng(2))
    }
    assert all(whole[t.name] == t.digest for t in ended if t.stage in ("ingest", "surface", "outline", "reconstruct"))
    assert len([t for t in ended if t.stage == "surface"]) < 16


def test_an_area_asks_for_the_same_splits_as_the_whole() -> None:
    whole = {
        t.name: t.digest for t in run_through(CitySource(catalog(False), CityParameters()), np.random.default_rng(2))
    }
    area = Area(shapely.box(0, 0, 130, 100))
    ended = run_through(CitySource(catalog(False), CityParameters(), area), np.random.default_rng(1))
    assert 0 < len([t for t in ended if t.stage == "split"]) < len(HOUSES)
    assert {t.unit for t in ended if t.stage == "reconstruct"} == {
        f"h0_{i}.{half}" for i, half in ((0, "a"), (0, "b"), (1, "a"), (1, "b"), (2, "a"), (2, "b"), (3, "a"))
    }
    assert all(whole[t.name] == t.digest for t in ended if t.stage in ("outline", "split", "units", "reconstruct"))


def test_an_override_touches_its_unit_and_the_exports_that_read_it() -> None:
    plain = {
        t.name: t.digest for t in run_through(CitySource(catalog(True), CityParameters()), np.random.default_rng(0))
    }
    over = {("reconstruct", "h1_5"): {"min_points": 9}}
    source = CitySource(catalog(True), CityParameters(), EVERYWHERE, over)
    touched = {t.name for t in run_through(source, np.random.default_rng(0)) if plain[t.name] != t.digest}
    assert touched == {"reconstruct-h1_5"}


@pytest.mark.parametrize(("output", "reread"), [(HULL, True), (reconstruct.CANDIDATES, False)])
def test_another_hull_of_a_unit_changes_the_exports_of_its_neighbours_too(output: str, reread: bool) -> None:
    """What only `explain` reads is no reason to export again."""

    def changed(source: CitySource) -> Iterator[Task]:
        ready = list(source.initial())
        while ready:
            task = ready.pop()
            record = record_of(task)
            if task.name == "reconstruct-h0_5":
                record = replace(record, outputs={**record.outputs, f"work/reconstruct/h0_5/{output}": "x" * 64})
            yield task
            ready.extend(source.after(task, record))

    plain = {
        t.name: t.digest for t in run_through(CitySource(catalog(True), CityParameters()), np.random.default_rng(0))
    }
    touched = {t.name for t in changed(CitySource(catalog(True), CityParameters())) if plain[t.name] != t.digest}
    readers = {owner("h0_4"), owner("h0_5"), owner("h0_6")}
    assert touched == ({f"export-{tile}" for tile in readers} if reread else set())


def test_a_unit_waits_for_every_tile_that_it_looks_into() -> None:
    """What is read without being waited for would depend on the order of the tasks."""
    source = CitySource(catalog(True), CityParameters())
    tile = next(iter(source.survey.lattice.tiles.values()))
    right = f"{tile.col + 1}_{tile.row}"
    assert right in source.survey.lattice.tiles
    _, y_min, x_max, _ = tile.bounds
    for gap, waits in ((4.9, True), (5.1, False)):
        box = (x_max - gap - 10, y_min + 20, x_max - gap, y_min + 30)
        entry = UnitEntry("u", tile.name, "p", 0, 1, "d", box, (box[0] + 5, box[1] + 5), (), ())
        assert (right in source.survey.lattice.tiles_under(entry)) == waits
    for looks in (unit_evidence.AROUND_M, unit_evidence.RASTER_MARGIN_M, split.AROUND_M):
        assert looks <= SEEN_AROUND_M
