"""Stage ``match``: a reference image, matched with its partners, becomes a depth map for each ground tile."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

from cityflow.core.building import Status
from cityflow.core.depth_map import DepthMap
from cityflow.core.grid import Bounds
from cityflow.core.ground_cells import GroundCells
from cityflow.core.json_values import rounded
from cityflow.core.pixels import ReducedPixels
from cityflow.errors import CityflowError
from cityflow.flow.stage import Cost, Node, Place, Stage
from cityflow.flow.task import Limits, Outcome, Record, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.cached_reads import open_pixels
from cityflow.handover.depth_map_files import depth_map_name, encode_depth_map
from cityflow.handover.field_types import OrientedField
from cityflow.matching.match import Matched, MatchParameters, match
from cityflow.orientation.flight_plan import FlightTile
from cityflow.survey.city import City
from cityflow.survey.recipe import Recipe, draft_by, task_by
from cityflow.survey.results import Results
from cityflow.survey.surface_source import IMAGES
from cityflow.survey.survey import Survey

NAME = "match"
VERSION = 5
GROUND = "ground "
"""Begins the names of the inputs that tell over which ground tiles an image is matched."""
NO_PARTNER = "no partner of the reference image could be read"


class Memory(Protocol):
    """The records of a RUN, as `flow.ledger.Ledger` has them."""

    def latest(self, stage: str, unit: str) -> Record | None: ...


@dataclass(frozen=True, slots=True)
class GroundTile(TaskInputs):
    """A ground tile: its name, its bounds in metres, and column and row of the cells in it that are the reference image's."""

    name: str
    bounds: Bounds
    chosen: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class MatchPlace(TaskInputs):
    """What is matched, and over which ground.

    Attributes
    ----------
    tiles : a depth map is made of each;  cell_m : edge of their cells
    heights : lowest ground and highest object, world metres
    images : the reference image, then its partners, as they were taken
    """

    tiles: tuple[GroundTile, ...]
    cell_m: float
    heights: tuple[float, float]
    images: tuple[OrientedField, ...]


@dataclass(frozen=True, slots=True)
class MatchInputs(TaskInputs):
    """A reference image and its partners.

    Attributes
    ----------
    reference : name of the reference image
    pixels : name → RUN-relative path of each image that could be read;  unread : the others
    level : of the pyramid that is matched, and that `place` speaks of
    """

    place: MatchPlace
    reference: str
    pixels: Mapping[str, str]
    unread: tuple[str, ...]
    level: int


@dataclass(frozen=True, slots=True)
class MatchRecipe(Recipe):
    """The match of one reference image; `images` are its name and those of its partners, `level` as in `MatchInputs`."""

    place: MatchPlace
    images: tuple[str, ...]
    level: int

    @property
    def reads(self) -> list[Node]:
        return [("ingest", n) for n in self.images]

    def task(self, results: Results) -> Task:
        read = {n: results.tiled_image(n) for n in self.images}
        pixels = {n: path for n, path in read.items() if path is not None}
        unread = tuple(n for n in self.images if n not in pixels)
        given = as_json(MatchInputs(self.place, self.images[0], pixels, unread, self.level))
        digests = {f"image {n}": results.digest_of("ingest", n) for n in self.images}
        grounds = {f"{GROUND}{tree['name']}": digest_of(tree) for tree in given["place"]["tiles"]}
        place = {k: v for k, v in given["place"].items() if k != "tiles"}
        return replace(self.base, inputs={**digests, **grounds, "place": digest_of(place)}, arguments=given)


def recipe(survey: Survey, unit: str) -> MatchRecipe:
    """The depth maps of one reference image."""
    return recipe_over(survey, unit, survey.matches.flight_tiles(unit))


def recipe_over(survey: Survey, unit: str, over: Sequence[FlightTile]) -> MatchRecipe:
    """The same, over some ground tiles of the same reference image."""
    names, view = (over[0].reference, *over[0].partners), survey.images.flown[over[0].reference]
    tiles = tuple(GroundTile(f.tile, f.cells.tile, f.cells.chosen) for f in over)
    images = tuple(survey.images.flown[n].image for n in names)
    place = MatchPlace(tiles, over[0].cells.cell_m, view.heights, images)
    base = KIND.task(
        unit, parameters=as_json(survey.parameters_of(NAME, unit, survey.parameters.match)), limits=survey.limits(NAME),
    )  # fmt: skip
    return MatchRecipe(base, place, names, survey.parameters.images.level)


def ground_of(record: Record) -> list[str]:
    """The ground tiles that were asked for."""
    return [name.removeprefix(GROUND) for name in record.inputs if name.startswith(GROUND)]


def ground_before(survey: Survey, memory: Memory, reference: str) -> list[str]:
    """The ground tiles that a reference image was matched over, where its record is of the images, poses and parameters of now; else none."""
    record = memory.latest(NAME, reference)
    over = [] if record is None else survey.matches.over(reference, ground_of(record))
    if record is None or not over:
        return []
    made, known = recipe_over(survey, reference, over), Results()
    for node in made.reads:
        if (read := memory.latest(*node)) is not None:
            known.learn(read)
    return [f.tile for f in over] if made.task(known).digest == record.digest else []


def run(workspace: Workspace, task: Task) -> Outcome:
    """Match, and write a depth map for each ground tile that points stand in."""
    given, parameters = task.arguments_as(MatchInputs), task.parameters_as(MatchParameters)
    reference, place = given.reference, given.place
    images = {image.name: image for image in place.images}
    pixels = {n: ReducedPixels(open_pixels(workspace.store, path), given.level) for n, path in given.pixels.items()}
    _refuse_unmatchable(reference, pixels.keys())
    grounds = {t.name: GroundCells(t.bounds, place.cell_m, t.chosen) for t in place.tiles}
    partners = [(images[n], pixels[n]) for n in images if n in pixels and n != reference]

    def leave(tile: str, depth_map: DepthMap) -> None:
        workspace.write(depth_map_name(tile), encode_depth_map(depth_map))

    found = match(images[reference], pixels[reference], partners, grounds, place.heights, parameters, leave)
    status, reason = _verdict(found, given.unread)
    return workspace.outcome(status, reason, _figures(found))


def _refuse_unmatchable(reference: str, read: Iterable[str]) -> None:
    names = set(read)
    if reference not in names:
        raise CityflowError(
            "the reference image could not be read", where=reference, remedy="see the ingest of this image"
        )
    if len(names) < 2:
        raise CityflowError(NO_PARTNER, where=reference, remedy="see the ingest of its neighbours")


def _verdict(found: Matched, unread: Sequence[str]) -> tuple[Status, str]:
    """A pair that could not be used leaves its reason in the record; only where none could be used the reference image has failed."""
    missing = [f"{n} could not be read" for n in unread]
    if found.pairs and not any(p.used for p in found.pairs):
        return Status.FAILED, "; ".join([*(f"{p.partner}: {p.reason}" for p in found.pairs), *missing])
    return (Status.DEGRADED, "; ".join(missing)) if missing else (Status.DONE, "")


def _figures(found: Matched) -> dict[str, Any]:
    """`blocks`: level → blocks of all pairs that were matched, and how many different ones these are."""
    return {
        "points": sum(found.points.values()),
        "blocks": {str(level): [n.matched, n.different] for level, n in found.blocks.items()},
        "pairs": {
            p.partner: {"used": p.used, "reason": p.reason, "matched": round(p.matched, 4),
                         "parallax_px": rounded(p.parallax_px, 4), "parallax_90_px": rounded(p.parallax_90_px, 4),
                         "parallax_rest_px": rounded(p.parallax_rest_px, 4)}
            for p in found.pairs
        },
        "sgm_seconds": round(found.sgm_seconds, 3),
    }  # fmt: skip


def _images(city: City, unit: str) -> Iterable[Node]:
    """The reference image and its partners."""
    first = city.survey.matches.flight_tiles(unit)[0]
    return [("ingest", n) for n in (first.reference, *first.partners)]


KIND = TaskKind(NAME, VERSION, run, MatchInputs)

STAGE = Stage(
    name=NAME,
    unit="reference image",
    place=Place.IMAGE,
    text="the reference image and its partners → depth map with precision, agreeing partners and colour, in a part for each ground tile",
    kinds=(KIND,),
    needs=(_images,),
    task=task_by(recipe),
    draft=draft_by(recipe),
    asked=lambda city, _: city.survey.source.kind == IMAGES,
    parameters=(MatchParameters,),
    cost=Cost(60.0, 1500.0, 40.0),
    limits=Limits(10800, 6000),
)
