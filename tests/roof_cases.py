"""Roofs with known truth: regions of the plan, the plane over each, and points drawn from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
import shapely.affinity
from shapely import Polygon, box

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron, Semantic
from cityflow.reconstruction.planes.plane_segments import PlaneSegments

ORIGIN = (85000.0, 447000.0, 0.0)

Plane = tuple[float, float, float]


@dataclass(frozen=True)
class RoofCase:
    """Outline in local xy, and for each plane (a, b, c) the region that it roofs."""

    outline: Polygon
    regions: tuple[tuple[Polygon, Plane], ...]

    def heights(self, x: FloatArray, y: FloatArray) -> FloatArray:
        z = np.full(len(x), np.nan)
        for region, (a, b, c) in self.regions:
            inside = shapely.intersects_xy(region, x, y) & np.isnan(z)
            z[inside] = a * x[inside] + b * y[inside] + c
        return z

    def volume(self, floor: float) -> float:
        return float(sum(_integral(region, plane) - floor * region.area for region, plane in self.regions))

    def segments(self, seed: int = 0, density: float = 15.0, noise: float = 0.02, gap: float = 0.0) -> PlaneSegments:
        """Labelled points; those within `gap` of a border between regions are on no plane."""
        rng = np.random.default_rng(seed)
        x0, y0, x1, y1 = self.outline.bounds
        xy = rng.uniform((x0, y0), (x1, y1), (round((x1 - x0) * (y1 - y0) * density), 2))
        xy = xy[shapely.contains_xy(self.outline, xy[:, 0], xy[:, 1])]
        planes = np.array(list(dict.fromkeys(plane for _, plane in self.regions)))
        labels = np.full(len(xy), -1)
        for region, plane in self.regions:
            inner = region.buffer(-gap) if gap else region
            labels[shapely.contains_xy(inner, xy[:, 0], xy[:, 1])] = planes.tolist().index(list(plane))
        z = self.heights(xy[:, 0], xy[:, 1]) + rng.normal(0, noise, len(xy))
        kept = np.isfinite(z)
        points = np.column_stack([xy, z])[kept]
        return PlaneSegments(ORIGIN, points, labels[kept], planes, np.full(len(planes), noise), noise)


def _integral(region: Polygon, plane: Plane) -> float:
    c = region.centroid
    return float((plane[0] * c.x + plane[1] * c.y + plane[2]) * region.area)


def lowest_of(outline: Polygon, planes: Sequence[Plane]) -> RoofCase:
    """A case whose roof is the lowest of its planes everywhere (hips and gables)."""
    regions = []
    for i, (a, b, c) in enumerate(planes):
        region = outline
        for j, (d, e, f) in enumerate(planes):
            if i != j:
                region = region & _half_plane(d - a, e - b, c - f)
        if not region.is_empty and region.area > 1e-6:
            regions.append((region, (a, b, c)))
    return RoofCase(outline, tuple(regions))


def _half_plane(nx: float, ny: float, least: float) -> Polygon:
    """Where nx·x + ny·y >= least, as a large polygon."""
    length = np.hypot(nx, ny)
    n, t = np.array([nx, ny]) / length, np.array([-ny, nx]) / length
    foot = n * least / length
    return Polygon([foot + 500 * t, foot - 500 * t, foot - 500 * t + 500 * n, foot + 500 * t + 500 * n])


def _placed(regions: Sequence[tuple[Polygon, Plane]]) -> tuple[tuple[Polygon, Plane], ...]:
    """Later regions lie over earlier ones."""
    cut = []
    for k, (region, plane) in enumerate(regions):
        for over, _ in regions[k + 1 :]:
            region = region - over
        cut.append((region, plane))
    parts = [(part, plane) for region, plane in cut for part in shapely.get_parts(region)]
    return tuple((part, plane) for part, plane in parts if part.area > 1e-9)


def _both(outline: Polygon, *cases: RoofCase) -> RoofCase:
    return RoofCase(outline, _placed([pair for case in cases for pair in case.regions]))


def _gable(x0: float, y0: float, x1: float, y1: float, eave: float, along: str = "x") -> RoofCase:
    slope = 0.8
    if along == "x":
        planes: list[Plane] = [(0.0, slope, eave - slope * y0), (0.0, -slope, eave + slope * y1)]
    else:
        planes = [(slope, 0.0, eave - slope * x0), (-slope, 0.0, eave + slope * x1)]
    return lowest_of(box(x0, y0, x1, y1), planes)


def roof_cases() -> Mapping[str, RoofCase]:
    s, house = 0.8, box(0, 0, 12, 8)
    hip = [(0.0, s, 5.0), (0.0, -s, 5 + 8 * s), (s, 0.0, 5.0), (-s, 0.0, 5 + 12 * s)]
    ell = Polygon([(0, 0), (14, 0), (14, 7), (7, 7), (7, 13), (0, 13)])
    tee = Polygon([(0, 0), (18, 0), (18, 8), (12, 8), (12, 14), (6, 14), (6, 8), (0, 8)])
    court = Polygon(box(0, 0, 20, 16).exterior.coords, [box(6, 6, 14, 10).exterior.coords[::-1]])
    ring = [(0.0, s, 4.0), (0.0, -s, 4 + 16 * s), (s, 0.0, 4.0), (-s, 0.0, 4 + 20 * s)]
    inner = [(0.0, -s, 4 + 6 * s), (0.0, s, 4 - 10 * s), (-s, 0.0, 4 + 6 * s), (s, 0.0, 4 - 14 * s)]
    steep = [(0.0, 2.0, 5.0), (0.0, 0.3, 7.55), (0.0, -0.3, 7.55 + 2.4), (0.0, -2.0, 21.0)]
    turned = shapely.affinity.rotate(house, 33, origin=(0, 0))
    c, d = np.cos(np.radians(33)), np.sin(np.radians(33))
    turned_planes = [(float(-s * d), float(s * c), 5.0), (float(s * d), float(-s * c), 5 + 8 * s)]
    return {
        "flat": RoofCase(house, ((house, (0.0, 0.0, 6.0)),)),
        "shed": RoofCase(house, ((house, (0.0, 0.3, 5.0)),)),
        "gable": _gable(0, 0, 12, 8, 5.0),
        "gable turned": lowest_of(turned, turned_planes),
        "hip": lowest_of(house, hip),
        "pyramid": lowest_of(box(0, 0, 8, 8), [hip[0], hip[1], hip[2], (-s, 0.0, 5 + 8 * s)]),
        "mansard": lowest_of(house, steep),
        "step": RoofCase(house, _placed([(house, (0.0, 0.0, 5.0)), (box(5, 0, 12, 8), (0.0, 0.0, 8.0))])),
        "corner step": RoofCase(house, _placed([(house, (0.0, 0.0, 5.0)), (box(5, 3, 12, 8), (0.0, 0.0, 8.0))])),
        "tower": RoofCase(house, _placed([(house, (0.0, 0.0, 5.0)), (box(4, 2, 8, 6), (0.0, 0.0, 9.0))])),
        "checkerboard": RoofCase(
            house,
            tuple(
                (box(x0, y0, x1, y1), (0.0, 0.0, z))
                for x0, y0, x1, y1, z in [(0, 0, 6, 4, 5.0), (6, 4, 12, 8, 5.0), (6, 0, 12, 4, 8.0), (0, 4, 6, 8, 8.0)]
            ),
        ),
        "gable beside flat": _both(
            box(0, 0, 16, 8), _gable(0, 0, 12, 8, 5.0), RoofCase(house, ((box(12, 0, 16, 8), (0.0, 0.0, 3.0)),))
        ),
        "gables at two heights": _both(box(0, 0, 20, 8), _gable(0, 0, 10, 8, 5.0), _gable(10, 0, 20, 8, 6.5)),
        "gables crosswise": _both(box(0, 0, 18, 8), _gable(0, 0, 12, 8, 5.0), _gable(12, 0, 18, 8, 5.0, along="y")),
        "dormer": _both(house, _gable(0, 0, 12, 8, 5.0), RoofCase(house, ((box(4, 1, 7, 3), (0.0, 0.1, 7.5)),))),
        "ell": _ell(ell, s),
        "tee": _tee(tee, s),
        "courtyard": _courtyard(court, ring, inner),
    }


def _ell(outline: Polygon, s: float) -> RoofCase:
    """Two gables of one height that meet in a valley and a hip."""
    east, north = [(0.0, s, 4.0), (0.0, -s, 4 + 7 * s)], [(s, 0.0, 4.0), (-s, 0.0, 4 + 7 * s)]
    below = _half_plane(1.0, -1.0, 0.0)  # x >= y
    regions = []
    for plane, side in [(east[0], below), (north[0], _half_plane(-1.0, 1.0, 0.0))]:
        band = box(0, 0, 14, 3.5) if plane is east[0] else box(0, 0, 3.5, 13)
        regions.append((outline & band & side, plane))
    regions.append((outline & box(3.5, 3.5, 14, 7) & below, east[1]))
    regions.append((outline & box(3.5, 3.5, 7, 13) & _half_plane(-1.0, 1.0, 0.0), north[1]))
    return RoofCase(outline, tuple(regions))


def _tee(outline: Polygon, s: float) -> RoofCase:
    """A gable with a lower gable running into its side."""
    main = [(0.0, s, 4.0), (0.0, -s, 4 + 8 * s)]
    wing = [(s, 0.0, 4 - 6 * s), (-s, 0.0, 4 + 12 * s)]
    left = Polygon([(6, 8), (9, 5), (9, 14), (6, 14)])
    right = Polygon([(12, 8), (12, 14), (9, 14), (9, 5)])
    back = box(0, 4, 18, 8) - left - right
    return RoofCase(outline, ((box(0, 0, 18, 4), main[0]), (back, main[1]), (left, wing[0]), (right, wing[1])))


def _courtyard(outline: Polygon, outer: Sequence[Plane], inner: Sequence[Plane]) -> RoofCase:
    """A hipped ring of roofs around a courtyard: lowest of eight planes on each side of the ridge."""
    sides = [
        (Polygon([(0, 0), (20, 0), (14, 6), (6, 6)]), outer[0], inner[0]),
        (Polygon([(20, 16), (0, 16), (6, 10), (14, 10)]), outer[1], inner[1]),
        (Polygon([(0, 16), (0, 0), (6, 6), (6, 10)]), outer[2], inner[2]),
        (Polygon([(20, 0), (20, 16), (14, 10), (14, 6)]), outer[3], inner[3]),
    ]
    regions = []
    for side, low_plane, high_plane in sides:
        for mine, other in ((low_plane, high_plane), (high_plane, low_plane)):
            half = _half_plane(other[0] - mine[0], other[1] - mine[1], mine[2] - other[2])
            regions.append((outline & side & half, mine))
    return RoofCase(outline, tuple(regions))


def lattice(outline: Polygon, step: float = 0.25, margin: float = 0.15) -> tuple[FloatArray, FloatArray]:
    """Positions inside an outline, away from its border."""
    x0, y0, x1, y1 = outline.bounds
    x, y = (g.ravel() for g in np.meshgrid(np.arange(x0, x1, step) + 0.111, np.arange(y0, y1, step) + 0.077))
    inside = shapely.contains_xy(outline.buffer(-margin), x, y)
    return x[inside], y[inside]


def top_heights(solid: Polyhedron, x: FloatArray, y: FloatArray) -> FloatArray:
    """World heights of the topmost roof face at world x, y; NaN off the roof."""
    z = np.full(len(x), -np.inf)
    for face in solid.of_semantic(Semantic.ROOF):
        rings = [solid.ring(ring) for ring in face.rings]
        inside = shapely.intersects_xy(Polygon(rings[0][:, :2], [r[:, :2] for r in rings[1:]]), x, y)
        centre = rings[0].mean(axis=0)
        offsets = rings[0] - centre
        a, b = np.linalg.lstsq(offsets[:, :2], offsets[:, 2], rcond=None)[0]
        here = a * (x - centre[0]) + b * (y - centre[1]) + centre[2]
        z[inside] = np.maximum(z[inside], here[inside])
    return np.where(np.isinf(z), np.nan, z)


def edges_are_matched(solid: Polyhedron) -> bool:
    """True where every edge is used exactly twice, in opposite directions."""
    edges = [e for f in solid.faces for ring in f.rings for e in zip(ring, [*ring[1:], ring[0]], strict=True)]
    return len(set(edges)) == len(edges) and {(b, a) for a, b in edges} == set(edges)
