"""Planes and outline to a valid solid, with a simpler partition where the finest one gives none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeVar

from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.extruded import moved
from cityflow.reconstruction.partition.partition_values import RoofPartition
from cityflow.reconstruction.partition.plane_energy import PartitionParameters
from cityflow.reconstruction.partition.raised_cells import with_raised
from cityflow.reconstruction.partition.roof_partition import partition_roof
from cityflow.reconstruction.partition.second_look import Patch
from cityflow.reconstruction.planes.plane_segments import PlaneSegments
from cityflow.reconstruction.planes.raised_part import RaisedPart, with_roofs
from cityflow.reconstruction.solids.assemble import assemble

P = TypeVar("P", bound=PartitionParameters)

ATTEMPTS = 3
"""A fixed number, so that the result never depends on the clock."""


@dataclass(frozen=True, slots=True)
class RoofSolid:
    """A roof over its walls.

    Attributes
    ----------
    partition : in the segments' local frame, for block models and reports
    segments : the planes that the roof uses; the solid's and the partition's numbers are theirs
    solid : world frame
    simplified : how often the partition was made coarser to get a valid solid
    faults : codes of the rules that the last attempt still breaks; empty for a valid solid
    missed : points of found planes that lie on none of the roof's faces, patch by patch
    """

    partition: RoofPartition
    segments: PlaneSegments
    solid: Polyhedron
    simplified: int
    faults: tuple[int, ...]
    missed: tuple[Patch, ...]


class Raised(NamedTuple):
    """What stands on the planes of a roof, and (N, 3) the points with it."""

    points: FloatArray
    parts: tuple[RaisedPart, ...]


def build_roof(
    outline: Polygon,
    segments: PlaneSegments,
    floor: float,
    parameters: PartitionParameters,
    raised: Raised | None = None,
) -> RoofSolid:
    """Partition and assemble; each further attempt asks more of every edge and of every polygon's width.

    Parameters
    ----------
    outline : world coordinates; vertices are taken over bit for bit
    floor : world height of the ground face, metres
    raised : parts that were taken off the segments
    """
    local = moved(outline, -segments.origin[0], -segments.origin[1])
    for attempt in range(ATTEMPTS):
        partition, missed = partition_roof(local, segments, coarser(parameters, attempt))
        whole = segments
        if raised is not None:
            partition = with_raised(partition, segments.coefficients, raised.parts)
            whole = with_roofs(segments, *raised)
        partition, used = _of_used_planes(partition, whole)
        solid = assemble(partition, used.coefficients, floor, used.origin, outline)
        faults = tuple(sorted({fault.code for fault in check_polyhedron(solid)}))
        if not faults:
            break
    return RoofSolid(partition, used, solid, attempt, faults, tuple(missed))


def _of_used_planes(partition: RoofPartition, segments: PlaneSegments) -> tuple[RoofPartition, PlaneSegments]:
    """A partition with the numbers of the planes that it uses, and these."""
    used = sorted({cell.plane for cell in partition.cells})
    return partition.renumbered(used), segments.take(used)


def coarser(parameters: P, times: int) -> P:
    """Parameters that leave fewer and wider roof polygons.

    >>> coarser(PartitionParameters(min_width=0.4), 1).min_width
    0.8
    """
    changed = {
        "edge_cost": min(parameters.edge_cost * 3**times, 10.0),
        "min_width": min(parameters.min_width * 2**times, 5.0),
        "min_length": min(parameters.min_length * 1.5**times, 10.0),
    }
    return parameters.model_copy(update=changed)
