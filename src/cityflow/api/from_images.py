"""From oriented images: depth maps, points, textures of a building, and the windows in them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Lod, Polyhedron
from cityflow.core.camera import OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.depth_map import DepthMap, ImagePoints, standing_points
from cityflow.core.grid import Bounds, Grid
from cityflow.core.ground_cells import GroundCells
from cityflow.core.openings import UnitOpenings
from cityflow.core.pixels import ArrayPixels, reduced
from cityflow.errors import CatalogError, CityflowError
from cityflow.io.catalog.stac import ImageAsset, read_catalog
from cityflow.io.images.coarse_image import coarse_image
from cityflow.matching.match import MatchParameters, match
from cityflow.texture.planes import face_planes
from cityflow.texture.unit import Surroundings, TexturedUnit, TextureParameters, texture_unit
from cityflow.windows.find_windows import find_unit_windows
from cityflow.windows.window_parameters import WindowParameters

CELL_M = 10.0
"""Of the lattice that says where depths are wanted."""
EVERYWHERE = (-np.inf, -np.inf, np.inf, np.inf)


def read_images(catalog: str, names: Sequence[str], level: int = 0) -> list[ColourImage]:
    """Images of a catalog with their cameras, poses and colour balance, decoded as a whole.

    Parameters
    ----------
    catalog : folder or URL, as `cityflow catalog create` makes it
    names : of images in the catalog
    level : 0: as they are; 1: half as wide and high, and so on

    Raises
    ------
    CatalogError
        There is no such catalog or image, or a file is damaged.
    """
    known = {a.name: a for a in read_catalog(catalog).images}
    missing = [n for n in names if n not in known]
    if missing:
        problem = f"no image '{missing[0]}' in the catalog"
        raise CatalogError(problem, where=catalog, remedy=f"one of {', '.join(sorted(known)[:8])}, …")
    return [_opened(known[n], level) for n in names]


def _opened(asset: ImageAsset, level: int) -> ColourImage:
    pixels, image = reduced(coarse_image(asset.href, 0).array, level), asset.oriented
    shown = OrientedImage(image.name, image.camera.reduced(level), image.rotation, image.centre, image.head)
    return ColourImage(shown, ArrayPixels(pixels), asset.gain, asset.gamma, asset.falloff, asset.shoulder, asset.white)


def match_images(
    reference: ColourImage, partners: Sequence[ColourImage], bounds: Bounds, heights: tuple[float, float],
    parameters: MatchParameters | None = None,
) -> DepthMap:  # fmt: skip
    """Depths of the pixels of an image whose points stand within `bounds`, from one partner or several.

    Parameters
    ----------
    reference, partners : images that overlap
    bounds : x_min, y_min, x_max, y_max of the ground that is wanted, world metres
    heights : lowest ground and highest object, world metres

    Returns
    -------
    DepthMap
        A window of the reference image: metres along the camera's z axis, NaN where unknown; expected standard deviation, partners that agree, colour.

    Raises
    ------
    CityflowError
        No pixel got a depth.
    """
    x, y = (np.arange(np.floor(bounds[k] / CELL_M), np.ceil(bounds[k + 2] / CELL_M), dtype=np.int64) for k in (0, 1))
    cells = GroundCells(bounds, CELL_M, tuple((c, r) for c in x.tolist() for r in y.tolist()))
    found: dict[str, DepthMap] = {}
    made = match(
        reference.image, reference.pixels, [(p.image, p.pixels) for p in partners], {"": cells}, heights,
        parameters or MatchParameters(), found.__setitem__,
    )  # fmt: skip
    if not found:
        why = "; ".join(f"{p.partner}: {p.reason}" for p in made.pairs if p.reason)
        problem = f"no pixel got a depth ({why or 'the image does not show these bounds'})"
        raise CityflowError(problem, where=reference.image.name, remedy="check bounds, heights and poses")
    return found[""]


def points_of_depths(depths: DepthMap, image: OrientedImage) -> ImagePoints:
    """The pixels with a depth as coloured points, (N, 3) world metres, row by row; `image` is the one that was matched."""
    return standing_points(depths, depths.views, image, EVERYWHERE)


def texture_building(
    building: Building, images: Sequence[ColourImage], heights: FloatArray, grid: Grid, others: Sequence[Building] = (),
    parameters: TextureParameters | None = None,
) -> TexturedUnit:  # fmt: skip
    """Textures of the faces of a building: for each a patch in the geometry of its image and a rectified one; a plain colour where no image sees it.

    Parameters
    ----------
    heights : (rows, cols) surface around the building on `grid`, which may stand before it, world metres; NaN where unknown
    others : buildings around, which may stand before it
    """
    solid = building.solids[Lod.LOD22]
    around = Surroundings(
        _shells(building), [s for other in others for s in _shells(other)], np.asarray(heights, np.float64), grid
    )
    return texture_unit(face_planes(solid, building.beyond), images, around, parameters or TextureParameters())


def windows_of(building: Building, textured: TexturedUnit, parameters: WindowParameters | None = None) -> UnitOpenings:
    """Windows and doors in the walls of a building by its rectified textures, metres on each wall, with a confidence."""
    patches = {patch.key: patch for patch in textured.texture.rectified}
    faces = face_planes(building.solids[Lod.LOD22], building.beyond)
    return find_unit_windows(faces, patches, parameters or WindowParameters())


def _shells(building: Building) -> list[Polyhedron]:
    """The solid of LoD2.2, and what stands out beyond it."""
    return [building.solids[Lod.LOD22], *([] if building.beyond is None else [building.beyond])]
