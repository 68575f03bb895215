"""Textures from whatever a catalog has: a LiDAR city with photographs from the air and from the street, with an ortho, with pictures that are odd, missing
or lost; and the same bytes whatever the area, the tiles and the store."""

from __future__ import annotations

import json
import shutil
import uuid
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from cityflow.core.building import Status
from cityflow.core.camera import Camera
from cityflow.core.parameters import merged
from cityflow.core.texture import FIRST_IMAGE, Patch, UnitTexture
from cityflow.errors import CityflowError
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Record, Task, digest_of
from cityflow.handover.texture_files import Rings, decode_unit
from cityflow.io.catalog.stac import read_catalog
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.stages.export.textured_faces import CUT_OTHERWISE
from cityflow.survey.area import Area
from cityflow.survey.given_outlines import noded_tile
from cityflow.survey.results import HULL
from in_process import Records, make_surfaces, outcome_of, record_of
from remembered_plans import remembered_plans  # noqa: F401  # for every test here
from stages.painted_houses import (
    FLOWN,
    LAWN,
    MIDDLE,
    PLANS,
    SIDES,
    WORKFLOW,
    Painted,
    Pictures,
    colour,
    eight_bits,
    looking,
    pictures,
    survey_in,
    taken,
)

Overrides = Mapping[tuple[str, str], Mapping[str, Any]]


def source_of(
    painted: Painted, area: Area | None = None, overrides: Overrides | None = None, **stages: Any
) -> CitySource:
    tree = {k: v for k, v in merged(WORKFLOW, stages).items() if k != "name"}
    options: dict[str, Any] = {} if area is None else {"area": area}
    return CitySource(
        read_catalog(painted.catalog), CityParameters.model_validate(tree), overrides=overrides, **options
    )


@dataclass
class Run:
    """Records of a run, its store, and what ran (the rest was there already)."""

    store: Store
    records: Records
    ran: set[tuple[str, str]]

    def texture(self, unit: str) -> tuple[UnitTexture, dict[Any, Rings]]:
        return decode_unit(self.store.read_bytes(next(iter(self.records["texture", unit].outputs))))

    def mean_colours(self, unit: str) -> dict[str, NDArray[np.float64]]:
        """Side of a house → what its texture shows of it, in the mean."""
        texture, rings = self.texture(unit)
        return {
            side_of(unit, rings[p.key]): p.pixels[p.mask].mean(axis=0) for p in texture.rectified if p.mask.sum() > 9
        }

    def sources(self, unit: str, side: str) -> dict[str, int]:
        """Image → pixels of the patch of a face."""
        texture, rings = self.texture(unit)
        (patch,) = [p for p in texture.raw if side_of(unit, rings[p.key]) == side and p.mask.sum() > 9]
        return counted(patch, texture)


def counted(patch: Patch, texture: UnitTexture) -> dict[str, int]:
    number, count = np.unique(patch.index[patch.mask], return_counts=True)
    return {
        texture.images[n - FIRST_IMAGE]: k
        for n, k in zip(number.tolist(), count.tolist(), strict=True)
        if n >= FIRST_IMAGE
    }


def side_of(unit: str, rings: Rings) -> str:
    """By the direction in which a face looks."""
    ring = np.array(rings[0])
    normal = np.cross(ring - ring[0], np.roll(ring - ring[0], -1, axis=0)).sum(axis=0)
    return max(SIDES, key=lambda side: float(normal @ np.array(SIDES[side])))


def run(
    source: CitySource,
    folder: Path | str,
    known: Run | None = None,
    before: Callable[[Task], None] | None = None,
    place: int = -1,
) -> Run:
    """Run what is not in `known`, whose files are copied; a task that raises has failed. `place` says which of the tasks that are ready is next."""
    if known is not None and not Path(folder).exists():
        shutil.copytree(known.store.root, folder)
    store = Store.open(folder)
    if known is None:
        make_surfaces(source, store)
    ready, records, ran = list(source.initial()), Records(), set()
    while ready:
        task = ready.pop(place)
        old: Record | None = known.records.get((task.stage, task.unit)) if known else None
        if old is not None and old.digest == task.digest:
            record = old
        else:
            ran.add((task.stage, task.unit))
            record = record_of(task, _outcome(store, task, before))
        records[task.stage, task.unit] = record
        ready.extend(source.after(task, record))
    return Run(store, records, ran)


def _outcome(store: Store, task: Task, before: Callable[[Task], None] | None) -> Outcome:
    try:
        if before is not None:
            before(task)
        return outcome_of(store, task)
    except CityflowError as error:
        return Outcome(Status.FAILED, str(error))


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Painted:
    """LiDAR with photographs from the air."""
    painted = survey_in(tmp_path_factory.mktemp("flown"))
    painted.write_images(pictures())
    painted.describe()
    return painted


@pytest.fixture(scope="module")
def flown_run(flown: Painted, tmp_path_factory: pytest.TempPathFactory) -> Run:
    return run(source_of(flown), tmp_path_factory.mktemp("run") / "run")


def with_images(flown: Painted, folder: Path, images: Pictures, **options: Any) -> Painted:
    """The same survey with other pictures."""
    painted = Painted(folder)
    for name in ("town.laz", "outlines.gpkg"):
        folder.mkdir(exist_ok=True)
        shutil.copy(flown.folder / name, folder / name)
    painted.write_images(images)
    painted.describe(images=bool(images), **options)
    return painted


def free_sides(unit: str, sides: Iterable[str] = SIDES) -> list[str]:
    """Without the wall that two houses share."""
    return [side for side in sides if (unit, side) not in (("a", "east"), ("b", "west"))]


def assert_true_colours(made: Run, most: float = 14.0, sides: Iterable[str] = SIDES) -> None:
    for unit in PLANS:
        shown = made.mean_colours(unit)
        for side in free_sides(unit, sides):
            off = np.abs(shown[side] - colour(unit, side)).max()
            assert off < most, (unit, side, shown[side], colour(unit, side))


def test_a_lidar_city_wears_its_photographs(flown_run: Run) -> None:
    ingested = {u for s, u in flown_run.records if s == "ingest"}
    noded = {u for u in ingested if noded_tile(u) is not None}
    assert noded
    assert ingested == {"town", "outlines", "outline_accuracy", *(i.name for i in FLOWN), *noded}
    assert not {s for s, _ in flown_run.records} & {"match", "fuse", "ortho", "frame", "walls"}
    assert_true_colours(flown_run)


def test_photographs_from_the_street(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    before = looking("street_before", (31, 21, 1.7), (31, 30, 3.0))
    up = looking("street_up", (43, 19, 1.7), (43, 30, 5.0))
    along = looking("street_along", (24, 27.5, 1.7), (40, 29.5, 2.5))
    away = looking("street_away", (31, 21, 1.7), (31, 0, 1.7))
    painted = with_images(flown, tmp_path / "street", [*pictures(), *pictures([before, up, along, away])])
    assert len(read_catalog(painted.catalog).images) == len(FLOWN) + 4
    made = run(source_of(painted), tmp_path / "run", flown_run)
    assert_true_colours(made)
    assert made.sources("a", "south").get("street_before", 0) > 1000
    street = {name: n for name, n in made.sources("b", "south").items() if name.startswith("street")}
    assert sum(street.values()) > 1000
    assert "street_up" in made.texture("b")[0].images, "an image without any ground is a candidate"
    assert made.sources("c", "north") == flown_run.sources("c", "north")


def test_surfaces_know_nothing_of_the_street(flown: Painted, tmp_path: Path) -> None:
    street = [looking(f"street_{k}", (28 + k, 12, 1.7), (28 + k, 30, 2.0)) for k in range(8)]
    painted = with_images(flown, tmp_path / "street", [*pictures(), *pictures(street)])
    images, alone = (source_of(p, points={"source": "images"}).survey.images for p in (painted, flown))
    assert set(images.views) - set(images.flown) == {i.name for i in street}
    assert list(images.tiles) == list(alone.tiles)
    assert images.gsd == alone.gsd
    assert [f.name for f in images.frames] == [f.name for f in alone.frames]
    assert [f for t in images.tiles.values() for f in images.flight_tiles(t)] == [
        f for t in alone.tiles.values() for f in alone.flight_tiles(t)
    ]


def test_an_ortho_alone_colours_the_roofs_and_the_lawn(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    painted = with_images(flown, tmp_path / "survey", [])
    painted.write_ortho()
    painted.describe(images=False, ortho=True)
    made = run(source_of(painted), tmp_path / "run", flown_run)
    assert_true_colours(made, most=6.0, sides=("roof",))
    assert np.abs(lawn(made) - np.array(LAWN)).max() < 6
    assert set(made.texture("c")[0].images) == {"ortho"}
    assert not [u for s, u in made.records if s == "windows"], "no wall can be seen"


def test_photographs_and_an_ortho_of_twelve_bits(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    deep = [(i, np.rint(taken(i) * 4095 / 255).astype(np.uint16)) for i in FLOWN]
    painted = with_images(flown, tmp_path / "survey", deep)
    painted.write_ortho(4095 / 255, "uint16")
    painted.describe(ortho=True)
    assert {a.white for a in read_catalog(painted.catalog).images} == {4095.0}
    made = run(source_of(painted), tmp_path / "run", flown_run)
    assert_true_colours(made)
    assert np.abs(lawn(made) - np.array(LAWN)).max() < 6


def lawn(made: Run) -> NDArray[np.float64]:
    """Mean colour of the picture that lies on the terrain."""
    (first, *_) = [p for p in made.store.find("products/textures") if p.endswith(".terrain.jpg")]
    picture = cv2.imdecode(np.frombuffer(made.store.read_bytes(first), np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return np.asarray(np.median(picture.reshape(-1, 3)[:, ::-1], axis=0))


def grey(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    return np.asarray(np.rint(pixels.mean(axis=2, keepdims=True)), np.uint8)


def test_four_bands_and_grey(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    wide = [(i, np.concatenate([p, 255 - p[..., :1]], axis=2)) for i, p in pictures()]
    painted = with_images(flown, tmp_path / "wide", wide)
    assert_true_colours(run(source_of(painted), tmp_path / "wide_run", flown_run))
    painted = with_images(flown, tmp_path / "grey", [(i, grey(p)) for i, p in pictures()])
    made = run(source_of(painted), tmp_path / "grey_run", flown_run)
    shown = made.mean_colours("c")["roof"]
    assert np.ptp(shown) < 1
    assert abs(shown[0] - colour("c", "roof").mean()) < 8


def test_a_grey_picture_beside_coloured_ones_is_left_out_by_name(
    flown: Painted, flown_run: Run, tmp_path: Path
) -> None:
    mixed = [(i, grey(p) if i.name == "west" else p) for i, p in pictures()]
    painted = with_images(flown, tmp_path / "survey", mixed)
    assert {a.name for a in read_catalog(painted.catalog).images} == {i.name for i in FLOWN} - {"west"}
    made = run(source_of(painted), tmp_path / "run", flown_run)
    assert_true_colours(made, sides=("south", "north", "east", "roof"))
    texture, rings = made.texture("c")
    plain = {side_of("c", rings[k]): f for k, f in texture.plain.items()}
    assert plain["west"].reason
    assert min(plain["west"].colour) > 40


def test_a_picture_exposed_by_a_quarter(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    odd = [(i, eight_bits(taken(i) * (0.25 if i.name == "south" else 1.0))) for i in FLOWN]
    made = run(source_of(with_images(flown, tmp_path / "survey", odd)), tmp_path / "run", flown_run)
    ratios = [(made.mean_colours(u)[side] / colour(u, side)).mean() for u in PLANS for side in free_sides(u)]
    assert min(ratios) > 0.7
    assert max(ratios) < 1.15 * min(ratios), "all are as bright as the mean of the survey, none is a patch"


def test_a_picture_that_is_gone_before_it_is_read(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    more = looking("more", (60, -8, 50), MIDDLE)
    changed = [(i, p[::-1] if i.name == "west" else p) for i, p in pictures([*FLOWN, more])]
    painted = with_images(flown, tmp_path / "survey", changed)
    painted.picture("west").unlink()
    made = run(source_of(painted), tmp_path / "run", flown_run)
    assert made.records["ingest", "west"].status is Status.FAILED
    for unit in PLANS:
        record = made.records["texture", unit]
        assert record.status is Status.DEGRADED
        assert "west" in record.reason
    assert_true_colours(made, sides=("south", "north", "east", "roof"))
    assert_plain_is_not_black(made)
    assert {u for s, u in made.ran if s == "ingest"} == {"west", "more"}


def test_a_picture_that_is_lost_after_it_was_read(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    def lose(task: Task) -> None:
        for file in (tmp_path / "run/work/ingest/west").rglob("*.tif"):
            file.unlink()

    overrides = {("texture", u): {"halo_m": 50.0} for u in PLANS}
    made = run(source_of(flown, overrides=overrides), tmp_path / "run", flown_run, lose)
    for unit in PLANS:
        assert made.records["texture", unit].status is Status.DEGRADED
        assert "west" in made.records["texture", unit].reason
        assert set(made.records["texture", unit].result["lost"]) == {"west"}
    assert_true_colours(made, sides=("south", "north", "east", "roof"))


def test_no_picture_can_be_read(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    painted = with_images(flown, tmp_path / "survey", [(i, p[::-1]) for i, p in pictures()])
    for image in FLOWN:
        painted.picture(image.name).unlink()
    made = run(source_of(painted), tmp_path / "run", flown_run)
    for unit in PLANS:
        record = made.records["texture", unit]
        assert (record.status, record.result["textured"]) == (Status.DEGRADED, 0)
    assert_plain_is_not_black(made)
    assert made.records["export", "city"].status is Status.DONE


def assert_plain_is_not_black(made: Run) -> None:
    for unit in PLANS:
        for face in made.texture(unit)[0].plain.values():
            assert face.reason
            assert min(face.colour) > 40


def textures(made: Run) -> dict[str, bytes]:
    return {
        u: made.store.read_bytes(next(iter(made.records["texture", u].outputs)))
        for u in PLANS
        if ("texture", u) in made.records
    }


def test_an_area_gives_the_same_bytes(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    x_0, y_0, x_1, y_1 = PLANS["b"]
    made = run(source_of(flown, Area(shapely.box(x_0 + 1, y_0, x_1, y_1))), tmp_path / "run")
    assert {u for s, u in made.records if s == "texture"} == {"b"}
    assert {u for s, u in made.records if s == "reconstruct"} == set(PLANS)
    assert textures(made)["b"] == textures(flown_run)["b"]


def test_tiles_change_no_texture(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    made = run(source_of(flown, tiles={"tile_m": 50, "index_cell_m": 50}), tmp_path / "run")
    for unit in PLANS:
        assert made.records["texture", unit].result == flown_run.records["texture", unit].result
        hulls = [made.records["reconstruct", u].outputs for u in sorted(PLANS)]
        sums = [next(d for p, d in left.items() if p.endswith(HULL)) for left in hulls]
        assert made.records["texture", unit].inputs["models"] == digest_of([sorted(PLANS), sums]), "of all three"
    assert textures(made) == textures(flown_run)


def test_a_unit_has_its_own_wishes(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    made = run(source_of(flown, overrides={("texture", "c"): {"most_images": 1}}), tmp_path / "run", flown_run)
    assert len(made.texture("c")[0].images) == 1
    assert {u for s, u in made.ran if s == "texture"} == {"c"}
    assert len([u for s, u in made.ran if s == "atlas"]) == 1


def test_pages_smaller_than_faces(flown: Painted, tmp_path: Path, flown_run: Run) -> None:
    small = {"page_px": 256, "first_px": 256}
    made = run(source_of(flown, atlas={"placement": small}), tmp_path / "run", flown_run)
    assert {r.status for (s, _), r in made.records.items() if s == "atlas"} == {Status.DONE}
    near = {"finest_m": 0.01, "largest_px": 8192}
    fine = looking("close", (37, 26, 4), (37, 30, 4), Camera(1200, 900, 900.0, 900.0, 600.0, 450.0))
    painted = with_images(flown, tmp_path / "close", [*pictures(), *pictures([fine])])
    made = run(source_of(painted, texture={"patches": near}, atlas={"placement": small}), tmp_path / "run2", flown_run)
    assert {r.status for (s, _), r in made.records.items() if s == "atlas"} == {Status.DONE}
    assert_true_colours(made)


def test_a_texture_that_fails_leaves_a_building_that_says_so(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    def fail(task: Task) -> None:
        if task.stage == "texture":
            raise CityflowError("the worker was out of memory")

    made = run(source_of(flown, overrides={("texture", "c"): {"halo_m": 50.0}}), tmp_path / "run", flown_run, fail)
    (feature,) = [f for f in features(made) if f["id"] == "c"]
    assert feature["CityObjects"]["c"]["attributes"]["texture_missing"] == "the worker was out of memory"
    assert feature["CityObjects"]["c"]["attributes"]["textured_share"] == 0
    healed = run(source_of(flown), tmp_path / "healed", Run(made.store, made.records, set()))
    assert {s for s, _ in healed.ran} == {"texture", "windows", "atlas", "export"}
    assert textures(healed) == textures(flown_run)
    assert features(healed) == features(flown_run)


def features(made: Run) -> list[dict[str, Any]]:
    lines = made.store.read_bytes("products/city.city.jsonl").splitlines()[1:]
    return [json.loads(line) for line in lines]


def test_a_picture_made_anew_concerns_those_whom_it_shows(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    narrow = Camera(60, 60, 330.0, 330.0, 30.0, 30.0)
    one = looking("one", (37, 60, 60), (37, 60.5, 0), narrow)
    survey = with_images(flown, tmp_path / "survey", [*pictures(), *pictures([one])], gains=False)
    first = run(source_of(survey), tmp_path / "run", flown_run)
    changed = with_images(
        flown, tmp_path / "survey", [*pictures(), (one, pictures([one])[0][1] // 2 + 20)], gains=False
    )
    second = run(source_of(changed), tmp_path / "second", first)
    assert {u for s, u in second.ran if s in ("texture", "ingest")} == {"one", "c"}


def test_neither_the_store_nor_the_order_of_tasks_changes_a_byte(flown: Painted, flown_run: Run) -> None:
    far = run(source_of(flown), f"memory://{uuid.uuid4().hex}", place=0)
    assert textures(far) == textures(flown_run)
    products = flown_run.store.find("products")
    assert products == far.store.find("products")
    assert [p for p in products if far.store.read_bytes(p) != flown_run.store.read_bytes(p)] == []


def test_names_as_people_write_them(flown: Painted, tmp_path: Path) -> None:
    ids = {"a": "NL/0345 (ä)", "b": 'b%2F"<&>', "c": "c.0_0"}
    renamed = [(replace(i, name=f"flug 3, {i.name} (süd)#1"), p) for i, p in pictures()]
    painted = with_images(flown, tmp_path / "survey", [])
    painted.write_outlines(ids)
    painted.write_images(renamed)
    painted.describe()
    formats = ["cityjson", "citygml", "obj", "tiles3d"]
    made = run(source_of(painted, export={"formats": formats}), tmp_path / "run")
    assert {u for s, u in made.records if s == "texture"} == set(ids.values())
    assert {r.status for (s, _), r in made.records.items() if s in ("texture", "atlas", "export")} == {Status.DONE}
    shares = {
        f["id"]: f["CityObjects"][f["id"]]["attributes"]["textured_share"]
        for f in features(made)
        if "textured_share" in str(f)
    }
    assert shares.keys() == set(ids.values())
    assert min(shares.values()) > 0.99
    named = {n for u in ids.values() for n in made.texture(u)[0].images}
    assert named <= {i.name for i in read_catalog(painted.catalog).images}


def test_a_neighbour_that_failed_costs_nobody_a_texture(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    def fail(task: Task) -> None:
        if task.name == "reconstruct-b":
            raise CityflowError("no model")

    overrides = {("reconstruct", "b"): {"methods": ["extruded", "monolithic"]}}
    made = run(source_of(flown, overrides=overrides), tmp_path / "run", flown_run, fail)
    assert ("texture", "b") not in made.records
    (feature,) = [f for f in features(made) if f["id"] == "a"]
    assert feature["CityObjects"]["a"]["attributes"]["textured_share"] > 0.99
    assert CUT_OTHERWISE not in json.dumps(feature)
    shown = made.mean_colours("a")
    assert shown.keys() == set(SIDES)
    assert np.abs(shown["east"] - colour("a", "east")).max() < 14, "what of the wall rises above the block"


def test_an_ortho_that_is_lost_on_the_way(flown: Painted, flown_run: Run, tmp_path: Path) -> None:
    painted = with_images(flown, tmp_path / "survey", pictures())
    ortho = painted.write_ortho()
    painted.describe(ortho=True)

    def lose(task: Task) -> None:
        if task.stage == "texture":
            ortho.unlink(missing_ok=True)

    made = run(source_of(painted), tmp_path / "run", flown_run, lose)
    assert all(made.records["texture", u].status is Status.DEGRADED for u in PLANS)
    assert all("ortho" in made.records["texture", u].reason for u in PLANS)
    exports = [r.status for (s, _), r in made.records.items() if s == "export"]
    assert set(exports) <= {Status.DONE, Status.DEGRADED}
    assert_true_colours(made)
