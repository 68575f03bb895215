"""Points of depth maps without refuted ones, for all stages that read points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray
from cityflow.core.depth_map import DepthMap, ImagePoints, joined, points_of
from cityflow.core.grid import Bounds, bounds_meet
from cityflow.flow.store import Store
from cityflow.flow.typed import TaskInputs
from cityflow.handover.depth_map_files import decode_depth_map
from cityflow.handover.field_types import OrientedField
from cityflow.handover.vote_files import decode_votes
from cityflow.surface.witnesses import Witness, WitnessParameters, without_refuted, words_for

VERSION = 2
"""Of what is refuted; a change of how the votes are read is one of the stages that read them."""
POINTS_KEPT = 15_000_000
"""Of some 40 bytes each."""

Place = Callable[[FloatArray], BoolArray]
"""Which of (N, 3) world points are wanted."""


@dataclass(frozen=True, slots=True)
class DepthInputs(TaskInputs):
    """Depth maps that a task compares with each other.

    Attributes
    ----------
    maps : RUN-relative paths, sorted by flight tile
    references : the images that they are of
    bands : of the images
    witnesses : what refutes a depth
    """

    maps: tuple[str, ...]
    references: tuple[OrientedField, ...]
    bands: int
    witnesses: WitnessParameters


@dataclass(frozen=True, slots=True)
class CheckedInputs(TaskInputs):
    """Depth maps that others have compared.

    Attributes
    ----------
    maps : RUN-relative paths, sorted by flight tile;  votes : for each of them, that of the votes over its ground tile
    missing : ground tiles whose depths could not be compared: nothing is read of them
    references, bands : as in `DepthInputs`
    """

    maps: tuple[str, ...]
    votes: tuple[str, ...]
    missing: tuple[str, ...]
    references: tuple[OrientedField, ...]
    bands: int


class PointReader:
    """Points of depth maps within bounds, in a fixed order; as many maps are kept as memory allows.

    Parameters
    ----------
    maps : names of the depth maps
    points : reads those of a map that can be wanted at all
    bands : of the images
    """

    def __init__(self, maps: Sequence[str], points: Callable[[str], ImagePoints], bands: int) -> None:
        self._maps, self._read, self._bands = maps, points, bands
        self._kept: dict[str, ImagePoints] = {}
        self._extent: dict[str, Bounds] = {}

    def __call__(self, bounds: Bounds) -> ImagePoints:
        parts = []
        for name in self._maps:
            if name in self._extent and not bounds_meet(self._extent[name], bounds):
                continue
            parts.append(_standing(self._points(name), partial(within, bounds=bounds)))
        return joined(parts, self._bands)

    def _points(self, name: str) -> ImagePoints:
        if name in self._kept:
            return self._kept[name]
        points = self._read(name)
        self._extent[name] = _extent(points)
        if sum(len(p) for p in self._kept.values()) + len(points) <= POINTS_KEPT:
            self._kept[name] = points
        return points


class Compared(NamedTuple):
    """Depth maps that were compared.

    Attributes
    ----------
    points : reads those that are not refuted
    votes : path of a depth map → image and votes for its depths, (h, w) uint8; 0 where they are refuted, unknown, or stand elsewhere
    """

    points: PointReader
    votes: dict[str, tuple[str, ByteArray]]


def compared(store: Store, given: DepthInputs, around: Bounds) -> Compared:
    """Compare depth maps with each other; nothing that stands beyond `around` is ever asked for."""
    images = {image.name: image for image in given.references}
    parts: dict[str, list[DepthMap]] = {}
    maps: dict[str, DepthMap] = {}
    for path in given.maps:
        maps[path] = found = decode_depth_map(store.read_bytes(path), colour=False)
        parts.setdefault(found.image, []).append(found)
    witnesses = [Witness.of(images[n], parts[n]) for n in sorted(parts)]
    words = words_for(witnesses, around, given.witnesses)
    votes = {path: (m.image, words[m.image].over(m)) for path, m in maps.items()}
    inside = partial(within, bounds=around)

    def read(path: str) -> ImagePoints:
        depth_map = without_refuted(decode_depth_map(store.read_bytes(path)), votes[path][1])
        return _standing(points_of(depth_map, images[depth_map.image]), inside)

    # most maps of tiles farther off are witnesses only
    wanted = [path for path in given.maps if votes[path][1].any()]
    return Compared(PointReader(wanted, read, given.bands), votes)


def checked_points(store: Store, given: CheckedInputs, inside: Place) -> PointReader:
    """The points that stand in a place, of depth maps whose votes others have left."""
    images = {image.name: image for image in given.references}
    paths = dict(zip(given.maps, given.votes, strict=True))
    votes = {path: decode_votes(store.read_bytes(path), images) for path in dict.fromkeys(given.votes)}

    def read(path: str) -> ImagePoints:
        depth_map = decode_depth_map(store.read_bytes(path))
        kept = without_refuted(depth_map, votes[paths[path]][depth_map.image])
        return _standing(points_of(kept, images[depth_map.image]), inside)

    return PointReader(given.maps, read, given.bands)


def within(xyz: FloatArray, bounds: Bounds) -> BoolArray:
    """(N,) which points stand in `bounds`, half-open."""
    x, y = xyz[:, 0], xyz[:, 1]
    return np.asarray((x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3]))


def _standing(points: ImagePoints, inside: Place) -> ImagePoints:
    here = inside(points.xyz)
    return points if here.all() else points.take(here)


def _extent(points: ImagePoints) -> Bounds:
    if not len(points):
        return np.inf, np.inf, -np.inf, -np.inf
    x, y = points.xyz[:, 0], points.xyz[:, 1]
    return float(x.min()), float(y.min()), float(x.max()), float(y.max())
