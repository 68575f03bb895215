"""Depth maps that a task reads, and their distance from its place."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from cityflow.core.camera import OrientedImage
from cityflow.flow.stage import Node
from cityflow.flow.task import digest_of
from cityflow.flow.typed import as_json
from cityflow.handover.depth_map_files import depth_map_name
from cityflow.handover.depth_reader import VERSION, DepthInputs
from cityflow.handover.oriented import to_json
from cityflow.orientation.flight_plan import FlightTile
from cityflow.surface.witnesses import WitnessParameters
from cityflow.survey.results import Results
from cityflow.survey.survey import Survey

MATCH = "match"


def reach_of(survey: Survey, reach_m: float) -> float:
    """How far around its place a stage needs depth maps that makes something of the points within `reach_m`, metres."""
    return reach_m + survey.parameters.image_surface.witnesses.reach_m


class DepthPart(NamedTuple):
    """The depth map of a reference image over a ground tile, and the task that makes it."""

    unit: str
    tile: str
    reference: str


@dataclass(frozen=True, slots=True)
class DepthSources:
    """Which depth maps a task reads, before it is known which of them there are.

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

    def maps(self, results: Results) -> dict[str, tuple[str, str]]:
        """Flight tile → path and digest of the depth map, of those that left one."""
        found = {f: results.output_of(MATCH, p.unit, depth_map_name(p.tile)) for f, p in self.parts.items()}
        return {f: left for f, left in found.items() if left is not None}

    def inputs(self, results: Results, only: Callable[[str], bool] | None = None) -> tuple[dict[str, str], DepthInputs]:
        """Digests of what the task reads, and where it is. An image that is matched over more ground leaves the same digests over the old.

        Parameters
        ----------
        only : which flight tiles' points are wanted; the others are witnesses. Without it all are
        """
        maps = self.maps(results)
        images = [self.images[n] for n in sorted({self.parts[f].reference for f in maps})]
        wanted = tuple(path for f, (path, _) in maps.items() if only is None or only(f))
        inputs = {
            **{f"depths {f}": digest for f, (_, digest) in maps.items()}, "poses": digest_of({i.name: to_json(i) for i in images}),
            "witnesses": digest_of([VERSION, as_json(self.witnesses)]),
        }  # fmt: skip
        paths = tuple(path for path, _ in maps.values())
        return inputs, DepthInputs(paths, wanted, tuple(images), self.bands, self.witnesses)


def depth_sources(survey: Survey, tiles: Iterable[str]) -> DepthSources:
    """What a task reads that wants the points over tiles.

    Parameters
    ----------
    tiles : those whose points are wanted, and all others within `reach_of` of what is wanted
    """
    flown = survey.images.flown
    units = survey.matches
    parts = {f.name: DepthPart(units.unit_of(f), f.tile, f.reference) for f in flight_tiles_over(survey, tiles)}
    images = {p.reference: flown[p.reference].image for p in parts.values()}
    return DepthSources(parts, images, survey.images.bands, survey.parameters.image_surface.witnesses)


def flight_tiles_over(survey: Survey, tiles: Iterable[str]) -> list[FlightTile]:
    """The reference images of ground tiles, sorted by the names of tile and image."""
    found = {f.name: f for t in tiles for f in survey.images.flight_tiles(survey.lattice.tiles[t])}
    return [found[name] for name in sorted(found)]


def matches_over(survey: Survey, tiles: Iterable[str]) -> list[Node]:
    """The tasks that make the depth maps over ground tiles."""
    units = (survey.matches.unit_of(f) for t in tiles for f in survey.images.flight_tiles(survey.lattice.tiles[t]))
    return [(MATCH, unit) for unit in dict.fromkeys(units)]
