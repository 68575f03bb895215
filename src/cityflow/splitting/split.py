"""A complex of houses becomes single units (Dahlke 2017 §2, §4): gaps first, then the terraces between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from pydantic import Field
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.parameters import Parameters
from cityflow.core.splitting import SURFACE, CutLine, Segments, SplitEvidence, Splitting, joined_segments
from cityflow.splitting.borders.possible_borders import possible_borders
from cityflow.splitting.cuts.cut_chords import line_at, off_corners, turned
from cityflow.splitting.directions.principal import (
    Principal,
    filtered,
    orientation_at,
    principal_directions,
)
from cityflow.splitting.lidar_surface import from_points
from cityflow.splitting.partition import partition
from cityflow.splitting.segments.segments import find_segments
from cityflow.splitting.strips.axis_strips import AxisStrip, axis_strips, is_round
from cityflow.splitting.strips.gap_strips import GapStrip, find_gaps
from cityflow.splitting.strips.slices import points_on_segments
from cityflow.splitting.strips.strip_evidence import look_at_strip
from cityflow.splitting.strips.strip_rasters import Cells, facade_cells, roof_raster

SAME_LINE_M = 1.2
"""Lines of neighbouring strips whose middles are nearer are the same border."""
ONE_CUT_M = 0.5
"""What is narrower is no gap."""
SHORTEST_CHAIN_M = 4.5
MOST_TURN_DEG = 8.0
"""Orientations farther apart have strips of their own."""
GAP_CONFIDENCE = 0.5
"""A gap of less is none."""
SLICE_CELLS, WIDEST_SLICE_M = 2.0, 0.4
"""Width and step of slices, cells of the nadir rasters and at most metres."""
UNCROSSED_M = 2.0
"""A unit is looked at by itself where so far around each place of the smallest unit no chord has crossed it."""


class SplitParameters(Parameters):
    """How outlines are split."""

    threshold: float = Field(0.5, ge=0, le=1, description="confidence from which a cut is accepted")
    minimum_area_m2: float = Field(10.0, gt=0, le=1000, description="no unit is smaller, m²")
    minimum_area_lidar_m2: float = Field(
        20.0,
        gt=0,
        le=1000,
        description="no unit that only LiDAR shows is smaller, m²: it does not tell garages from extensions",
    )

    def where(self, pictures: bool) -> SplitParameters:
        """With the smallest unit that pictures, or points alone, can show."""
        least = max(self.minimum_area_m2, self.minimum_area_lidar_m2)
        return self if pictures else self.model_copy(update={"minimum_area_m2": least})


@dataclass(frozen=True, slots=True)
class _Seen:
    """What is found once for an outline: all segments, its principal directions, cells of the oblique frames."""

    segments: Segments
    principal: Principal
    cells: list[Cells]


def split(evidence: SplitEvidence, parameters: SplitParameters) -> Splitting:
    """Split one outline; whatever its shape, there is a result.

    Parameters
    ----------
    evidence : rasters of every look direction over the outline, the nadir first
    """
    parameters = parameters.where(any(f.ortho is not None for f in evidence.frames))
    reason = _unsplittable(evidence, parameters)
    if reason:
        return Splitting((evidence.outline,), reason=reason)
    evidence = replace(evidence, frames=(from_points(evidence), *evidence.frames[1:]))
    segments = find_segments(evidence)
    principal = principal_directions(segments)
    seen = _Seen(segments, principal, facade_cells(evidence.frames[1:]))
    step = slice_step(evidence)
    gaps, gap_lines = _gaps(evidence, seen, step)
    accepted_gaps = [g for g, a in zip(gaps, gap_lines, strict=True) if a[0].confidence >= GAP_CONFIDENCE]
    parts = _parts(evidence.outline, accepted_gaps)
    found = _once([c for part in parts for c in _terraces(evidence, part, seen, parameters, step)])
    found = _corners(evidence, found, accepted_gaps, seen, parameters, step)
    return _splitting(evidence, accepted_gaps, gap_lines, found, principal, parameters)


def slice_step(evidence: SplitEvidence) -> float:
    """Width of a slice, metres."""
    return float(min(SLICE_CELLS * evidence.gsd_m, WIDEST_SLICE_M))


def _unsplittable(evidence: SplitEvidence, parameters: SplitParameters) -> str:
    outline = evidence.outline
    if outline.is_empty or not outline.is_valid:
        return "the outline is not valid"
    if outline.area < 2 * parameters.minimum_area_m2:
        return f"{outline.area:.1f} m² are too few for two units of {parameters.minimum_area_m2:g} m²"
    if not evidence.frames:
        return "no rasters"
    if is_round(outline):
        return "a round building has no cut lines"
    return ""


def _aspects(principal: Principal) -> list[float]:
    return [a.degrees for a in principal.aspects]


def _strips(part: Polygon, principal: Principal, step: float) -> tuple[AxisStrip, ...]:
    return axis_strips(part, _aspects(principal), step, SHORTEST_CHAIN_M)


def _gaps(evidence: SplitEvidence, seen: _Seen, step: float) -> tuple[list[Polygon], list[tuple[CutLine, CutLine]]]:
    """Every gap as a polygon, with its two border lines."""
    polygons, lines = [], []
    for strip in _strips(evidence.outline, seen.principal, step):
        roof = roof_raster(strip, evidence.outline, evidence.frames[0])
        for gap in find_gaps(roof, evidence.ground_height, strip.depth, leaves=evidence.frames[0].ortho is not None):
            if gap.width < ONE_CUT_M:  # both of its borders are one cut, which the terraces show
                continue
            pair = _gap_lines(strip, evidence.outline, gap, _sigma(strip, seen.principal))
            if pair is not None:
                a, b = (shapely.get_coordinates(c.line) for c in pair)
                polygons.append(Polygon(np.concatenate([a, b[::-1]])))
                lines.append(pair)
    return polygons, lines


def _gap_lines(strip: AxisStrip, outline: Polygon, gap: GapStrip, sigma: float) -> tuple[CutLine, CutLine] | None:
    found = []
    for u in (gap.u_0, gap.u_1):
        line = line_at(strip, outline, u)
        if line is None:
            return None
        found.append(CutLine(line, "gap", gap_m=gap.width, confidence=gap.confidence, angle_sigma_deg=sigma))
    return found[0], found[1]


def _sigma(strip: AxisStrip, principal: Principal) -> float:
    near = [a.sigma for a in principal.aspects if abs((a.degrees - strip.aspect_deg + 90) % 180 - 90) < 1e-3]
    return float(near[0]) if near else float("nan")


def _parts(outline: Polygon, gaps: Sequence[Polygon]) -> list[Polygon]:
    """What the gaps leave, without slivers."""
    if not gaps:
        return [outline]
    left = shapely.difference(outline, shapely.buffer(shapely.union_all(list(gaps)), 0.02, join_style="mitre"))
    return [p for p in shapely.get_parts(left) if isinstance(p, Polygon) and p.area > 1.0] or [outline]


def _terraces(
    evidence: SplitEvidence, part: Polygon, seen: _Seen, parameters: SplitParameters, step: float
) -> list[CutLine]:
    """Possible borders in a part between gaps, by the directions of that part."""
    if part.area < 2 * parameters.minimum_area_m2:
        return []
    inside = _within(seen.segments, part)
    principal = principal_directions(inside)
    if not principal.aspects:
        principal = seen.principal
    kept = filtered(inside, principal) if principal.aspects else inside
    points = points_on_segments(joined_segments([kept, _walls(evidence, kept.frames)], kept.frames), evidence.gsd_m)
    found = []
    for strip in _strips(part, principal, step):
        found += possible_borders(
            look_at_strip(strip, part, evidence, points, seen.cells), part, _sigma(strip, principal)
        )
    return [_as_its_part(c, part, inside, principal) for c in found]


def _as_its_part(cut: CutLine, part: Polygon, segments: Segments, principal: Principal) -> CutLine:
    """A border in the direction of the houses beside it, where a complex has orientations a few degrees apart (Dahlke 2017 §3)."""
    line = cut.line
    if len(set(principal.orientation)) < 2:
        return cut
    middle = shapely.get_coordinates(shapely.line_interpolate_point(line, 0.5, normalized=True))[0]
    here = principal.aspects_of(orientation_at(segments, principal, middle, line.length))
    start, end = shapely.get_coordinates(line)[[0, -1]]
    now = float(np.degrees(np.arctan2(end[1] - start[1], end[0] - start[0])))
    turns = [((a.degrees - now + 90) % 180 - 90, a) for a in here]
    angle, aspect = min(turns, key=lambda t: abs(t[0]), default=(np.inf, None))
    if aspect is None or abs(angle) > MOST_TURN_DEG:
        return cut
    return replace(cut, line=turned(line, aspect.degrees, part), angle_sigma_deg=aspect.sigma)


def _walls(evidence: SplitEvidence, frames: tuple[str, ...]) -> Segments:
    """Walls that rise above lower roofs, as level segments: in a slice along one they count as what lies on the roof."""
    ends = [shapely.get_coordinates(e.line)[[0, -1]] for e in evidence.inner_edges if e.line.length > 0]
    xy = np.array(ends, np.float64).reshape(-1, 2, 2)
    xyz = np.concatenate([xy, np.full((len(xy), 2, 1), evidence.ground_height)], axis=2)
    n = len(xyz)
    return Segments(xyz[:, 0], xyz[:, 1], np.zeros(n, np.int64), np.full(n, SURFACE, np.uint8), frames)


def _corners(
    evidence: SplitEvidence,
    found: list[CutLine],
    gaps: list[Polygon],
    seen: _Seen,
    parameters: SplitParameters,
    step: float,
) -> list[CutLine]:
    """Also borders that end at others: within units that no axis strip of the whole has crossed, corners of a ring above all; then within their parts."""
    strips = [p for part in _parts(evidence.outline, gaps) for p in _strips(part, seen.principal, step)]
    covered, least = shapely.union_all([p.area() for p in strips]), parameters.minimum_area_m2
    looked: list[Polygon] = []
    while lines := [off_corners(c.line, evidence.outline) for c in found if c.confidence >= parameters.threshold]:
        units = partition(evidence.outline, lines, gaps, least).units
        open_ = [u for u in units if u.area >= 2 * least and _holds_a_unit(u.difference(covered), least)]
        new = [u for u in open_ if all(u.symmetric_difference(o).area > least for o in looked)]
        if not new:
            break
        looked += new
        found = _once([*found, *(c for u in new for c in _terraces(evidence, u, seen, parameters, step))])
    return found


def _holds_a_unit(left: BaseGeometry, least_m2: float) -> bool:
    """Whether a part of what no chord has crossed is wide enough for one more unit."""
    wide = shapely.buffer(left, -UNCROSSED_M, join_style="mitre")
    return bool((shapely.area(shapely.get_parts(wide)) > least_m2).any())


def _within(segments: Segments, part: Polygon) -> Segments:
    middle = (segments.start + segments.end)[:, :2] / 2
    near = shapely.buffer(part, 1.0, join_style="mitre")
    return segments.take(np.asarray(shapely.contains_xy(near, middle[:, 0], middle[:, 1])))


def _once(found: Sequence[CutLine]) -> list[CutLine]:
    """Strongest first, without lines that another strip has found too."""
    kept: list[CutLine] = []
    for c in sorted(found, key=lambda c: (-c.confidence, *shapely.get_coordinates(c.line)[0])):
        middle = shapely.line_interpolate_point(c.line, 0.5, normalized=True)
        if all(middle.distance(k.line) > SAME_LINE_M for k in kept):
            kept.append(c)
    return kept


def _splitting(
    evidence: SplitEvidence,
    polygons: list[Polygon],
    pairs: list[tuple[CutLine, CutLine]],
    found: Sequence[CutLine],
    principal: Principal,
    parameters: SplitParameters,
) -> Splitting:
    good = [c for c in found if c.confidence >= parameters.threshold]
    lines = [off_corners(c.line, evidence.outline) for c in good]
    result = partition(evidence.outline, lines, polygons, parameters.minimum_area_m2)
    kept_pairs = [p for p in pairs if p[0].confidence >= GAP_CONFIDENCE]
    unused = {i for i, _ in result.gaps_dropped}
    used_gaps = [c for i, p in enumerate(kept_pairs) if i not in unused for c in p]
    rejected = [c for i, p in enumerate(kept_pairs) if i in unused for c in p]
    rejected += [c for p in pairs if p[0].confidence < GAP_CONFIDENCE for c in p]
    used = set(result.used)
    rejected += [c for i, c in enumerate(good) if i not in used]
    rejected += [c for c in found if c.confidence < parameters.threshold]
    accepted = [good[i] for i in result.used]
    return Splitting(
        result.units,
        (*accepted, *used_gaps),
        tuple(rejected),
        principal.aspects,
        principal.slopes,
        "" if len(result.units) > 1 else _why_whole(found, principal),
        (("candidates", float(len(found))), ("gaps", float(len(used_gaps) // 2))),
    )


def _why_whole(found: Sequence[CutLine], principal: Principal) -> str:
    if not principal.aspects:
        return "no main directions"
    return "no border has enough evidence" if found else "no evidence of a border"
