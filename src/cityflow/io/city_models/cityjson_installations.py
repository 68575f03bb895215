"""What is fixed to a building in CityJSON 2.0: a `BuildingInstallation` each, a child of the building."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Installation, Polyhedron
from cityflow.io.city_models.roof_plane_attributes import counted_points

Json = Any
KIND, LOD = "BuildingInstallation", "3"


def installation_objects(building: Building, add: Callable[[FloatArray], list[int]]) -> dict[str, Json]:
    """City objects by name; `add` puts (N, 3) points among the vertices of the feature and says where they are."""
    return {
        f"{building.id}-{one.kind}-{number}": {
            "type": KIND,
            "attributes": {"function": one.kind, "points": one.points},
            "parents": [building.id],
            "geometry": [_geometry(one.surfaces, add(one.surfaces.vertices))],
        }
        for number, one in enumerate(building.installations, start=1)
    }


def _geometry(surfaces: Polyhedron, index: list[int]) -> Json:
    return {
        "type": "MultiSurface",
        "lod": LOD,
        "boundaries": [[[index[i] for i in ring] for ring in face.rings] for face in surfaces.faces],
        "semantics": {
            "surfaces": [{"type": f.semantic.value} | counted_points(f.points) for f in surfaces.faces],
            "values": list(range(len(surfaces.faces))),
        },
    }


def installations_of(feature: Mapping[str, Json], polyhedron: Callable[[Json], Polyhedron]) -> tuple[Installation, ...]:
    """Those of a feature, in their order; `polyhedron` reads a geometry."""
    objects = feature["CityObjects"]
    children = (objects[name] for name in objects[feature["id"]].get("children", ()))
    return tuple(
        Installation(c["attributes"]["function"], polyhedron(c["geometry"][0]), c["attributes"]["points"])
        for c in children
        if c["type"] == KIND
    )
