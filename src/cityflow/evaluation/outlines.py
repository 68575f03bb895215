"""Found outlines against true ones: completeness and correctness by number and by area, IoU, distance of the corners.

Completeness and correctness as usual for building detection: the share of the truth that was found, and the share of
the found that is true. By number, an outline counts as matched when the union of the others covers at least half of it.

An IoU of each true outline is told in two ways. `iou_each` holds it against the found ones that belong to it, so a found outline that joins two true
ones across a narrow gap halves the figure of both. `iou_joined` holds all that belongs together, on both sides, against each other: then joining costs
the area of the gap alone, and how well gaps are cut is told by `evaluation.unit_accuracy`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.arrays import BoolArray, FloatArray, IntArray

_HALF = 0.5
"""Found where at least half of it is covered: the majority."""


@dataclass(frozen=True, slots=True)
class OutlineAccuracy:
    """How well found outlines agree with true ones.

    Attributes
    ----------
    found, true : numbers of outlines over the minimum area
    completeness, correctness : by number, 0 to 1
    completeness_area, correctness_area : by area, of all outlines, 0 to 1
    iou : area of the intersection of both unions over the area of their union
    iou_weighted : mean over the true outlines over the minimum area of each one's IoU, weighted by its area
    iou_each : (true,) IoU of each true outline over the minimum area with the union of the found ones that touch it by
        more than half of the smaller; 0 where there is none
    iou_joined : (true,) likewise, of the union of all true ones with the union of all found ones that hang together so
    boundary_m : median distance of points along the found boundaries of matched outlines from the true boundary
    corner_median_m, corner_mean_m : distance of each true corner of a matched outline from the nearest found one
    missed, wrong : positions of the unmatched in the sequences given
    """

    found: int
    true: int
    completeness: float
    correctness: float
    completeness_area: float
    correctness_area: float
    iou: float
    iou_weighted: float
    iou_each: FloatArray
    iou_joined: FloatArray
    boundary_m: float
    corner_median_m: float
    corner_mean_m: float
    missed: tuple[int, ...]
    wrong: tuple[int, ...]

    @property
    def iou_mean(self) -> float:
        """Of `iou_each`."""
        return float(self.iou_each.mean()) if len(self.iou_each) else float("nan")

    @property
    def iou_joined_mean(self) -> float:
        """Of `iou_joined`."""
        return float(self.iou_joined.mean()) if len(self.iou_joined) else float("nan")


def compare_outlines(
    found: Sequence[Polygon],
    true: Sequence[Polygon],
    minimum_area_m2: float = 25.0,
    window: BaseGeometry | None = None,
) -> OutlineAccuracy:
    """Accuracy of found outlines, inside `window` where one is given.

    Parameters
    ----------
    found, true : valid polygons, metres
    minimum_area_m2 : smaller ones are not counted; they take part in unions and areas
    window : outlines are cut by it first; of the found only what lies inside is judged
    """
    f, t = _cut(found, window), _cut(true, window)
    f_union, t_union = shapely.union_all(f), shapely.union_all(t)
    common = shapely.area(shapely.intersection(f_union, t_union))
    f_large, t_large = shapely.area(f) > minimum_area_m2, shapely.area(t) > minimum_area_m2
    f_matched, t_matched = _covered_share(f, t_union) >= _HALF, _covered_share(t, f_union) >= _HALF
    pairs = _belonging(t[t_large], f)
    iou_each = _iou_each(t[t_large], f, pairs)
    boundary, corners = _deviations(f[f_large & f_matched], t[t_large & t_matched])
    return OutlineAccuracy(
        found=int(f_large.sum()),
        true=int(t_large.sum()),
        completeness=_share(t_matched[t_large]),
        correctness=_share(f_matched[f_large]),
        completeness_area=_ratio(common, shapely.area(t_union)),
        correctness_area=_ratio(common, shapely.area(f_union)),
        iou=_ratio(common, shapely.area(shapely.union(f_union, t_union))),
        iou_weighted=_ratio(float(iou_each @ shapely.area(t[t_large])), float(shapely.area(t[t_large]).sum())),
        iou_each=iou_each,
        iou_joined=_iou_joined(t[t_large], f, pairs),
        boundary_m=_median(boundary),
        corner_median_m=_median(corners),
        corner_mean_m=float(corners.mean()) if len(corners) else float("nan"),
        missed=tuple(np.flatnonzero(t_large & ~t_matched).tolist()),
        wrong=tuple(np.flatnonzero(f_large & ~f_matched).tolist()),
    )


def united_by_adjacency(polygons: Sequence[Polygon], gap_m: float = 0.05) -> list[Polygon]:
    """Outlines that touch, or nearly, as one: what a survey from above can tell apart."""
    grown = shapely.buffer(np.asarray(polygons, dtype=object), gap_m / 2, join_style="mitre")
    united = shapely.get_parts(shapely.buffer(shapely.union_all(grown), -gap_m / 2, join_style="mitre"))
    return [p for p in united if isinstance(p, Polygon) and p.area > 0]


def blocks_of(polygons: Sequence[Polygon], reach_m: float, margin_m: float) -> BaseGeometry:
    """Convex hulls, widened by `margin_m`, of clusters of outlines nearer than `reach_m` to each other."""
    every = np.asarray(polygons, dtype=object)
    clusters = shapely.get_parts(shapely.union_all(shapely.buffer(every, reach_m / 2)))
    hulls = [
        shapely.convex_hull(shapely.union_all(every[shapely.intersects(cluster, every)])).buffer(margin_m)
        for cluster in clusters
    ]
    return shapely.union_all(hulls)


def _cut(polygons: Sequence[Polygon], window: BaseGeometry | None) -> np.ndarray:
    """Same length as the input; what lies wholly outside becomes empty."""
    every = np.array(list(polygons), dtype=object)
    return every if window is None or not len(every) else np.asarray(shapely.intersection(every, window))


def _covered_share(polygons: np.ndarray, cover: BaseGeometry) -> FloatArray:
    area = shapely.area(polygons)
    return np.asarray(shapely.area(shapely.intersection(polygons, cover)) / np.where(area > 0, area, np.inf))


def _belonging(true: np.ndarray, found: np.ndarray) -> tuple[IntArray, IntArray]:
    """Pairs of outlines that share more than half of the smaller, ordered by the true one."""
    t, f = shapely.STRtree(found).query(true, predicate="intersects")
    common = shapely.area(shapely.intersection(true[t], found[f]))
    belongs = common > _HALF * np.minimum(shapely.area(true[t]), shapely.area(found[f]))
    order = np.lexsort((f[belongs], t[belongs]))
    return t[belongs][order].astype(np.int64), f[belongs][order].astype(np.int64)


def _iou_each(true: np.ndarray, found: np.ndarray, pairs: tuple[IntArray, IntArray]) -> FloatArray:
    result = np.zeros(len(true))
    for index in np.unique(pairs[0]):
        result[index] = _iou(true[index], shapely.union_all(found[pairs[1][pairs[0] == index]]))
    return result


def _iou_joined(true: np.ndarray, found: np.ndarray, pairs: tuple[IntArray, IntArray]) -> FloatArray:
    size = len(true) + len(found)
    linked = coo_array((np.ones(len(pairs[0])), (pairs[0], pairs[1] + len(true))), shape=(size, size))
    _, label = connected_components(linked, directed=False)
    result, of_true, of_found = np.zeros(len(true)), label[: len(true)], label[len(true) :]
    for group in np.unique(of_true[pairs[0]]):
        mine = of_true == group
        result[mine] = _iou(shapely.union_all(true[mine]), shapely.union_all(found[of_found == group]))
    return result


def _iou(a: BaseGeometry, b: BaseGeometry) -> float:
    return float(shapely.intersection(a, b).area / shapely.union(a, b).area)


def _deviations(found: np.ndarray, true: np.ndarray) -> tuple[FloatArray, FloatArray]:
    """Distances (m) of points every half metre of the found boundaries, and of the true corners to found ones."""
    if not len(found) or not len(true):
        return np.empty(0), np.empty(0)
    along = shapely.get_coordinates(shapely.segmentize(shapely.boundary(found), 0.5))
    boundary = shapely.distance(shapely.points(along), shapely.union_all(shapely.boundary(true)))
    corners = shapely.points(corners_of(true))
    return np.asarray(boundary), np.asarray(shapely.distance(corners, shapely.multipoints(corners_of(found))))


def corners_of(polygons: np.ndarray) -> FloatArray:
    """(n, 2) vertices where the boundary of the polygons turns by more than 20°."""
    thin = shapely.simplify(polygons, 0.05)
    rings, _ = shapely.get_rings(thin, return_index=True)
    kept = [xy[_turns(xy)] for xy in (shapely.get_coordinates(ring)[:-1] for ring in rings)]
    return np.concatenate(kept) if kept else np.empty((0, 2))


def _turns(xy: FloatArray) -> BoolArray:
    ahead = np.roll(xy, -1, axis=0) - xy
    behind = np.roll(ahead, 1, axis=0)
    cross = behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0]
    return np.asarray(np.abs(np.arctan2(cross, (ahead * behind).sum(axis=1))) > np.radians(20))


def _share(flags: BoolArray) -> float:
    return float(flags.mean()) if len(flags) else float("nan")


def _ratio(part: float, whole: float) -> float:
    return float(part / whole) if whole > 0 else float("nan")


def _median(values: FloatArray) -> float:
    return float(np.median(values)) if len(values) else float("nan")
