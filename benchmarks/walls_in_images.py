"""Given outlines of roofs or of walls where images show the façades, and outlines found there: do the walls move in to where they stand?

    python benchmarks/walls_in_images.py --seeds 411 412 [--size 110] [--cache FOLDER]

Surfaces and façade points are drawn with the errors of matching (`drawn_town.py`). Judged by edges of the true walls of at least 1 m that no neighbour
shares: how far from them the outline stands, which becomes the solid's wall; edges without overhang count as spoilt where they are 5 cm farther off than
before. Of found outlines a second table tells by what each edge with overhang is known, and why it moves or stays. `walls_in.py` judges whole runs over LiDAR.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely
from shapely import LineString

from cityflow.core.arrays import FloatArray
from cityflow.core.building import OUTLINE_SIGMA_M, Outline
from cityflow.evaluation.models_overhangs import true_overhang
from cityflow.geometry.straight_edges import WallEdge, known_part, wall_edges
from cityflow.outlines.find_outlines import FindParameters, find_outlines
from cityflow.outlines.from_walls.wall_points import WallPointParameters
from cityflow.outlines.given.given import clean_outlines
from cityflow.outlines.noded.adjacency import party_edges
from cityflow.outlines.noded.noding import node_outlines
from cityflow.outlines.under_eaves.facades_inside import SeenHouses, facade_beside, facade_inside
from cityflow.outlines.under_eaves.found_walls import ROOF_EDGE_M, found_walls_in, seen_in, tops_of
from cityflow.outlines.under_eaves.walls_in import WallsInParameters, walls_moved_in
from cityflow.synthetic.town_units import Unit
from drawn_town import drawn_town, table
from walls_in import LAYERS, NONE_M, PARALLEL, SHORTEST_M, place_of_wall

NODING_M, TOUCHING_M, SPOILT_M, FAR_M = 0.05, 1e-4, 0.05, 1.5
HEAD = (
    "outlines",
    "units",
    "edges moved",
    "edges with overhang",
    "off m: before",
    "now",
    "within 0.1 m %: before",
    "now",
    "edges without",
    "spoilt",
)


def given(units: Sequence[Unit], layer: str) -> list[Outline]:
    """Noded, as a run has them, by unit."""
    attribute = LAYERS[layer].removesuffix("s")
    clean, _ = clean_outlines([Outline(u.id, getattr(u, attribute)) for u in units])
    noded = node_outlines(clean, NODING_M)
    party = party_edges(noded)
    return [replace(o, party=party[o.id]) for o in noded]


def free_edges(unit: Unit, units: Sequence[Unit]) -> list[WallEdge]:
    """Edges of the true walls that no other unit shares."""
    others = [u for u in units if u.id != unit.id and shapely.dwithin(u.wall_outline, unit.wall_outline, TOUCHING_M)]
    border = unit.wall_outline.boundary
    common = [shapely.intersection(border, shapely.buffer(u.wall_outline, TOUCHING_M)) for u in others]
    parts = [p for c in common for p in shapely.get_parts(shapely.line_merge(c))]
    shared = tuple(p for p in parts if isinstance(p, LineString) and p.length > 0.01)
    return [e for e in wall_edges(unit.wall_outline, shared) if not e.party and e.length >= SHORTEST_M]


def off_m(edge: WallEdge, outline: Outline) -> float:
    """How far from a true wall the outline stands; infinite where nothing of it does."""
    rings = [shapely.get_coordinates(r) for r in shapely.get_rings(outline.polygon)]
    place = place_of_wall(edge.xy[[0, -1]], np.concatenate([np.stack([r[:-1], r[1:]], axis=1) for r in rings]))
    return abs(place) if np.isfinite(place) else np.inf


def rows_of(seed: int, size: int, cache: Path | None) -> list[list[str]]:
    made = drawn_town(seed, size, cache)
    walls = made.wall_points(WallPointParameters())
    seen = SeenHouses.of(tops_of(made.region_surface(walls)), walls)
    rows = []
    for layer in LAYERS:
        before = given(made.town.units, layer)
        moved = walls_moved_in(before, lambda o, e: facade_inside(o, e, seen, OUTLINE_SIGMA_M), WallsInParameters())
        of_unit = {a.id: (a, b) for a, b in zip(before, moved, strict=True)}
        found = np.array(
            [
                (true_overhang(e.xy[0], e.xy[-1], u.roof_outline), *(off_m(e, o) for o in of_unit[u.id]))
                for u in made.town.units
                if u.id in of_unit
                for e in free_edges(u, made.town.units)
            ]
        )
        rows.append([f"{layer}, seed {seed}", f"{len(of_unit)}", f"{sum(len(o.rims) for o in moved)}", *_told(found)])
    return rows


def _told(found: FloatArray) -> list[str]:
    has = found[:, 0] > NONE_M
    medians = [f"{np.median(found[has, k]):.3f}" for k in (1, 2)]
    within = [f"{100 * np.mean(found[has, k] <= 0.1):.1f}" for k in (1, 2)]
    spoilt = np.sum(found[~has, 2] > found[~has, 1] + SPOILT_M)
    return [f"{has.sum()}", *medians, *within, f"{(~has).sum()}", f"{spoilt}"]


def found_rows(seed: int, size: int, cache: Path | None) -> list[list[str]]:
    """Edges of true walls under eaves, by what is known of the found edge that stands for them."""
    made = drawn_town(seed, size, cache)
    surface = made.region_surface(made.wall_points(WallPointParameters()))
    seen = seen_in(surface)
    assert seen is not None
    before = find_outlines(surface, FindParameters())
    after = found_walls_in(before, seen, WallsInParameters())
    party = party_edges(before)
    edges = [(e, o) for o in before for e in wall_edges(o.polygon, party[o.id]) if not e.party]
    middles = shapely.STRtree([e.line for e, _ in edges])
    lines = [
        np.concatenate([np.stack([r[:-1], r[1:]], axis=1) for o in every for r in map(shapely.get_coordinates, shapely.get_rings(o.polygon))])
        for every in (before, after)
    ]  # fmt: skip
    by_kind: dict[str, list[tuple[float, float]]] = {}
    for unit in made.town.units:
        for edge in free_edges(unit, made.town.units):
            if true_overhang(edge.xy[0], edge.xy[-1], unit.roof_outline) <= NONE_M:
                continue
            near = [edges[k] for k in np.sort(middles.query(edge.line, predicate="dwithin", distance=FAR_M)).tolist()]
            off = [place_of_wall(edge.xy[[0, -1]], every) for every in lines]
            by_kind.setdefault(_kind(edge, near, seen), []).append((_apart(off[0]), _apart(off[1])))
    return [[f"{seed}", kind, *_of_kind(by_kind[kind])] for kind in sorted(by_kind)]


def _kind(edge: WallEdge, near: list[tuple[WallEdge, Outline]], seen: SeenHouses) -> str:
    """Why the found edge that stands for a true one moves or stays."""
    alike = [
        (e, o)
        for e, o in near
        if e.along @ edge.along > PARALLEL and place_of_wall(edge.xy[[0, -1]], e.xy[[0, -1]][None]) < FAR_M
    ]
    if not alike:
        return "no edge of an outline stands for it"
    own, outline = min(alike, key=lambda x: abs(place_of_wall(edge.xy[[0, -1]], x[0].xy[[0, -1]][None])))
    said = known_part(own, outline.edges)
    if said is not None and said.source == "wall":
        return "façades gave the edge"
    place = facade_beside(own, seen)
    if place is None:
        return "roof's edge, no façade seen"
    found = facade_inside(outline, own, seen, ROOF_EDGE_M)
    if found is None:
        return "roof's edge, on its façade"
    p = WallsInParameters()
    counts = -found.place_m > max(p.least_m, p.significance * float(np.hypot(found.sigma_m, found.outline_sigma_m)))
    return "roof's edge, façade inside" if counts else "roof's edge, façade inside but not significantly"


def _apart(place: float) -> float:
    return abs(place) if np.isfinite(place) else np.inf


def _of_kind(off: list[tuple[float, float]]) -> list[str]:
    before, after = np.array(off).T
    with np.errstate(invalid="ignore"):
        moved = np.abs(before - after) > SPOILT_M
    return [
        f"{len(off)}", f"{np.median(before):.3f}", f"{np.median(after):.3f}", f"{100 * np.mean(after <= 0.1):.0f}", f"{100 * np.mean(after <= 0.2):.0f}",
        f"{np.sum(moved)}", f"{np.sum(after > before + SPOILT_M)}",
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[411, 412])
    parser.add_argument("--size", type=int, default=110)
    parser.add_argument("--cache", type=Path)
    asked = parser.parse_args()
    rows = [row for seed in asked.seeds for row in rows_of(seed, asked.size, asked.cache)]
    table("Given outlines and façades of images", HEAD, rows)
    rows = [row for seed in asked.seeds for row in found_rows(seed, asked.size, asked.cache)]
    head = [
        "seed",
        "edge under eaves",
        "count",
        "off m: before",
        "now",
        "within 0.1 m %",
        "0.2 m %",
        "moved",
        "wrongly",
    ]
    table("Found outlines and façades of images", head, rows)


if __name__ == "__main__":
    main()
