"""Terraces and perimeter blocks: rows of units with a common wall, a gap here and there, steps in eaves and ridges."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.parameters import Parameters
from cityflow.synthetic import roofs
from cityflow.synthetic import town_shapes as shapes
from cityflow.synthetic.town_drafts import BlockDraft, GapDraft, Style, TreeDraft, UnitDraft, draw_facade, draw_style
from cityflow.synthetic.town_houses import roof_extras
from cityflow.synthetic.town_shapes import Overhang, Ring, Volume


class RowGaps(Parameters):
    """Gaps between the houses of a row, where they shall be others than usual; no house of such a row is like the one before."""

    share: float = Field(0.45, ge=0, le=1, description="share of the houses that are followed by a gap")
    width_m: tuple[float, float] = Field((0.6, 1.2), description="least and greatest width, metres")
    tree_share: float = Field(0.0, ge=0, le=1, description="share of the gaps that are filled by a tree")
    roofed_share: float = Field(
        0.0, ge=0, le=1, description="share of a gap's width under the verges of the gables beside it"
    )

    def of(self, rule: RowRule) -> RowRule:
        """The rule with these gaps."""
        return replace(
            rule, gap=self.share, gap_m=self.width_m, tree_in_gap=self.tree_share, roofed=self.roofed_share, twin=0.0, same=0.0
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class RowRule:
    """How the units of a row are drawn: widths, depths, eaves and overhangs (metres), and chances.

    Attributes
    ----------
    flat : of a row with level roofs;  twin, same : of a unit like the one before but for the façade, or altogether
    gap, tree_in_gap : of a gap after a unit, and of a tree in it;  annexe : of a low level annexe at the back
    gap_m : widths of gaps;  roofed : share of them that verges cover
    """

    width_m: tuple[float, float] = (5.0, 7.5)
    depth_m: float = 9.0
    eave_m: float = 5.6
    eave_step_m: float = 0.9
    flat: float = 0.2
    twin: float = 0.3
    same: float = 0.1
    annexe: float = 0.25
    gap: float = 0.12
    tree_in_gap: float = 0.5
    stagger_m: float = 1.4
    over_m: tuple[float, float] = (0.0, 0.6)
    gap_m: tuple[float, float] = (0.8, 2.0)
    roofed: float = 0.0


@dataclass(frozen=True, slots=True)
class _Row:
    """Units side by side: ends along u, front and back along v, whether a gap follows, and how far verges reach over gaps, (n, 2) left and right."""

    left: FloatArray
    right: FloatArray
    front: FloatArray
    back: FloatArray
    gap_after: BoolArray
    copies: BoolArray
    verge: FloatArray


def make_row(
    rng: np.random.Generator, length: float, rule: RowRule, row: int
) -> tuple[list[UnitDraft], list[GapDraft]]:
    """Units from u = 0 to u = `length`, fronts near v = 0, in the row's own frame; gaps count within the row."""
    plan = _plan(rng, length, rule)
    roof = {
        "flat": bool(rng.random() < rule.flat),
        "slope": float(np.tan(np.radians(rng.uniform(30, 46)))),
        "over": float(rng.uniform(*rule.over_m)),
    }
    level = row if rng.random() < 0.6 else -1
    units: list[UnitDraft] = []
    eave = rule.eave_m
    for i in range(len(plan.left)):
        if plan.copies[i]:
            units.append(_copy(rng, units[-1], plan, i, rule))
            continue
        if i:
            eave = float(np.clip(eave + _eave_step(rng, rule), 0.65 * rule.eave_m, 1.5 * rule.eave_m))
        unit = _unit(rng, plan, i, eave, roof, row, level)
        units.append(_with_annexe(rng, unit, plan, i) if rng.random() < rule.annexe else unit)
    return _with_pipes(rng, units), _gaps(rng, plan, rule)


def _eave_step(rng: np.random.Generator, rule: RowRule) -> float:
    return float(rng.uniform(-1, 1)) * rule.eave_step_m if rng.random() < 0.6 else 0.0


def _plan(rng: np.random.Generator, length: float, rule: RowRule) -> _Row:
    """Widths, gaps and staggers; a copy has the width, front and back of its predecessor and no gap between."""
    mean = sum(rule.width_m) / 2
    count = max(2, round(length / (mean + rule.gap * 1.4)))
    draw = rng.random(count)
    copies = (draw < rule.twin + rule.same) & (np.arange(count) > 0)
    copies[-1] = False  # the last one takes what the rounding of the others leaves
    gap = np.where(rng.random(count) < rule.gap, np.round(rng.uniform(*rule.gap_m, count), 3), 0.0)
    gap[:-1][copies[1:]] = 0.0
    gap[-1] = 0.0
    width = rng.uniform(*rule.width_m, count)
    front = np.where(rng.random(count) < 0.35, rng.uniform(0.3, 1.0, count) * rule.stagger_m, 0.0)
    depth = np.where(rng.random(count) < 0.6, rule.depth_m, rule.depth_m + rng.uniform(-1.0, 1.4, count))
    for i in np.flatnonzero(copies):
        width[i], front[i], depth[i] = width[i - 1], front[i - 1], depth[i - 1]
    width = np.round(width * (length - gap.sum()) / width.sum(), 3)
    width[-1] = length - gap.sum() - width[:-1].sum()
    right = np.round(np.cumsum(width + gap) - gap, 3)
    left = np.round(np.cumsum(width + gap) - gap - width, 3)
    touching = gap == 0
    left[1:][touching[:-1]] = right[:-1][touching[:-1]]
    return _Row(
        left,
        right,
        np.asarray(np.round(front, 3), np.float64),
        np.asarray(np.round(front + depth, 3), np.float64),
        ~touching,
        copies,
        np.round(rule.roofed / 2 * np.column_stack([np.r_[0.0, gap[:-1]], gap]), 3),
    )


def _unit(
    rng: np.random.Generator, plan: _Row, i: int, eave: float, roof: dict[str, float | bool], row: int, level: int
) -> UnitDraft:
    width, depth = float(plan.right[i] - plan.left[i]), float(plan.back[i] - plan.front[i])
    slope, over = float(roof["slope"]), float(roof["over"])
    if roof["flat"]:
        main, extras = shapes.flat_roof(roofs.rectangle(0, 0, width, depth), eave), []
    else:
        left, right = plan.verge[i].tolist()
        main = shapes.gable_roof(width, depth, eave, slope, Overhang(left, right, over, over))
        extras = roof_extras(rng, (width, depth), eave, slope)
    volumes = [shapes.moved(v, 0.0, float(plan.left[i]), float(plan.front[i])) for v in (main, *extras)]
    volumes[0] = replace(volumes[0], ring=_noded_ring(plan, i))
    if extras == [] and roof["flat"]:
        volumes[0] = shapes.flat_roof(volumes[0].ring, eave)
    shape = "terrace flat" if roof["flat"] else "terrace gable"
    return UnitDraft(shape, tuple(volumes), draw_style(rng, flat=bool(roof["flat"])), row, level)


def _with_annexe(rng: np.random.Generator, unit: UnitDraft, plan: _Row, i: int) -> UnitDraft:
    """A level annexe of one storey at the back, clear of the neighbours."""
    u_0, u_1, v = float(plan.left[i]) + 0.5, float(plan.right[i]) - 0.5, float(plan.back[i])
    width = float(rng.uniform(0.5, 1.0)) * (u_1 - u_0)
    ring = roofs.rectangle(u_0, v - 0.5, u_0 + width, v + float(rng.uniform(2.0, 3.5)))
    annexe = shapes.flat_roof(ring, float(rng.uniform(2.7, 3.3)))
    return replace(unit, volumes=(*unit.volumes, annexe))


def _copy(rng: np.random.Generator, before: UnitDraft, plan: _Row, i: int, rule: RowRule) -> UnitDraft:
    """The unit before once more: with a façade of its own, or (more seldom) with nothing of its own at all."""
    shift = float(plan.left[i] - plan.left[i - 1])
    copy = before.moved(0.0, shift, 0.0)
    volumes = (replace(copy.volumes[0], ring=_noded_ring(plan, i)), *copy.volumes[1:])
    if copy.shape == "terrace flat":
        volumes = (shapes.flat_roof(volumes[0].ring, copy.volumes[0].faces[0].height), *copy.volumes[1:])
    twin = bool(rng.random() * (rule.twin + rule.same) < rule.twin)
    style = _other_facade(rng, before.style) if twin else before.style
    return replace(copy, volumes=volumes, style=style, twin=twin)


def _other_facade(rng: np.random.Generator, style: Style) -> Style:
    """Another colour, clearly: at least 40 levels in one channel."""
    facade = draw_facade(rng)
    while max(abs(a - b) for a, b in zip(facade.tint, style.facade.tint, strict=True)) < 40:
        facade = draw_facade(rng)
    return replace(style, facade=facade)


def _noded_ring(plan: _Row, i: int) -> Ring:
    """Rectangle of unit i with the corners of both neighbours in its side walls; its first edge is the front."""
    low, high = float(plan.front[i]), float(plan.back[i])

    def between(j: int, touching: bool) -> list[float]:
        if not touching:
            return []
        return sorted(v for v in (float(plan.front[j]), float(plan.back[j])) if low < v < high)

    u_0, u_1 = float(plan.left[i]), float(plan.right[i])
    left = between(i - 1, i > 0 and not plan.gap_after[i - 1])
    right = between(i + 1, i + 1 < len(plan.left) and not plan.gap_after[i])
    side_right = [(u_1, v) for v in [low, *right, high]]
    side_left = [(u_0, v) for v in [high, *reversed(left)]]
    return ((u_0, low), *side_right, *side_left)


def _with_pipes(rng: np.random.Generator, units: list[UnitDraft]) -> list[UnitDraft]:
    """Drain pipes at two borders of three; the unit on the left of the border has it."""
    return [
        replace(u, pipes=(False, bool(not u.twin and rng.random() < 0.65))) if i + 1 < len(units) else u
        for i, u in enumerate(units)
    ]


def _gaps(rng: np.random.Generator, plan: _Row, rule: RowRule) -> list[GapDraft]:
    gaps = []
    for i in np.flatnonzero(plan.gap_after[:-1]):
        low, high = max(plan.front[i], plan.front[i + 1]), min(plan.back[i], plan.back[i + 1])
        ring = roofs.rectangle(float(plan.right[i]), float(low), float(plan.left[i + 1]), float(high))
        gaps.append(GapDraft(ring, (int(i), int(i) + 1), bool(rng.random() < rule.tree_in_gap)))
    return gaps


def add_row(
    rng: np.random.Generator, block: BlockDraft, length: float, rule: RowRule, at: tuple[float, float, float]
) -> None:
    """Put a row into a block: `at` is the turn (radians) and the place of its corner (u, v)."""
    angle, u, v = at
    first, row = len(block.units), 1 + max((d.row for d in block.units), default=-1)
    units, gaps = make_row(rng, length, rule, row)
    block.units += [d.moved(angle, u, v) for d in units]
    for gap in gaps:
        ring = shapes.moved(Volume(gap.ring, ()), angle, u, v).ring
        block.gaps.append(GapDraft(ring, (gap.between[0] + first, gap.between[1] + first), gap.tree))
        if gap.tree:
            middle = np.mean(ring, axis=0)
            top = rule.eave_m * float(rng.uniform(1.2, 1.5)) + 2.0
            block.trees.append(TreeDraft(float(middle[0]), float(middle[1]), float(rng.uniform(2.2, 3.4)), top))


def terraces_block(rng: np.random.Generator, size: tuple[float, float], gaps: RowGaps | None = None) -> BlockDraft:
    """Two rows back to back with gardens between."""
    block = BlockDraft("terraces", size)
    for turn in (0.0, np.pi):
        rule = RowRule(depth_m=float(rng.uniform(8.0, 10.0)), eave_m=float(rng.uniform(4.8, 8.5)))
        rule = rule if gaps is None else gaps.of(rule)
        length = size[0] - 3.0 - float(rng.uniform(0, 5))
        v = 1.0 + float(rng.uniform(0, 3.0))
        at = (0.0, 1.5, v) if turn == 0 else (np.pi, size[0] - 1.5, size[1] - v)
        add_row(rng, block, length, rule, at)
    for _ in range(int(rng.integers(3, 7))):
        radius = float(rng.uniform(1.4, 3.0))
        at_uv = float(rng.uniform(4, size[0] - 4)), size[1] / 2 + float(rng.uniform(-2.5, 2.5))
        block.trees.append(TreeDraft(*at_uv, radius, radius * float(rng.uniform(2.2, 3.0))))
    return block


def perimeter_block(rng: np.random.Generator, size: tuple[float, float], gaps: RowGaps | None = None) -> BlockDraft:
    """Four rows around a courtyard with a corner house at each end."""
    block = BlockDraft("perimeter", size)
    depth, eave = float(np.round(rng.uniform(10.0, 12.0), 2)), float(rng.uniform(9.0, 14.0))
    rule = RowRule(
        (8.0, 13.0), depth, eave, 1.8, flat=0.15, twin=0.25, same=0.06, annexe=0.0, gap=0.1, tree_in_gap=0.6,
        stagger_m=0.0, over_m=(0.0, 0.4),
    )  # fmt: skip
    rule = rule if gaps is None else gaps.of(rule)
    inner_u, inner_v = size[0] - 2 * depth, size[1] - 2 * depth
    sides = [(0.0, depth, 0.0), (np.pi / 2, size[0], depth), (np.pi, size[0] - depth, size[1]), (-np.pi / 2, 0.0, size[1] - depth)]  # fmt: skip
    for k, at in enumerate(sides):
        add_row(rng, block, inner_u if k % 2 == 0 else inner_v, replace(rule, depth_m=depth), at)
    for u, v in ((0.0, 0.0), (size[0] - depth, 0.0), (size[0] - depth, size[1] - depth), (0.0, size[1] - depth)):
        block.units.append(_corner_house(rng, depth, eave, (u, v)))
    block.paved.append((depth + 3, depth + 3, size[0] - depth - 3, depth + 7))
    for _ in range(int(rng.integers(2, 5))):
        radius = float(rng.uniform(2.0, 3.6))
        at_uv = float(rng.uniform(depth + 4, size[0] - depth - 4)), float(rng.uniform(depth + 4, size[1] - depth - 4))
        block.trees.append(TreeDraft(*at_uv, radius, radius * float(rng.uniform(2.4, 3.2))))
    return block


def _corner_house(rng: np.random.Generator, depth: float, eave: float, at: tuple[float, float]) -> UnitDraft:
    """A square house, higher than its neighbours, under a pyramid or a level roof."""
    height, flat = eave + float(rng.uniform(0.5, 3.0)), bool(rng.random() < 0.4)
    ring = roofs.rectangle(0, 0, depth, depth)
    volume = shapes.flat_roof(ring, height) if flat else shapes.hip_roof(depth, depth, height, 0.7, 0.0)
    name = "corner flat" if flat else "corner pyramid"
    return UnitDraft(name, (volume,), draw_style(rng, flat=flat), row=0).moved(0.0, *at)
