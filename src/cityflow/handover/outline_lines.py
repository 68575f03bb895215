"""Outlines as lines of GeoJSON text: written by tile, read one by one by byte range. Coordinates survive bit for bit."""

from __future__ import annotations

import hashlib
import json
from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from math import nan
from typing import Any

import shapely
from shapely import LineString

from cityflow.core.building import Direction, Outline, OutlineEdge
from cityflow.core.grid import tile_at
from cityflow.core.json_values import finite
from cityflow.flow.store import Store
from cityflow.flow.task import Json
from cityflow.flow.typed import TaskInputs
from cityflow.handover.cached_reads import read_text
from cityflow.outlines.noded.adjacency import party_edges


@dataclass(frozen=True, slots=True)
class OutlineAt(TaskInputs):
    """Where an outline is written: byte `start` and `length` of its line in the file at the RUN-relative `path`."""

    path: str
    start: int
    length: int

    def read(self, store: Store) -> Outline:
        """The outline; the file is kept for the next of its lines."""
        return decode(read_text(store, self.path)[self.start : self.start + self.length]).outline


@dataclass(frozen=True, slots=True)
class Standing:
    """An outline with the units whose outlines share an edge with it, and the tiles that own these."""

    outline: Outline
    neighbours: tuple[str, ...] = ()
    neighbour_tiles: tuple[str, ...] = ()

    @property
    def point(self) -> tuple[float, float]:
        """The representative point, which decides on the tile that owns the building."""
        point = self.outline.polygon.representative_point()
        return point.x, point.y


def owned(outlines: Sequence[Outline], tile_m: float, known: Collection[str]) -> dict[str, list[Standing]]:
    """Outlines by the name of the tile that owns them, each with those neighbours whose tiles are known.

    Neighbours are all that share a vertex: where four houses meet in a corner, each one's walls there depend on the others.
    """
    point = {o.id: Standing(o).point for o in outlines}
    owner = {i: tile_at(x, y, tile_m).name for i, (x, y) in point.items()}
    shared, party = touching(outlines), party_edges(outlines)
    by_tile: dict[str, list[Standing]] = defaultdict(list)
    for outline in outlines:
        beside = tuple(n for n in sorted(shared[outline.id]) if owner[n] in known)
        by_tile[owner[outline.id]].append(
            Standing(replace(outline, party=party[outline.id]), beside, tuple(sorted({owner[n] for n in beside})))
        )
    return by_tile


def touching(outlines: Sequence[Outline]) -> dict[str, set[str]]:
    """For each outline the ids of those that share a vertex with it; noded outlines do so bit for bit."""
    at: dict[tuple[float, float], list[str]] = defaultdict(list)
    for outline in outlines:
        for vertex in set(map(tuple, shapely.get_coordinates(outline.polygon).tolist())):
            at[vertex].append(outline.id)
    found: dict[str, set[str]] = {o.id: set() for o in outlines}
    for ids in at.values():
        for one in ids if len(ids) > 1 else ():
            found[one].update(i for i in ids if i != one)
    return found


def encode(standing: Standing) -> bytes:
    """One line of UTF-8 text with a line feed at its end."""
    outline = standing.outline
    tree: dict[str, Json] = {
        "type": "Feature",
        "id": outline.id,
        "geometry": shapely.geometry.mapping(outline.polygon),
        "properties": dict(outline.attributes),
        "remark": outline.remark,
        "neighbours": standing.neighbours,
        "neighbour_tiles": standing.neighbour_tiles,
        **_known_of(outline),
    }
    return (json.dumps(tree, ensure_ascii=False, separators=(",", ":")) + "\n").encode()


def decode(line: bytes) -> Standing:
    tree = json.loads(line)
    roof = shapely.geometry.shape(tree["roof"]) if "roof" in tree else None
    edges, rims, inner = (tuple(map(_edge, tree.get(name, ()))) for name in ("edges", "rims", "inner_edges"))
    aspects, slopes = (tuple(Direction(*d) for d in tree.get(name, ())) for name in ("aspects", "slopes"))
    outline = Outline(
        tree["id"], shapely.geometry.shape(tree["geometry"]), tree["properties"], tree["remark"],
        roof, edges, inner, aspects, slopes, tuple(map(LineString, tree.get("party", ()))), rims,
    )  # fmt: skip
    return Standing(outline, tuple(tree["neighbours"]), tuple(tree["neighbour_tiles"]))


def _known_of(outline: Outline) -> dict[str, Json]:
    """What is known of walls and directions; nothing if not searched, so that such lines stay as short as they were."""
    tree: dict[str, Json] = {}
    if outline.roof is not None:
        tree["roof"] = shapely.geometry.mapping(outline.roof)
    for name, edges in (("edges", outline.edges), ("rims", outline.rims), ("inner_edges", outline.inner_edges)):
        if edges:
            tree[name] = [_edge_tree(e) for e in edges]
    for name, directions in (("aspects", outline.aspects), ("slopes", outline.slopes)):
        if directions:
            tree[name] = [[d.degrees, d.sigma, d.weight] for d in directions]
    if outline.party:
        tree["party"] = [shapely.get_coordinates(line).tolist() for line in outline.party]
    return tree


def _edge_tree(edge: OutlineEdge) -> list[Json]:
    return [shapely.get_coordinates(edge.line).tolist(), edge.source, finite(edge.sigma_m), edge.seen]


def _edge(tree: Sequence[Any]) -> OutlineEdge:
    xy, source, sigma, seen = tree
    return OutlineEdge(LineString(xy), source, nan if sigma is None else sigma, seen)


def decode_all(text: bytes) -> list[Standing]:
    return [decode(line) for line in text.splitlines() if line]


def entries(text: bytes, path: str) -> list[dict[str, Json]]:
    """What the driver needs to know of each line of a file that is (to be) written at `path`."""
    found: list[dict[str, Json]] = []
    start = 0
    for line in text.splitlines(keepends=True):
        found.append(_entry(decode(line), path, start, line))
        start += len(line)
    return found


def _entry(standing: Standing, path: str, start: int, line: bytes) -> dict[str, Json]:
    return {
        "id": standing.outline.id,
        "path": path,
        "start": start,
        "length": len(line),
        "digest": hashlib.sha256(line).hexdigest(),
        "bounds": list(standing.outline.polygon.bounds),
        "point": list(standing.point),
        "neighbours": list(standing.neighbours),
        "neighbour_tiles": list(standing.neighbour_tiles),
    }


def lines(standings: Iterable[Standing]) -> bytes:
    """All outlines, sorted by id."""
    ordered: Sequence[Standing] = sorted(standings, key=lambda s: s.outline.id)
    return b"".join(encode(s) for s in ordered)
