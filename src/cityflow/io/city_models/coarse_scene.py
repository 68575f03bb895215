"""A ground tile as it looks from far away: what `coarse_glb` writes, made from the tile's models, terrain and textures."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Building, Semantic
from cityflow.core.coarse import Blocks, Coarse
from cityflow.core.grid import Bounds
from cityflow.core.texture import Drape, TextureSet
from cityflow.core.verdicts import VERDICT_KEY
from cityflow.geometry.coarse_ground import coarse_ground, heights_at
from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.gltf_materials import linear, srgb
from cityflow.io.city_models.gltf_surfaces import UNTEXTURED, Surfaces, surfaces_of
from cityflow.io.city_models.obj_materials import MATERIALS
from cityflow.io.images.small_image import eighth_of, shrunk

Read = Callable[[str], bytes]
"""Contents of a file by its path in RUN."""

PARTS = 64
"""Of the longer side of what is shown; no smaller part of it has a colour of its own. On 1,080 rows of 60° that is 16 pixels from a side away."""
PICTURE_PX = 128
PLAN_SHARE = 1 / 16
"""How much of the error plans are simplified by."""
RIGHT_SHARE = 0.95
"""Of roofs by their area in plan, and of terrain, that is within the error in height."""
LOWEST_M = 0.5
"""Of a block, so that it has walls."""

_SAMPLES = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4]], np.float64)
_SAMPLES /= _SAMPLES.sum(axis=1, keepdims=True)
_DEFAULT = np.rint([np.array(MATERIALS[name]) * 255 for name in ("roof", "wall")])


def coarse_of(
    buildings: Sequence[Building], vertices: FloatArray, triangles: IntArray, bounds: Bounds,
    textures: TextureSet | None, drape: Drape | None, read: Read,
) -> Coarse:  # fmt: skip
    """A tile from far away.

    Parameters
    ----------
    buildings : with their party walls cut;  vertices, triangles : (V, 3) world metres and (T, 3) of the terrain
    bounds : of the tile, world metres
    textures : rectified ones, drape : ortho on the terrain; None where there are none.  read : reads their pages
    """
    ground = coarse_ground(vertices, triangles, bounds)
    unlike = np.abs(heights_at(*ground, vertices[:, :2]) - vertices[:, 2])
    picture = None if drape is None else shrunk(eighth_of(read(drape.page.path)), PICTURE_PX)
    surfaces = surfaces_of(buildings, Appearance("", textures))
    corners = surfaces.xyz[surfaces.triangles]
    is_roof = _is(surfaces, Semantic.ROOF)[surfaces.face[surfaces.triangles[:, 0]]]
    owner = surfaces.building[surfaces.face[surfaces.triangles[:, 0]]] if len(surfaces.rows) else np.empty(0, np.int64)
    roofs, owners = corners[is_roof], owner[is_roof]
    plan_area = np.abs(np.cross(roofs[:, 1] - roofs[:, 0], roofs[:, 2] - roofs[:, 0])[:, 2]) / 2
    floors = np.array([b.ground_height for b in buildings], np.float64)
    tops = np.maximum(_means(roofs[:, :, 2].mean(axis=1), plan_area, owners, floors), floors + LOWEST_M)
    off = np.abs(roofs[:, :, 2] - tops[owners][:, None])
    longest = max(bounds[2] - bounds[0], bounds[3] - bounds[1])
    error = max(
        longest / PARTS,
        reached(off.ravel(), np.repeat(plan_area, 3)),
        reached(unlike[np.isfinite(unlike)]),
    )
    blocks = Blocks(
        tuple(b.id for b in buildings), tuple(b.status.value for b in buildings),
        tuple(str(b.attributes.get(VERDICT_KEY) or "") for b in buildings),
        np.array([[_figure(b, "nmad"), _figure(b, "rmse")] for b in buildings], np.float64).reshape(-1, 2),
        tuple(simpler(b.footprint, PLAN_SHARE * error, error**2) for b in buildings),
        np.column_stack([floors, tops]), _colours(surfaces, len(buildings), textures, read),
    )  # fmt: skip
    extent = bounds if drape is None else drape.bounds
    return Coarse(bounds, *ground, picture, extent, blocks, round(float(error) + 0.005, 2))


def simpler(plan: Polygon, tolerance: float, least_hole: float) -> Polygon:
    """A plan with fewer vertices, metres, and without holes smaller than `least_hole`, m²."""
    holes = [hole for hole in plan.interiors if shapely.Polygon(hole).area >= least_hole]
    found = shapely.simplify(shapely.Polygon(plan.exterior, holes), tolerance)
    return found if isinstance(found, Polygon) and not found.is_empty and found.is_valid else plan


def _figure(building: Building, name: str) -> float:
    value = building.attributes.get(name)
    return float(value) if isinstance(value, int | float) else float("nan")


def _is(surfaces: Surfaces, semantic: Semantic) -> NDArray[np.bool_]:
    """(F,) whether a face is of a type, and outside: party walls are in no sight."""
    return np.array([r.face.semantic is semantic and r.face.neighbour is None for r in surfaces.rows], bool)


def _means(values: FloatArray, weights: FloatArray, owners: IntArray, otherwise: FloatArray) -> FloatArray:
    """Weighted mean for each owner; `otherwise` where there is no weight."""
    total = np.bincount(owners, weights, len(otherwise))
    return np.divide(np.bincount(owners, weights * values, len(otherwise)), total, out=otherwise.copy(), where=total > 0)  # fmt: skip


def reached(values: FloatArray, weights: FloatArray | None = None) -> float:
    """What `RIGHT_SHARE` of the values do not exceed, by weight; 0 of none."""
    if not len(values):
        return 0.0
    order = np.argsort(values, kind="stable")
    grown = np.cumsum(np.ones(len(values)) if weights is None else weights[order])
    return float(values[order[min(np.searchsorted(grown, RIGHT_SHARE * grown[-1]), len(values) - 1)]])


def _colours(surfaces: Surfaces, count: int, textures: TextureSet | None, read: Read) -> NDArray[np.uint8]:
    """(count, 2, 3) mean colours of roofs and walls by area, light as light; those of their class where a building has none."""
    found = np.empty((count, 2, 3), np.uint8)
    face = surfaces.face[surfaces.triangles[:, 0]]
    light = _light(surfaces, face, textures, read)
    a, b, c = (surfaces.xyz[surfaces.triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    for k, semantic in enumerate((Semantic.ROOF, Semantic.WALL)):
        chosen = np.flatnonzero(_is(surfaces, semantic)[face])
        owners = surfaces.building[face[chosen]] if len(chosen) else chosen
        plain = np.broadcast_to(linear(_DEFAULT[k]), (count, 3))
        channels = [_means(light[chosen, i], area[chosen], owners, plain[:, i]) for i in range(3)]
        found[:, k] = srgb(np.column_stack(channels))
    return found


def _light(surfaces: Surfaces, face: IntArray, textures: TextureSet | None, read: Read) -> FloatArray:
    """(T, 3) linear light of each triangle: mean of a few places on its page, or its plain colour."""
    light = linear(surfaces.colour[face].reshape(-1, 3))
    page = surfaces.page[face]
    for number in np.unique(page[page != UNTEXTURED]).tolist():
        assert textures is not None
        picture = eighth_of(read(textures.pages[number].path))
        chosen = np.flatnonzero(page == number)
        uv = np.einsum("sk,tkc->tsc", _SAMPLES, surfaces.uvd[surfaces.triangles[chosen]][:, :, :2])
        col = np.clip((uv[..., 0] * picture.shape[1]).astype(np.int64), 0, picture.shape[1] - 1)
        row = np.clip(((1 - uv[..., 1]) * picture.shape[0]).astype(np.int64), 0, picture.shape[0] - 1)
        light[chosen] = linear(picture[row, col]).mean(axis=1)
    return light
