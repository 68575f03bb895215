"""Assets of a catalog: LiDAR files, images, rasters, outlines, and their locations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds
from cityflow.core.orientation_figures import OrientationFigures
from cityflow.core.reference import Reference

LIDAR, OUTLINES, IMAGE, SPARSE = "lidar", "outlines", "image", "sparse"
RASTERS = ("dsm", "dtm", "ortho")


@dataclass(frozen=True, slots=True)
class LidarAsset:
    """One LiDAR file.

    Attributes
    ----------
    name : unique in the catalog, from the file's name
    href : absolute path or URL
    checksum : SHA-256, 64 hexadecimal digits;  size : bytes
    bounds : x_min, y_min, x_max, y_max, metres;  z_range : lowest and highest
    points : number of points
    date : ISO 8601 day, empty where unknown
    classes : ASPRS classes seen when the catalog was made (in a sample, for large files)
    returns : largest number of returns
    crs_in_file : name of the CRS in the file's header, empty where it has none
    """

    name: str
    href: str
    checksum: str
    size: int
    bounds: Bounds
    z_range: tuple[float, float]
    points: int
    date: str = ""
    classes: tuple[int, ...] = ()
    returns: int = 1
    crs_in_file: str = ""


@dataclass(frozen=True, slots=True)
class OutlineAsset:
    """The file of given outlines.

    Attributes
    ----------
    name, href, checksum, size, date : as in `LidarAsset`
    bounds : metres, in the catalog's CRS
    count : number of features
    id_column, id_format, layer : how to read it, see `io.tables.outline_file.read_outlines`
    crs_in_file : name of the file's own CRS, empty where it has none
    """

    name: str
    href: str
    checksum: str
    size: int
    bounds: Bounds
    count: int
    id_column: str | None = None
    id_format: str | None = None
    layer: str | None = None
    date: str = ""
    crs_in_file: str = ""


@dataclass(frozen=True, slots=True)
class RasterAsset:
    """A given DSM, DTM or ortho image; `kind` is one of ``dsm``, ``dtm``, ``ortho``; `cell` in metres."""

    name: str
    kind: str
    href: str
    checksum: str
    size: int
    bounds: Bounds
    cell: float
    shape: tuple[int, int]
    date: str = ""
    crs_in_file: str = ""


@dataclass(frozen=True, slots=True)
class ImageAsset:
    """One oriented image.

    Attributes
    ----------
    name : unique in the catalog, of letters, digits, dots, dashes and underscores; that of `oriented` too
    href, checksum, size, date : as in `LidarAsset`
    bounds : box around its footprint on the lowest ground, metres
    oriented : camera and pose
    heights : lowest ground and highest object that it may show, world metres
    bands, dtype : of the file as it is; ``uint8`` or ``uint16``
    gain, gamma, falloff, shoulder : what makes the image match the others, and keeps highlights below white: as in `core.colour_image.ColourImage`
    pixel_mm : size of a pixel on the sensor, millimetres; 0 where unknown
    white : of 16-bit files the value that the survey's sensor shows as white, 4095 for one of 12 bits; 0 where unknown
    pose_covariance : (21,) upper triangle, rows first, of rotation vector in the camera frame (radians) and centre (metres), by `cityflow orient`; empty
        where nobody has looked
    video_s : of a frame of a video: seconds since its start; None otherwise
    """

    name: str
    href: str
    checksum: str
    size: int
    bounds: Bounds
    oriented: OrientedImage
    heights: tuple[float, float]
    bands: int = 3
    dtype: str = "uint8"
    gain: tuple[float, ...] = (1.0, 1.0, 1.0)
    date: str = ""
    pixel_mm: float = 0.0
    gamma: tuple[float, ...] = ()
    falloff: float = 0.0
    shoulder: float = 0.0
    white: float = 0.0
    pose_covariance: tuple[float, ...] = ()
    video_s: float | None = None

    def __eq__(self, other: object) -> bool:
        """Equal in every value, also in those of arrays."""
        if not isinstance(other, ImageAsset):
            return NotImplemented
        return _plain(self) == _plain(other)

    def __hash__(self) -> int:
        return hash((self.name, self.checksum))


@dataclass(frozen=True, slots=True)
class SparseAsset:
    """Tie points of the images' orientation, a LAZ file in the catalog's folder; attributes as in `LidarAsset`."""

    name: str
    href: str
    checksum: str
    size: int
    bounds: Bounds
    z_range: tuple[float, float]
    points: int
    date: str = ""


Asset = LidarAsset | ImageAsset | SparseAsset | OutlineAsset | RasterAsset


@dataclass(frozen=True, slots=True)
class Catalog:
    """A survey: what there is, where it lies, and in which reference.

    Attributes
    ----------
    href : the catalog's folder, absolute path or URL
    reference : that of every coordinate in here, and of a run
    date : newest ISO day of LiDAR and images, else of anything; empty where unknown
    bounds : of all LiDAR files; else of all images' footprints, of the DSM, of all rasters, of all items: an outline far away makes no survey larger
    rasters : kind → raster
    images : sorted by name;  sparse : their tie points
    orientation : what `cityflow orient` has found of the images; None where it has not made the catalog
    made_in : folder that it was made in, where it names files outside; empty where it does not say
    notes : what whoever opened it should know
    """

    href: str
    title: str
    reference: Reference
    licence: str
    attribution: str
    lidar: tuple[LidarAsset, ...]
    outlines: OutlineAsset | None = None
    rasters: Mapping[str, RasterAsset] = field(default_factory=dict)
    images: tuple[ImageAsset, ...] = ()
    sparse: SparseAsset | None = None
    orientation: OrientationFigures | None = None
    made_in: str = field(default="", compare=False)
    notes: tuple[str, ...] = field(default=(), compare=False)

    @property
    def assets(self) -> tuple[Asset, ...]:
        given = (self.outlines,) if self.outlines is not None else ()
        sparse = (self.sparse,) if self.sparse is not None else ()
        return *self.lidar, *self.images, *sparse, *given, *self.rasters.values()

    @property
    def date(self) -> str:
        measured = [a.date for a in self.lidar if a.date] + [a.date for a in self.images if a.date]
        return max(measured, default=max((a.date for a in self.assets), default=""))

    @property
    def bounds(self) -> Bounds:
        rasters = [r for r in self.rasters.values() if r.kind == "dsm"] or self.rasters.values()
        return united([a.bounds for a in self.lidar or self.images or rasters or self.assets])


def _plain(asset: ImageAsset) -> tuple[object, ...]:
    image = asset.oriented
    return (
        asset.name, asset.href, asset.checksum, asset.size, asset.bounds, asset.heights, asset.bands, asset.dtype, asset.gain,
        asset.date, asset.pixel_mm, asset.gamma, asset.falloff, asset.shoulder, asset.white, asset.pose_covariance, asset.video_s,
        image.name, image.head, image.camera, image.rotation.tolist(), image.centre.tolist(),
    )  # fmt: skip


def united(bounds: list[Bounds]) -> Bounds:
    """The box around several.

    >>> united([(0, 0, 1, 1), (2, -1, 3, 0)])
    (0, -1, 3, 1)
    """
    return min(b[0] for b in bounds), min(b[1] for b in bounds), max(b[2] for b in bounds), max(b[3] for b in bounds)
