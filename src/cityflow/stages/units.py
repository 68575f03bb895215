"""Stage ``units``: the units of the outlines of a ground tile, noded with those of touching outlines."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.building import Outline, OutlineEdge, Status
from cityflow.core.edits import Edits
from cityflow.core.splitting import Splitting
from cityflow.flow.stage import Cost, Node, Place, Stage
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs
from cityflow.flow.workspace import Workspace
from cityflow.handover.field_types import EditsField
from cityflow.handover.outline_lines import OutlineAt, Standing, entries, lines, touching
from cityflow.handover.refused_outlines import REFUSED, encode_refused
from cityflow.handover.split_lines import decode_splitting
from cityflow.outlines.given.edited import REJECTED, rejected
from cityflow.outlines.identity import ids_from_geometry
from cityflow.outlines.noded.adjacency import party_edges
from cityflow.splitting.partition import with_vertices
from cityflow.survey.city import City
from cityflow.survey.survey import Survey
from cityflow.survey.unit_entry import UnitEntry

NAME = "units"
VERSION = 3
UNITS, SPLITS = "units.jsonl", "splits.ndjson"
TIE_M = 1e-3
"""How near a neighbour's vertex lies on an edge; rounding."""
SHORTEST_EDGE_M = 0.1
"""Shorter pieces of an edge say nothing of it; set by hand."""
NOT_SPLIT = "not split: {}"


@dataclass(frozen=True, slots=True)
class SplitOutline(TaskInputs):
    """An outline, the tile that owns it, the RUN-relative path of how it was split, and why it was not where there is none."""

    outline: OutlineAt
    tile: str
    split: str | None
    reason: str


@dataclass(frozen=True, slots=True)
class UnitsInputs(TaskInputs):
    """The outlines of a tile and those that touch them.

    Attributes
    ----------
    own : ids of those of the tile;  outlines : id → all of them
    edits : those that act on any of them
    """

    own: tuple[str, ...]
    outlines: Mapping[str, SplitOutline]
    edits: EditsField


@dataclass(frozen=True, slots=True)
class _Part:
    """A unit, whose outline it comes from, and the tile that owns that."""

    outline: Outline
    source: str
    tile: str


def task(survey: Survey, name: str, own: Sequence[UnitEntry], beside: Sequence[UnitEntry]) -> Task:
    """The units of one tile: of its `own` outlines, with those of the outlines `beside` that touch them."""
    every = [*own, *(o for o in beside if o.id not in {u.id for u in own})]
    splits = {o.id: survey.results.outputs_of("split", o.id) for o in every}
    reasons = {o.id: survey.results.reason_of("split", o.id) for o in every}
    edits = [survey.edits.of_units.near(shapely.box(*o.bounds)) for o in every if survey.edits.rejected]
    drawn = list(dict.fromkeys(line for e in edits for line in e.lines()))
    return KIND.task(
        name,
        inputs={
            **({"edits": digest_of(drawn)} if drawn else {}),
            **{f"outline {o.id}": o.digest for o in every}, **{p: d for s in splits.values() for p, d in s.items()},
            **{f"failed {o}": reason for o, reason in reasons.items() if not splits[o]},
        },
        given=UnitsInputs(
            tuple(o.id for o in own),
            {o.id: SplitOutline(o.at, o.tile, next(iter(splits[o.id]), None), reasons[o.id]) for o in every},
            Edits.from_lines(drawn),
        ),
        limits=survey.limits(NAME),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """One line per unit, as the stage ``outline`` writes them where nothing is split."""
    given = task.arguments_as(UnitsInputs)
    own = set(given.own)
    parts = [p for name, known in given.outlines.items() for p in _parts(workspace.store, name, known)]
    no_building = rejected([p.outline.polygon for p in parts], given.edits, by_points=False)
    refused = [p.outline for p, no in zip(parts, no_building, strict=True) if no and p.source in own]
    if refused:
        workspace.write(REFUSED, encode_refused((o.id, o.polygon) for o in refused))
    tied = _tied([p for p, no in zip(parts, no_building, strict=True) if not no])
    every = [p.outline for p in tied]
    shared, party = touching(every), party_edges(every)
    tile_of = {p.outline.id: p.tile for p in tied}
    mine = [
        Standing(replace(p.outline, party=party[p.outline.id]), tuple(sorted(shared[p.outline.id])), tuple(sorted({tile_of[n] for n in shared[p.outline.id]})))
        for p in tied if p.source in own
    ]  # fmt: skip
    text = lines(mine)
    workspace.write(UNITS, text)
    workspace.write(SPLITS, _splits(workspace.store, given))
    unsplit = sorted(n for n in own if given.outlines[n].split is None)
    reason = f"{len(unsplit)} outlines could not be split: {', '.join(unsplit[:5])}" if unsplit else ""
    return workspace.outcome(
        Status.DEGRADED if unsplit else Status.DONE, reason,
        {"units": entries(text, workspace.path(UNITS)), "outlines": len(own), "refused": [[o.id, REJECTED] for o in refused]},
    )  # fmt: skip


def _splits(store: Store, given: UnitsInputs) -> bytes:
    """A line with its id for every outline of the tile that went through splitting."""
    paths = {name: given.outlines[name].split for name in sorted(given.own)}
    return b"".join(
        json.dumps(name, ensure_ascii=False).encode() + b"\t" + store.read_bytes(path)
        for name, path in paths.items()
        if path
    )


def _parts(store: Store, name: str, known: SplitOutline) -> list[_Part]:
    outline = known.outline.read(store)
    if known.split is None:
        remark = "; ".join(filter(None, [outline.remark, NOT_SPLIT.format(known.reason or "the task failed")]))
        return [_Part(replace(outline, remark=remark), name, known.tile)]
    splitting = decode_splitting(store.read_bytes(known.split))
    return [_Part(o, name, known.tile) for o in units_of(outline, splitting)]


def units_of(outline: Outline, splitting: Splitting) -> list[Outline]:
    """The single units with ids of their own: the outline's where it stays whole, else its id and their place.

    Attributes, remark and directions are handed down, and the edges that a unit has a part in; the roof's outline stays with the outline.
    """
    directions: dict[str, Any] = {"aspects": splitting.aspects, "slopes": splitting.slopes}
    if len(splitting.units) == 1:
        return [replace(outline, polygon=splitting.units[0], **directions)]
    places = ids_from_geometry(splitting.units)
    return [
        replace(
            outline,
            id=f"{outline.id}.{place}",
            polygon=polygon,
            roof=None,
            edges=_along(polygon, outline.edges),
            rims=outline.rims,
            inner_edges=_inside(polygon, outline.inner_edges),
            **directions,
        )
        for place, polygon in zip(places, splitting.units, strict=True)
    ]


def _along(polygon: Polygon, edges: Sequence[OutlineEdge]) -> tuple[OutlineEdge, ...]:
    """The parts of the edges on the border of a unit."""
    return _parts_in(shapely.buffer(polygon.boundary, TIE_M), edges)


def _inside(polygon: Polygon, edges: Sequence[OutlineEdge]) -> tuple[OutlineEdge, ...]:
    return _parts_in(polygon, edges)


def _parts_in(place: BaseGeometry, edges: Sequence[OutlineEdge]) -> tuple[OutlineEdge, ...]:
    """Straight parts of at least `SHORTEST_EDGE_M`."""
    cut = ((e, shapely.intersection(e.line, place)) for e in edges)
    parts = [(e, p) for e, shape in cut for p in shapely.get_parts(shape) if isinstance(p, LineString)]
    return tuple(replace(e, line=p) for e, p in parts if p.length >= SHORTEST_EDGE_M)


def _tied(parts: Sequence[_Part]) -> list[_Part]:
    """Cuts that end on a wall shared with another outline leave their vertex there, too: noded outlines stay noded."""
    if len({p.source for p in parts}) < 2:
        return list(parts)
    polygons = np.array([p.outline.polygon for p in parts], dtype=object)
    pairs = shapely.STRtree(polygons).query(polygons, predicate="dwithin", distance=TIE_M).T.tolist()
    others: dict[int, list[int]] = {i: [] for i in range(len(parts))}
    for i, j in pairs:
        if parts[i].source != parts[j].source:
            others[i].append(j)
    return [_with_vertices_of(p, polygons[sorted(others[i])]) for i, p in enumerate(parts)]


def _with_vertices_of(part: _Part, beside: np.ndarray) -> _Part:
    if not len(beside):
        return part
    polygon = with_vertices(part.outline.polygon, np.unique(shapely.get_coordinates(beside), axis=0), TIE_M)
    return replace(part, outline=replace(part.outline, polygon=polygon))


def _own_outlines(_: City, tile: str) -> Iterable[Node]:
    return [("outline", tile)]


def _outlines_beside(city: City, tile: str) -> Iterable[Node]:
    """The tiles that own what touches its outlines."""
    return [("outline", t) for o in city.outlines_of[tile] for t in city.outlines[o].neighbour_tiles]


def _splits_of_touching(city: City, tile: str) -> Iterable[Node]:
    return [("split", o) for o in _touching(city, tile)]


def _touching(city: City, tile: str) -> list[str]:
    """The outlines of a tile and those that touch them."""
    own = city.outlines_of[tile]
    beside = [n for o in own for n in city.outlines[o].neighbours if n in city.outlines]
    return list(dict.fromkeys([*own, *beside]))


def _task(city: City, tile: str) -> Task:
    every = [city.outlines[o] for o in _touching(city, tile)]
    own = len(city.outlines_of[tile])
    return task(city.survey, tile, every[:own], every[own:])


KIND = TaskKind(NAME, VERSION, run, UnitsInputs)

STAGE = Stage(
    name=NAME,
    unit="ground tile",
    place=Place.TILE,
    text="split outlines of the tile and those that touch them → its units, noded",
    kinds=(KIND,),
    needs=(_own_outlines, _outlines_beside, _splits_of_touching),
    task=_task,
    asked=lambda city, _: city.survey.splits,
    count=lambda city: len(city.ring_of(city.tiles)) if city.survey.splits else 0,
    cost=Cost(0.2, 400.0, 0.1),
)
