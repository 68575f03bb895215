"""Values of textures: faces in planes with axes, patches of pixels, pages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Semantic
from cityflow.core.run_lengths import RunLengthMask

Colour = tuple[int, int, int]
"""Red, green, blue, 0 to 255."""

Shell = Literal["solid", "beyond", "installation"]
"""The closed solid of a unit at LoD2.2, the surfaces of its overhangs, or those of what is fixed to it, which have no textures (`Building`)."""

FaceKey = tuple[Shell, int]
"""A face of a unit: shell, and index among the shell's faces."""

OUTSIDE, INTERPOLATED, FIRST_IMAGE = 0, 1, 2
"""Values of an index raster: no texture, interpolated from what stands around, and from here on the images in their order."""


@dataclass(frozen=True, slots=True, eq=False)
class FacePlane:
    """A face in a frame of its own: s to the right, t up as one sees it from outside, the normal towards the eye.

    Attributes
    ----------
    key : which face
    semantic : its type
    rings : exterior, then holes, (n, 3) world metres, without the repeated last vertex, in the order of `Face.rings`
    origin : (3,) world position of s = t = 0
    right, up, normal : (3,) unit vectors; right × up = normal; of a wall `up` is vertical, of a roof it climbs, of level faces it is north
    polygon : the face in s, t, metres
    """

    key: FaceKey
    semantic: Semantic
    rings: tuple[FloatArray, ...]
    origin: FloatArray
    right: FloatArray
    up: FloatArray
    normal: FloatArray
    polygon: Polygon

    def world(self, st: FloatArray) -> FloatArray:
        """(N, 2) → (N, 3) world metres."""
        st = np.asarray(st, np.float64)
        return self.origin + st[..., :1] * self.right + st[..., 1:2] * self.up

    def on_plane(self, xyz: FloatArray) -> FloatArray:
        """(N, 3) world metres → (N, 2) s, t of their projections onto the plane."""
        local = np.asarray(xyz, np.float64) - self.origin
        return np.stack([local @ self.right, local @ self.up], axis=-1)


@dataclass(frozen=True, slots=True)
class FaceGrid:
    """Square cells on a face's plane; row 0 is the highest t, (0, 0) its upper left cell, seen from outside.

    Attributes
    ----------
    s_min, t_max : outer corner of cell (0, 0), metres
    cell : metres;  rows, cols : size
    """

    s_min: float
    t_max: float
    cell: float
    rows: int
    cols: int

    @classmethod
    def over(cls, polygon: Polygon, cell: float, margin: int = 0) -> FaceGrid:
        """The smallest grid over a polygon in s, t, with `margin` cells around it."""
        s_0, t_0, s_1, t_1 = polygon.bounds
        cols = max(int(np.ceil((s_1 - s_0) / cell - 1e-9)), 1) + 2 * margin
        rows = max(int(np.ceil((t_1 - t_0) / cell - 1e-9)), 1) + 2 * margin
        return cls(s_0 - margin * cell, t_1 + margin * cell, cell, rows, cols)

    def centres(self) -> FloatArray:
        """(rows, cols, 2) s, t of the cells' middles."""
        s = self.s_min + (np.arange(self.cols) + 0.5) * self.cell
        t = self.t_max - (np.arange(self.rows) + 0.5) * self.cell
        return np.stack(np.meshgrid(s, t), axis=-1)


@dataclass(frozen=True, slots=True)
class FaceView:
    """How one image looks at one face, whatever stands between.

    Attributes
    ----------
    image : index of the image
    gsd_m : worst-case ground sampling distance on the face, metres (Frommholz 2017, section 5)
    incidence_deg : angle between the face's normal and the ray to the camera, in the middle of the part that is in the frame
    inside : share of the face's area that is in front of the camera and in the frame
    """

    image: int
    gsd_m: float
    incidence_deg: float
    inside: float


@dataclass(frozen=True, slots=True, eq=False)
class SeenFace:
    """How much of a face an image really sees: `mask` is on the face's grid, true where nothing stands between."""

    view: FaceView
    mask: RunLengthMask


@dataclass(frozen=True, slots=True)
class FaceFigures:
    """How well a face's texture is founded; attributes of the face in every product.

    Attributes
    ----------
    gsd_m : worst-case ground sampling distance of the root image on the face, metres
    incidence_deg : angle at which the root image looks at it, degrees from the normal
    candidates : images that have it in their frame, from outside
    images : images whose pixels are in the texture
    occluded : share of the face's pixels that the root does not see
    interpolated : share of the face's pixels that no image sees
    """

    gsd_m: float
    incidence_deg: float
    candidates: int
    images: int
    occluded: float
    interpolated: float


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """The texture of one face, before it has a place on a page.

    Attributes
    ----------
    key : which face
    pixels : (rows, cols, 3) uint8; meaningful where `mask` is true
    index : (rows, cols) uint16: `OUTSIDE`, `INTERPOLATED`, or `FIRST_IMAGE` + the index of the image that a pixel came from
    mask : (rows, cols) bool, the pixel set that needs a place: the face's polygon and its padding
    corners : for every ring of the face (n, 3): column and row of each vertex in the patch (0, 0 is the corner of the first pixel), and its
        distance d from the plane through the root camera's centre, metres (Frommholz 2017, equation 1); d = 1 throughout where the patch is rectified
    figures : how well it is founded
    """

    key: FaceKey
    pixels: NDArray[np.uint8]
    index: NDArray[np.uint16]
    mask: BoolArray
    corners: tuple[FloatArray, ...]
    figures: FaceFigures


@dataclass(frozen=True, slots=True)
class PlainFace:
    """A face without a texture: its colour, and why. `reason` is empty if none is needed (ground, party walls)."""

    colour: Colour
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class UnitTexture:
    """All textures of a unit.

    Attributes
    ----------
    images : names of the images that the index rasters count
    raw : patches in the geometry of their root images
    rectified : the same patches as one would see them straight from the front
    plain : faces that have none
    """

    images: tuple[str, ...]
    raw: tuple[Patch, ...]
    rectified: tuple[Patch, ...]
    plain: Mapping[FaceKey, PlainFace] = field(default_factory=dict)


# ---- what exports get -------------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class TexturePage:
    """A page of an atlas: a file beside the products.

    Attributes
    ----------
    path : relative to RUN, below ``products/textures/``
    width, height : pixels
    media_type : ``image/png`` or ``image/jpeg``
    """

    path: str
    width: int
    height: int
    media_type: str


@dataclass(frozen=True, slots=True, eq=False)
class FaceTexture:
    """The texture of a face on a page.

    Attributes
    ----------
    page : index among the set's pages
    rings : for every ring of the face (n, 3): u to the right and v upwards from the page's lower left corner, both 0 to 1, and d in metres;
        what a renderer interpolates is (u·d, v·d, d), and it divides by the third
    figures : how well it is founded
    """

    page: int
    rings: tuple[FloatArray, ...]
    figures: FaceFigures


@dataclass(frozen=True, slots=True, eq=False)
class BuildingTexture:
    """Textured and plain faces of a building by key; faces in neither are as they always were."""

    faces: Mapping[FaceKey, FaceTexture]
    plain: Mapping[FaceKey, PlainFace] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class TextureSet:
    """The textures of the buildings of one tile.

    Attributes
    ----------
    rectified : whether d is 1 throughout, so that any reader shows it right
    pages : that the buildings' faces refer to
    buildings : building id → its textures
    """

    rectified: bool
    pages: tuple[TexturePage, ...]
    buildings: Mapping[str, BuildingTexture]


@dataclass(frozen=True, slots=True)
class Drape:
    """An ortho that lies on the terrain.

    Attributes
    ----------
    page : its file
    bounds : x_min, y_min, x_max, y_max of its outer edges, world metres; north is up
    """

    page: TexturePage
    bounds: tuple[float, float, float, float]

    def uv(self, xy: FloatArray) -> FloatArray:
        """(N, 2) world metres → (N, 2) u, v from the lower left corner, 0 to 1, cut off at the edges."""
        x_0, y_0, x_1, y_1 = self.bounds
        uv = (np.asarray(xy, np.float64)[..., :2] - (x_0, y_0)) / (x_1 - x_0, y_1 - y_0)
        return np.asarray(np.clip(uv, 0.0, 1.0))
