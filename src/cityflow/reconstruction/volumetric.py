"""The volumetric method (Frommholz 2017, section 3): buildings with set-backs, steps and parts that stand over a void.

Surfaces from cubes, nodes where three of them meet, edges between nodes on the same two surfaces, and a closed hull.
"""

from __future__ import annotations

from cityflow.core.building import Status
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.reconstruction.partition.roof_partition import PartitionParameters
from cityflow.reconstruction.solids.levels import LevelParameters, block_levels
from cityflow.reconstruction.solids.roof_solid import build_roof
from cityflow.reconstruction.volumetric_parts.roof_surfaces import SurfaceParameters, roof_surfaces

METHOD = "volumetric"


class VolumetricParameters(Parameters):
    """Surfaces, the complex of columns between them, and what an edge must be worth."""

    surfaces: SurfaceParameters = SurfaceParameters()
    partition: PartitionParameters = PartitionParameters()
    levels: LevelParameters = LevelParameters()


def reconstruct(evidence: Evidence, parameters: VolumetricParameters) -> Candidate:
    """The method: surfaces, nodes, edges, closed hull. No solid where no surface is found."""
    segments, noisy = roof_surfaces(evidence, parameters.surfaces)
    if len(segments) == 0:
        return Candidate(METHOD, None, status=Status.FAILED, reason=f"no roof surface in {len(evidence.points)} points")
    roof = build_roof(evidence.outline, segments, evidence.ground_height, parameters.partition)
    frame = evidence.ground_height, segments.origin, evidence.outline
    blocks = block_levels(roof.partition, segments.coefficients, *frame, parameters.levels)
    notes = {"surfaces": len(segments), "noise": round(segments.noise, 4), "share_noise": round(noisy, 4)}
    return Candidate(METHOD, roof.solid, segments.roof_planes(), blocks, notes=notes)
