"""Roof surfaces of a unit: surfaces of cubes, each point then on the surface that fits it best.

Cubes tell which surfaces there are, but they straddle ridges and steps. The points near them choose their surface anew,
with the same energy as in the orientation histogram's method; surfaces that turn out equal become one and are fitted
again, and the points that are left are searched once more.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from pydantic import Field

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Evidence
from cityflow.reconstruction.noise.cubes import cut_in_cubes
from cityflow.reconstruction.noise.voxel_filter import VoxelFilterParameters, filter_noise
from cityflow.reconstruction.planes.level_regions import level_regions
from cityflow.reconstruction.planes.local_orientation import local_orientation
from cityflow.reconstruction.planes.plane_labels import LabelEnergy, label_energy, relabel
from cityflow.reconstruction.planes.plane_segments import UNASSIGNED, PlaneSegments
from cityflow.reconstruction.planes.roof_cloud import RoofCloud, local_origin, roof_cloud
from cityflow.reconstruction.volumetric_parts.blur import without_ramps, without_strips
from cityflow.reconstruction.volumetric_parts.cube_regions import cube_regions

CUBE_POINTS = 12.0
"""Points that 3×3 cubes of a level roof should hold: four times those of a plane; set by hand."""
RAMP_WIDTH = 1.2
"""Narrower (m) steep surfaces between a higher and a lower one are the blur of a step; set by hand, as is the next."""
RAMP_SLOPE_DEG = 40.0
"""What is steep there, degrees."""


class SurfaceParameters(Parameters):
    """How surfaces are found in cubes; thresholds follow from density and noise of the points."""

    noise: VoxelFilterParameters = VoxelFilterParameters()
    target_density_m2: float = Field(16.0, gt=0, le=1000, description="denser clouds are thinned to so many points/m²")
    angle_deg: float = Field(
        25.0, gt=0, le=60, description="normals of one surface's cubes agree within this (degrees)"
    )
    max_slope_deg: float = Field(76.0, gt=45, lt=89, description="steeper surfaces (degrees) are walls")
    unevenness: float = Field(0.04, ge=0, le=0.5, description="how far a real roof departs from a plane (sigma, m)")
    min_area_m2: float = Field(2.0, gt=0, le=100, description="smallest roof surface")
    min_points: int = Field(6, ge=4, le=1000, description="fewest points of a surface")
    min_width: float = Field(0.5, ge=0, le=5, description="narrower surfaces (m) are ledges, gutters or edges")
    smoothness: float = Field(2.0, ge=0, le=20, description="cost of a point among points of another surface (3σ: 4.5)")
    max_surfaces: int = Field(200, ge=1, le=1000, description="most roof surfaces of one unit")
    party_strip: float = Field(
        0.9, ge=0, le=5, description="surfaces that reach no farther (m) from a party wall are the blur of its step"
    )
    rounds: int = Field(6, ge=1, le=50, description="most rounds of labelling and fitting")


def roof_surfaces(evidence: Evidence, parameters: SurfaceParameters) -> tuple[PlaneSegments, float]:
    """Roof surfaces, those with most points first, and the share of points that were noise."""
    origin = local_origin(evidence)
    local = evidence.points.xyz - np.asarray(origin)
    local = local[np.all(np.isfinite(local), axis=1)]
    before = max(len(local), 1)
    if len(local) > 4 * parameters.min_points:
        local = local[filter_noise(local, parameters.noise).keep]
    cloud = roof_cloud(local, parameters.target_density_m2, CUBE_POINTS)
    noise = local_orientation(cloud, math.tan(math.radians(parameters.max_slope_deg))).noise
    energy = label_energy(cloud.density, noise, parameters)
    labels, planes = _labelled(cloud, energy, parameters)
    points = cloud.points
    if evidence.party and parameters.party_strip > 0:
        party = shapely.transform(shapely.union_all(list(evidence.party)), lambda xy: xy - np.asarray(origin[:2]))
        points, labels, planes = without_strips(points, labels, planes, party, parameters.party_strip)
    stays, labels, planes = without_ramps(points, labels, planes, RAMP_WIDTH, RAMP_SLOPE_DEG)
    points, labels = points[stays], labels[stays]
    return PlaneSegments.largest_first(origin, points, labels, planes, noise), 1.0 - len(local) / before


def _labelled(cloud: RoofCloud, energy: LabelEnergy, parameters: SurfaceParameters) -> tuple[IntArray, FloatArray]:
    """Surfaces of all points; surfaces of the points left over, in smaller cubes; levels of those left then."""
    labels, planes = np.full(len(cloud.points), UNASSIGNED), np.empty((0, 3))
    for attempt in range(4):
        left = np.flatnonzero(labels == UNASSIGNED)
        if len(left) < energy.min_points:
            break
        if attempt < 3:
            found, more = _in_cubes(cloud.points[left], cloud.cell * (1.0, 2.5, 0.75)[attempt], energy, parameters)
        else:
            found, more = level_regions(
                cloud, labels == UNASSIGNED, 2.0 * energy.sigma, energy.min_points, parameters.max_surfaces
            )
            found = found[left]
        if len(more) == 0:
            continue
        labels = labels.copy()
        labels[left] = np.where(found >= 0, found + len(planes), UNASSIGNED)
        planes = np.concatenate([planes, more])[: parameters.max_surfaces]
        labels[labels >= len(planes)] = UNASSIGNED
        labels, planes = relabel(cloud, labels, planes, energy, parameters.rounds)
    return labels, planes


def _in_cubes(
    points: FloatArray, edge: float, energy: LabelEnergy, parameters: SurfaceParameters
) -> tuple[IntArray, FloatArray]:
    """Surface of each point by its cube, and planes z = a·x + b·y + c, of those that are no walls."""
    cubes = cut_in_cubes(points, edge)
    regions = cube_regions(cubes, energy.sigma, parameters.angle_deg, energy.min_points)
    normal = regions.planes[:, :3]
    roofs = np.flatnonzero(normal[:, 2] > math.cos(math.atan(energy.max_slope)))
    number = np.full(len(regions) + 1, UNASSIGNED)
    number[roofs] = np.arange(len(roofs))
    slope = -normal[roofs, :2] / normal[roofs, 2:]
    centre = regions.planes[roofs, 3:6] + cubes.corner
    height = centre[:, 2] - np.sum(slope * centre[:, :2], axis=1)
    return number[regions.point_labels()], np.column_stack([slope, height])
