"""Roof planes from the histogram of local orientations (Gross 2005, section 3), and a building from these planes.

The local gradients of the height surface are collected in a histogram of directions, weighted by their magnitude. Its
hills are the orientations of the roof; connected points of one hill that lie on one plane are a roof surface. Level
points, whose gradient has no direction, are a class of their own. The planes are fitted in iterations with a noise
threshold. Beyond the paper, the points then choose among the planes near them (`plane_labels`), which recovers points at
ridges and joins what was split, and the points left over are searched again for smaller surfaces.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from pydantic import Field

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Scalar, Status
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.reconstruction.partition.cut_lines import main_directions
from cityflow.reconstruction.partition.plane_energy import PartitionParameters
from cityflow.reconstruction.partition.second_look import Patch
from cityflow.reconstruction.planes.level_regions import level_regions
from cityflow.reconstruction.planes.local_orientation import LocalOrientation, local_orientation
from cityflow.reconstruction.planes.orientation_regions import (
    RegionRule,
    Weighting,
    connected_regions,
    orientation_buckets,
    seed_order,
)
from cityflow.reconstruction.planes.plane_labels import LabelEnergy, label_energy, relabel
from cityflow.reconstruction.planes.plane_segments import UNASSIGNED, PlaneSegments
from cityflow.reconstruction.planes.prior_directions import with_prior
from cityflow.reconstruction.planes.raised_parts import raised_parts
from cityflow.reconstruction.planes.roof_cloud import RoofCloud, local_origin, roof_cloud
from cityflow.reconstruction.planes.waves import without_waves
from cityflow.reconstruction.solids.levels import block_levels
from cityflow.reconstruction.solids.roof_solid import Raised, RoofSolid, build_roof

METHOD = "orientation_histogram"
MOST_NAMED = 5


class OrientationHistogramParameters(Parameters):
    """How roof planes are found; thresholds follow from density and noise of the points."""

    target_density_m2: float = Field(
        16.0, gt=0, le=1000, description="denser clouds are thinned to so many points per m²"
    )
    neighbourhood_points: float = Field(12.0, ge=6, le=200, description="typical number of points in 3×3 cells")
    bin_deg: float = Field(5.0, ge=1, le=30, description="width of a bin of the histogram (degrees)")
    histogram: Weighting = Field(
        "gradient", description="weight of a point in the histogram: gradient, count; off: no histogram at all"
    )
    level_slope_deg: float = Field(4.0, ge=0, le=20, description="flatter points (degrees) have no direction")
    max_slope_deg: float = Field(72.0, gt=45, lt=90, description="steeper surfaces (degrees) are walls")
    angle_deg: float = Field(20.0, gt=0, le=60, description="local planes of one surface agree within this (degrees)")
    unevenness: float = Field(
        0.06, ge=0, le=0.5, description="how far a real roof surface departs from a plane (sigma, m)"
    )
    min_area_m2: float = Field(1.5, gt=0, le=100, description="smallest surface worth a plane")
    min_points: int = Field(6, ge=4, le=1000, description="fewest points of a plane")
    min_width: float = Field(0.5, ge=0, le=5, description="narrower surfaces (m) are ledges, gutters or edges")
    smoothness: float = Field(
        2.0, ge=0, le=20, description="cost of a point among points of another plane (3σ miss: 4.5)"
    )
    max_planes: int = Field(100, ge=1, le=1000, description="most planes of one unit")
    prior: bool = Field(
        False, description="planes near a principal direction or slope of the evidence take it as one more observation"
    )
    rounds: int = Field(6, ge=1, le=50, description="most rounds of labelling and fitting")
    partition: PartitionParameters = PartitionParameters()


def reconstruct(evidence: Evidence, parameters: OrientationHistogramParameters) -> Candidate:
    """The method: planes, partition of the outline, closed solid. No solid where no plane is found."""
    segments = _found_planes(evidence, parameters)
    if len(segments) == 0:
        return Candidate(METHOD, None, status=Status.FAILED, reason=f"no roof plane in {len(evidence.points)} points")
    found = len(segments)
    roof = _roof_of(segments, evidence, parameters.partition)
    segments = roof.segments
    blocks = block_levels(
        roof.partition,
        segments.coefficients,
        evidence.ground_height,
        segments.origin,
        evidence.outline,
    )
    notes = {
        "planes_found": found,
        "cells": len(roof.partition.cells),
        "times_simplified": roof.simplified,
        "noise": round(segments.noise, 4),
        "points_used": len(segments.points),
        "share_on_planes": round(float(np.mean(segments.labels >= 0)), 4),
        **_named(roof.missed),
    }
    status, reason = Status.DONE, ""
    if roof.simplified:
        status, reason = Status.DEGRADED, f"roof simplified {roof.simplified} times until the solid was valid"
    elif found >= parameters.max_planes:
        status = Status.DEGRADED
        reason = f"{found} planes found, the largest number allowed; {len(segments)} used"
    return Candidate(METHOD, roof.solid, segments.roof_planes(), blocks, status, reason, notes)


def _named(missed: tuple[Patch, ...]) -> dict[str, Scalar]:
    """What was found and got no face: how many patches, how many points, and where their heights lie against the roof's."""
    if not missed:
        return {}
    told = ", ".join(f"{len(p.xy)} points {p.above:+.1f} m" for p in missed[:MOST_NAMED])
    return {
        "missed_patches": len(missed),
        "missed_points": sum(len(p.xy) for p in missed),
        "missed": told + (", …" if len(missed) > MOST_NAMED else ""),
    }


def simpler(full: OrientationHistogramParameters) -> Iterator[OrientationHistogramParameters]:
    """Parameters for simpler roofs: larger surfaces only, fewer planes, edges that must be worth more."""
    for area, most, edge in ((2.0, 20, 2.0), (4.0, 8, 4.0), (8.0, 3, 8.0)):
        partition = full.partition.model_copy(
            update={
                "edge_cost": full.partition.edge_cost * edge,
                "min_width": full.partition.min_width * edge,
                "max_lines": min(full.partition.max_lines, 4 * most),
            }
        )
        update = {
            "min_area_m2": full.min_area_m2 * area,
            "max_planes": min(full.max_planes, most),
            "partition": partition,
        }
        yield full.model_copy(update=update)


def find_planes(evidence: Evidence, parameters: OrientationHistogramParameters) -> PlaneSegments:
    """Roof planes of one unit, those with most points first; of a matched surface without those that follow its waves."""
    found = _found_planes(evidence, parameters)
    return without_waves(found) if evidence.matched else found


def _roof_of(segments: PlaneSegments, evidence: Evidence, parameters: PartitionParameters) -> RoofSolid:
    """On a matched surface parts that stand on planes are sought as a whole; where no valid solid comes of them the roof is of planes alone."""
    outline, floor = evidence.outline, evidence.ground_height
    if evidence.matched:
        segments = without_waves(segments)
        bare, parts = raised_parts(segments, main_directions(outline)[0])
        if parts:
            roof = build_roof(outline, bare, floor, parameters, Raised(segments.points, parts))
            if not roof.faults:
                return roof
    return build_roof(outline, segments, floor, parameters)


def _found_planes(evidence: Evidence, parameters: OrientationHistogramParameters) -> PlaneSegments:
    origin = local_origin(evidence)
    local = evidence.points.xyz - np.asarray(origin)
    local = local[np.all(np.isfinite(local), axis=1)]
    cloud = roof_cloud(local, parameters.target_density_m2, parameters.neighbourhood_points)
    surface = local_orientation(cloud, math.tan(math.radians(parameters.max_slope_deg)))
    energy = label_energy(cloud.density, surface.noise, parameters)
    labels, planes = _surfaces(cloud, surface, energy, parameters)
    if parameters.prior and (evidence.aspects or evidence.slopes):
        planes = with_prior(cloud.points, labels, planes, evidence.aspects, evidence.slopes)
    return PlaneSegments.largest_first(origin, cloud.points, labels, planes, surface.noise)


def _surfaces(
    cloud: RoofCloud, surface: LocalOrientation, energy: LabelEnergy, parameters: OrientationHistogramParameters
) -> tuple[IntArray, FloatArray]:
    """Regions of all points, labels; regions of the points left over, labels; levels of those left then, and labels."""
    labels, planes = np.full(len(cloud.points), UNASSIGNED), np.empty((0, 3))
    for search in (_regions, _regions, _levels):
        found, more = search(cloud, surface, labels == UNASSIGNED, energy, parameters)
        if len(more) == 0:
            continue
        labels = np.where(found >= 0, found + len(planes), labels)
        planes = np.concatenate([planes, more])[: parameters.max_planes]
        labels[labels >= len(planes)] = UNASSIGNED
        labels, planes = relabel(cloud, labels, planes, energy, parameters.rounds)
    return labels, planes


def _levels(
    cloud: RoofCloud,
    _: LocalOrientation,
    left: IntArray,
    energy: LabelEnergy,
    parameters: OrientationHistogramParameters,
) -> tuple[IntArray, FloatArray]:
    return level_regions(cloud, left, 2.0 * energy.sigma, energy.min_points, parameters.max_planes)


def _regions(
    cloud: RoofCloud,
    surface: LocalOrientation,
    left: IntArray,
    energy: LabelEnergy,
    parameters: OrientationHistogramParameters,
) -> tuple[IntArray, FloatArray]:
    """Connected regions of like orientation among the points that are left."""
    index = np.flatnonzero(left)
    if len(index) < energy.min_points:
        return np.full(len(left), UNASSIGNED), np.empty((0, 3))
    part = cloud if len(index) == len(left) else cloud.take(index)
    local = surface if part is cloud else local_orientation(part, energy.max_slope)
    slopes = (math.tan(math.radians(parameters.level_slope_deg)), energy.max_slope)
    bucket, _ = orientation_buckets(local, slopes, parameters.bin_deg, parameters.histogram)
    seeds = seed_order(local, bucket, 2.0 * energy.sigma)
    cosine = float(np.cos(math.radians(parameters.angle_deg)))
    rule = RegionRule(3.0 * energy.sigma, cosine, energy.min_points, parameters.max_planes)
    regions, planes = connected_regions(part, local, bucket, seeds, rule)
    found = np.full(len(left), UNASSIGNED)
    found[index] = regions
    return found, planes
