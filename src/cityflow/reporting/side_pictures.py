"""The densest part of the city from four sides: with textures where there are some, on its ortho."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from cityflow.core.arrays import ByteArray, FloatArray, IntArray
from cityflow.core.building import Building, Lod
from cityflow.core.grid import Bounds, bounds_meet, grown
from cityflow.flow.store import Store
from cityflow.geometry.polygon_triangulation import triangulate_faces
from cityflow.geometry.polyhedron import FaceArrays, project, projection_normals
from cityflow.geometry.textured_view import TexturedTriangles
from cityflow.handover.texture_files import PAGES
from cityflow.io.rasters.surface_dataset import read_layers
from cityflow.reporting.atlas_cell_faces import AtlasCellFaces
from cityflow.reporting.model_pictures import densest_spot
from cityflow.survey.survey import Survey
from cityflow.viewer.model_view import (
    SKY,
    Surfaces,
    light_of,
    semantic_key,
    surfaces_of,
    terrain_surfaces,
)
from cityflow.viewer.picture import Picture, picture
from cityflow.viewer.side_view import SIDES, draw_side, side_camera

GROUND_TIMES = 2.46
"""The ground that is drawn is so much wider than what is shown across the middle of a view, so that its end is far behind."""
WELL_LIT, MOST_BRIGHTER = 225.0, 2.2
LARGEST_PAGE = 8192 * 8192
PAPER = (150, 150, 150)


@dataclass(frozen=True, slots=True)
class Spot:
    """What is looked at: (2,) x and y, and the metres shown across it."""

    xy: FloatArray
    across_m: float


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """Triangles that are drawn alike: (C, 3) corners and texture coordinates, (T, 3) triangles, (T,) pages and (T, 3) colours."""

    xyz: FloatArray
    uvd: FloatArray
    triangles: IntArray
    page: IntArray
    colour: IntArray
    pages: tuple[NDArray[np.uint8], ...] = ()


def ground_m(across_m: float) -> float:
    """Edge of the ground that is drawn."""
    return GROUND_TIMES * across_m


def side_pictures(
    store: Store, survey: Survey, spot: Spot, atlas_cells: Sequence[AtlasCellFaces], others: Iterable[Building]
) -> Iterator[Picture]:
    """Four pictures; `others` are buildings without textures around the spot."""
    x, y = spot.xy.tolist()
    half = ground_m(spot.across_m) / 2
    bounds = (x - half, y - half, x + half, y + half)
    surfaces = surfaces_of(s for b in others for s in (b.solids[Lod.LOD22], *([b.beyond] if b.beyond else [])))
    parts = [
        *(_atlas_cell(store, atlas_cell) for atlas_cell in atlas_cells),
        *([_bare(surfaces)] if len(surfaces.corners) else []),
    ]
    if not parts:
        return
    low = float(np.median([p.xyz[:, 2].min() for p in parts]))
    scene = _joined([*parts, *_ground(store, survey, bounds)])
    target = np.array([x, y, low + 4.0])
    wears = "the models textured from photographs" if atlas_cells else "the models coloured by kind of surface"
    plain = " Those in plain colours have no texture yet." if atlas_cells and len(surfaces.corners) else ""
    key = () if atlas_cells else semantic_key(surfaces)
    drawn = {side: draw_side(scene, side_camera(target, spot.across_m, looking)) for side, looking in SIDES}
    brighter = brightening(list(drawn.values())) if atlas_cells else 1.0
    bright = f" Brightened {brighter:.1f} times." if brighter > 1.0 else ""
    for side, pixels in drawn.items():
        text = f"{spot.across_m:.0f} m across the densest spot, {wears}.{plain}{bright}"
        yield replace(picture(f"From the {side}", text, _brightened(pixels, brighter), key), half=True)


def brightening(pictures: Sequence[ByteArray]) -> float:
    """How much brighter dark photographs are shown, the same in all (rows, cols, 3) pictures: nearly all of their pixels stay below white.

    >>> brightening([np.full((4, 4, 3), 100, np.uint8)]), brightening([np.full((4, 4, 3), 200, np.uint8)])
    (2.2, 1.0)
    """
    lit = np.concatenate([p.reshape(-1, 3).max(axis=1) for p in pictures])
    lit = lit[lit != max(SKY)]
    usual = float(np.quantile(lit, 0.97)) if len(lit) else WELL_LIT
    return round(min(WELL_LIT / max(usual, 1.0), MOST_BRIGHTER), 1) if usual < 0.8 * WELL_LIT else 1.0


def _brightened(pixels: ByteArray, times: float) -> ByteArray:
    """All but the sky."""
    sky = (pixels == np.array(SKY, np.uint8)).all(axis=-1, keepdims=True)
    return np.where(sky, pixels, np.minimum(pixels * times, 255.0)).astype(np.uint8)


def viewed_spot(middles: FloatArray, weights: FloatArray, across_m: float) -> FloatArray:
    """(2,) where to look: the densest spot of (N, 2) middles, moved inwards so that as little as possible of what is shown lies beyond all of them.

    >>> viewed_spot(np.array([[0.0, 0.0], [1000.0, 1000.0], [1005.0, 1001.0]]), np.ones(3), 130.0).tolist()
    [940.0, 936.0]
    """
    low, high = middles.min(axis=0), middles.max(axis=0)
    margin = np.minimum(across_m / 2, (high - low) / 2)
    return np.clip(densest_spot(middles, weights), low + margin, high - margin)


def _atlas_cell(store: Store, atlas_cell: AtlasCellFaces) -> _Part:
    arrays = atlas_cell.arrays
    triangles, faces = _triangles(arrays)
    pages = tuple(_page(store, path) for path in atlas_cell.pages)
    return _Part(
        arrays.vertices + arrays.origin,
        atlas_cell.uvd,
        triangles,
        atlas_cell.page[faces],
        atlas_cell.colour[faces],
        pages,
    )


def _triangles(arrays: FaceArrays) -> tuple[IntArray, IntArray]:
    return triangulate_faces(project(arrays, projection_normals(arrays)), arrays.ring_start, arrays.face_start)


def _page(store: Store, path: str) -> NDArray[np.uint8]:
    """The pixels of a page; one grey pixel where it is not there, or far too large to be one."""
    try:
        with Image.open(io.BytesIO(store.read_bytes(path))) as image:
            if image.width * image.height <= LARGEST_PAGE:
                return np.array(image.convert("RGB"))
    except (FileNotFoundError, OSError):
        pass
    return np.full((1, 1, 3), PAPER[0], np.uint8)


def _bare(surfaces: Surfaces) -> _Part:
    """Models without textures, shaded by the sun."""
    corners = surfaces.corners.reshape(-1, 3)
    colour = np.clip(surfaces.colours * light_of(surfaces.corners)[:, None], 0, 255).astype(np.int64)
    triangles = np.arange(len(corners)).reshape(-1, 3)
    uvd = np.tile([0.0, 0.0, 1.0], (len(corners), 1))
    return _Part(corners, uvd, triangles, np.full(len(triangles), -1), colour)


def _ground(store: Store, survey: Survey, bounds: Bounds) -> Iterator[_Part]:
    """The terrain, a part for each tile, under the tile's ortho without its roofs where the export has made one."""
    for name, tile in sorted(survey.lattice.tiles.items()):
        if not bounds_meet(tile.bounds, bounds):
            continue
        # one cell further, so that no gap is left between tiles
        grid, found = read_layers(
            store.zarr_store(survey.source.zarr),
            survey.lattice.grid,
            grown(tile.bounds, survey.lattice.cell_m),
            ("dtm",),
        )
        part = _terrain(store, name, tile.bounds, terrain_surfaces(found["dtm"], grid))
        if part is not None:
            yield part


def _terrain(store: Store, tile: str, bounds: Bounds, surfaces: Surfaces) -> _Part | None:
    if not len(surfaces.corners):
        return None
    corners = surfaces.corners.reshape(-1, 3)
    triangles = np.arange(len(corners)).reshape(-1, 3)
    path = f"{PAGES}/{tile}.terrain.jpg"
    pages = (_page(store, path),) if store.exists(path) else ()
    (x_0, y_0, x_1, y_1) = bounds
    uvd = np.column_stack(
        [(corners[:, 0] - x_0) / (x_1 - x_0), (corners[:, 1] - y_0) / (y_1 - y_0), np.ones(len(corners))]
    )
    colour = np.clip(surfaces.colours * light_of(surfaces.corners)[:, None], 0, 255).astype(np.int64)
    return _Part(corners, uvd, triangles, np.full(len(triangles), 0 if pages else -1), colour, pages)


def _joined(parts: Sequence[_Part]) -> TexturedTriangles:
    corners = np.cumsum([0, *(len(p.xyz) for p in parts)])[:-1]
    pages = np.cumsum([0, *(len(p.pages) for p in parts)])[:-1]
    return TexturedTriangles(
        np.concatenate([p.xyz for p in parts]), np.concatenate([p.uvd for p in parts]),
        np.concatenate([p.triangles + n for p, n in zip(parts, corners, strict=True)]),
        np.concatenate([np.where(p.page >= 0, p.page + n, -1) for p, n in zip(parts, pages, strict=True)]),
        np.concatenate([p.colour for p in parts]), [page for p in parts for page in p.pages],
    )  # fmt: skip
