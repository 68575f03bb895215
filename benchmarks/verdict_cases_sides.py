"""Cases for verdicts whose outlines are right but for one side, as found outlines are: a side, a part of it, or a border is too far out or in.

Nothing else is spoilt. Surveys are those of images, or of a scanner; half of the units are left alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.polygon import orient

from cityflow.geometry.straight_edges import WallEdge, wall_edges
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_lidar import TownLidarParameters, town_lidar
from cityflow.synthetic.town_units import Unit
from scenes.drawn_houses import disturbed
from verdict_cases import SCAN_M2, Case, Faults, Survey, case_of
from verdict_cases_images import image_survey

REACH_M, SKEWED, PART = (0.5, 3.0), 0.5, (0.4, 1.0)
"""How far a side is moved; the share of the sides of which one end stays; how much of a side is moved."""
KINDS = ("side out", "side in", "border out", "border in")
SOUND, LEAST_SIDE_M, LEAST_SHARE = 0.5, 2.0, 0.4
"""Share of the units left alone; shorter sides are not moved; an outline keeps so much of its area."""
DECIMALS, TOUCH_M, SHARED_M = 4, 0.05, 0.5
EDGE_M, DENSITIES = 150.0, (2.5, 4.0, 8.0, 8.0, 20.0)


def image_side_cases(seed: int) -> Iterator[Case]:
    """The cases of a town that was matched, the same for the same seed."""
    town, survey, _ = image_survey(seed)
    yield from _cases(town, seed, survey)


def scanned_side_cases(seed: int) -> Iterator[Case]:
    """The cases of a town that was scanned, the same for the same seed."""
    town = make_town(seed, TownParameters(width_m=EDGE_M, height_m=EDGE_M))
    scan = town_lidar(town, seed, TownLidarParameters(density_m2=SCAN_M2))
    yield from _cases(town, seed, Survey(scan.points, scan.truth_class, SCAN_M2, DENSITIES))


def _cases(town: Town, seed: int, survey: Survey) -> Iterator[Case]:
    tree = shapely.STRtree([u.roof_outline for u in town.units])
    for unit in town.units:
        rng = np.random.default_rng([seed, unit.index, 98])
        near = [town.units[k] for k in np.sort(tree.query(unit.wall_outline, predicate="dwithin", distance=4.0))]
        outline, kind = _outline(unit, near, survey.outline_sigma_m, rng)
        case = case_of(town, survey, unit, near, Faults(outline, kind, float(rng.choice(survey.densities))), rng)
        yield _between_neighbours(case, unit, near) if kind.startswith("border") else case


def _outline(unit: Unit, near: list[Unit], sigma_m: float, rng: np.random.Generator) -> tuple[Polygon, str]:
    """An outline, and what is wrong with it."""
    walls, kind = unit.wall_outline, str(rng.choice(KINDS)) if rng.random() > SOUND else "sound"
    party = [u.wall_outline for u in near if u is not unit and shapely.dwithin(u.wall_outline, walls, 0.05)]
    lines = [shapely.intersection(walls.boundary, p.buffer(0.05)) for p in party]
    edges = wall_edges(walls, [p for g in lines for p in shapely.get_parts(g) if isinstance(p, shapely.LineString)])
    sides = [e for e in edges if e.length >= LEAST_SIDE_M and e.party == kind.startswith("border")]
    if kind != "sound" and sides:
        moved = _moved(walls, sides[int(rng.integers(len(sides)))], kind.endswith("out"), rng)
        if kind == "side out" and party:
            moved = shapely.difference(moved, shapely.union_all(party))
        moved = shapely.transform(moved, lambda xy: np.round(xy, DECIMALS))
        if isinstance(moved, Polygon) and moved.is_valid and moved.area > LEAST_SHARE * walls.area:
            return orient(moved), kind
    return (disturbed(walls, rng, float(rng.uniform(0.0, sigma_m))) if sigma_m and not party else walls), "sound"


def _moved(walls: Polygon, side: WallEdge, outwards: bool, rng: np.random.Generator) -> shapely.Geometry:
    """An outline with a side, or a part of it, moved square to itself."""
    length = side.length * float(rng.uniform(*PART) if rng.random() < SKEWED else 1.0)
    first = float(rng.uniform(0.0, side.length - length))
    reach = float(rng.uniform(*REACH_M)) * (1.0 if outwards else -1.0)
    ends = (reach, reach) if rng.random() > SKEWED else ((reach, 0.0) if rng.random() < 0.5 else (0.0, reach))
    a, b = (side.start + s * side.along for s in (first, first + length))
    strip = Polygon([a, b, b + ends[1] * side.outward, a + ends[0] * side.outward]).buffer(0)
    return shapely.union(walls, strip) if outwards else shapely.difference(walls, strip)


def _between_neighbours(case: Case, unit: Unit, near: list[Unit]) -> Case:
    """A moved border is one to the neighbour still, whose is what was lost: a unit cut in two is no fault of a roof."""
    outline = case.evidence.outline
    lost = shapely.difference(unit.wall_outline, outline).buffer(TOUCH_M)
    others = shapely.union_all([lost, *(u.wall_outline.buffer(TOUCH_M) for u in near if u is not unit)])
    shared = shapely.get_parts(shapely.intersection(outline.boundary, others))
    party = tuple(p for p in shared if isinstance(p, shapely.LineString) and p.length > SHARED_M)
    places = case.places[~shapely.contains_xy(lost, *case.places[:, :2].T)]
    return replace(case, evidence=replace(case.evidence, party=party), places=places)
