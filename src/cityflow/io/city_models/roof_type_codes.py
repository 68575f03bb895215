"""Codes of roof types in the SIG 3D code list of CityGML; types that the list lacks are omitted."""

from __future__ import annotations

from cityflow.core.building import Building, Lod
from cityflow.core.roof_type_names import CODES
from cityflow.geometry.roof_type import roof_type

ROOF_TYPE_CODES = "https://www.sig3d.org/codelists/citygml/2.0/building/2.0/_AbstractBuilding_roofType.xml"


def roof_type_code(building: Building) -> str | None:
    """Code of the roof type in the attributes, else of the one that the solid shows; None for one without a code."""
    known = building.attributes.get("roof_type")
    if known is not None:
        return {kind.value: code for kind, code in CODES.items()}.get(str(known))
    solid = building.solids.get(Lod.LOD22)
    return None if solid is None else CODES.get(roof_type(solid, building.planes))
