"""Depth maps that a task reads: which, and how far around its place."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from cityflow.flow.stage import Node
from cityflow.flow.task import Json, digest_of
from cityflow.handover.depth_reader import VERSION
from cityflow.handover.oriented import to_json
from cityflow.survey.survey import Survey


def reach_of(survey: Survey, reach_m: float) -> float:
    """How far around its place a stage needs depth maps that makes something of the points within `reach_m`, metres."""
    return reach_m + survey.parameters.image_surface.witnesses.reach_m


def depths_over(
    survey: Survey, tiles: Iterable[str], only: Callable[[str], bool] | None = None
) -> tuple[dict[str, str], dict[str, Json]]:
    """Inputs and arguments of a task that reads the points over tiles.

    Parameters
    ----------
    tiles : those whose points are wanted, and all others within `reach_of` of what is wanted
    only : which flight tiles' points are wanted; the others are witnesses. Without it all are
    """
    maps = survey.depth_maps(tiles)
    bases = sorted({survey.images.flight_tile(u).base for u in maps})
    images = {n: to_json(survey.images.flown[n].image) for n in bases}
    wanted = [path for u, (path, _) in maps.items() if only is None or only(u)]
    parameters = survey.parameters.image_surface.witnesses.model_dump(mode="json")
    inputs = {**dict(maps.values()), "poses": digest_of(images), "witnesses": digest_of([VERSION, parameters])}
    return inputs, {
        "maps": [path for path, _ in maps.values()], "wanted": wanted, "bases": list(images.values()),
        "bands": survey.images.bands, "witnesses": parameters,
    }  # fmt: skip


def matches_over(survey: Survey, tiles: Iterable[str]) -> list[Node]:
    """The depth maps over ground tiles."""
    return [("match", f.name) for t in tiles for f in survey.images.flight_tiles(survey.tiles[t])]
