"""Rows of houses under a laser scanner, their borders known: gables or eaves to the street, flat roofs with parapets, mixed, and what is no row.

Single buildings that look like rows stand among them: slabs with dormers and cross gables, houses with two wings, flat roofs with penthouses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.polygon import orient

from cityflow.core.arrays import FloatArray
from cityflow.core.points import PointCloud
from cityflow.synthetic import roofs
from cityflow.synthetic.known_terrain import Terrain, make_terrain, unbroken
from cityflow.synthetic.roofs import LocalFace, Placement
from cityflow.synthetic.town_lidar import TownLidarParameters, town_lidar
from scenes import simple_roofs
from scenes.prism_scene import PrismScene, TruthBuilding, trees_beside

CELL_M = (76.0, 30.0)
SOUTH_WEST, RELIEF = (85000.0, 447000.0), 0.3
ROWS = ("gables", "eaves", "flat", "mixed")
SINGLES = ("slab", "cross gables", "two wings", "penthouse")
FIREWALL_M, PARAPET_M = 0.15, 0.25
STEP_M, CHANGE_M, RISE = 0.25, 0.25, 0.3
STEP_SHARE, CHANGE_SHARE, VALLEY_SHARE = 0.4, 0.15, 0.5


@dataclass
class Draft:
    """One unit: its outline and roof in the frame of its row, and marks that only its maker knows."""

    ring: tuple[tuple[float, float], ...]
    faces: list[LocalFace] = field(default_factory=list)
    wall_after: bool = False


@dataclass(frozen=True)
class Row:
    """A complex: what it is, its outline, its units, borders and what a scanner may see of each."""

    kind: str
    outline: Polygon
    units: tuple[Polygon, ...]
    traces: tuple[tuple[LineString, frozenset[str]], ...]


@dataclass(frozen=True)
class RowTown:
    points: PointCloud
    terrain: Terrain
    rows: tuple[Row, ...]


Gap = tuple[tuple[float, float], ...]
Drafts = tuple[list[Draft], list[Gap]]


def row_town(
    seed: int,
    width_m: float,
    parameters: TownLidarParameters,
    drafts_of: Callable[[np.random.Generator, str], Drafts] | None = None,
) -> RowTown:
    """The houses of a square depend on the seed alone, the points on the survey too.

    Parameters
    ----------
    drafts_of : makes the houses of a row of a kind; the plain ones of this file where None
    """
    rng = np.random.default_rng([seed, 77])
    bounds = (*SOUTH_WEST, SOUTH_WEST[0] + width_m, SOUTH_WEST[1] + width_m)
    terrain = unbroken(make_terrain(rng, bounds, RELIEF))
    rows, buildings = [], list[TruthBuilding]()
    columns, lines = int(width_m // CELL_M[0]), int(width_m // CELL_M[1])
    for number in range(columns * lines):
        kind = str(rng.choice(ROWS)) if rng.random() < 0.7 else str(rng.choice(SINGLES))
        drafts, gaps = (drafts_of or _drafts)(rng, kind)
        corner = bounds[0] + (number % columns) * CELL_M[0] + 6.0, bounds[1] + (number // columns) * CELL_M[1] + 8.0
        heading = float(rng.uniform(-0.1, 0.1))
        z = float(terrain.z(np.array([corner[0] + 30.0]), np.array([corner[1] + 6.0]))[0])
        place = Placement(*corner, heading, round(z, 2))
        made = [_built(f"r{number}u{k}", d, place, terrain) for k, d in enumerate(drafts)]
        buildings += made
        between = [orient(Polygon(place.to_world(g))) for g in gaps]
        rows.append(_row(kind, drafts, made, between))
    scene = PrismScene(bounds, terrain, tuple(buildings), trees_beside(rng, terrain, buildings))
    return RowTown(town_lidar(scene, seed, parameters).points, terrain, tuple(rows))


def _built(name: str, draft: Draft, place: Placement, terrain: Terrain) -> TruthBuilding:
    outline = orient(Polygon(place.to_world(draft.ring)))
    prisms = tuple(place.face(f) for f in draft.faces)
    floor = float(terrain.z(*shapely.get_coordinates(outline).T).min())
    return TruthBuilding(name, "row", outline, prisms, prisms, floor)


def _row(kind: str, drafts: list[Draft], made: list[TruthBuilding], gaps: list[Polygon]) -> Row:
    outline = shapely.union_all([shapely.buffer(p, 1e-4) for p in (*[b.outline for b in made], *gaps)]).buffer(-1e-4)
    traces = []
    for before, after, draft in zip(made[:-1], made[1:], drafts[:-1], strict=True):
        common = shapely.intersection(before.outline.boundary, shapely.buffer(after.outline, 2e-3))
        parts = [g for g in shapely.get_parts(common) if isinstance(g, LineString)]
        if common.length > 1.0:
            line = max(parts, key=lambda g: float(g.length)) if len(parts) == 1 else _ends(common)
            traces.append((line, _traces(line, (before, after), draft.wall_after)))
        else:
            nearest = shapely.shortest_line(before.outline, after.outline)
            for b, other in ((before, after), (after, before)):
                side = _ends(
                    shapely.intersection(b.outline.boundary, shapely.buffer(other.outline, nearest.length + 0.01))
                )
                traces.append((side, frozenset({"gap"})))
    return Row(kind, orient(shapely.simplify(outline, 0.005)), tuple(b.outline for b in made), tuple(traces))


def _ends(lines: shapely.Geometry) -> LineString:
    c = shapely.get_coordinates(lines)
    far = np.unravel_index(np.argmax(((c[:, None] - c[None]) ** 2).sum(axis=2)), (len(c), len(c)))
    return LineString(c[list(far)])


def _traces(line: LineString, pair: tuple[TruthBuilding, TruthBuilding], wall: bool) -> frozenset[str]:
    """What of the true roofs a scanner could see along a border."""
    p, q = shapely.get_coordinates(line)[[0, -1]]
    along = (q - p) / np.hypot(*(q - p))
    away = np.array([along[1], -along[0]])
    if shapely.contains_xy(pair[0].outline, *((p + q) / 2 + 0.2 * away)):
        away = -away
    at = p + np.linspace(0.05, 0.95, 40)[:, None] * (q - p)
    near, far = (
        np.array([b.z(*(at + s * d * away).T) for s, b in zip((-1, 1), pair, strict=True)]) for d in (0.5, 1.5)
    )
    step = near[1] - near[0]
    rise = (far - near) / 1.0
    known = np.isfinite(step) & np.isfinite(rise).all(axis=0)
    flat = np.abs(step) - 0.5 * np.abs(rise).sum(axis=0)
    found = {"firewall"} if wall else set()
    if (flat[known] > STEP_M).mean() >= STEP_SHARE:
        found.add("step")
    elif (flat[known] > CHANGE_M).mean() >= CHANGE_SHARE:
        found.add("change")
    if (rise[:, known] > RISE).all(axis=0).mean() >= VALLEY_SHARE:
        found.add("valley")
    return frozenset(found)


def _drafts(rng: np.random.Generator, kind: str) -> Drafts:
    if kind in SINGLES:
        return [_single(rng, kind)], []
    count = int(rng.integers(4, 10))
    slope, eave = float(np.tan(np.radians(rng.uniform(32, 50)))), float(rng.uniform(4.0, 9.0))
    same = rng.random() < 0.4
    width, depth, low = float(rng.uniform(4.6, 7.4)), float(rng.uniform(8.0, 12.0)), 0.0
    parapets, firewalls = bool(rng.random() < 0.5), bool(rng.random() < 0.35)
    drafts, gaps, u = [], [], 0.0
    for k in range(count):
        if not same:
            width = float(rng.uniform(4.6, 7.4))
        if rng.random() < (0.2 if same else 0.6):
            eave = float(np.clip(eave + rng.uniform(-1.1, 1.1), 3.0, 12.0))
        if rng.random() < 0.25:
            depth, low = float(np.clip(depth + rng.uniform(-1.5, 1.5), 7.0, 13.0)), float(rng.uniform(0, 1.2))
        if u + width > 60.0:
            break
        one = str(rng.choice(["gables", "eaves", "flat"])) if kind == "mixed" else kind
        box = (round(u, 3), round(u + width, 3), round(low, 3), round(low + depth, 3))
        drafts.append(_house(rng, one, box, (round(eave, 3), slope), parapets))
        drafts[-1].wall_after = parapets and one == "flat"
        u = box[1]
        if rng.random() < 0.07 and k < count - 1:
            gap = round(float(rng.uniform(0.8, 2.0)), 3)
            drafts[-1].wall_after = False
            gaps.append(roofs.rectangle(u, max(low, 1.2), u + gap, low + min(depth, 7.0)))
            u += gap
        elif firewalls and one == "eaves" and rng.random() < 0.7:
            drafts[-1].faces += _firewall(box, (eave, slope), float(rng.uniform(0.3, 0.6)))
            drafts[-1].wall_after = k < count - 1
    return drafts, gaps


def _house(
    rng: np.random.Generator,
    kind: str,
    box: tuple[float, float, float, float],
    roof: tuple[float, float],
    parapets: bool,
) -> Draft:
    (u_0, u_1, v_0, v_1), (eave, slope) = box, roof
    draft = Draft(roofs.rectangle(u_0, v_0, u_1, v_1))
    if kind == "gables":
        draft.faces = simple_roofs.gable_across((u_0, u_1), v_0, v_1, eave, slope * float(rng.uniform(0.85, 1.15)))
        if rng.random() < 0.3:
            draft.faces.append(_dormer_sideways(rng, box, (eave, slope)))
    elif kind == "eaves":
        draft.faces = simple_roofs.gable(u_0, u_1, (v_0, v_1), eave, slope)
        if rng.random() < 0.45:
            draft.faces.append(_dormer(rng, u_0 + 0.8, (v_0, v_1), (eave, slope), u_1 - u_0 - 1.6))
    else:
        draft.faces = [LocalFace(draft.ring, 0, 0, eave)]
        if parapets:
            draft.faces += _parapet(box, eave + float(rng.uniform(0.3, 0.6)))
        if rng.random() < 0.3 and u_1 - u_0 > 3.6:
            u, v = float(rng.uniform(u_0 + 0.6, u_1 - 3.0)), float(rng.uniform(v_0 + 1, v_1 - 4))
            draft.faces.append(LocalFace(roofs.rectangle(u, v, u + 2.3, v + 3.0), 0, 0, eave + 2.4, roofs.DORMER))
    if kind != "flat" and rng.random() < 0.6:
        v = (v_0 + v_1) / 2 + float(rng.uniform(-1.5, 1.0))
        draft.faces.append(
            simple_roofs.chimney(float(rng.uniform(u_0, u_1 - 0.6)), v, eave + slope * (v_1 - v_0) / 2 + 0.7)
        )
    return draft


def _dormer(
    rng: np.random.Generator, u: float, v: tuple[float, float], roof: tuple[float, float], most: float
) -> LocalFace:
    (eave, slope), width = roof, min(float(rng.uniform(1.6, 3.4)), most)
    top = min(eave + slope * 0.6 + float(rng.uniform(1.3, 2.0)), eave + slope * (v[1] - v[0]) / 2 - 0.3)
    ends = (v[0] + 0.6, (v[0] + v[1]) / 2) if rng.random() < 0.5 else ((v[0] + v[1]) / 2, v[1] - 0.6)
    return LocalFace(roofs.rectangle(u, ends[0], u + width, ends[1]), 0, 0, top, roofs.DORMER)


def _dormer_sideways(
    rng: np.random.Generator, box: tuple[float, float, float, float], roof: tuple[float, float]
) -> LocalFace:
    u_0, u_1, v_0, v_1 = box
    v, half = float(rng.uniform(v_0 + 1.0, v_1 - 3.5)), (u_1 - u_0) / 2
    return LocalFace(
        roofs.rectangle(u_0 + 0.6, v, u_0 + half, v + 2.2), 0, 0, roof[0] + 0.8 * roof[1] * half, roofs.DORMER
    )


def _parapet(box: tuple[float, float, float, float], top: float) -> list[LocalFace]:
    u_0, u_1, v_0, v_1 = box
    t = PARAPET_M
    sides = [(u_0, v_0, u_0 + t, v_1), (u_1 - t, v_0, u_1, v_1), (u_0, v_0, u_1, v_0 + t), (u_0, v_1 - t, u_1, v_1)]
    return [LocalFace(roofs.rectangle(*s), 0, 0, top) for s in sides]


def _firewall(box: tuple[float, float, float, float], roof: tuple[float, float], rise: float) -> list[LocalFace]:
    """The last of the house, above its roof."""
    return simple_roofs.gable(box[1] - 2 * FIREWALL_M, box[1], (box[2], box[3]), roof[0] + rise, roof[1])


def _single(rng: np.random.Generator, kind: str) -> Draft:
    """One building that has something of a row."""
    length, depth = float(rng.uniform(18, 55)), float(rng.uniform(9, 13))
    eave, slope = float(rng.uniform(5, 12)), float(np.tan(np.radians(rng.uniform(28, 45))))
    draft = Draft(roofs.rectangle(0, 0, length, depth))
    if kind == "penthouse":
        draft.faces = [LocalFace(draft.ring, 0, 0, eave), *_parapet((0, length, 0, depth), eave + 0.4)]
        for u in np.arange(4.0, length - 6.0, float(rng.uniform(9, 14))).tolist():
            draft.faces.append(LocalFace(roofs.rectangle(u, 2.5, u + 3.5, depth - 3.0), 0, 0, eave + 2.6, roofs.DORMER))
        return draft
    draft.faces = simple_roofs.gable(0, length, (0, depth), eave, slope)
    pitch = float(rng.uniform(4.0, 8.0))
    if kind == "slab":
        draft.faces += [
            _dormer(rng, u, (0, depth), (eave, slope), 3.0) for u in np.arange(1.5, length - 4.0, pitch).tolist()
        ]
    elif kind == "cross gables":
        for u in np.arange(2.0, length - 7.0, pitch + 5.0).tolist():
            draft.faces += simple_roofs.gable_across(
                (u, u + 5.0), 0.0, depth / 2, eave + 0.3, min(slope, 0.9 * slope * depth / 5.0)
            )
    else:
        reach = depth + float(rng.uniform(4, 8))
        draft.ring = ((0, 0), (length, 0), (length, depth), (depth, depth), (depth, reach), (0, reach))
        draft.faces += simple_roofs.gable_across((0, depth), depth / 2, reach, eave, slope)
    return draft


def ground_under(town: RowTown, outline: Polygon) -> float:
    xy: FloatArray = shapely.get_coordinates(shapely.segmentize(outline, 1.0))
    return float(town.terrain.z(xy[:, 0], xy[:, 1]).min())
