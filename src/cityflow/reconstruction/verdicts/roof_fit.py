"""Distances of the points of a unit from its model, and the points that are no roof."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import Polyhedron
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.roof_distances import NEAR, roof_hits
from cityflow.reconstruction.noise.voxel_filter import LEAST_NOISE_M
from cityflow.reconstruction.planes.roof_cloud import typical_density
from cityflow.reconstruction.verdicts.no_roof import Kind, kinds_of

NO_DENSITY = 1.0
"""Points per square metre where there are none to count; set by hand."""
FROM_CLOUD = 1.4826
"""From the median of absolute deviations to the standard deviation of a normal law."""


@dataclass(frozen=True, slots=True)
class RoofFit:
    """The points of a unit against its model.

    Attributes
    ----------
    distance : (N,) above the topmost roof, metres, NaN where there is none
    face : (N,) number of the topmost roof face, -1 where there is none
    kinds : (N,) `no_roof.Kind`
    noise : metres, robust standard deviation of the points that the roof explains
    density : roof points per square metre
    """

    distance: FloatArray
    face: IntArray
    kinds: IntArray
    noise: float
    density: float

    @property
    def roof(self) -> BoolArray:
        """(N,) the points that are of the roof, or of a structure that the model lacks."""
        return np.asarray(self.kinds == Kind.ROOF)

    @property
    def explained(self) -> BoolArray:
        """(N,) the roof points within 20 cm of the model."""
        return np.asarray(self.roof & (np.abs(self.distance) <= NEAR))

    @property
    def by_chance(self) -> float:
        """Share of the points that noise alone puts more than 20 cm off a model that is right."""
        return math.erfc(NEAR / (self.noise * math.sqrt(2.0)))


def fit_of(solid: Polyhedron, evidence: Evidence) -> RoofFit:
    """Distances and kinds of all points of the unit."""
    xyz = evidence.points.xyz
    face, distance = roof_hits(solid, xyz)
    near = distance[np.abs(distance) <= NEAR]
    noise = FROM_CLOUD * float(np.median(np.abs(near - np.median(near)))) if len(near) else NEAR
    kinds = kinds_of(solid, xyz, distance, float(solid.vertices[:, 2].min()), typical_density(xyz), noise)
    density = typical_density(xyz[kinds == Kind.ROOF]) or NO_DENSITY
    return RoofFit(distance, face, kinds, max(noise, LEAST_NOISE_M), density)
