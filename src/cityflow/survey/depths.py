"""Depth maps that a task reads, and their distance from its place."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from cityflow.flow.stage import Node
from cityflow.flow.task import digest_of
from cityflow.flow.typed import as_json
from cityflow.handover.depth_reader import VERSION, DepthInputs
from cityflow.handover.oriented import to_json
from cityflow.survey.survey import Survey

MATCH = "match"


def reach_of(survey: Survey, reach_m: float) -> float:
    """How far around its place a stage needs depth maps that makes something of the points within `reach_m`, metres."""
    return reach_m + survey.parameters.image_surface.witnesses.reach_m


def depths_over(
    survey: Survey, tiles: Iterable[str], only: Callable[[str], bool] | None = None
) -> tuple[dict[str, str], DepthInputs]:
    """Digests of what a task reads that wants the points over tiles, and where it is.

    Parameters
    ----------
    tiles : those whose points are wanted, and all others within `reach_of` of what is wanted
    only : which flight tiles' points are wanted; the others are witnesses. Without it all are
    """
    maps = depth_maps(survey, tiles)
    references = sorted({survey.images.flight_tile(u).reference for u in maps})
    images = [survey.images.flown[n].image for n in references]
    wanted = tuple(path for u, (path, _) in maps.items() if only is None or only(u))
    witnesses = survey.parameters.image_surface.witnesses
    inputs = {
        **dict(maps.values()), "poses": digest_of({i.name: to_json(i) for i in images}), "witnesses": digest_of([VERSION, as_json(witnesses)]),
    }  # fmt: skip
    paths = tuple(path for path, _ in maps.values())
    return inputs, DepthInputs(paths, wanted, tuple(images), survey.images.bands, witnesses)


def matches_over(survey: Survey, tiles: Iterable[str]) -> list[Node]:
    """The depth maps over ground tiles."""
    return [(MATCH, f.name) for t in tiles for f in survey.images.flight_tiles(survey.lattice.tiles[t])]


def depth_maps(survey: Survey, tiles: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Flight tile → path and digest of the depth map, of those over `tiles` that left one."""
    units = [f.name for t in tiles for f in survey.images.flight_tiles(survey.lattice.tiles[t])]
    found = {u: survey.results.outputs_of(MATCH, u) for u in units}
    return {u: next(iter(outputs.items())) for u, outputs in sorted(found.items()) if outputs}


def unmatched(survey: Survey, tiles: Iterable[str]) -> list[str]:
    """Flight tiles over `tiles` that have failed."""
    units = dict.fromkeys(sorted(f.name for t in tiles for f in survey.images.flight_tiles(survey.lattice.tiles[t])))
    return [u for u in units if survey.results.has_failed(MATCH, u)]
