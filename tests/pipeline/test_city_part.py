"""A few tasks run again: what depends on them runs, nothing else is looked at, and a walk over the whole city finds nothing that is not up to date."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely

from cityflow.core.building import Status
from cityflow.core.edits import NO_EDITS, DrawnOutline, Edits
from cityflow.core.grid import tile_at
from cityflow.core.reference import Reference
from cityflow.flow.ready import Ready
from cityflow.flow.stage import Node
from cityflow.flow.task import Record, Task
from cityflow.handover.export_summary import SUMMARY
from cityflow.io.catalog.stac_assets import Catalog, ImageAsset, LidarAsset, OutlineAsset
from cityflow.orientation.views import View, footprint
from cityflow.pipeline.city_part import CityPart
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.part_reach import Chosen
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.survey import survey
from cityflow.survey.area import Area
from cityflow.survey.given_outlines import ACCURACY, noded_tile
from cityflow.survey.image_survey import ImageSurvey
from cityflow.survey.results import HULL
from cityflow.synthetic.flight import plan_flight
from cityflow.synthetic.flight_presets import preset
from remembered_plans import remembered_plans  # noqa: F401  # for every test here

TILE = 100.0
EXTENT = (1000.0, 2000.0, 1400.0, 2200.0)
HEIGHTS = (10.0, 35.0)
AREA = Area(shapely.box(*EXTENT))
REFERENCE = Reference("EPSG:28992", 28992, None, "")
COLS, ROWS = 16, 4
"""Houses of 25 m in rows, 50 m apart: every fourth shares its wall with one across the border of a tile."""


def houses() -> dict[str, dict[str, Any]]:
    found = {}
    for row in range(ROWS):
        for col in range(COLS):
            x, y = EXTENT[0] + 25 * col, EXTENT[1] + 50 * row + 20
            near = [f"h{row}_{j}" for j in (col - 1, col + 1) if 0 <= j < COLS]
            found[f"h{row}_{col}"] = {"bounds": [x, y, x + 25, y + 12], "point": [x + 12.5, y + 6], "neighbours": near}
    return found


HOUSES = houses()


def owner(house: str) -> str:
    x, y = HOUSES[house]["point"]
    return tile_at(x, y, TILE).name


def scanned(*, given: bool = True) -> tuple[Catalog, CityParameters]:
    bounds = [(1000.0, 2000.0, 1200.0, 2200.0), (1200.0, 2000.0, 1400.0, 2200.0)]
    files = tuple(LidarAsset(f"f{i}", f"f{i}.laz", f"{i}" * 64, 1, b, (0.0, 9.0), 9) for i, b in enumerate(bounds))
    outlines = OutlineAsset("outlines", "o.gpkg", "9" * 64, 1, EXTENT, len(HOUSES)) if given else None
    return Catalog("", "town", REFERENCE, "", "", files, outlines), parameters()


def flown() -> tuple[Catalog, CityParameters]:
    shot = plan_flight(
        EXTENT,
        HEIGHTS[0],
        preset("five_cameras", width_px=3000, height_px=2400, gsd_m=0.1, forward_overlap=0.6, side_overlap=0.4),
    )
    images = tuple(
        ImageAsset(i.name, f"{i.name}.jpg", f"{k:064d}", 1, footprint(View(i, HEIGHTS)).bounds, i, HEIGHTS)
        for k, i in enumerate(shot)
    )
    return Catalog("", "flight", REFERENCE, "", "", (), images=images), parameters()


def parameters() -> CityParameters:
    return CityParameters.model_validate({"tiles": {"tile_m": TILE}, "texture": {"around_m": 20.0}})


@pytest.fixture(scope="module", params=["given outlines", "found outlines", "images"])
def town(request: pytest.FixtureRequest) -> Town:
    made = {"given outlines": scanned, "found outlines": lambda: scanned(given=False), "images": flown}
    return Town(*made[request.param]())


class Town:
    """A survey, and the records of a whole run over it."""

    def __init__(self, catalog: Catalog, asked: CityParameters) -> None:
        self.catalog, self.asked = catalog, asked
        self._images = ImageSurvey(catalog, asked)
        self.records: dict[Node, Record] = {}
        run(self.source(), self.records)

    def source(self, edits: Edits = NO_EDITS) -> CitySource:
        """Anew, but for what follows from the poses alone, which takes as long as all else."""
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(survey, "ImageSurvey", lambda *_: self._images)
            found = CitySource(self.catalog, self.asked, AREA)
        found.survey.__dict__["edits"] = edits
        return found


class Memory:
    def __init__(self, records: dict[Node, Record]) -> None:
        self.records = records
        self.read: list[Node] = []

    def has(self, stage: str, unit: str) -> bool:
        return (stage, unit) in self.records

    def latest(self, stage: str, unit: str) -> Record | None:
        self.read.append((stage, unit))
        return self.records.get((stage, unit))


def nobody(_: Task) -> bool:
    return False


def run(
    source: Any,
    records: dict[Node, Record],
    redo: Callable[[Task], bool] = nobody,
    leave: Callable[[Task], Record] | None = None,
) -> list[Node]:
    """What ran, in this order; what stands in the records and was not to be redone does not run."""
    ready, ran = [iter(source.initial())], list[Node]()
    while ready:
        task = next(ready[-1], None)
        if task is None:
            ready.pop()
            continue
        node = task.stage, task.unit
        if node not in records or records[node].digest != task.digest or redo(task):
            ran.append(node)
            records[node] = (leave or record_of)(task)
        ready.append(iter(source.after(task, records[node])))
    return ran


def run_as_an_engine(
    part: CityPart,
    records: dict[Node, Record],
    redo: Callable[[Task], bool],
    leave: Callable[[Task], Record],
    random: np.random.Generator,
) -> set[Node]:
    """What ran, where four tasks are under way at a time and any of them ends first."""
    ready, under_way, ran = Ready(part.initial()), list[tuple[Task, int]](), set[Node]()
    while True:
        while len(under_way) < 4 and (following := ready.next()) is not None:
            under_way.append(following)
        if not under_way:
            return ran
        task, rank = under_way.pop(int(random.integers(len(under_way))))
        node = task.stage, task.unit
        if node not in records or records[node].digest != task.digest or redo(task):
            ran.add(node)
            records[node] = leave(task)
        ready.add(part.after(task, records[node]), rank)


def record_of(task: Task, *, edition: str = "", failed: bool = False) -> Record:
    """What the task would have left; its contents follow from what it was made of."""
    name = {"reconstruct": HULL, "outline": "outlines.jsonl", "units": "units.jsonl", "export": SUMMARY}.get(
        task.stage, "out"
    )
    digest = f"{task.digest[:20]}{edition}"
    outputs: dict[str, str] = {f"work/{task.stage}/{task.unit}/{task.digest[:16]}/{name}": digest}
    result: dict[str, Any] = {"digest": digest}
    if task.stage == "ingest" and task.unit not in ("outlines", ACCURACY) and noded_tile(task.unit) is None:
        outputs = {f"work/ingest/{task.unit}/{c}_{r}.laz": "p" for c in range(20, 33) for r in range(40, 47)}
    if (task.stage, task.unit) == ("ingest", "outlines"):
        tiles = sorted({owner(h) for h in HOUSES})
        outputs = {f"work/ingest/outlines/{t}.jsonl": "d" for t in tiles}
        result |= {"sampled_from": "f1", "reached": {t: [t] for t in tiles}}
    if (tile := noded_tile(task.unit)) is not None:
        outputs, result = {f"work/ingest/{task.unit}/{tile}.jsonl": "d"}, {"beside": {}}
    if task.stage in ("outline", "units"):
        result["units"] = [entry(h, next(iter(outputs)), edition) for h in HOUSES if owner(h) == task.unit]
    status = (Status.FAILED, "no model") if failed else (Status.DONE, "")
    return Record(
        task.stage,
        task.unit,
        1,
        task.digest,
        task.version,
        *status,
        {} if failed else outputs,
        result,
        task.parameters,
        task.inputs,
    )


def entry(house: str, path: str, edition: str) -> dict[str, Any]:
    about = HOUSES[house]
    return {
        **about, "id": house, "path": path, "start": 0, "length": 1, "digest": f"{house}{edition}",
        "neighbour_tiles": sorted({owner(n) for n in about["neighbours"]}),
    }  # fmt: skip


def chosen(*nodes: Node) -> Chosen:
    houses_of = [u for _, u in nodes if u in HOUSES]
    places = {owner(u): tuple(tuple(HOUSES[h]["bounds"]) for h in houses_of if owner(h) == owner(u)) for u in houses_of}
    return Chosen(frozenset(nodes), places)


def is_among(nodes: Iterable[Node]) -> Callable[[Task], bool]:
    return lambda task: (task.stage, task.unit) in nodes


def stale(town: Town, records: dict[Node, Record], edits: Edits = NO_EDITS) -> list[Node]:
    return run(town.source(edits), dict(records))


AT_A_BORDER = "h1_11"
"""Its neighbour `h1_12` is in the next tile."""
FAR = 150.0
"""Nothing so far from a house feels it: models around are looked for within 20 m, and no tile is larger."""


def test_the_town_is_as_thought(town: Town) -> None:
    assert owner(AT_A_BORDER) != owner("h1_12")
    assert stale(town, town.records) == []
    textures = [n for n in town.records if n[0] == "texture"]
    assert bool(textures) == bool(town.catalog.images)


@pytest.mark.parametrize("failed", [False, True])
def test_a_building_with_another_hull_sets_going_what_it_touches_and_nothing_else(town: Town, failed: bool) -> None:
    nodes = [(s, AT_A_BORDER) for s in ("reconstruct", "texture", "windows") if (s, AT_A_BORDER) in town.records]

    def leave(task: Task) -> Record:
        own = task.stage == "reconstruct"
        return record_of(task, edition="b" if own else "", failed=failed and own)

    records, whole = dict(town.records), dict(town.records)
    memory = Memory(records)
    part = CityPart(town.source(), chosen(*nodes), memory)
    ran = run(part, records, is_among(nodes), leave)
    assert set(run(town.source(), whole, is_among(nodes), leave)) == set(ran)
    assert whole == records
    assert stale(town, records) == []
    tiles = {owner(AT_A_BORDER), owner("h1_12")}
    assert {("export", t) for t in tiles} | {("export", "city")} <= set(ran)
    if town.catalog.images:
        assert {s for s, _ in ran} >= {"texture", "atlas"}
    assert {t for s, t in ran if s == "export"} - {"city"} <= set(town.source().city.ring_of(tiles))
    assert not part.walk.left
    assert not part.walk.waiting()


def test_what_makes_the_same_again_changes_nothing_and_reads_little(town: Town) -> None:
    records = dict(town.records)
    memory = Memory(records)
    part = CityPart(town.source(), chosen(("reconstruct", "h0_0")), memory)
    assert run(part, records, lambda task: task.unit == "h0_0" and task.stage == "reconstruct") == [
        ("reconstruct", "h0_0")
    ]
    assert records == town.records
    far = [
        u
        for s, u in memory.read
        if s in ("reconstruct", "texture", "windows") and HOUSES[u]["point"][0] > EXTENT[0] + 2 * TILE + FAR
    ]
    assert far == []


@pytest.mark.parametrize("changed", [False, True])
def test_an_outline_that_is_split_anew_reaches_all_that_its_tile_names(town: Town, changed: bool) -> None:
    if ("split", AT_A_BORDER) not in town.records:
        pytest.skip("given outlines are not split")

    def leave(task: Task) -> Record:
        return record_of(task, edition="b" if changed and task.stage in ("split", "units") else "")

    records, whole = dict(town.records), dict(town.records)
    nodes = [(s, AT_A_BORDER) for s in ("split", "reconstruct")]
    part = CityPart(town.source(), chosen(*nodes), Memory(records))
    ran = run(part, records, is_among(nodes), leave)
    assert set(run(town.source(), whole, is_among(nodes), leave)) == set(ran)
    assert whole == records
    assert stale(town, records) == []
    assert bool(part.renamed) == changed
    assert (len(ran) > 20) == changed


def without(record: Record, house: str) -> Record:
    """The same of a tile where a house is no more."""
    if record.stage not in ("outline", "units"):
        return record
    entries = [e for e in record.result["units"] if e["id"] != house]
    beside = [{**e, "neighbours": [n for n in e["neighbours"] if n != house]} for e in entries]
    told = [e if e == b else {**b, "digest": f"{b['digest']} alone"} for e, b in zip(entries, beside, strict=True)]
    return replace(record, result={**record.result, "units": told})


def test_an_outline_that_is_rejected_and_comes_back_is_what_a_whole_run_makes(town: Town) -> None:
    """Its tile and those that the edit may reach are looked at; what runs beside these is what a walk over the whole city finds out of date."""
    if town.catalog.outlines is not None:
        pytest.skip("given outlines are dealt out anew")
    records, rejected = dict(town.records), Edits(rejected=(shapely.Point(HOUSES[AT_A_BORDER]["point"]),))
    near = dict.fromkeys([owner(AT_A_BORDER), *sorted(tile for stage, tile in town.records if stage == "outline")])
    nodes = [("outline", tile) for tile in near]
    asked = Chosen(frozenset(nodes), dict.fromkeys(sorted(near), ()), tuple(near))
    for edits in (rejected, NO_EDITS):
        whole = dict(records)

        def leave(task: Task, edits: Edits = edits) -> Record:
            found = record_of(task)
            return without(found, AT_A_BORDER) if edits.rejected else found

        part = CityPart(town.source(edits), asked, Memory(records))
        ran = run(part, records, is_among(nodes), leave)
        assert ran[0] == nodes[0]
        assert set(run(town.source(edits), whole, is_among(nodes), leave)) == set(ran)
        assert whole == records
        assert stale(town, records, edits) == []
        assert part.renamed == {owner(AT_A_BORDER), owner("h1_12")}
        assert not {s for s, _ in ran} & {"detect", "surface", "ingest"}
        assert {u for s, u in ran if s == "split"} <= {AT_A_BORDER, "h1_10", "h1_12"}
    assert {n: r.digest for n, r in records.items()} == {n: r.digest for n, r in town.records.items()}


@pytest.mark.parametrize("seed", range(4))
def test_an_outline_that_is_moved_is_made_anew_whichever_task_ends_first(town: Town, seed: int) -> None:
    """The building keeps its name: it is split, named and reconstructed again, and nothing that sees it begins before."""
    if town.catalog.outlines is not None:
        pytest.skip("given outlines are dealt out anew")
    drawn = Edits(outlines=(DrawnOutline(shapely.box(*HOUSES[AT_A_BORDER]["bounds"]), AT_A_BORDER, locked=True),))
    tiles = sorted(tile for stage, tile in town.records if stage == "outline")
    nodes, records, whole = [("outline", tile) for tile in tiles], dict(town.records), dict(town.records)

    def leave(task: Task) -> Record:
        found = record_of(task)
        if (task.stage, task.unit) not in (("outline", owner(AT_A_BORDER)), ("units", owner(AT_A_BORDER))):
            return found
        moved = [
            {**e, "digest": f"{e['digest']} moved"} if e["id"] == AT_A_BORDER else e for e in found.result["units"]
        ]
        return replace(found, result={**found.result, "units": moved})

    part = CityPart(town.source(drawn), Chosen(frozenset(nodes), dict.fromkeys(tiles, ())), Memory(records))
    ran = run_as_an_engine(part, records, is_among(nodes), leave, np.random.default_rng(seed))
    assert {("split", AT_A_BORDER), ("units", owner(AT_A_BORDER)), ("reconstruct", AT_A_BORDER)} <= ran
    assert set(run(town.source(drawn), whole, is_among(nodes), leave)) == ran
    assert whole == records
    assert stale(town, records, drawn) == []


def test_edits_that_change_no_outline_set_nothing_going(town: Town) -> None:
    if town.catalog.outlines is not None:
        pytest.skip("given outlines are dealt out anew")
    records, beside = dict(town.records), shapely.Point(EXTENT[0] + 12.0, EXTENT[1] + 45.0)
    edits, tiles = Edits(rejected=(beside,)), sorted(t for s, t in town.records if s == "outline")
    nodes = [("outline", tile) for tile in tiles]
    part = CityPart(town.source(edits), Chosen(frozenset(nodes), dict.fromkeys(tiles, ())), Memory(records))
    assert set(run(part, records, is_among(nodes))) == {*nodes, ("export", "city")}
    assert stale(town, records, edits) == []


def test_what_is_unfinished_elsewhere_is_left_and_named(town: Town) -> None:
    """A model and the exports that wait for it were not there before: they are for the next run, and the building that was asked for is done."""
    missing: set[Node] = {
        ("reconstruct", "h3_0"),
        ("export", owner("h3_0")),
        ("reconstruct", "h1_9"),
        ("export", "city"),
    }
    records = {n: r for n, r in town.records.items() if n not in missing}
    nodes = [("reconstruct", AT_A_BORDER)]
    part = CityPart(town.source(), chosen(*nodes), Memory(records))
    ran = run(part, records, is_among(nodes), lambda task: record_of(task, edition="b"))
    assert ("reconstruct", AT_A_BORDER) in ran
    assert not missing & set(ran)
    assert ("export", owner("h1_12")) in ran
    assert ("export", "city") in part.walk.left
    assert ("export", owner(AT_A_BORDER)) in part.walk.waiting()
    after = set(stale(town, records))
    assert missing <= after
    assert ("reconstruct", AT_A_BORDER) not in after


def test_what_is_unfinished_beside_it_is_not_gone_into(town: Town) -> None:
    """Of a tile without outlines nobody asks what these would be made of, and all that waits for them is left."""
    here, beside = owner("h1_0"), owner("h1_7")
    assert here != beside
    of_tile = ("surface", "fuse", "walls", "ortho", "outline", "units", "export")
    missing = {n for n in town.records if n[0] in of_tile and n[1] == beside} | {("export", "city")}
    records = {n: r for n, r in town.records.items() if n not in missing}
    part = CityPart(town.source(), chosen(("reconstruct", "h1_0")), Memory(records))
    leave = lambda task: record_of(task, edition="b" if task.unit == "h1_0" else "")  # noqa: E731
    ran = run(part, records, is_among([("reconstruct", "h1_0")]), leave)
    assert ("reconstruct", "h1_0") in ran
    assert not missing & set(ran)
    assert ("outline", beside) in part.walk.left
    assert {s for s, u in part.walk._wanted if u == beside} & {"fuse", "walls"} == set()
    assert missing <= set(stale(town, records))


def test_a_texture_of_a_building_that_failed_since_is_not_taken_from_before(town: Town) -> None:
    """Its record is still there; whoever makes the pages of its atlas cell anew must not see it."""
    if not town.catalog.images:
        pytest.skip("no textures")
    fails = [("reconstruct", "h1_10")]
    records = dict(town.records)
    run(town.source(), records, is_among(fails), lambda task: record_of(task, failed=(task.stage, task.unit) in fails))
    assert ("texture", "h1_10") in records
    assert stale(town, records) == []
    nodes = [("reconstruct", AT_A_BORDER)]
    part = CityPart(town.source(), chosen(*nodes), Memory(records))
    run(
        part, records, is_among(nodes), lambda task: record_of(task, edition="b" if task.stage == "reconstruct" else "")
    )
    assert stale(town, records) == []


def test_any_few_buildings_in_any_order(town: Town) -> None:
    order = np.random.default_rng(7)
    records = dict(town.records)
    for edition in "bc":
        nodes = [("reconstruct", str(u)) for u in order.choice(sorted(HOUSES), 3, replace=False)]

        def leave(task: Task, edition: str = edition, nodes: Iterable[Node] = tuple(nodes)) -> Record:
            return record_of(task, edition=edition if (task.stage, task.unit) in nodes else "")

        part = CityPart(town.source(), chosen(*nodes), Memory(records))
        run(part, records, is_among(nodes), leave)
        assert stale(town, records) == []


@pytest.mark.parametrize("seed", range(4))
def test_any_few_outlines_as_an_engine_goes_through_them(town: Town, seed: int) -> None:
    """Several tasks are under way, and any of them ends first: exports wait until it is known which units there are."""
    if ("split", AT_A_BORDER) not in town.records:
        pytest.skip("given outlines are not split")
    random = np.random.default_rng(seed)
    few = [str(u) for u in random.choice(sorted(HOUSES), 3, replace=False)]
    nodes = [(stage, u) for u in few for stage in ("split", "reconstruct")]
    changed = {("split", few[0]), ("units", owner(few[0])), ("reconstruct", few[1])}

    def leave(task: Task) -> Record:
        return record_of(task, edition="b" if (task.stage, task.unit) in changed else "")

    records, whole = dict(town.records), dict(town.records)
    part = CityPart(town.source(), chosen(*nodes), Memory(records))
    ran = run_as_an_engine(part, records, is_among(nodes), leave, random)
    assert set(run(town.source(), whole, is_among(nodes), leave)) == ran
    assert whole == records
    assert stale(town, records) == []


def test_buildings_run_in_the_order_in_which_they_were_named(town: Town) -> None:
    houses = [h for h in HOUSES if owner(h) == owner(AT_A_BORDER)][:3]
    for named in (houses, houses[::-1]):
        asked = replace(chosen(*(("reconstruct", h) for h in houses)), first=tuple(named))
        part = CityPart(town.source(), asked, Memory(dict(town.records)))
        tasks = [t.unit for t in part.initial() if t.stage == "reconstruct"]
        assert [u for u in tasks if u in houses] == named


def test_an_atlas_cell_alone(town: Town) -> None:
    cells = [n for n in town.records if n[0] == "atlas"]
    if not cells:
        pytest.skip("no textures")
    records, node = dict(town.records), cells[3]
    part = CityPart(town.source(), Chosen(frozenset([node]), {node[1].rpartition(".")[0]: ()}), Memory(records))

    def leave(task: Task) -> Record:
        return replace(record_of(task), outputs={"products/x": "x"}) if task.stage == "atlas" else record_of(task)

    ran = run(part, records, lambda task: (task.stage, task.unit) == node, leave)
    assert ran[0] == node
    assert {s for s, _ in ran} == {"atlas", "export"}
    assert stale(town, records) == []


@pytest.mark.parametrize("reach_m", [80.0, -30.0], ids=["in time", "too early"])
def test_what_a_driver_has_left_behind_is_forgotten_and_its_tasks_are_the_same(town: Town, reach_m: float) -> None:
    source, usual, memory = town.source(), town.source(), Memory({})
    source.city.forget_by(memory.latest, reach_m)
    run(source, memory.records)
    run(usual, dict(town.records))
    assert {n: r.digest for n, r in memory.records.items()} == {n: r.digest for n, r in town.records.items()}
    assert not source.city.units
    assert len(usual.city.units) == len(HOUSES)
    assert ("reconstruct", AT_A_BORDER) not in source.survey.results
    assert source.expected_units() == usual.expected_units()
    assert bool(memory.read) == (reach_m < 0), "what is asked for once more is read from the records"
