"""The textures of a tile as its exports want them: faces of the buildings on the pages of the tile's leaves, and an ortho over its terrain."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from cityflow.core.building import Building, Lod, Polyhedron, Scalar
from cityflow.core.texture import (
    BuildingTexture,
    FaceFigures,
    FaceKey,
    FaceTexture,
    PlainFace,
    Shell,
    TexturePage,
    TextureSet,
)
from cityflow.flow.workspace import Workspace
from cityflow.geometry.polyhedron import face_areas
from cityflow.handover.texture_files import Rings, faces_of, rings_of

CUT_OTHERWISE = "the face has changed since it was textured"
CUT_COLOUR = (170, 165, 158)
"""Grey of faces that were cut otherwise than their texture; set by hand."""


def texture_sets(workspace: Workspace, atlas_cells: Iterable[str], buildings: Mapping[str, Building]) -> dict[str, TextureSet]:  # fmt: skip
    """The sets ``raw`` and ``rectified``; `leaves` are paths of what the atlas tasks wrote."""
    manifests = [json.loads(workspace.read(path)) for path in atlas_cells]
    keys = {unit: faces_of(buildings[unit]) for m in manifests for unit in m["plain"] if unit in buildings}
    plain = {u: found for m in manifests for u, rows in m["plain"].items() if u in keys for found in [_plain(rows, keys[u])]}  # fmt: skip
    return {name: _set(name, manifests, keys, plain) for name in ("raw", "rectified")}


def _set(
    name: str, manifests: Sequence[Mapping[str, Any]], keys: Mapping[str, Mapping[Rings, FaceKey]],
    plain: Mapping[str, Mapping[FaceKey, PlainFace]],
) -> TextureSet:  # fmt: skip
    pages: list[TexturePage] = []
    faces: dict[str, dict[FaceKey, FaceTexture]] = {unit: {} for unit in keys}
    for manifest in manifests:
        for row in manifest["sets"][name]["faces"]:
            key = keys.get(row["unit"], {}).get(rings_of(row["rings"]))
            if key is not None:
                uvd = tuple(np.array(r, np.float64).reshape(-1, 3) for r in row["uvd"])
                faces[row["unit"]][key] = FaceTexture(len(pages) + row["page"], uvd, FaceFigures(**row["figures"]))
        pages += [TexturePage(**tree) for tree in manifest["sets"][name]["pages"]]
    buildings = {u: BuildingTexture(found, {**_left(keys[u], found), **plain[u]}) for u, found in faces.items()}
    return TextureSet(name == "rectified", tuple(pages), buildings)


def _left(keys: Mapping[Rings, FaceKey], found: Mapping[FaceKey, FaceTexture]) -> dict[FaceKey, PlainFace]:
    """Faces that a texture was wanted for, but by other vertices."""
    return {key: PlainFace(CUT_COLOUR, CUT_OTHERWISE) for key in keys.values() if key not in found}


def with_texture_figures(building: Building, texture: BuildingTexture | None, failure: str = "") -> Building:
    """Attributes: how much of roofs and walls has a texture, how fine it is, how much of it is interpolated; or why making it failed."""
    if texture is None:
        return building.with_attributes({"textured_share": 0.0, "texture_missing": failure}) if failure else building
    areas = dict(_areas(building))
    wanted = {k for k in areas if k in texture.faces or (k in texture.plain and texture.plain[k].reason)}
    total, textured = sum(areas[k] for k in wanted), sum(areas[k] for k in texture.faces)
    if not total:
        return building
    more: dict[str, Scalar] = {"textured_share": round(textured / total, 3)}
    if textured:
        parts = [(areas[k] / textured, f.figures) for k, f in texture.faces.items()]
        more["texture_gsd_m"] = round(sum(share * f.gsd_m for share, f in parts), 4)
        more["texture_interpolated"] = round(sum(share * f.interpolated for share, f in parts), 3)
    return building.with_attributes(more)


def _areas(building: Building) -> Iterable[tuple[FaceKey, float]]:
    for shell, polyhedron in _shells(building):
        for number, area in enumerate(face_areas(polyhedron).tolist()):
            yield (shell, number), area


def _shells(building: Building) -> Iterable[tuple[Shell, Polyhedron]]:
    yield "solid", building.solids[Lod.LOD22]
    if building.beyond is not None:
        yield "beyond", building.beyond


def _plain(rows: Sequence[Any], keys: Mapping[Rings, FaceKey]) -> dict[FaceKey, PlainFace]:
    found = {}
    for rings, colour, reason in rows:
        key = keys.get(rings_of(rings))
        if key is not None:
            found[key] = PlainFace((colour[0], colour[1], colour[2]), reason)
    return found
