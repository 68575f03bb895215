"""Stage ``match``: one reference image over one ground tile, matched with its partners, becomes a depth map."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cityflow.core.building import Status
from cityflow.core.grid import Bounds
from cityflow.core.ground_cells import GroundCells
from cityflow.core.json_values import rounded
from cityflow.core.pixels import ReducedPixels
from cityflow.errors import CityflowError
from cityflow.flow.stage import Cost, Node, Stage
from cityflow.flow.task import Limits, Outcome, Task, digest_of
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.cached_reads import open_pixels
from cityflow.handover.depth_map_files import encode_depth_map
from cityflow.handover.field_types import OrientedField
from cityflow.matching.match import Matched, MatchParameters, match
from cityflow.survey.city import City
from cityflow.survey.recipe import Recipe, draft_by, task_by
from cityflow.survey.results import Results
from cityflow.survey.survey import Survey

NAME = "match"
VERSION = 1
DEPTHS = "depth.cfd"
NO_PARTNER = "no partner of the reference image could be read"


@dataclass(frozen=True, slots=True)
class MatchPlace(TaskInputs):
    """What is matched, and over which ground.

    Attributes
    ----------
    tile : bounds of the ground tile;  cell_m : edge of its cells;  chosen : column and row of those that are the reference image's
    heights : lowest ground and highest object, world metres
    images : the reference image, then its partners, as they were taken
    """

    tile: Bounds
    cell_m: float
    chosen: tuple[tuple[int, int], ...]
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
        return replace(self.base, inputs={**digests, "place": digest_of(given["place"])}, arguments=given)


def recipe(survey: Survey, unit: str) -> MatchRecipe:
    """The depth map of one reference image over one ground tile."""
    flight_tile = survey.images.flight_tile(unit)
    names = (flight_tile.reference, *flight_tile.partners)
    cells, view = flight_tile.cells, survey.images.flown[flight_tile.reference]
    images = tuple(survey.images.flown[n].image for n in names)
    place = MatchPlace(cells.tile, cells.cell_m, cells.chosen, view.heights, images)
    base = Task(
        NAME, unit, "cityflow.stages.match:run", VERSION,
        parameters=as_json(survey.parameters_of(NAME, unit, survey.parameters.match)), limits=survey.limits(NAME),
    )  # fmt: skip
    return MatchRecipe(base, place, names, survey.parameters.images.level)


def run(workspace: Workspace, task: Task) -> Outcome:
    """Match, and write the depths of the pixels whose points stand in the tile."""
    given, parameters = task.arguments_as(MatchInputs), task.parameters_as(MatchParameters)
    reference, place = given.reference, given.place
    images = {image.name: image for image in place.images}
    pixels = {n: ReducedPixels(open_pixels(workspace.store, path), given.level) for n, path in given.pixels.items()}
    _refuse_unmatchable(reference, pixels.keys())
    keep = GroundCells(place.tile, place.cell_m, place.chosen)
    partners = [(images[n], pixels[n]) for n in images if n in pixels and n != reference]
    found = match(images[reference], pixels[reference], partners, keep, place.heights, parameters)
    if found.depth_map is not None:
        workspace.write(DEPTHS, encode_depth_map(found.depth_map))
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
    """A pair that could not be used leaves its reason in the record; only where none could be used the flight tile has failed."""
    missing = [f"{n} could not be read" for n in unread]
    if found.pairs and not any(p.used for p in found.pairs):
        return Status.FAILED, "; ".join([*(f"{p.partner}: {p.reason}" for p in found.pairs), *missing])
    return (Status.DEGRADED, "; ".join(missing)) if missing else (Status.DONE, "")


def _figures(found: Matched) -> dict[str, Any]:
    depth_map = found.depth_map
    known = 0 if depth_map is None else int(np.isfinite(depth_map.depth).sum())
    return {
        "points": known,
        "window": [] if depth_map is None else [depth_map.row, depth_map.col, *depth_map.depth.shape],
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
    flight_tile = city.survey.images.flight_tile(unit)
    return [("ingest", n) for n in (flight_tile.reference, *flight_tile.partners)]


STAGE = Stage(
    name=NAME,
    unit="flight tile: one reference image over one ground tile",
    text="windows of the reference image and its partners → depth map with precision, agreeing partners and colour",
    needs=(_images,),
    task=task_by(recipe),
    draft=draft_by(recipe),
    parameters=(MatchParameters,),
    cost=Cost(10.0, 1500.0, 10.0),
    limits=Limits(1800, 6000),
)
