"""Rows as streets have them: houses of one row differ or repeat, wide ones stand among narrow ones, annexes stand behind them.

What is taken from experience of terraces: annexes of one storey, half to all of a house wide, against one of its party walls; roofs of other slopes and ridges
beside each other; rows of one design, whose borders show nothing but the annexes and the widths. Houses down to 3.5 m wide and annexes beside the last house
came in after a look at where the model failed in Delft.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.polygon import orient

from cityflow.synthetic import roofs
from cityflow.synthetic.roofs import LocalFace
from lidar_rows import SINGLES, Draft, Drafts, _drafts, _firewall, _house

ONE_DESIGN, WIDE, ANNEX, SIDE = 0.35, 0.12, 0.5, 0.3
"""Shares: rows of one design, houses half as wide again to twice as wide, houses with an annex in a street that has some,
ends of rows with one beside."""
LONGEST_M = 60.0


def street_drafts(rng: np.random.Generator, kind: str) -> Drafts:
    """The houses of a street, or one building that looks like a row, behind which annexes stand too."""
    annexes = ANNEX if rng.random() < 0.7 else 0.0
    if kind in SINGLES:
        single, gaps = _drafts(rng, kind)
        return (single if kind == "two wings" else _beside(rng, [_extended(rng, d, annexes) for d in single])), gaps
    one_design = rng.random() < ONE_DESIGN
    width, depth, eave = float(rng.uniform(3.6, 8.0)), float(rng.uniform(7.0, 12.0)), float(rng.uniform(3.0, 9.0))
    slope, low, parapets = _slope(rng), 0.0, bool(rng.random() < 0.4)
    firewalls = 0.0 if rng.random() < 0.6 else float(rng.uniform(0.3, 1.0))
    drafts: list[Draft] = []
    u = 0.0
    for _ in range(int(rng.integers(3, 11))):
        roof = kind
        if not one_design:
            width = float(np.clip(rng.normal(width, 0.8), 3.5, 9.0)) * (
                float(rng.uniform(1.5, 2.0)) if rng.random() < WIDE else 1.0
            )
            eave = float(np.clip(eave + (rng.normal(0, 0.8) if rng.random() < 0.6 else 0.0), 2.6, 11.0))
            slope = _slope(rng) if rng.random() < 0.35 else slope
            if rng.random() < 0.4:
                depth, low = float(np.clip(depth + rng.normal(0, 1.0), 6.5, 13.0)), float(rng.uniform(0, 0.9))
            roof = str(rng.choice(["gables", "eaves", "eaves", "flat"])) if kind == "mixed" else kind
        if u + width > LONGEST_M:
            break
        box = (round(u, 3), round(u + width, 3), round(low, 3), round(low + depth, 3))
        house = _house(rng, roof, box, (round(eave, 3), slope), parapets)
        if roof == "eaves" and rng.random() < firewalls:
            house.faces += _firewall(box, (eave, slope), float(rng.uniform(0.2, 0.6)))
            house.wall_after = True
        house.wall_after |= parapets and roof == "flat"
        drafts.append(_extended(rng, house, annexes))
        u, width = box[1], (width if one_design else min(width, 8.0))
    if drafts:
        drafts[-1].wall_after = False
    return _beside(rng, drafts), []


def _slope(rng: np.random.Generator) -> float:
    return float(np.tan(np.radians(rng.uniform(25, 52))))


def _extended(rng: np.random.Generator, draft: Draft, share: float) -> Draft:
    """A house with an annex behind it, against one of its party walls, or without."""
    if rng.random() >= share:
        return draft
    (u_0, v_0), (u_1, v_1) = draft.ring[0], draft.ring[2]
    wide = (u_1 - u_0) * (1.0 if rng.random() < 0.25 else float(rng.uniform(0.4, 0.75)))
    if u_1 - u_0 > 12.0:
        wide = float(rng.uniform(3.0, 6.0))
    start, reach, top = (
        (u_0 if rng.random() < 0.5 else u_1 - wide),
        float(rng.uniform(1.2, 4.5)),
        float(rng.uniform(2.4, 3.4)),
    )
    a, b, c = round(start, 3), round(start + wide, 3), round(v_1 + reach, 3)
    back = [(b, v_1), (b, c), (a, c), (a, v_1)]
    ring = [(u_0, v_0), (u_1, v_0), *([(u_1, v_1)] if b < u_1 else []), *back, *([(u_0, v_1)] if a > u_0 else [])]
    return replace(draft, ring=tuple(ring), faces=[*draft.faces, LocalFace(roofs.rectangle(a, v_1, b, c), 0, 0, top)])


def _beside(rng: np.random.Generator, drafts: list[Draft]) -> list[Draft]:
    """Annexes of one storey beside the first and the last house, which they belong to."""
    for k in (0, -1):
        if not drafts or rng.random() >= SIDE:
            continue
        u_0, v_0, u_1, v_1 = Polygon(drafts[k].ring).bounds
        wide, start = float(rng.uniform(2.2, 4.2)), v_0 + float(rng.uniform(0.0, 2.5))
        end, top = min(start + float(rng.uniform(4.0, 8.0)), v_1), float(rng.uniform(2.4, 3.4))
        a, b = (u_0 - wide, u_0) if k == 0 else (u_1, u_1 + wide)
        beside = roofs.rectangle(round(a, 3), round(start, 3), round(b, 3), round(end, 3))
        both = orient(shapely.union(Polygon(drafts[k].ring), Polygon(beside)))
        if both.geom_type == "Polygon":
            ring = tuple((float(x), float(y)) for x, y in both.exterior.coords[:-1])
            drafts[k] = replace(drafts[k], ring=ring, faces=[*drafts[k].faces, LocalFace(beside, 0, 0, top)])
    return drafts
