"""Codes of the simple roof types in the SIG 3D code list of CityGML; anything else is left unsaid."""

from __future__ import annotations

from cityflow.core.building import Building, Lod
from cityflow.geometry.roof_type import roof_type

ROOF_TYPE_CODES = "https://www.sig3d.org/codelists/citygml/2.0/building/2.0/_AbstractBuilding_roofType.xml"
FLAT, MONOPITCH, GABLED, HIPPED = "1000", "1010", "1030", "1040"
_CODES = {"flat": FLAT, "monopitch": MONOPITCH, "gabled": GABLED, "hipped": HIPPED}


def roof_type_code(building: Building) -> str | None:
    """Code of a flat, monopitch, gabled or hipped roof; None for any other or unknown one."""
    solid = building.solids.get(Lod.LOD22)
    return None if solid is None else _CODES.get(roof_type(solid, building.planes))
