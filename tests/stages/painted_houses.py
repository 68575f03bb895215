"""Three painted houses on a lawn, photographed by a few small cameras: a survey in miniature whose every face has a colour of its own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import geopandas
import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from box_rays import through_box
from cityflow.catalog.create import CreatedCatalog, SurveyFiles, SurveyText, create_catalog
from cityflow.catalog.orientation import ImageSource
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.grid import Grid
from cityflow.core.points import BUILDING, GROUND, PointCloud
from cityflow.io.crs import resolve
from cityflow.io.images.image_write import png_bytes, tiff_bytes
from cityflow.io.orientation.colmap import write_colmap
from cityflow.io.points.las_write import write_points
from cityflow.io.rasters.raster import write_cog

X, Y, FLOOR, SIDE = 85000.0, 447000.0, 3.0, 80.0
CRS_CODE = "EPSG:7415"
PLANS = {
    "a": (X + 25, Y + 30, X + 37, Y + 40),
    "b": (X + 37, Y + 30, X + 49, Y + 40),
    "c": (X + 30, Y + 55, X + 44, Y + 65),
}
"""A row of two, and one behind it."""
TOPS = {"a": 11.0, "b": 8.0, "c": 11.0}
SIDES = {"west": (-1, 0, 0), "east": (1, 0, 0), "south": (0, -1, 0), "north": (0, 1, 0), "roof": (0, 0, 1)}
LAWN = (90, 130, 70)
CAMERA = Camera(300, 220, 330.0, 330.0, 150.0, 110.0)
WORKFLOW: dict[str, Any] = {
    "name": "painted_houses",
    "tiles": {"tile_m": 80, "index_cell_m": 40},
    "surface": {"cell_m": 0.5, "dtm": {"method": "classified", "classified": {"largest_window_m": 20}}},
    "outline": {"source": "given"},
    "reconstruct": {"methods": ["extruded"]},
    "export": {"formats": ["cityjson"]},
}


def colour(house: str, side: str) -> NDArray[np.float64]:
    """(3,) mean colour of a face, no two alike."""
    number = list(PLANS).index(house) * len(SIDES) + list(SIDES).index(side)
    return np.array([70 + 9 * number, 215 - 31 * (number % 5), 60 + 50 * (number % 4)], float)


def looking(name: str, place: Iterable[float], at: Iterable[float], camera: Camera = CAMERA) -> OrientedImage:
    """A photograph from a place (metres from the south-west corner, and above the lawn) towards another, upright."""
    centre, target = (np.array([X, Y, FLOOR]) + np.array(list(p), float) for p in (place, at))
    axis = (target - centre) / np.linalg.norm(target - centre)
    up = np.array([0.0, 0.0, 1.0]) if abs(axis[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    right = np.cross(axis, up) / np.linalg.norm(np.cross(axis, up))
    return OrientedImage(name, camera, np.array([right, np.cross(axis, right), axis]), centre)


MIDDLE = (38, 45, 0)
FLOWN = (
    looking("nadir_0", (33, 45, 75), (33, 45, 0)),
    looking("nadir_1", (43, 45, 75), (43, 45, 0)),
    looking("south", (38, -10, 55), MIDDLE),
    looking("north", (38, 100, 55), MIDDLE),
    looking("west", (-17, 45, 55), MIDDLE),
    looking("east", (93, 45, 55), MIDDLE),
)
"""Seen from above, and from all sides."""


Windows = Mapping[tuple[str, str], Sequence[tuple[float, float, float, float]]]
"""House and side → windows: distance from the wall's western or southern end, height of the sill above the lawn, width, height; all metres."""

PANE, CHEQUER = 30.0, 12.0


def taken(
    image: OrientedImage, windows: Windows = MappingProxyType({}), chequer: float = CHEQUER
) -> NDArray[np.float64]:
    """(rows, cols, 3) what the camera sees, 0 to 255: walls and roofs with a chequered pattern of one metre, dark windows, the lawn, a pale sky."""
    c = image.camera
    u, v = np.meshgrid(np.arange(c.width) + 0.5, np.arange(c.height) + 0.5)
    rays = np.stack([(u - c.cx) / c.fx, (v - c.cy) / c.fy, np.ones_like(u)], axis=-1).reshape(-1, 3) @ image.rotation
    with np.errstate(divide="ignore", invalid="ignore"):
        best = (FLOOR - image.centre[2]) / rays[:, 2]
        out = np.where((best > 0)[:, None], np.array(LAWN, float), np.array([200.0, 215.0, 235.0]))
        best = np.where(best > 0, best, np.inf)
        for house, (x_0, y_0, x_1, y_1) in PLANS.items():
            low, high = np.array([x_0, y_0, FLOOR]), np.array([x_1, y_1, TOPS[house]])
            enters, leaves = through_box(image.centre, rays, low, high)
            t = enters.max(axis=0)
            hit = (t > 0) & (t < best) & (t <= leaves)
            axis = enters.argmax(axis=0)
            for side, normal in SIDES.items():
                k = int(np.flatnonzero(normal)[0])
                on = hit & (axis == k) & (rays[:, k] * normal[k] < 0)
                if on.any():
                    where = image.centre + t[on, None] * rays[on] - low
                    odd = np.floor(where + 1e-6)[:, [j for j in range(3) if j != k]].sum(axis=1) % 2
                    out[on] = colour(house, side) + np.where(odd, chequer, -chequer)[:, None]
                    out[np.flatnonzero(on)[_in_a_window(where[:, [1 - k % 2, 2]], windows.get((house, side), ()))]] = (
                        PANE
                    )
                    best[on] = t[on]
    return out.reshape(c.height, c.width, 3)


def _in_a_window(at: NDArray[np.float64], windows: Iterable[tuple[float, float, float, float]]) -> NDArray[np.bool_]:
    """Of (N, 2) places along a wall and above its foot."""
    inside = np.zeros(len(at), bool)
    for left, sill, wide, high in windows:
        inside |= ((at >= (left, sill)) & (at <= (left + wide, sill + high))).all(axis=1)
    return inside


Pictures = Sequence[tuple[OrientedImage, NDArray[Any]]]
"""Poses with pixels."""


def eight_bits(colours: NDArray[np.float64]) -> NDArray[np.uint8]:
    return np.clip(np.rint(colours), 0, 255).astype(np.uint8)


def pictures(
    images: Iterable[OrientedImage] = FLOWN, windows: Windows = MappingProxyType({}), chequer: float = CHEQUER
) -> list[tuple[OrientedImage, NDArray[Any]]]:
    """What cameras took, as it is."""
    return [(i, eight_bits(taken(i, windows, chequer))) for i in images]


@dataclass(frozen=True)
class Painted:
    """Where the files of a survey lie."""

    folder: Path

    @property
    def catalog(self) -> Path:
        return self.folder / "catalog"

    def picture(self, name: str) -> Path:
        return next((self.folder / "images").glob(f"{name}.*"))

    def write_images(self, pictures: Pictures, origin: tuple[float, float, float] = (X, Y, 0)) -> None:
        """Pictures and their poses."""
        (self.folder / "images").mkdir(parents=True, exist_ok=True)
        named = []
        for image, pixels in pictures:
            plain = pixels.dtype == np.uint8 and pixels.shape[2] != 4
            file = f"{image.name}.png" if plain else f"{image.name}.tif"
            (self.folder / "images" / file).write_bytes(png_bytes(pixels) if plain else tiff_bytes(pixels))
            named.append(replace(image, name=file))
        write_colmap(self.folder / "sparse", named, np.empty((0, 3)), origin)

    def write_lidar(self, density: float = 8.0) -> None:
        rng = np.random.default_rng(4)
        xy = rng.uniform(0, SIDE, (round(density * SIDE**2), 2)) + np.array([X, Y])
        z = np.full(len(xy), FLOOR)
        for house, (x_0, y_0, x_1, y_1) in PLANS.items():
            z[(xy[:, 0] > x_0) & (xy[:, 0] < x_1) & (xy[:, 1] > y_0) & (xy[:, 1] < y_1)] = TOPS[house]
        on = z > FLOOR
        z += rng.normal(0, 0.01, len(xy))
        cloud = PointCloud.of(np.column_stack([xy, z]), np.where(on, BUILDING, GROUND).astype(np.uint8))
        (self.folder / "town.laz").write_bytes(write_points(cloud, crs=CRS("EPSG:28992")))

    def write_ortho(self, scale: float = 1.0, dtype: str = "uint8") -> Path:
        grid = Grid(X, Y + SIDE, 0.2, round(SIDE / 0.2), round(SIDE / 0.2))
        x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
        colours = np.broadcast_to(np.array(LAWN, float), (*grid.shape, 3)).copy()
        for house, plan in PLANS.items():
            colours[shapely.contains_xy(shapely.box(*plan), x, y)] = colour(house, "roof")
        values = np.moveaxis(np.clip(np.rint(colours * scale), 1, np.iinfo(dtype).max).astype(dtype), -1, 0)
        path = self.folder / "ortho.tif"
        path.write_bytes(write_cog(values, grid, resolve(CRS_CODE), nodata=None))
        return path

    def write_outlines(self, ids: Mapping[str, str] | None = None) -> Path:
        path = self.folder / "outlines.gpkg"
        names, plans = [(ids or {}).get(n, n) for n in PLANS], [shapely.box(*p) for p in PLANS.values()]
        geopandas.GeoDataFrame({"id": names}, geometry=plans, crs=28992).to_file(path)
        return path

    def describe(self, *, images: bool = True, ortho: bool = False, **options: Any) -> CreatedCatalog:
        """Make the catalog, or make it again."""
        poses = {"colmap": self.folder / "sparse"}
        heights = (FLOOR - 1, max(TOPS.values()) + 3)
        source = ImageSource(self.folder / "images", poses, origin=(X, Y, 0), heights=heights)
        return create_catalog(
            self.catalog,
            SurveyFiles(
                lidar=[str(self.folder / "town.laz")],
                images=replace(source, **options) if images else None,
                orthos=[self.folder / "ortho.tif"] if ortho else [],
                outlines=self.folder / "outlines.gpkg",
                id_column="id",
            ),
            crs=CRS_CODE,
            text=SurveyText(date="2026-06-21"),
        )


def survey_in(folder: Path) -> Painted:
    """LiDAR and outlines of the houses; images and orthos are added by who wants them."""
    folder.mkdir(parents=True, exist_ok=True)
    painted = Painted(folder)
    painted.write_lidar()
    painted.write_outlines()
    return painted
