"""Clusters of views that look alike, and the local reference frame of each (Dahlke 2017 §1.2).

A cluster is what lies in a cone around some direction; half the allowed difference as the cone's half angle makes sure that no two of its views
differ by more. Cones are placed greedily where most views are left, so that a regular flight gives one cluster a camera head, and photographs
that look everywhere give a few full clusters and some small ones.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.local_frame import LocalFrame
from cityflow.core.parameters import Parameters

COMPASS = ("north", "northeast", "east", "southeast", "south", "southwest", "west", "northwest")
NADIR = "nadir"
ORIGIN_STEP = 1000.0
"""The origin of the local frames is a multiple of this, metres."""
BIN = 0.02
"""Edge of the cells in which unit vectors are gathered before cones are placed: 1.1°; set by hand, as are those below."""
SETTLING_STEPS = 8
"""Moves of a cone at most; it stops sooner where it holds no more than before."""

ALIKE_DEG = 20.0
"""Views of a cluster differ by no more than this: Dahlke 2017 §1.2."""
NADIR_DEG = 10.0
"""Views tilted less than this are the nadir cluster: the same cone around the vertical."""


class LookParameters(Parameters):
    """Which views look alike."""

    least_images: int = Field(5, ge=1, description="a cluster of fewer images gets no local reference frame of its own")


def look_directions(images: Sequence[OrientedImage]) -> tuple[LocalFrame, ...]:
    """Clusters of views, each image in exactly one; the nadir cluster first, then the larger ones first.

    Parameters
    ----------
    images : in any order; the result does not depend on it

    Returns
    -------
    Local frames, also of clusters that are not `worth_a_frame`. Names are unique. The nadir frame is upright; the others' y axis is the
    projection of the world's z, so that walls stand upright in a tilted ortho and x is level.
    """
    ordered = sorted(images, key=lambda image: image.name)
    if not ordered:
        return ()
    axes = np.array([image.axis for image in ordered])
    origin = _origin(np.array([image.centre for image in ordered]))
    label, centres = _cones(axes, np.radians(ALIKE_DEG / 2), np.radians(NADIR_DEG))
    clusters = [np.flatnonzero(label == k) for k in range(len(centres))]
    means = [_unit(axes[c].sum(axis=0)) if len(c) else centres[k] for k, c in enumerate(clusters)]
    order = sorted(range(1, len(centres)), key=lambda k: (-len(clusters[k]), *means[k].tolist()))
    frames, taken = [], set[str]()
    for k in [0, *order]:
        if len(clusters[k]) == 0:
            continue
        direction = np.array([0.0, 0.0, -1.0]) if k == 0 else means[k]
        name = _unique(NADIR if k == 0 else direction_name(direction), taken)
        names = tuple(ordered[i].name for i in clusters[k])
        frames.append(LocalFrame(name, frame_rotation(direction), origin, names))
    return tuple(frames)


def worth_a_frame(frame: LocalFrame, parameters: LookParameters) -> bool:
    """Whether a cluster has enough images for a surface and an ortho of its own."""
    return len(frame.images) >= parameters.least_images


def looking(frame: LocalFrame) -> FloatArray:
    """(3,) unit vector in which the local frame looks, world."""
    return np.asarray(-frame.frame_from_world[2])


def frame_rotation(direction: FloatArray) -> FloatArray:
    """(3, 3) frame_from_world: z against `direction`, y as upright as can be, x level; upright if `direction` is vertical."""
    z = -_unit(np.asarray(direction, np.float64))
    up = np.array([0.0, 0.0, 1.0]) - z[2] * z
    if np.linalg.norm(up) < 1e-6:
        up = np.array([0.0, 1.0, 0.0])
    y = _unit(up - (up @ z) * z)
    return np.array([np.cross(y, z), y, z])


def direction_name(direction: FloatArray) -> str:
    """Compass direction and tilt from nadir in degrees.

    >>> direction_name(np.array([1.0, 0.0, -1.0]))
    'east_45'
    """
    east, north, up = (float(c) for c in direction)
    tilt = np.degrees(np.arctan2(np.hypot(east, north), -up))
    octant = round(float(np.degrees(np.arctan2(east, north))) / 45.0) % 8
    return f"{COMPASS[octant]}_{round(float(tilt)):02d}"


def _unique(name: str, taken: set[str]) -> str:
    number, result = 1, name
    while result in taken:
        number += 1
        result = f"{name}_{number}"
    taken.add(result)
    return result


def _origin(centres: FloatArray) -> FloatArray:
    """A round point near the middle of the survey, at height 0."""
    middle = (centres.min(axis=0) + centres.max(axis=0)) / 2
    return np.array([*(np.round(middle[:2] / ORIGIN_STEP) * ORIGIN_STEP), 0.0])


def _cones(axes: FloatArray, half_angle: float, nadir: float) -> tuple[IntArray, list[FloatArray]]:
    """(N,) cluster of each axis, and the clusters' cones; cluster 0 is the nadir cone."""
    cones = [np.array([0.0, 0.0, -1.0])]
    within_nadir = axes @ cones[0] >= np.cos(min(nadir, half_angle))
    left = ~within_nadir
    bins, weights_of = _bins(axes)
    near = bins @ bins.T >= np.cos(half_angle)
    while left.any():
        weight = near @ np.bincount(weights_of, left, minlength=len(bins))
        # the first of the heaviest: bins are sorted by direction, so ties do not depend on the order of images
        cones.append(_settled(axes, left, bins[int(np.argmax(weight))], half_angle))
        left &= axes @ cones[-1] < np.cos(half_angle)
    closeness = axes @ np.array(cones).T
    closeness[:, 0] = np.where(within_nadir, 2.0, -2.0)
    return np.argmax(closeness, axis=1), cones


def _settled(axes: FloatArray, left: BoolArray, start: FloatArray, half_angle: float) -> FloatArray:
    """The cone moved to the mean of what it holds, as long as it then holds no less."""
    best, most, centre = start, 0, start
    for _ in range(SETTLING_STEPS):
        held = left & (axes @ centre >= np.cos(half_angle))
        if int(held.sum()) <= most:
            break
        best, most = centre, int(held.sum())
        centre = _unit(axes[held].sum(axis=0))
    if most == 0:
        return np.asarray(axes[np.flatnonzero(left)[0]])
    return best


def _bins(axes: FloatArray) -> tuple[FloatArray, IntArray]:
    """(B, 3) mean unit vectors of the occupied cells of the sphere, and (N,) the cell of each axis."""
    _, number = np.unique(np.round(axes / BIN).astype(np.int64), axis=0, return_inverse=True)
    number = number.reshape(-1)
    sums = np.column_stack([np.bincount(number, axes[:, k]) for k in range(3)])
    return sums / np.linalg.norm(sums, axis=1, keepdims=True), number


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))
