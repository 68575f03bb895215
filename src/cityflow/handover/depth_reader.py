"""Points of depth maps without refuted ones, for all stages that read points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cityflow.core.depth_map import DepthMap, ImagePoints, joined, points_of
from cityflow.core.grid import Bounds, bounds_meet
from cityflow.flow.store import Store
from cityflow.flow.typed import TaskInputs
from cityflow.handover.depth_map_files import decode_depth_map
from cityflow.handover.field_types import OrientedField
from cityflow.surface.witnesses import Place, Witness, WitnessParameters, Words, without_refuted, words_for

VERSION = 2
"""Of what is refuted."""
POINTS_KEPT = 15_000_000
"""Of some 40 bytes each."""


@dataclass(frozen=True, slots=True)
class DepthInputs(TaskInputs):
    """The depth maps that a task reads.

    Attributes
    ----------
    maps : RUN-relative paths of all, sorted by flight tile;  wanted : of those whose points are wanted, the others are witnesses
    references : the images that they are of
    bands : of the images
    witnesses : what refutes a depth
    """

    maps: tuple[str, ...]
    wanted: tuple[str, ...]
    references: tuple[OrientedField, ...]
    bands: int
    witnesses: WitnessParameters


class DepthReader:
    """Points of depth maps within bounds, in a fixed order, without those that are refuted; as many maps are kept as memory allows.

    Parameters
    ----------
    around : nothing beyond is ever asked for
    place : nor what stands elsewhere; None: everywhere in `around`
    """

    def __init__(self, store: Store, given: DepthInputs, around: Bounds, place: Place | None = None) -> None:
        self._store, self._given, self._around, self._place = store, given, around, place
        self._images = {image.name: image for image in given.references}
        self._kept: dict[str, ImagePoints] = {}
        self._extent: dict[str, Bounds] = {}

    def __call__(self, bounds: Bounds) -> ImagePoints:
        parts = []
        for path in self._given.wanted:
            if path in self._extent and not bounds_meet(self._extent[path], bounds):
                continue
            points = self._points(path)
            parts.append(points.take(within(points, bounds)))
        return joined(parts, self._given.bands)

    def _points(self, path: str) -> ImagePoints:
        if path in self._kept:
            return self._kept[path]
        depth_map = without_refuted(decode_depth_map(self._store.read_bytes(path)), self._words)
        whole = points_of(depth_map, self._images[depth_map.image])
        points = whole.take(within(whole, self._around))
        self._extent[path] = _extent(points)
        if sum(len(p) for p in self._kept.values()) + len(points) <= POINTS_KEPT:
            self._kept[path] = points
        return points

    @cached_property
    def _words(self) -> dict[str, Words]:
        """Votes for each depth of the wanted images, found once from all maps."""
        parts: dict[str, list[DepthMap]] = {}
        asked, wanted = set[str](), frozenset(self._given.wanted)
        for path in self._given.maps:
            found = decode_depth_map(self._store.read_bytes(path), colour=False)
            parts.setdefault(found.image, []).append(found)
            if path in wanted:
                asked.add(found.image)
        witnesses = [Witness.of(self._images[n], parts[n]) for n in sorted(parts)]
        return words_for(witnesses, self._around, self._given.witnesses, asked, self._place)


def within(points: ImagePoints, bounds: Bounds) -> NDArray[np.bool_]:
    """Which points stand in `bounds`, half-open."""
    x, y = points.xyz[:, 0], points.xyz[:, 1]
    return np.asarray((x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3]))


def _extent(points: ImagePoints) -> Bounds:
    if not len(points):
        return np.inf, np.inf, -np.inf, -np.inf
    low, high = points.xyz.min(axis=0), points.xyz.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
