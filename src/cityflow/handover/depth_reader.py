"""Points of depth maps without refuted ones, for all stages that read points."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray
from cityflow.core.depth_map import DepthMap, ImagePoints, joined, numbers_within, standing_points
from cityflow.core.grid import Bounds, Box, bounds_meet, grown
from cityflow.core.heap import hand_back_heap
from cityflow.core.local_frame import LocalFrame
from cityflow.flow.store import Store
from cityflow.flow.typed import TaskInputs
from cityflow.handover.depth_map_files import decode_depth_map
from cityflow.handover.field_types import OrientedField
from cityflow.handover.vote_files import decode_boxes, decode_votes
from cityflow.surface.witnesses import Window, Witness, WitnessParameters, words_for

VERSION = 3
"""Of what is refuted; a change of how the votes are read is one of the stages that read them."""
POINTS_KEPT = 15_000_000
"""Of some 40 bytes each."""
SHARED_FROM = 0.5
"""Share of the points of a reading that are kept anyway, from which it is kept in their place; bounds memory."""
NOWHERE: Bounds = (np.inf, np.inf, -np.inf, -np.inf)
ROUNDED_M = 1e-3
"""Maps are read that end so far beyond what is wanted: far more than a place is rounded by."""


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
    maps : RUN-relative paths, sorted by flight tile;  votes : for each of them, that of the votes over its ground tile;  names : its image
    missing : ground tiles whose depths could not be compared: nothing is read of them
    references, bands : as in `DepthInputs`
    """

    maps: tuple[str, ...]
    votes: tuple[str, ...]
    names: tuple[str, ...]
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
    extents : of maps where they are known, in the plan of the points; a map that does not meet the bounds is not read
    """

    def __init__(
        self, maps: Sequence[str], points: Callable[[str], ImagePoints], bands: int, extents: Mapping[str, Bounds] | None = None
    ) -> None:  # fmt: skip
        self._maps, self._read, self._bands = maps, points, bands
        self._kept: dict[str, ImagePoints] = {}
        self._extent: dict[str, Bounds] = dict(extents or {})
        self._box: dict[str, Box] = {}

    def __call__(self, bounds: Bounds) -> ImagePoints:
        parts = {name: self._standing(name, bounds) for name in self._wanted(bounds)}
        found = joined(list(parts.values()), self._bands)
        if self._share(parts, found):
            del parts
            hand_back_heap()
        return found

    def parts(self, bounds: Bounds) -> list[ImagePoints]:
        """Those of each map, at least one part; and perhaps others, which are cheaper to keep than to copy the rest."""
        return [self._points(name) for name in self._wanted(bounds)] or [joined([], self._bands)]

    def _wanted(self, bounds: Bounds) -> list[str]:
        """Maps that may have points there."""
        asked = grown(bounds, ROUNDED_M)
        return [name for name in self._maps if name not in self._extent or bounds_meet(self._extent[name], asked)]

    def _standing(self, name: str, bounds: Bounds) -> ImagePoints:
        """Points of a map in half-open bounds."""
        points = self._points(name)
        if len(points):
            x_min, y_min, _, x_max, y_max, _ = self._box[name]
            if x_min >= bounds[0] and y_min >= bounds[1] and x_max < bounds[2] and y_max < bounds[3]:
                return points
        return standing(points, bounds)

    def _share(self, parts: dict[str, ImagePoints], found: ImagePoints) -> bool:
        """Maps that are whole in what was found, which is most of it, are kept as parts of that: their points stand in memory once. Whether it was so."""
        whole = {name for name, part in parts.items() if self._kept.get(name) is part}
        if sum(len(parts[name]) for name in whole) < SHARED_FROM * len(found):
            return False
        first = 0
        for name, part in parts.items():
            if name in whole:
                self._kept[name] = _part_of(found, first, part)
            first += len(part)
        return bool(whole)

    def box(self, name: str) -> Box:
        """Of the points of a map, which has some."""
        if name not in self._box:
            self._points(name)
        return self._box[name]

    def _points(self, name: str) -> ImagePoints:
        if name in self._kept:
            return self._kept[name]
        points = self._read(name)
        if len(points):
            self._box[name] = box = points.box
            self._extent[name] = (*box[:2], *box[3:5])
        else:
            self._extent[name] = NOWHERE
        if sum(len(p) for p in self._kept.values()) + len(points) <= POINTS_KEPT:
            self._kept[name] = points
        return points


def _part_of(joined_points: ImagePoints, first: int, part: ImagePoints) -> ImagePoints:
    """A part of joined points as it was, without its own memory; the points of one image have its number, 0."""
    at, p = slice(first, first + len(part)), joined_points
    return ImagePoints(
        p.xyz[at],
        p.colour[at],
        np.broadcast_to(np.int64(0), len(part)),
        p.views[at],
        p.sigma[at],
        part.names,
        part.centres,
    )


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
    parts: dict[str, dict[str, DepthMap]] = {}
    for path in given.maps:
        found = decode_depth_map(store.read_bytes(path), colour=False)
        parts.setdefault(found.image, {})[path] = found
    witnesses, places = list[Witness](), dict[str, tuple[str, Window]]()
    for name in sorted(parts):
        of_image = parts.pop(name)
        witnesses.append(Witness.of(images[name], list(of_image.values())))
        places |= {path: (name, (m.row, m.col, *m.depth.shape)) for path, m in of_image.items()}
    words = words_for(witnesses, around, given.witnesses)
    del witnesses
    hand_back_heap()
    votes = {}
    for path in given.maps:
        name, window = places[path]
        votes[path] = name, _in_little_memory(words[name].over(window))

    def read(path: str) -> ImagePoints:
        depth_map = decode_depth_map(store.read_bytes(path))
        return standing_points(depth_map, votes[path][1], images[depth_map.image], around)

    # the others are witnesses only
    wanted = [path for path in given.maps if votes[path][1].any()]
    return Compared(PointReader(wanted, read, given.bands), votes)


def _in_little_memory(votes: ByteArray) -> ByteArray:
    """The same; most maps of tiles farther off have none."""
    return votes if votes.any() else np.broadcast_to(np.uint8(0), votes.shape)


def checked_boxes(store: Store, given: CheckedInputs) -> dict[str, Box]:
    """Path of a depth map → box of its points that are not refuted, world metres; of those that have some."""
    boxes = {path: decode_boxes(store.read_bytes(path)) for path in dict.fromkeys(given.votes)}
    places = zip(given.maps, given.votes, given.names, strict=True)
    return {path: boxes[votes][name] for path, votes, name in places if name in boxes[votes]}


def checked_points(
    store: Store, given: CheckedInputs, bounds: Bounds, frame: LocalFrame | None = None, *, colour: bool = True
) -> PointReader:
    """The points within bounds of depth maps whose votes others have left; with a frame, bounds and points are in it."""
    images, boxes = {i.name: i for i in given.references}, checked_boxes(store, given)
    extents = {path: (*b[:2], *b[3:5]) if frame is None else frame.bounds_of(b) for path, b in boxes.items()}
    wanted = grown(bounds, ROUNDED_M)
    extents = {path: extent for path, extent in extents.items() if bounds_meet(extent, wanted)}
    votes: dict[str, set[str]] = {}
    places = {m: (v, name) for m, v, name in zip(given.maps, given.votes, given.names, strict=True) if m in extents}
    for path, name in places.values():
        votes.setdefault(path, set()).add(name)
    found = {path: decode_votes(store.read_bytes(path), names) for path, names in votes.items()}

    def read(path: str) -> ImagePoints:
        depth_map, (place, name) = decode_depth_map(store.read_bytes(path), colour=colour), places[path]
        return standing_points(depth_map, found[place][name], images[name], bounds, frame)

    return PointReader(list(places), read, given.bands if colour else 0, extents)


def within(xyz: FloatArray, bounds: Bounds) -> BoolArray:
    """(N,) which points stand in `bounds`, half-open."""
    x, y = xyz[:, 0], xyz[:, 1]
    return np.asarray((x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3]))


def standing(points: ImagePoints, bounds: Bounds) -> ImagePoints:
    """Those of the points that stand in `bounds`, half-open."""
    here = numbers_within(points.xyz, bounds)
    return points if len(here) == len(points) else points.take(here)
