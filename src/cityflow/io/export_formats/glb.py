"""``glb/TILE.glb``: a node per building for Blender, game engines and viewers, written by trimesh; pages of textures stay files beside."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from urllib.parse import quote

import numpy as np
import trimesh
from trimesh.exchange.gltf import export_glb
from trimesh.visual import ColorVisuals, TextureVisuals
from trimesh.visual.material import PBRMaterial

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building
from cityflow.io.attributes import described
from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.cityjson import Transform
from cityflow.io.city_models.gltf import TERRAIN_MATERIAL, y_up
from cityflow.io.city_models.gltf_materials import CLAMP, LINEAR, LINEAR_MIPMAPS, UNLIT
from cityflow.io.city_models.gltf_surfaces import UNTEXTURED, Surfaces, batches, surfaces_of
from cityflow.io.city_models.obj import MATERIALS
from cityflow.io.crs import vertical_datum
from cityflow.io.export_formats.formats import folder_of
from cityflow.io.export_formats.tile import CityTile, Files


def write(tile: CityTile) -> Files:
    """For `formats.written`. Metres about `origin` (extras of the scene), y up: east, north, up are x, −z, y."""
    look = Appearance(folder_of("glb"), tile.rectified, tile.drape)
    origin = Transform.over(tile.bounds)
    at = np.array([origin.x, origin.y, origin.z])
    scene = trimesh.Scene(metadata={
        "name": tile.name, "crs": tile.reference.code, "vertical_datum": vertical_datum(tile.reference), "origin": at.tolist(),
        "title": tile.title, "attribution": tile.attribution,
    })  # fmt: skip
    for building in tile.buildings:
        for part, mesh in _meshes(building, look, at):
            scene.add_geometry(mesh, node_name=part, geom_name=part)
    if len(tile.terrain[1]):
        scene.add_geometry(_terrain(tile, look, at), node_name=TERRAIN_MATERIAL, geom_name=TERRAIN_MATERIAL)
    if not scene.is_empty:
        yield f"{folder_of('glb')}/{tile.name}.glb", export_glb(scene, tree_postprocessor=_finish)


def _meshes(building: Building, look: Appearance, origin: FloatArray) -> Iterator[tuple[str, trimesh.Trimesh]]:
    """The building in a mesh for each of its materials; the first has its id for a name, and its attributes."""
    surfaces = surfaces_of([building], look)
    attributes = {"id": building.id, **described(building)}
    for number, batch in enumerate(batches(surfaces)) if len(surfaces.triangles) else ():
        mesh = trimesh.Trimesh(
            y_up(surfaces.xyz[batch.corners] - origin), batch.triangles, process=False, metadata=attributes if number == 0 else {"id": building.id}
        )  # fmt: skip
        mesh.visual = _visual(surfaces, batch.corners, batch.page, look)
        yield building.id if number == 0 else f"{building.id} {number}", mesh


def _visual(surfaces: Surfaces, corners: Any, page: int, look: Appearance) -> ColorVisuals | TextureVisuals:
    if page == UNTEXTURED:
        return ColorVisuals(vertex_colors=surfaces.colour[surfaces.face[corners]].astype(np.uint8))
    return TextureVisuals(uv=surfaces.uvd[corners, :2], material=_material(look.image(look.pages()[page])))


def _terrain(tile: CityTile, look: Appearance, origin: FloatArray) -> trimesh.Trimesh:
    vertices, triangles = tile.terrain
    mesh = trimesh.Trimesh(y_up(vertices - origin), triangles, process=False)
    if look.drape is None:
        colour = (np.array(MATERIALS[TERRAIN_MATERIAL]) * 255).round().astype(np.uint8)
        mesh.visual = ColorVisuals(vertex_colors=np.tile(colour, (len(vertices), 1)))
    else:
        mesh.visual = TextureVisuals(uv=look.drape.uv(vertices[:, :2]), material=_material(look.image(look.drape.page)))
    return mesh


def _material(image: str) -> PBRMaterial:
    """Named by its image, which `_finish` puts in; trimesh would decode it and encode it anew."""
    return PBRMaterial(name=image, metallicFactor=0.0, roughnessFactor=1.0)


def _finish(tree: dict[str, Any]) -> None:
    """Images of the materials that are named by one, beside the file; unlit, since photographs have their light already."""
    textured = [m for m in tree.get("materials", []) if "name" in m]
    tree["images"] = [{"uri": quote(m["name"]), "mimeType": _mime(m["name"])} for m in textured]
    tree["samplers"] = (
        [{"magFilter": LINEAR, "minFilter": LINEAR_MIPMAPS, "wrapS": CLAMP, "wrapT": CLAMP}] if textured else []
    )
    tree["textures"] = [{"source": i, "sampler": 0} for i in range(len(textured))]
    for number, material in enumerate(textured):
        material["pbrMetallicRoughness"] = {**material["pbrMetallicRoughness"], "baseColorTexture": {"index": number}}
        material["extensions"] = {UNLIT: {}}
    if textured:
        tree["extensionsUsed"] = sorted({*tree.get("extensionsUsed", ()), UNLIT})
    tree["asset"]["generator"] = "cityflow"
    for name in ("images", "samplers", "textures"):
        if not tree[name]:
            del tree[name]


def _mime(image: str) -> str:
    return "image/png" if image.endswith(".png") else "image/jpeg"
