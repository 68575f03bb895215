"""Rows of houses with known borders: every trace is found where it is, and what only looks like one is not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import shapely
from shapely import LineString, Polygon, box

from cityflow.core.arrays import FloatArray
from cityflow.core.building import OutlineEdge
from cityflow.core.splitting import CutLine, SplitEvidence, Splitting
from cityflow.splitting.split import SplitParameters, split
from splitting.row_scene import House, row_evidence

RED, SLATE, BROWN = (150, 80, 60), (80, 84, 92), (110, 90, 75)
SAND, WHITE, BRICK = (205, 190, 160), (235, 232, 225), (150, 84, 66)


def _splitting(evidence: SplitEvidence) -> Splitting:
    return split(evidence, SplitParameters())


def _off(cuts: tuple[CutLine, ...], true: FloatArray) -> FloatArray:
    """Of each true border the distance of the nearest cut's ends, metres."""
    lines = shapely.multilinestrings([c.line for c in cuts]) if cuts else LineString()
    ends = shapely.points(true.reshape(-1, 2))
    off = np.nan_to_num(shapely.distance(ends, lines), nan=99.0)
    return np.asarray(off.reshape(-1, 2).max(axis=1), np.float64)


def _angles(cuts: tuple[CutLine, ...], true: FloatArray) -> FloatArray:
    wanted = true[0, 1] - true[0, 0]
    d = np.array([np.subtract(*shapely.get_coordinates(c.line)[[-1, 0]]) for c in cuts])
    turn = np.degrees(np.arctan2(d[:, 1], d[:, 0]) - np.arctan2(wanted[1], wanted[0]))
    return np.asarray(np.abs((turn + 90) % 180 - 90), np.float64)


TRACES = {
    "roof colour": [House(), House(roof=SLATE), House(roof=BROWN), House()],
    "height": [House(eave=6.0), House(eave=6.5), House(eave=5.9), House(eave=6.4)],
    "facades alone": [House(), House(facade=BRICK), House(facade=WHITE), House(facade=BRICK)],
    "all, and dormers": [House(dormer=True), House(5.2, 6.6, SLATE, BRICK), House(7.1, 6.0, RED, WHITE, True)],
}


@cache
def _row(trace: str) -> tuple[SplitEvidence, FloatArray]:
    return row_evidence(TRACES[trace])


@cache
def _split_row(trace: str) -> Splitting:
    return _splitting(_row(trace)[0])


@pytest.mark.parametrize("trace", TRACES)
def test_every_trace_is_found_in_its_place(trace: str) -> None:
    houses, (evidence, true), found = TRACES[trace], _row(trace), _split_row(trace)
    assert len(found.cut_lines) == len(true)
    assert _off(found.cut_lines, true).max() < 0.2
    assert _angles(found.cut_lines, true).max() < 0.5
    assert len(found.units) == len(houses)
    assert sum(u.area for u in found.units) == pytest.approx(evidence.outline.area, rel=1e-4)
    assert not found.reason


@pytest.mark.parametrize("angle", [-3.0, 2.5])
def test_each_part_of_a_bent_row_is_cut_in_its_own_direction(angle: float) -> None:
    """Dahlke 2017 §3: orientations two or three degrees apart in one complex."""
    houses = [House(), House(roof=SLATE), House(roof=BROWN), House(roof=SLATE), House(), House(roof=BROWN)]
    evidence, true = row_evidence(houses, bend=(2, angle))
    found = _splitting(evidence)
    assert len(found.cut_lines) == len(true)
    assert _off(found.cut_lines, true).max() < 0.3
    middles = np.array([shapely.get_coordinates(c.line).mean(axis=0) for c in found.cut_lines])
    for k in (0, 1, 3, 4):
        nearest = int(np.argmin(np.linalg.norm(middles - true[k].mean(axis=0), axis=1)))
        assert _angles((found.cut_lines[nearest],), true[k : k + 1]).max() < 0.5


def test_height_steps_are_measured() -> None:
    found = _split_row("height")
    steps = sorted(c.height_step_m for c in found.cut_lines)
    assert steps == pytest.approx([0.5, 0.5, 0.6], abs=0.08)


def test_houses_that_are_the_same_stay_one() -> None:
    """Windows, dormers and the ridge are no borders."""
    found = _splitting(row_evidence([House(dormer=True)] * 4)[0])
    assert found.cut_lines == ()
    assert len(found.units) == 1
    assert found.reason


def test_shadow_over_roof_and_ground_is_no_border() -> None:
    found = _splitting(row_evidence([House()] * 3, shadow=9.0)[0])
    assert found.cut_lines == ()


def test_step_of_storeys_within_one_building_is_no_border() -> None:
    """A block of level parts in the same colours is one building; with colours of its own each part is a house."""
    same = [House(9, 6.0), House(9, 9.2)]
    own = [House(9, 6.0), House(9, 9.2, SLATE, BRICK)]
    assert len(_splitting(row_evidence(same)[0]).units) == 1
    assert len(_splitting(row_evidence(own)[0]).units) == 2


def test_gap_under_a_tree_has_two_borders() -> None:
    houses = [House(), House(roof=SLATE, facade=BRICK), House(facade=WHITE), House(roof=BROWN)]
    evidence, true = row_evidence(houses, tree_gap=(1, 1.5))
    found = _splitting(evidence)
    gaps = [c for c in found.cut_lines if c.kind == "gap"]
    assert len(gaps) == 2
    assert gaps[0].gap_m == pytest.approx(1.5, abs=0.25)
    assert evidence.outline.area - sum(u.area for u in found.units) == pytest.approx(1.5 * 9.0, abs=2.5)
    cuts = tuple(c for c in found.cut_lines if c.kind == "cut")
    assert len(cuts) == len(true)
    assert _off(cuts, true).max() < 0.2


def test_lidar_alone_shows_steps() -> None:
    evidence, true = _row("height")
    nadir = replace(evidence.frames[0], ortho=None, seen=None)
    found = _splitting(replace(evidence, frames=(nadir,)))
    assert len(found.cut_lines) == len(true)
    assert _off(found.cut_lines, true).max() < 0.3


def test_inner_wall_adds_to_the_evidence() -> None:
    """A step too slight to be believed alone becomes likelier where a wall was found along it."""
    evidence, true = row_evidence([House(eave=6.0), House(eave=6.06)])
    wall = OutlineEdge(LineString(true[0]), "wall", 0.05, 1.0)

    def likeliest(e: SplitEvidence) -> float:
        found = _splitting(e)
        return max((c.confidence for c in (*found.cut_lines, *found.rejected)), default=0.0)

    assert likeliest(replace(evidence, inner_edges=(wall,))) > likeliest(evidence)


def test_threshold_moves_cuts_to_the_rejected() -> None:
    evidence, _ = _row("facades alone")
    strict = split(evidence, SplitParameters(threshold=1.0))
    assert strict.cut_lines == ()
    assert len(strict.rejected) >= 3
    assert all(0 <= c.confidence < 1 for c in strict.rejected)


@pytest.mark.parametrize("seed", range(3))
def test_accidents_of_the_outline_change_no_line(seed: int) -> None:
    """Bumps and notches half a metre deep, slanting bits of four metres, all along the outline; the surfaces are the same."""
    evidence, true = _row("all, and dormers")
    ring, rng = evidence.outline.exterior, np.random.default_rng(seed)
    ragged = evidence.outline
    for at in np.arange(2.0, ring.length - 5.0, 6.0):
        a, b = (np.array(ring.interpolate(at + d).coords[0]) for d in np.sort(rng.uniform(0.0, 4.0, 2)))
        off = 0.5 * np.array([b[1] - a[1], a[0] - b[0]]) / max(float(np.hypot(*(b - a))), 1e-9)
        bit = Polygon([a - off, b - off, b + off, a + off] if rng.random() < 0.5 else [a - off, b, b + off, a])
        ragged = ragged.union(bit) if rng.random() < 0.5 else ragged.difference(bit)
    found = _splitting(replace(evidence, outline=max(shapely.get_parts(ragged), key=lambda p: p.area)))
    assert len(found.cut_lines) == len(true)
    assert _off(found.cut_lines, true).max() < 0.8
    assert min(c.confidence for c in found.cut_lines) > 0.8


def test_the_same_evidence_gives_the_same_lines() -> None:
    trace = "all, and dormers"
    first, second = _split_row(trace), _splitting(_row(trace)[0])
    lines = [[(c.line.wkb, c.confidence) for c in (*s.cut_lines, *s.rejected)] for s in (first, second)]
    assert lines[0] == lines[1]
    assert [u.wkb for u in first.units] == [u.wkb for u in second.units]


def _without_surface(evidence: SplitEvidence) -> SplitEvidence:
    frames = tuple(
        replace(f, dsm=np.full_like(f.dsm, np.nan), seen=np.zeros(f.grid.shape, bool)) for f in evidence.frames
    )
    return replace(evidence, frames=frames)


@pytest.mark.parametrize(
    "outline",
    [box(0, 0, 3, 3), box(0, 0, 5, 3.8), shapely.Point(0, 0).buffer(9)],
    ids=["below 10 m²", "below twice 10 m²", "round"],
)
def test_what_cannot_be_split_stays_whole_for_a_reason(outline: Polygon) -> None:
    evidence, _ = row_evidence([House(), House(roof=SLATE)])
    x, y = evidence.outline.centroid.coords[0]
    moved = shapely.affinity.translate(outline, x, y)
    found = _splitting(replace(evidence, outline=moved))
    assert found.units == (moved,)
    assert found.reason


def test_points_alone_show_no_garages() -> None:
    assert SplitParameters().where(True).minimum_area_m2 == 10.0
    assert SplitParameters().where(False).minimum_area_m2 == 20.0
    assert SplitParameters(minimum_area_m2=30.0).where(False).minimum_area_m2 == 30.0


def test_nothing_known_over_the_outline() -> None:
    evidence, _ = row_evidence([House(), House(roof=SLATE)])
    found = _splitting(_without_surface(evidence))
    assert len(found.units) == 1
    assert found.cut_lines == ()
    assert found.reason
