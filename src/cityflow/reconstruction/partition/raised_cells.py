"""Parts that stand on a plane, cut into a finished partition of the roof."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.partition_values import RoofPartition
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.planes.raised_part import RaisedPart

INSIDE_M = 0.3
"""The plane that a part stands on is looked for so far behind its front: half of what the narrowest is deep."""


def with_raised(partition: RoofPartition, planes: FloatArray, parts: Sequence[RaisedPart]) -> RoofPartition:
    """The partition with the polygons of parts, whose planes come after `planes` (P, 3), those of the partition.

    A part ends at its sides, and where its roof meets the plane around it.
    """
    division, labels = partition.subdivision()
    number = len(planes)
    for part in parts:
        below = _below(division, labels, part)
        if below is None:
            number += len(part.roof)
            continue
        for roof, ring in zip(part.roof, part.plans(), strict=True):
            polygon = _clipped(ring, roof - planes[below])
            labels = _inset(division, labels, polygon, (below, number))
            number += 1
    division.dissolve()
    return RoofPartition.of_subdivision(division, labels)


def _below(division: Subdivision, labels: dict[int, int], part: RaisedPart) -> int | None:
    """The plane of the cell that the middle of a part's front stands on."""
    (u0, u1, front), (along, up) = part.numbers[:3], part.frame
    place = shapely.Point((u0 + u1) / 2 * along + (front + INSIDE_M) * up)
    cell = next((n for n in division.cells if division.polygon(n).contains(place)), None)
    return None if cell is None else labels[cell]


def _clipped(ring: FloatArray, above: FloatArray) -> FloatArray:
    """The part of a convex ring where a·x + b·y + c is above zero."""
    height = ring @ above[:2] + above[2]
    found: list[FloatArray] = []
    for k in range(len(ring)):
        p, q, h, i = ring[k - 1], ring[k], height[k - 1], height[k]
        if h * i < 0:
            found.append(p + h / (h - i) * (q - p))
        if i >= 0:
            found.append(q)
    return np.array(found).reshape(-1, 2)


def _inset(division: Subdivision, labels: dict[int, int], ring: FloatArray, planes: tuple[int, int]) -> dict[int, int]:
    """Labels after the cells of the first plane have been cut along a ring, with the second plane within it."""
    below, plane = planes
    if len(ring) < 3:
        return labels
    labels = dict(labels)
    for p, q in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        line = _line(p, q)
        for cell in [n for n, label in labels.items() if label == below]:
            parts = division.cut(cell, line)
            if parts != [cell]:
                labels.update(dict.fromkeys(parts, labels.pop(cell)))
    inside = shapely.Polygon(ring)
    for cell, label in labels.items():
        if label == below and inside.contains(division.polygon(cell).representative_point()):
            labels[cell] = plane
    return division.merge(labels)


def _line(p: FloatArray, q: FloatArray) -> CutLine:
    length = math.hypot(*(q - p))
    nx, ny = float((p - q)[1] / length), float((q - p)[0] / length)
    along = sorted((nx * p[1] - ny * p[0], nx * q[1] - ny * q[0]))
    return CutLine(nx, ny, float(nx * p[0] + ny * p[1]), float(along[0]), float(along[1]), length)
