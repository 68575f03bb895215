"""The simple roof types that a few planes tell, by the SIG 3D code list of CityGML; anything else is left unsaid."""

from __future__ import annotations

import numpy as np

from cityflow.core.building import Building, Lod, RoofPlane

ROOF_TYPE_CODES = "https://www.sig3d.org/codelists/citygml/2.0/building/2.0/_AbstractBuilding_roofType.xml"
FLAT, MONOPITCH, GABLED = "1000", "1010", "1030"
FLAT_BELOW_DEG = 5.0
OPPOSITE_WITHIN_DEG = 15.0
RIDGE_WITHIN_M = 0.2


def roof_type_code(building: Building) -> str | None:
    """Code of a flat, monopitch or gabled roof; None for any other or unknown one."""
    planes = building.planes
    if not planes or Lod.LOD22 not in building.solids:
        return None
    sloped = [plane for plane in planes if plane.slope_deg >= FLAT_BELOW_DEG]
    if not sloped:
        return FLAT
    if len(planes) == 1:
        return MONOPITCH
    if len(planes) == len(sloped) == 2 and _opposite(*planes) and _meet_on_top(building):
        return GABLED
    return None


def _opposite(a: RoofPlane, b: RoofPlane) -> bool:
    turn = abs((a.aspect_deg - b.aspect_deg + 180) % 360 - 180)
    return turn >= 180 - OPPOSITE_WITHIN_DEG


def _meet_on_top(building: Building) -> bool:
    """Two opposite planes meet in a ridge, not in a valley nor at a step: they agree at the highest vertex."""
    vertices = building.solids[Lod.LOD22].vertices
    x, y, _ = vertices[np.argmax(vertices[:, 2])]
    heights = [float(plane.z(x, y)) for plane in building.planes]
    return max(heights) - min(heights) <= RIDGE_WITHIN_M
