"""The textures of a tile as its exports want them: faces of the buildings on the pages of the tile's leaves, and an ortho over its terrain."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import cv2
import numpy as np
import shapely
from affine import Affine
from numpy.typing import NDArray
from rasterio.features import rasterize
from shapely import Polygon

from cityflow.core.building import Building, Face, Lod, Polyhedron, Scalar, Semantic
from cityflow.core.grid import Bounds, Grid
from cityflow.core.texture import (
    BuildingTexture,
    Drape,
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
from cityflow.io.fetch import local_file
from cityflow.io.image_write import jpeg_bytes
from cityflow.io.reference import resolve
from cityflow.io.surface_zarr import read_layers
from cityflow.stages.atlas import FOLDER
from cityflow.stages.rasters import given_colours
from cityflow.stages.survey import ZARR
from cityflow.stages.texture_files import Rings
from cityflow.texture.patches.fill import interpolated

CUT_OTHERWISE = "the face was cut in another way when it was textured"
CUT_COLOUR = (170, 165, 158)
DRAPE_QUALITY = 88
WHITE = 255.0
EAVES_M = 0.8
"""Eaves that an ortho shows beside walls, about; the ground there is out of its sight."""


def texture_sets(workspace: Workspace, leaves: Iterable[str], buildings: Mapping[str, Building]) -> dict[str, TextureSet]:  # fmt: skip
    """The sets ``raw`` and ``rectified``; `leaves` are paths of what the atlas tasks wrote."""
    manifests = [json.loads(workspace.read(path)) for path in leaves]
    keys = {unit: _keys(buildings[unit]) for m in manifests for unit in m["plain"] if unit in buildings}
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
            key = keys.get(row["unit"], {}).get(_rings(row["rings"]))
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


def drape(
    workspace: Workspace, task_arguments: Mapping[str, Any], tile: str, covered: Sequence[Polygon], longest_px: int
) -> Drape | None:
    """The tile's ortho as a picture for its terrain; None where there is none.

    Parameters
    ----------
    covered : plans of what stands on the terrain; an ortho shows roofs there, and beside it eaves that reach beyond the walls
    """
    bounds: Bounds = tuple(task_arguments["bounds"])
    found = _ortho(workspace, task_arguments, bounds)
    if found is None:
        return None
    colours, grid = _reduced(_without_roofs(found, covered), longest_px)
    path = workspace.publish(f"{FOLDER}/{tile}.terrain.jpg", jpeg_bytes(colours, DRAPE_QUALITY))
    return Drape(TexturePage(path, colours.shape[1], colours.shape[0], "image/jpeg"), grid.bounds)


Colours = tuple[NDArray[Any], NDArray[np.bool_], Grid]
"""(rows, cols, 3) float32 of 0 to 255, which cells have one, and where they are."""


def _ortho(workspace: Workspace, a: Mapping[str, Any], bounds: Bounds) -> Colours | None:
    if a["own_orthos"]:
        whole = Grid.covering(tuple(a["product_grid"]), a["product_cell_m"])
        grid, layers = read_layers(workspace.store.zarr_store(ZARR), whole, bounds, ("ortho", "ortho_seen"))
        scale = a["white"] / WHITE
        bands = layers["ortho"] if len(layers["ortho"]) >= 3 else np.repeat(layers["ortho"][:1], 3, axis=0)
        colours = np.moveaxis(bands[:3], 0, -1).astype(np.float32) / np.float32(scale)
        return (colours, layers["ortho_seen"], grid) if layers["ortho_seen"].any() else None
    for _, href, cell in a["given_orthos"]:
        grid = Grid.covering(bounds, cell)
        with local_file(href) as path:
            given = np.moveaxis(given_colours(path, grid, resolve(a["crs"])), 0, -1)
        known = np.isfinite(given).all(axis=-1)
        if known.any():
            return np.nan_to_num(given).astype(np.float32), np.asarray(known), grid
    return None


def _without_roofs(found: Colours, covered: Sequence[Polygon]) -> Colours:
    """Interpolated from the ground around under and beside buildings, and where the ortho has no colour."""
    colours, known, grid = found
    ground = known
    if covered:
        wide = shapely.union_all(shapely.buffer(np.array(covered, dtype=object), EAVES_M, quad_segs=2))
        ground = known & ~rasterize([wide], out_shape=grid.shape, transform=Affine(*grid.transform)).astype(bool)
    ground = ground if ground.any() else known
    return interpolated(colours, ground), known, grid


def _reduced(found: Colours, longest_px: int) -> tuple[NDArray[np.uint8], Grid]:
    """As many pixels as asked for at most."""
    colours, _, grid = found
    factor = longest_px / max(grid.rows, grid.cols)
    if factor < 1:
        size = max(round(grid.cols * factor), 1), max(round(grid.rows * factor), 1)
        colours = cv2.resize(colours, size, interpolation=cv2.INTER_AREA)
    return np.clip(np.rint(colours), 0, 255).astype(np.uint8), grid


def _areas(building: Building) -> Iterable[tuple[FaceKey, float]]:
    for shell, polyhedron in _shells(building):
        for number, area in enumerate(face_areas(polyhedron).tolist()):
            yield (shell, number), area


def _shells(building: Building) -> Iterable[tuple[Shell, Polyhedron]]:
    yield "solid", building.solids[Lod.LOD22]
    if building.beyond is not None:
        yield "beyond", building.beyond


def _keys(building: Building) -> dict[Rings, FaceKey]:
    """The faces of a building that can have a texture, by the world vertices of their rings."""
    return {
        _world(p, face): (shell, number)
        for shell, p in _shells(building)
        for number, face in enumerate(p.faces)
        if face.semantic is not Semantic.GROUND and face.neighbour is None
    }


def _world(polyhedron: Polyhedron, face: Face) -> Rings:
    return _rings([polyhedron.ring(ring).tolist() for ring in face.rings])


def _rings(tree: Sequence[Sequence[Sequence[float]]]) -> Rings:
    return tuple(tuple((p[0], p[1], p[2]) for p in ring) for ring in tree)


def _plain(rows: Sequence[Any], keys: Mapping[Rings, FaceKey]) -> dict[FaceKey, PlainFace]:
    found = {}
    for rings, colour, reason in rows:
        key = keys.get(_rings(rings))
        if key is not None:
            found[key] = PlainFace((colour[0], colour[1], colour[2]), reason)
    return found
