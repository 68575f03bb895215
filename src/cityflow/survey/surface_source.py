"""Surface sources: LiDAR, images, or a given DSM."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from cityflow.core.grid import Bounds, Tile
from cityflow.io.catalog.stac_assets import ImageAsset, LidarAsset, RasterAsset

LIDAR, IMAGES, RASTERS = "lidar", "images", "rasters"
ZARR, OVERVIEW, FRAMES = "surface.zarr", "surface.zarr/overview", "surface.zarr/frames"
"""The rasters of a run; a surface from images or rasters has a coarser copy for what works on half a metre, and one group per local frame."""

Asset = LidarAsset | ImageAsset | RasterAsset


class Source(Protocol):
    """One of the three.

    Attributes
    ----------
    kind : `LIDAR`, `IMAGES` or `RASTERS`
    zarr : group whose layers stand on the grid that terrain, classes and outlines have
    indexed_by : the stage that leaves the points that buildings are made of: as they were read, or as they were matched
    cell_m : cell of the delivered DSM and ortho, metres;  factor : so many of them along one cell of that grid
    tiles : ground tiles with something to see, south-west first
    """

    kind: str
    zarr: str
    indexed_by: str

    @property
    def cell_m(self) -> float: ...

    @property
    def factor(self) -> int: ...

    @property
    def tiles(self) -> Mapping[str, Tile]: ...

    def assets_over(self, bounds: Bounds | None = None) -> Sequence[Asset]:
        """What the surface within `bounds` was made from; of the whole survey without them."""
        ...
