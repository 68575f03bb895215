"""Depth maps that a task compares, and points of them that a task reads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from cityflow.core.camera import OrientedImage
from cityflow.flow.stage import Node
from cityflow.flow.task import digest_of
from cityflow.flow.typed import as_json
from cityflow.handover.depth_map_files import depth_map_name
from cityflow.handover.depth_reader import VERSION, CheckedInputs, DepthInputs
from cityflow.handover.oriented import to_json
from cityflow.handover.vote_files import VOTES
from cityflow.orientation.flight_plan import FlightTile
from cityflow.surface.witnesses import WitnessParameters
from cityflow.survey.results import Results
from cityflow.survey.survey import Survey

MATCH, FUSE = "match", "fuse"


class DepthPart(NamedTuple):
    """The depth map of a reference image over a ground tile, and the task that makes it."""

    unit: str
    tile: str
    reference: str


@dataclass(frozen=True, slots=True)
class DepthSources:
    """Which depth maps a task compares, before it is known which of them there are.

    Attributes
    ----------
    parts : flight tile → its depth map, sorted
    images : the reference images
    bands : of the images
    witnesses : what refutes a depth
    """

    parts: Mapping[str, DepthPart]
    images: Mapping[str, OrientedImage]
    bands: int
    witnesses: WitnessParameters

    @property
    def reads(self) -> list[Node]:
        return list(dict.fromkeys((MATCH, part.unit) for part in self.parts.values()))

    def inputs(self, results: Results) -> tuple[dict[str, str], DepthInputs]:
        """Digests of what the task reads, and where it is. An image that is matched over more ground leaves the same digests over the old."""
        maps = _maps(self.parts, results)
        images = [self.images[n] for n in sorted({self.parts[f].reference for f in maps})]
        inputs = {
            **{f"depths {f}": digest for f, (_, digest) in maps.items()}, "poses": _digest_of_poses(images),
            "witnesses": digest_of([VERSION, as_json(self.witnesses)]),
        }  # fmt: skip
        paths = tuple(path for path, _ in maps.values())
        return inputs, DepthInputs(paths, tuple(images), self.bands, self.witnesses)


@dataclass(frozen=True, slots=True)
class CheckedSources:
    """Which points of images a task reads, before it is known which of them there are.

    Attributes
    ----------
    parts : flight tile → its depth map, sorted;  images : the reference images
    bands : of the images
    """

    parts: Mapping[str, DepthPart]
    images: Mapping[str, OrientedImage]
    bands: int

    @property
    def reads(self) -> list[Node]:
        compared = dict.fromkeys((FUSE, part.tile) for part in self.parts.values())
        return [*compared, *dict.fromkeys((MATCH, part.unit) for part in self.parts.values())]

    def inputs(self, results: Results) -> tuple[dict[str, str], CheckedInputs]:
        """Digests of what the task reads, and where it is; of a tile whose depths could not be compared, that it is missing."""
        over = dict.fromkeys(p.tile for p in self.parts.values())
        missing = tuple(t for t in over if results.has_failed(FUSE, t))
        votes = {t: results.output_of(FUSE, t, VOTES) for t in over}
        there = {t: left for t, left in votes.items() if left is not None}
        maps = _maps({f: p for f, p in self.parts.items() if p.tile in there}, results)
        tiles = {f: self.parts[f].tile for f in maps}
        images = [self.images[n] for n in sorted({self.parts[f].reference for f in maps})]
        inputs = {
            **{f"depths {f}": digest for f, (_, digest) in maps.items()}, "poses": _digest_of_poses(images),
            **{f"votes {t}": there[t][1] for t in dict.fromkeys(tiles.values())}, **{f"votes {t}": "missing" for t in missing},
        }  # fmt: skip
        paths = tuple(path for path, _ in maps.values())
        found = tuple(there[t][0] for t in tiles.values())
        names = tuple(self.parts[f].reference for f in maps)
        return inputs, CheckedInputs(paths, found, names, missing, tuple(images), self.bands)


def _maps(parts: Mapping[str, DepthPart], results: Results) -> dict[str, tuple[str, str]]:
    """Flight tile → path and digest of the depth map, of those that left one."""
    found = {f: results.output_of(MATCH, p.unit, depth_map_name(p.tile)) for f, p in parts.items()}
    return {f: left for f, left in found.items() if left is not None}


def _digest_of_poses(images: Iterable[OrientedImage]) -> str:
    return digest_of({i.name: to_json(i) for i in images})


def depth_sources(survey: Survey, tiles: Iterable[str]) -> DepthSources:
    """What a task reads that compares the depths over ground tiles."""
    parts, images = _parts(survey, flight_tiles_over(survey, tiles))
    return DepthSources(parts, images, survey.images.bands, survey.parameters.image_surface.witnesses)


def checked_sources(survey: Survey, flight_tiles: Iterable[FlightTile]) -> CheckedSources:
    """What a task reads that wants the points of some reference images over ground tiles."""
    return CheckedSources(*_parts(survey, flight_tiles), survey.images.bands)


def _parts(survey: Survey, flight_tiles: Iterable[FlightTile]) -> tuple[dict[str, DepthPart], dict[str, OrientedImage]]:
    flown, units = survey.images.flown, survey.matches
    parts = {f.name: DepthPart(units.unit_of(f), f.tile, f.reference) for f in flight_tiles}
    return parts, {p.reference: flown[p.reference].image for p in parts.values()}


def flight_tiles_over(survey: Survey, tiles: Iterable[str]) -> list[FlightTile]:
    """The reference images of ground tiles, sorted by the names of tile and image."""
    found = {f.name: f for t in tiles for f in survey.images.flight_tiles(survey.lattice.tiles[t])}
    return [found[name] for name in sorted(found)]


def matches_over(survey: Survey, tiles: Iterable[str]) -> list[Node]:
    """The tasks that make the depth maps over ground tiles."""
    units = (unit for t in tiles for unit in survey.matches.units_over(survey.lattice.tiles[t]))
    return [(MATCH, unit) for unit in dict.fromkeys(units)]


def checked_over(survey: Survey, tiles: Sequence[str]) -> list[Node]:
    """The tasks that leave the points over ground tiles: those that make the depth maps, and those that compare them."""
    return [*((FUSE, t) for t in tiles), *matches_over(survey, tiles)]
