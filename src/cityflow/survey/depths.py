"""Depth maps that a task reads, and their distance from its place."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from cityflow.core.camera import OrientedImage
from cityflow.flow.stage import Node
from cityflow.flow.task import digest_of
from cityflow.flow.typed import as_json
from cityflow.handover.depth_reader import VERSION, DepthInputs
from cityflow.handover.oriented import to_json
from cityflow.surface.witnesses import WitnessParameters
from cityflow.survey.results import Results
from cityflow.survey.survey import Survey

MATCH = "match"


def reach_of(survey: Survey, reach_m: float) -> float:
    """How far around its place a stage needs depth maps that makes something of the points within `reach_m`, metres."""
    return reach_m + survey.parameters.image_surface.witnesses.reach_m


@dataclass(frozen=True, slots=True)
class DepthSources:
    """Which depth maps a task reads, before it is known which of them there are.

    Attributes
    ----------
    references : flight tile → its reference image, sorted
    images : the reference images
    bands : of the images
    witnesses : what refutes a depth
    """

    references: Mapping[str, str]
    images: Mapping[str, OrientedImage]
    bands: int
    witnesses: WitnessParameters

    @property
    def reads(self) -> list[Node]:
        return [(MATCH, unit) for unit in self.references]

    def maps(self, results: Results) -> dict[str, tuple[str, str]]:
        """Flight tile → path and digest of the depth map, of those that left one."""
        found = {u: results.outputs_of(MATCH, u) for u in self.references}
        return {u: next(iter(outputs.items())) for u, outputs in found.items() if outputs}

    def inputs(self, results: Results, only: Callable[[str], bool] | None = None) -> tuple[dict[str, str], DepthInputs]:
        """Digests of what the task reads, and where it is.

        Parameters
        ----------
        only : which flight tiles' points are wanted; the others are witnesses. Without it all are
        """
        maps = self.maps(results)
        images = [self.images[n] for n in sorted({self.references[u] for u in maps})]
        wanted = tuple(path for u, (path, _) in maps.items() if only is None or only(u))
        inputs = {
            **dict(maps.values()), "poses": digest_of({i.name: to_json(i) for i in images}),
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
    references = {u: survey.images.flight_tile(u).reference for u in flight_tiles_over(survey, tiles)}
    images = {n: flown[n].image for n in references.values()}
    return DepthSources(references, images, survey.images.bands, survey.parameters.image_surface.witnesses)


def flight_tiles_over(survey: Survey, tiles: Iterable[str]) -> list[str]:
    """Names of the flight tiles over ground tiles, sorted."""
    return sorted({unit for _, unit in matches_over(survey, tiles)})


def matches_over(survey: Survey, tiles: Iterable[str]) -> list[Node]:
    """The depth maps over ground tiles."""
    return [(MATCH, f.name) for t in tiles for f in survey.images.flight_tiles(survey.lattice.tiles[t])]
