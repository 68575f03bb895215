"""The parameters of a whole workflow: the tree of the models of its algorithms."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

from pydantic import Field, model_validator

from cityflow.core.parameters import Parameters
from cityflow.flow.task import Limits
from cityflow.io.export_formats.formats import TITLES as EXPORT_FORMATS
from cityflow.matching.match import MatchParameters
from cityflow.orientation.flight_plan import FlightPlanParameters
from cityflow.orientation.look_directions import LookParameters
from cityflow.outlines.find_outlines import FindParameters
from cityflow.outlines.from_walls.wall_points import WallPointParameters
from cityflow.outlines.under_eaves.walls_in import WallsInParameters
from cityflow.reconstruction.model import ModelParameters
from cityflow.reconstruction.noise.voxel_filter import NoiseParameters
from cityflow.splitting.split import SplitParameters
from cityflow.surface.image_surface import ImageSurfaceParameters
from cityflow.surface.overview import overview_factor
from cityflow.surface.tile_surface import SurfaceParameters
from cityflow.surface.tin import TinParameters
from cityflow.surface.true_ortho import OrthoParameters
from cityflow.survey.atlas_parameters import AtlasParameters
from cityflow.survey.orient_parameters import RefineParameters
from cityflow.survey.raw_parameters import RawInput
from cityflow.texture.unit import TextureParameters
from cityflow.viewer.report_parameters import ReportParameters
from cityflow.windows.window_parameters import WindowParameters

CELLS_M = (0.02, 0.025, 0.04, 0.05, 0.08, 0.1, 0.125, 0.2, 0.25, 0.4, 0.5, 1.0)
"""Cells of a surface from images: each divides ten metres, so that tiles of any multiple of ten metres are whole cells."""


if TYPE_CHECKING:
    FormatName = str
else:
    FormatName = Literal[*EXPORT_FORMATS]


class TileParameters(Parameters):
    """How the world is cut."""

    tile_m: float = Field(250.0, ge=50, le=5000, description="edge of a ground tile, m; a multiple of surface.cell_m")
    index_cell_m: float = Field(50.0, ge=10, le=1000, description="edge of a cell of the point index, m")


class OutlineParameters(Parameters):
    """Where outlines come from."""

    source: Literal["auto", "given", "found"] = Field(
        "auto",
        description="given: the catalog's outlines; found: those found in the surface; auto: given where the catalog has some, else found",
    )
    found: FindParameters = FindParameters()
    walls_in: WallsInParameters = WallsInParameters()
    noding_tolerance_m: float = Field(
        0.05, ge=1e-4, le=0.5, description="narrower gaps and overlaps of neighbours are closed, m"
    )


class SplittingParameters(Parameters):
    """Whether and how outlines become single units."""

    when: Literal["found", "always", "never"] = Field(
        "found",
        description="found: only outlines that were found in the surface; always: also given ones, as of a cadastre",
    )
    method: SplitParameters = SplitParameters()


class EditParameters(Parameters):
    """What a person has drawn."""

    path: str = Field(
        "", description="GeoPackage of edits (docs/edits.md), relative to the workflow file or the current folder"
    )


class PointsParameters(Parameters):
    """Where points come from."""

    source: Literal["auto", "lidar", "images", "rasters"] = Field(
        "auto", description="LiDAR files, oriented images, a given DSM; auto: the first of them that the catalog has"
    )


FRAME_HALO_M = 2.0
"""Points this far beyond a ground tile may show in its frames, m; set by hand."""


class ImagesParameters(Parameters):
    """What is made from oriented images."""

    level: int = Field(
        0,
        ge=0,
        le=4,
        description="images are reduced to 1 / 2^level of their width for surfaces: 1 is a quarter of the pixels; textures use all pixels",
    )
    cell_m: float | None = Field(
        None, ge=0.02, le=1, description="cell of DSM and ortho, metres; null: from the ground sampling distance"
    )
    least_views: int = Field(
        3,
        ge=2,
        le=16,
        description="ground counts as surveyed if so many images, a reference image and its partners, see it; fewer if no reference image has so many",
    )
    most_ortho_tilt: float = Field(
        35.0,
        ge=0,
        le=80,
        description="images tilted more than this colour only those parts of the ortho that no other image sees, degrees",
    )
    frames: bool = Field(True, description="tilted DSMs and oblique orthos of clusters of oblique views")


class ExportParameters(Parameters):
    """What is written."""

    formats: tuple[FormatName, ...] = Field(
        ("cityjson", "citygml", "obj", "tiles3d"),
        description="formats per tile; obj_raw has textures in the geometry of the photographs, for renderers that divide; glb has a node per building",
    )
    root_transform: tuple[float, ...] | None = Field(
        None, min_length=16, max_length=16,
        description="where a local frame stands: the 16 numbers of a matrix to the globe (EPSG:4978), column after column, in the root of the 3D Tiles",
    )  # fmt: skip
    drape_px: int = Field(
        4096,
        ge=64,
        le=16384,
        description="longest edge of the ortho on a tile's terrain, pixels; a finer one is reduced",
    )
    terrain: TinParameters = TinParameters()
    join_up_to_tiles: int = Field(
        25,
        ge=0,
        le=400,
        description="cities of at most so many tiles get outlines.gpkg and city.city.jsonl; larger ones a table of units per tile, and `cityflow join`",
    )


class StageLimits(Parameters):
    """What a task of a stage may use; its process is killed beyond it. Never an input to a result."""

    time_s: float = Field(600.0, gt=0, le=86400, description="time, s, without waiting for a core that others use")
    memory_mb: float = Field(6000.0, gt=50, le=1e6, description="memory of the task's process, MB")
    retries: int = Field(1, ge=0, le=10, description="further tries after a crash")


class ExecutionParameters(Parameters):
    """How tasks are run; nothing here changes a result. Each stage has limits of its own under its name (`cityflow.pipeline.workflow_parameters`)."""

    max_in_flight: int | None = Field(
        None, ge=1, description="tasks on the scheduler at once; null: a number per worker"
    )

    def limits_of(self, stage: str) -> Limits:
        chosen: StageLimits = getattr(self, stage)
        return Limits(chosen.time_s, chosen.memory_mb, chosen.retries)


class WallParameters(WallPointParameters):
    """Which points stand on walls, and whether noise is removed before."""

    noise: NoiseParameters = NoiseParameters()


class SurveyParameters(Parameters):
    """All parameters of a run, by stage."""

    tiles: TileParameters = TileParameters()
    points: PointsParameters = PointsParameters()
    raw: RawInput = RawInput()
    orient: RefineParameters = RefineParameters()
    images: ImagesParameters = ImagesParameters()
    look_directions: LookParameters = LookParameters()
    flight: FlightPlanParameters = FlightPlanParameters()
    match: MatchParameters = MatchParameters()
    surface: SurfaceParameters = SurfaceParameters()
    image_surface: ImageSurfaceParameters = ImageSurfaceParameters()
    ortho: OrthoParameters = OrthoParameters()
    walls: WallParameters = WallParameters()
    outline: OutlineParameters = OutlineParameters()
    split: SplittingParameters = SplittingParameters()
    edits: EditParameters = EditParameters()
    reconstruct: ModelParameters = ModelParameters()
    texture: TextureParameters = TextureParameters()
    atlas: AtlasParameters = AtlasParameters()
    windows: WindowParameters = WindowParameters()
    export: ExportParameters = ExportParameters()
    report: ReportParameters = ReportParameters()
    execution: ExecutionParameters = ExecutionParameters()

    @model_validator(mode="after")
    def _tiles_fit(self) -> SurveyParameters:
        """Tiles are whole chunks of whole cells."""
        cells = self.tiles.tile_m / self.surface.cell_m
        if abs(cells - round(cells)) > 1e-9:
            raise ValueError(
                f"tiles.tile_m ({self.tiles.tile_m:g}) is no multiple of surface.cell_m ({self.surface.cell_m:g})"
            )
        asked, tile_m = self.images.cell_m, self.tiles.tile_m
        if asked is not None and not _fits(asked, tile_m):
            fitting = ", ".join(f"{c:g}" for c in CELLS_M if _fits(c, tile_m))
            raise ValueError(
                f"images.cell_m ({asked:g}) does not divide tiles.tile_m ({tile_m:g}); these do: {fitting}"
            )
        return self


def _fits(cell_m: float, tile_m: float) -> bool:
    """Whether a tile is a whole number of fine cells, and of the coarser ones that terrain is found on."""
    cells = tile_m / (cell_m * overview_factor(cell_m))
    return abs(cells - round(cells)) < 1e-9


def nearest_cell(gsd_m: float) -> float:
    """The usual cell nearest to a ground sampling distance, by ratio.

    >>> nearest_cell(0.083), nearest_cell(0.14)
    (0.08, 0.125)
    """
    return min(CELLS_M, key=lambda cell: abs(math.log(cell / gsd_m)))
