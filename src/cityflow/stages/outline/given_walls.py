"""Given outlines and their walls: points and façades that a tile's task reads, and outlines with walls moved in."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cityflow.core.grid import Bounds, grown
from cityflow.flow.store import Store
from cityflow.flow.typed import TaskInputs
from cityflow.handover.house_points import houses_of
from cityflow.handover.outline_lines import Standing
from cityflow.handover.surface_windows import read_windows
from cityflow.handover.surfaces import Surfaces
from cityflow.handover.wall_point_files import read_walls
from cityflow.outlines.noded.adjacency import party_edges
from cityflow.outlines.under_eaves.facades_inside import LARGEST_M, NEAR_M, SeenHouses, facade_inside
from cityflow.outlines.under_eaves.walls_in import WallsInParameters, walls_moved_in
from cityflow.survey.surface_source import LIDAR
from cityflow.survey.survey import Survey

REACH_M = 2 * LARGEST_M + NEAR_M
"""Of everything that the walls of a tile's outlines may come from."""


@dataclass(frozen=True, slots=True)
class FacadeInputs(TaskInputs):
    """What shows the walls of a tile's outlines.

    Attributes
    ----------
    points : RUN-relative paths of index pieces, of a laser; None where images show façades
    walls : of the façades of images
    """

    points: tuple[str, ...] | None
    walls: tuple[str, ...]
    surfaces: Surfaces


def are_looked_for(survey: Survey) -> bool:
    """Whether façades may tell that given outlines are rims of roofs: not where a surface is given."""
    return survey.outlines_given and survey.parameters.outline.walls_in.wanted and survey.sees_facades


def inputs_of(survey: Survey, name: str) -> dict[str, str]:
    """What the walls of a tile's outlines depend on, beside the outlines."""
    around = survey.lattice.tiles[name].buffered(REACH_M)
    if survey.source.kind == LIDAR:
        return {**survey.index.over(around), **{f"unread {f}": "missing" for f in survey.unread(around)}}
    near = survey.lattice.near(name, REACH_M)
    walls = {p: d for t in near for p, d in survey.results.outputs_of("walls", t).items()}
    return {**{f"surface {t}": survey.results.digest_of("surface", t) for t in near}, **walls}


def facades_of(survey: Survey, name: str) -> FacadeInputs:
    """Where `moved_in` finds it."""
    if survey.source.kind == LIDAR:
        return FacadeInputs(tuple(survey.index.over(survey.lattice.tiles[name].buffered(REACH_M))), (), survey.surfaces)
    walls = tuple(p for t in survey.lattice.near(name, REACH_M) for p in survey.results.outputs_of("walls", t))
    return FacadeInputs(None, walls, survey.surfaces)


def moved_in(
    store: Store, facades: FacadeInputs, own: Sequence[Standing], others: Iterable[Standing], parameters: WallsInParameters,
    outline_sigma_m: float,
) -> list[Standing]:  # fmt: skip
    """A tile's own outlines by their walls; they stay with their tile and their neighbours.

    Parameters
    ----------
    others : outlines of other tiles; those count that touch own ones
    outline_sigma_m : how exact the outlines are (standard deviation)
    """
    beside = {n for s in own for n in s.neighbours}
    every = [*own, *(s for s in others if s.outline.id in beside)]
    low, high = (np.array([s.outline.polygon.bounds for s in every])[:, k : k + 2] for k in (0, 2))
    narrow = {s.outline.id for s, size in zip(every, (high - low).max(axis=1), strict=True) if size <= LARGEST_M}
    if not narrow:
        return list(own)
    seen = _seen(store, facades, grown((*low.min(axis=0), *high.max(axis=0)), NEAR_M))
    moved = walls_moved_in(
        [s.outline for s in every],
        lambda outline, edge: facade_inside(outline, edge, seen, outline_sigma_m) if outline.id in narrow else None,
        parameters,
    )
    party = party_edges(moved)
    return [replace(s, outline=replace(o, party=party[o.id])) for s, o in zip(own, moved, strict=False)]


def _seen(store: Store, facades: FacadeInputs, bounds: Bounds) -> SeenHouses:
    if facades.points is not None:
        return SeenHouses.of(houses_of(store, facades.points, bounds), None)
    surfaces = facades.surfaces
    grid, layers = read_windows(store, surfaces.group, surfaces.working, bounds, ("dsm",))
    return SeenHouses.of(grid.points(layers["dsm"].astype(np.float64)), read_walls(store, facades.walls, bounds))
