"""A flight as a source of tasks: every task once, none before what it reads, the same ones whatever the order, the area of interest or the tiles."""

from __future__ import annotations

import json
import pickle
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import shapely

from cityflow.core.building import Status
from cityflow.core.grid import Bounds
from cityflow.core.reference import Reference
from cityflow.flow.draft import Draft
from cityflow.flow.task import Record, Task
from cityflow.handover.fused import FUSED
from cityflow.handover.vote_files import VOTES
from cityflow.io.catalog.stac_assets import Catalog, ImageAsset, OutlineAsset
from cityflow.orientation.views import View, footprint
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.survey.area import EVERYWHERE, Area
from cityflow.survey.city import OUTLINES
from cityflow.survey.given_outlines import ACCURACY, noded_tile
from cityflow.survey.survey_parameters import TileParameters
from cityflow.synthetic.flight import plan_flight
from cityflow.synthetic.flight_presets import preset
from remembered_plans import remembered_plans  # noqa: F401  # for every test here

AREA = (1000.0, 2000.0, 1180.0, 2140.0)
HEIGHTS = (10.0, 35.0)


def catalog(area: Bounds = AREA, cameras: str = "five_cameras") -> Catalog:
    shot = plan_flight(area, HEIGHTS[0], preset(cameras, width_px=1200, height_px=900, forward_overlap=0.6))
    images = tuple(
        ImageAsset(i.name, f"{i.name}.jpg", f"{k:064d}", 1, footprint(View(i, HEIGHTS)).bounds, i, HEIGHTS)
        for k, i in enumerate(shot)
    )
    return Catalog("", "flight", Reference("EPSG:28992", 28992, None, ""), "", "", (), images=images)


@cache
def flown() -> Catalog:
    return catalog()


def parameters(tile_m: float = 100.0) -> CityParameters:
    return CityParameters(tiles=TileParameters(tile_m=tile_m))


def record_of(task: Task, failed: Sequence[str] = ()) -> Record:
    """What the task would have left."""
    result: dict[str, Any] = {"digest": f"{task.stage} {task.unit}"}
    if task.stage in ("outline", "units"):
        result["units"] = [_entry(task)]
    outputs = {f"work/{task.stage}/{task.unit}/out": f"{task.stage} {task.unit}"}
    if task.stage == "fuse":
        outputs = {f"work/fuse/{task.unit}/{name}": f"{name} {task.unit}" for name in (FUSED, VOTES)}
    if task.stage == "match":
        # what an image leaves of a tile does not depend on what else is asked for
        name = task.arguments["reference"]
        outputs = {f"work/match/{task.unit}/{t}.cfd": f"depths of {name} over {t}" for t in over(task)}
    status, reason = (Status.FAILED, "damaged") if task.name in failed else (Status.DONE, "")
    return Record(
        task.stage, task.unit, 1, task.digest, task.version, status, reason, {} if failed and status is Status.FAILED else outputs,
        result, task.parameters, task.inputs,
    )  # fmt: skip


def over(task: Task) -> list[str]:
    """Ground tiles that a reference image is matched over."""
    return [tree["name"] for tree in task.arguments["place"]["tiles"]]


def _entry(task: Task) -> dict[str, Any]:
    """One house in the middle of every tile."""
    col, row = (int(v) for v in task.unit.split("_"))
    size = 100.0 if row < 30 else 50.0  # rows of the area by the tiles used here
    x, y = (col + 0.5) * size, (row + 0.5) * size
    return {
        "id": f"house {task.unit}", "path": f"work/{task.stage}/{task.unit}/out", "start": 0, "length": 1, "digest": f"house {task.unit}",
        "bounds": [x - 5, y - 5, x + 5, y + 5], "point": [x, y], "neighbours": [], "neighbour_tiles": [],
    }  # fmt: skip


def run_through(source: CitySource, seed: int = 0, failed: Sequence[str] = ()) -> list[Task]:
    return run_on(source, list(source.initial()), seed, failed)


def run_on(source: CitySource, ready: list[Task], seed: int = 0, failed: Sequence[str] = ()) -> list[Task]:
    """From what is ready to the end."""
    order, ended = np.random.default_rng(seed), list[Task]()
    while ready:
        task = ready.pop(int(order.integers(len(ready))))
        ended.append(task)
        ready.extend(source.after(task, record_of(task, failed)))
    return ended


def drafted_through(source: CitySource, seed: int, failed: Sequence[str] = ()) -> tuple[list[Task], int]:
    """As workers do it: a draft is made from the records of what it awaits, in whatever order these come; the tasks, and how many were drafts."""
    source.walk.ahead = True
    order, records, drafts = np.random.default_rng(seed), dict[tuple[str, str], Record](), 0
    ready, ended = list(source.initial()), list[Task]()
    while ready:
        free = [k for k, t in enumerate(ready) if not isinstance(t, Draft) or all(n in records for n in t.awaited)]
        task = ready.pop(free[int(order.integers(len(free)))])
        if isinstance(task, Draft):
            drafts += 1
            made = replace(pickle.loads(task.recipe)([records[n] for n in task.awaited]), shared=task.shared)
            again = task.made()
            assert (made.arguments, made.inputs, made) == (again.arguments, again.inputs, again)
            assert (made.function, made.version, made.limits, made.in_place) == (
                task.function,
                task.version,
                task.limits,
                task.in_place,
            )
            task = made
        ended.append(task)
        records[task.stage, task.unit] = record = record_of(task, failed)
        ready.extend(source.after(task, record))
    return ended, drafts


def test_tasks_that_are_drafted_while_their_inputs_are_at_work_are_the_same(whole: list[Task]) -> None:
    ended, drafts = drafted_through(CitySource(flown(), parameters()), 1)
    assert {t.name: t for t in ended} == {t.name: t for t in whole}
    assert len(ended) == len(whole)
    stages = ("match", "fuse", "surface", "ortho", "frame", "walls", "detect", "outline")
    assert drafts == sum(t.stage in stages for t in whole), "none of these waits for the driver"


def test_tasks_that_are_drafted_know_what_has_failed(whole: list[Task]) -> None:
    area, tile = Area(shapely.box(1010, 2010, 1060, 2060)), "10_20"
    match = next(t for t in whole if t.stage == "match" and tile in over(t))
    failed = [f"ingest-{match.arguments['reference']}", f"fuse-{tile}", f"walls-{tile}"]
    plain = run_through(CitySource(flown(), parameters(), area), 0, failed)
    ended, _ = drafted_through(CitySource(flown(), parameters(), area), 1, failed)
    assert {t.name: t for t in ended} == {t.name: t for t in plain}
    digests = {t.name: t.digest for t in whole}
    changed = {t.stage for t in plain if t.stage != "export" and t.digest != digests[t.name]}
    assert changed >= {"surface", "detect"}


@pytest.fixture(scope="module")
def whole() -> list[Task]:
    return run_through(CitySource(flown(), parameters()))


def test_a_tile_whose_depths_could_not_be_compared_is_named(whole: list[Task]) -> None:
    """Nothing is read of it, and whoever would have read it says so."""
    tile = "10_20"
    tasks = run_through(CitySource(flown(), parameters()), 0, [f"fuse-{tile}"])
    readers = [t for t in tasks if t.stage in ("walls", "frame") and tile in t.arguments["depths"]["missing"]]
    assert {t.stage for t in readers} == {"walls", "frame"}
    before = {t.name: t for t in whole}
    for task in readers:
        maps = task.arguments["depths"]["maps"]
        assert not any(path.endswith(f"/{tile}.cfd") for path in maps)
        assert set(maps) == {p for p in before[task.name].arguments["depths"]["maps"] if not p.endswith(f"/{tile}.cfd")}
        assert task.digest != before[task.name].digest


def test_outlines_are_forgotten_when_all_units_around_are_known() -> None:
    source = CitySource(flown(), parameters())
    split = [t.unit for t in run_through(source, 3) if t.stage == "split"]
    city = source.city
    around = {tile: set(city.ring_of([tile])) for tile in city.survey.lattice.tiles}
    done = [tile for tile, ring in around.items() if ring <= set(city.units_of)]
    assert set(city.tiles) <= set(done)
    assert not set(done) & set(city.outlines_of)
    left = {f"house {tile}" for tile in city.outlines_of}
    assert set(city.outlines) == left
    assert set(city.survey.results.of_stage("split")) == left & set(split)
    assert sum(city.count_outlines[t] for t in city.tiles) == len(city.tiles), "they still count"


def photographs_of(task: Task) -> list[str]:
    """Names of the images that a model is held against."""
    colours = task.arguments["photographs"]["colours"]
    table = json.loads(task.shared[colours["files"]]) if colours["rows"] else []
    return [table[row][0] for row in colours["rows"]]


def test_models_are_held_against_the_images_that_show_them(whole: list[Task]) -> None:
    place, views = {(t.stage, t.unit): i for i, t in enumerate(whole)}, {i.name: i.oriented for i in flown().images}
    models = [t for t in whole if t.stage == "reconstruct"]
    for task in models:
        bounds = next(e for t in whole if t.stage == "units" for e in [_entry(t)] if e["id"] == task.unit)["bounds"]
        corners = np.array([(x, y, z) for x in bounds[::2] for y in bounds[1::2] for z in HEIGHTS])
        shown = {n for n, image in views.items() if image.holds(image.project(corners)[0]).all()}
        assert shown <= set(photographs_of(task))
        assert all(place["ingest", n] < place["reconstruct", task.unit] for n in photographs_of(task))
    seen = next(t for t in models if photographs_of(t))
    lost = photographs_of(seen)[0]
    again = {
        t.unit: t
        for t in run_through(CitySource(flown(), parameters()), 0, [f"ingest-{lost}"])
        if t.stage == "reconstruct"
    }
    assert lost not in photographs_of(again[seen.unit])
    assert again[seen.unit].inputs["images"] != seen.inputs["images"]


def test_every_task_once_and_after_what_it_reads(whole: list[Task]) -> None:
    names = [(t.stage, t.unit) for t in whole]
    assert len(names) == len(set(names))
    place = {name: i for i, name in enumerate(names)}
    assert names[-1] == ("export", "city")
    by_stage = {
        stage: [t for t in whole if t.stage == stage]
        for stage in ("match", "fuse", "surface", "ortho", "frame", "walls", "detect", "outline", "split", "units")
    }
    assert all(by_stage.values())
    for task in by_stage["match"]:
        assert all(
            place["ingest", tree["name"]] < place["match", task.unit] for tree in task.arguments["place"]["images"]
        )
    for stage in ("fuse", "frame", "walls"):
        for task in by_stage[stage]:
            read = [path.split("/")[2] for path in task.arguments["depths"]["maps"]]
            assert read
            assert all(place["match", u] < place[stage, task.unit] for u in read)
    for task in by_stage["detect"]:
        assert all(place["walls", path.split("/")[2]] < place["detect", task.unit] for path in task.arguments["walls"])
        assert f"work/walls/{task.unit}/out" in task.arguments["walls"]
        assert place["detect", task.unit] < place["outline", task.unit]
    tilted = CitySource(flown(), parameters()).survey.images.tilted
    for task in by_stage["split"]:
        own = task.unit.removeprefix("house ")
        assert all(place[stage, own] < place["split", task.unit] for stage in ("surface", "ortho", "outline"))
        assert {tree["frame"]["name"] for tree in task.arguments["frames"]} == {f.name for f in tilted.frames}
        over = tilted.units_over([own])
        assert over
        assert all(place["frame", u] < place["split", task.unit] for u in over)
    assert (
        {t.unit for t in by_stage["fuse"]}
        == {t.unit for t in by_stage["surface"]}
        == {t.unit for t in by_stage["ortho"]}
    )


def test_given_outlines_wait_for_the_facades_around_them() -> None:
    given = replace(flown(), outlines=OutlineAsset("outlines", "o.gpkg", "9" * 64, 1, AREA, 9))
    source = CitySource(given, parameters())
    tiles = list(source.survey.lattice.tiles)
    order, place, ready = np.random.default_rng(1), dict[tuple[str, str], int](), list(source.initial())
    outlines = []
    while ready:
        task = ready.pop(int(order.integers(len(ready))))
        assert (task.stage, task.unit) not in place
        place[task.stage, task.unit] = len(place)
        record = record_of(task)
        if task.unit == OUTLINES:
            outputs = {f"work/ingest/outlines/{t}.jsonl": t for t in tiles}
            record = replace(record, outputs=outputs, result={"reached": {t: [t] for t in tiles}})
        if (tile := noded_tile(task.unit)) is not None:
            record = replace(record, outputs={f"work/ingest/{task.unit}/{tile}.jsonl": tile}, result={"beside": {}})
        if task.stage == "outline":
            outlines.append(task)
        ready.extend(source.after(task, record))
    assert {t.unit for t in outlines} == set(tiles)
    for task in outlines:
        assert f"work/walls/{task.unit}/out" in task.arguments["facades"]["walls"]
        assert all(
            place["walls", path.split("/")[2]] < place["outline", task.unit]
            for path in task.arguments["facades"]["walls"]
        )
        read = [k.split()[1] for k in task.inputs if k.startswith("surface ")]
        assert task.unit in read
        assert all(place["surface", t] < place["outline", task.unit] for t in read)
    assert ("ingest", ACCURACY) not in place
    assert max(place, key=lambda k: place[k]) == ("export", "city")


def test_every_tile_is_seen_from_all_five_directions(whole: list[Task]) -> None:
    inner = [t for t in whole if t.stage == "match" and "10_20" in over(t)]
    heads = {t.arguments["reference"].rsplit("_", 1)[1] for t in inner}
    assert len(heads) == 5
    for task in inner:
        assert len(task.arguments["place"]["images"]) >= 3


def test_the_order_of_events_changes_no_task(whole: list[Task]) -> None:
    digests = {t.name: t.digest for t in whole}
    assert {t.name: t.digest for t in run_through(CitySource(flown(), parameters()), 1)} == digests


def test_an_area_asks_for_the_same_tasks_as_the_whole_and_for_fewer(whole: list[Task]) -> None:
    digests = {t.name: t.digest for t in whole}
    some = run_through(CitySource(flown(), parameters(), Area(shapely.box(1010, 2010, 1060, 2060))))
    assert len(some) < len(whole)
    assert all(digests[t.name] == t.digest for t in some if t.stage not in ("match", "export"))


WEST, MORE = Area(shapely.box(1010, 2010, 1060, 2060)), Area(shapely.box(1010, 2010, 1160, 2060))


@pytest.fixture(scope="module")
def strip() -> Catalog:
    """A long flight of one camera: an area at its end needs a part of it."""
    return catalog((1000.0, 2000.0, 1700.0, 2100.0), "nadir")


def tiles_of_images(tasks: Sequence[Task]) -> list[tuple[str, str]]:
    """Reference images and ground tiles that are matched."""
    return [(t.arguments["reference"], name) for t in tasks if t.stage == "match" for name in over(t)]


def test_a_larger_area_matches_images_again_and_makes_no_surface_again(strip: Catalog) -> None:
    """What was made of an area stands where the area grows, since parts of depth maps keep their digests."""
    tasks = [run_through(CitySource(strip, parameters(), area)) for area in (WEST, MORE, EVERYWHERE)]
    found = [set(tiles_of_images(some)) for some in tasks]
    assert found[0] < found[1] < found[2]
    for some in tasks:
        assert len(tiles_of_images(some)) == len(set(tiles_of_images(some))), "no tile of an image twice"
        assert all(t.unit == t.arguments["reference"] for t in some if t.stage == "match"), "one task for each image"
    for some, larger in ((tasks[0], tasks[1]), (tasks[1], tasks[2])):
        digests = {t.name: t.digest for t in larger}
        changed = {t.stage for t in some if digests.get(t.name) != t.digest}
        assert changed == {"match", "export"}
        assert {"fuse", "surface", "walls", "ortho"} <= {t.stage for t in some}


def test_ground_that_is_asked_for_late_is_matched_by_tasks_of_its_own(strip: Catalog) -> None:
    """As where a building at the edge of the area reaches over a tile that nobody could foresee."""
    source = CitySource(strip, parameters(), WEST)
    before = {t.name: t for t in run_through(source)}
    tile = "15_20"
    more = run_on(source, list(source.walk.want([("fuse", tile)])))
    assert not {t.name for t in more} & set(before)
    late = [t for t in more if t.stage == "match"]
    assert late
    assert all(t.unit == f"{name}.{t.arguments['reference']}" for t in late for name in over(t))
    assert not set(tiles_of_images(late)) & set(tiles_of_images(list(before.values())))
    digests = {t.name: t.digest for t in run_through(CitySource(strip, parameters()))}
    assert [t.digest for t in more if t.stage == "fuse"] == [digests[f"fuse-{tile}"]]


def test_ground_under_buildings_that_textures_look_past_is_foreseen(strip: Catalog) -> None:
    """The area ends 5 m before a tile does: buildings 100 m from it may stand before its own."""
    textured = parameters(50.0)
    plain = textured.model_copy(update={"texture": textured.texture.model_copy(update={"when": "never"})})
    found = [
        CitySource(strip, asked, Area(shapely.box(1010, 2010, 1045, 2060))).survey.matches.first or frozenset()
        for asked in (plain, textured)
    ]
    column = max(int(t.split("_")[0]) for t in found[0])
    assert {int(t.split("_")[0]) for t in found[1] - found[0]} == {column + 1}
    assert CitySource(strip, textured).survey.matches.first is None


class Memory:
    """Records of an earlier run."""

    def __init__(self, tasks: Sequence[Task]) -> None:
        self._records = {(t.stage, t.unit): record_of(t) for t in tasks}

    def latest(self, stage: str, unit: str) -> Record | None:
        return self._records.get((stage, unit))


def test_what_images_were_matched_over_stands_when_less_is_asked_for(strip: Catalog) -> None:
    """Ground asked for late is in it, too. Where the earlier matches are of other parameters, no more is matched than is needed."""
    every = run_through(CitySource(strip, parameters()))
    digests = {t.name: t.digest for t in every}
    source = CitySource(strip, parameters(), WEST, memory=Memory(every))
    less = [*run_through(source), *run_on(source, list(source.walk.want([("fuse", "15_20")])))]
    assert all(digests[t.name] == t.digest for t in less if t.stage != "export")
    other = parameters()
    other = other.model_copy(update={"match": other.match.model_copy(update={"most_parallax_px": 3.0})})
    narrow = set(tiles_of_images(run_through(CitySource(strip, other, WEST))))
    assert set(tiles_of_images(run_through(CitySource(strip, other, WEST, memory=Memory(every))))) == narrow
    assert narrow < set(tiles_of_images(less))


def test_smaller_tiles_have_the_same_reference_images_and_partners(whole: list[Task]) -> None:
    small = run_through(CitySource(flown(), parameters(50.0)))

    def pairs(tasks: list[Task]) -> set[tuple[str, ...]]:
        return {tuple(tree["name"] for tree in t.arguments["place"]["images"]) for t in tasks if t.stage == "match"}

    cells = [
        {
            (t.arguments["reference"], *c)
            for t in tasks
            if t.stage == "match"
            for tree in t.arguments["place"]["tiles"]
            for c in tree["chosen"]
        }
        for tasks in (whole, small)
    ]
    assert pairs(small) <= pairs(whole)
    assert cells[1] <= cells[0]


def test_a_changed_image_makes_its_matches_stale_and_no_others(whole: list[Task]) -> None:
    digests = {t.name: t.digest for t in whole}
    name = next(t for t in whole if t.stage == "match").arguments["reference"]
    source = CitySource(flown(), parameters())
    ready, after = list(source.initial()), dict[str, str]()
    while ready:
        task = ready.pop()
        after[task.name] = task.digest
        record = record_of(task)
        if task.name == f"ingest-{name}":
            record = Record(**{**_fields(record), "result": {"digest": "other pixels"}})
        ready.extend(source.after(task, record))
    matches = {t.name: t for t in whole if t.stage == "match"}
    changed = {n for n in matches if after[n] != digests[n]}
    assert changed == {
        n for n, t in matches.items() if name in [tree["name"] for tree in t.arguments["place"]["images"]]
    }
    assert changed


def _fields(record: Record) -> dict[str, Any]:
    return {k: getattr(record, k) for k in Record.__dataclass_fields__}


def test_an_image_that_cannot_be_read_is_left_out_and_named(whole: list[Task]) -> None:
    name = next(t for t in whole if t.stage == "match").arguments["reference"]
    ended = run_through(CitySource(flown(), parameters(), EVERYWHERE), failed=[f"ingest-{name}"])
    concerned = [
        t for t in ended if t.stage == "match" and name in [tree["name"] for tree in t.arguments["place"]["images"]]
    ]
    assert concerned
    assert all(t.arguments["unread"] == [name] for t in concerned)
    assert all(name not in t.arguments["pixels"] for t in concerned)
    assert {t.name for t in ended} == {t.name for t in whole}


def test_a_frame_is_coloured_by_all_that_is_matched_for_it_also_by_the_images_of_small_clusters() -> None:
    def turned(asset: ImageAsset) -> ImageAsset:
        """Looking 14° aside: too far for the cluster, too few for one of their own."""
        c, s = np.cos(np.radians(14.0)), np.sin(np.radians(14.0))
        view = asset.oriented
        rotation = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]) @ view.rotation
        return replace(asset, oriented=replace(view, rotation=rotation))

    chosen = [a.name for a in flown().images if a.name.endswith("_right")][10:13]
    images = tuple(turned(a) if a.name in chosen else a for a in flown().images)
    source = CitySource(replace(flown(), images=images), parameters())
    frames = [t for t in run_through(source) if t.stage == "frame" and t.arguments["depths"]["maps"]]
    survey = source.survey.images
    assert any(len(f.images) < 5 for f in survey.frames)
    joined = {n for f in survey.frames if len(f.images) < 5 for n in f.images}
    bases = {path.split("/")[2] for t in frames for path in t.arguments["depths"]["maps"]}
    assert joined & bases
    for task in frames:
        wanted = {path.split("/")[2] for path in task.arguments["depths"]["maps"]}
        assert wanted <= set(task.arguments["colours"]["pixels"])
