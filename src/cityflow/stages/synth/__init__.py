"""Stages of ``cityflow synth``: pictures, calibration frames, LiDAR tiles and truth tiles of a synthetic town, a task each.

A task makes the part of the town that it needs from the seed; nothing travels between tasks, so a town of any size is made by any number of
workers, and each file depends on the parameters alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds, Grid, Tile, tiles_over
from cityflow.core.photo_metadata import PhotoMetadata
from cityflow.core.pixels import PixelArray
from cityflow.core.reference import Reference
from cityflow.flow.task import Limits, Outcome, Record, Task
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.field_types import OrientedField
from cityflow.io.crs import crs_of, resolve
from cityflow.io.images.exif_write import with_exif
from cityflow.io.images.image_write import JPEG_ENDING, TIFF_ENDING, jpeg_bytes, tiff_bytes
from cityflow.io.points.las_write import write_points
from cityflow.io.rasters.raster import write_cog
from cityflow.stages.synth.photo_tags import photo_tags
from cityflow.stages.synth.synthetic_survey import BELOW_M, RawOutput, SynthParameters, town_of
from cityflow.synthetic.caster import Scene
from cityflow.synthetic.footprints import ground_quad
from cityflow.synthetic.render import RenderParameters, irradiance
from cityflow.synthetic.sensor import SensorParameters, exposed
from cityflow.synthetic.sensor_readout import dark_frame, flat_frame, raw_frame
from cityflow.synthetic.town import Town, TownParameters
from cityflow.synthetic.town_lidar import TownLidarParameters, town_lidar
from cityflow.synthetic.town_truth import NO_PART, JudgedCells, TruthRasters, judged_cells, truth_rasters
from cityflow.synthetic.video_flight import VideoParameters

PICTURE, CALIBRATION, SCAN, TRUTH, VIDEO = "picture", "calibration", "scan", "truth", "video"
STAGES = (PICTURE, CALIBRATION, SCAN, TRUTH, VIDEO)
VERSION = 4
SCAN_TILE_M, TRUTH_TILE_M = 250.0, 100.0
DAY = "2026-06-21"
"""Of the survey."""
SHADOW_M = 60.0
"""What stands this far outside a picture may throw a shadow into it."""
SCENE_STEP_M = 100.0
WHOLE_TOWN_M = 450.0
"""A town up to this wide is one scene for all pictures; of a wider one each picture takes its part, cut on a lattice."""
RIM_M = 1.0
LIMITS = Limits(time_s=7200, memory_mb=8000)
LAYERS: dict[str, tuple[str, float | None]] = {
    "dsm": ("float32", float("nan")), "dsm_bare": ("float32", float("nan")), "dtm": ("float32", float("nan")),
    "part": ("uint8", NO_PART), "unit": ("uint32", 0), "open_cells": ("uint8", None), "rim": ("uint8", None),
}  # fmt: skip
"""Truth rasters: dtype, and the value that means nothing is there."""


@dataclass(frozen=True, slots=True)
class PictureParameters(TaskInputs):
    """A picture, of the town that the seed makes; `image` is its true pose, `exif` what the file says of itself."""

    seed: int
    town: TownParameters
    render: RenderParameters
    raw: RawOutput | None
    jpeg_quality: int
    image: OrientedField
    exif: PhotoMetadata | None = None


@dataclass(frozen=True, slots=True)
class FrameParameters(TaskInputs):
    """A dark and a flat frame of a head; `shape` is rows and columns, `number` tells the frames of a head apart."""

    seed: int
    shape: tuple[int, int]
    sensor: SensorParameters
    raw: RawOutput
    number: int
    head: str


@dataclass(frozen=True, slots=True)
class ScanParameters(TaskInputs):
    """A tile of the scan; `bounds` in metres."""

    seed: int
    town: TownParameters
    crs: str
    bounds: Bounds
    lidar: TownLidarParameters


@dataclass(frozen=True, slots=True)
class FilmParameters(TaskInputs):
    """A video over `area` (metres), whose altitude counts from the height `ground_m`."""

    seed: int
    town: TownParameters
    crs: str
    render: RenderParameters
    area: Bounds
    ground_m: float
    video: VideoParameters


@dataclass(frozen=True, slots=True)
class TruthParameters(TaskInputs):
    """A tile of the truth; `bounds` and the cell of its rasters in metres."""

    seed: int
    town: TownParameters
    crs: str
    bounds: Bounds
    cell_m: float


class SynthSource:
    """The tasks of one synthetic survey; none waits for another."""

    def __init__(self, parameters: SynthParameters) -> None:
        self.parameters = parameters

    @property
    def images(self) -> tuple[OrientedImage, ...]:
        """What is flown, with true poses."""
        return self.parameters.images

    def initial(self) -> Iterator[Task]:
        """Everything."""
        p = self.parameters
        tags: Sequence[PhotoMetadata | None] = [None] * len(self.images)
        if p.exif:
            tags = photo_tags(p.given_images, DAY, p.given.position_m, resolve(p.crs))
        for image, exif in zip(self.images, tags, strict=True):
            picture = PictureParameters(p.seed, p.whole_town, p.render, p.raw, p.jpeg_quality, image, exif)
            yield _task(PICTURE, image.name, picture)
        if p.raw is not None:
            yield from self._calibration(p.raw)
        if p.lidar is not None:
            for tile in tiles_over(p.area, SCAN_TILE_M):
                yield _task(
                    SCAN, tile.name, ScanParameters(p.seed, p.whole_town, p.crs, clipped(tile, p.area), p.lidar)
                )
        if p.video is not None:
            film = FilmParameters(p.seed, p.whole_town, p.crs, p.render, p.area, p.video_ground_m, p.video)
            yield _task(VIDEO, VIDEO, film, module="cityflow.stages.synth.film")
        for tile in tiles_over(p.area, TRUTH_TILE_M):
            truth = TruthParameters(p.seed, p.whole_town, p.crs, clipped(tile, p.area), p.truth_cell_m)
            yield _task(TRUTH, tile.name, truth)

    def after(self, _task: Task, _record: Record) -> Iterable[Task]:
        return ()

    def _calibration(self, raw: RawOutput) -> Iterator[Task]:
        p = self.parameters
        assert p.flight is not None
        for head in p.flight.heads:
            camera = p.flight.camera(head)
            shape = camera.height, camera.width
            for number in range(raw.calibration_frames):
                frame = FrameParameters(p.seed, shape, p.render.sensor, raw, number, head.name)
                yield _task(CALIBRATION, f"{head.name}_{number:02d}", frame)


def _task(stage: str, unit: str, parameters: TaskInputs, module: str = "cityflow.stages.synth") -> Task:
    """All that decides is in the parameters; there is nothing to look for."""
    function = f"{module}:run_{stage}"
    return Task(stage, unit, function, VERSION, as_json(parameters), limits=LIMITS, in_place=True)


def clipped(tile: Tile, area: Bounds) -> Bounds:
    """The part of a tile that lies in the area."""
    x_min, y_min, x_max, y_max = tile.bounds
    return max(x_min, area[0]), max(y_min, area[1]), min(x_max, area[2]), min(y_max, area[3])


def picture_path(name: str, jpeg: bool) -> str:
    """Where a picture is written, relative to the survey's folder."""
    return f"images/{name}{JPEG_ENDING if jpeg else TIFF_ENDING}"


def writes_jpeg(render: RenderParameters, jpeg_quality: int) -> bool:
    """Whether pictures are JPEG files: colours of 8 bits only."""
    return jpeg_quality > 0 and render.sensor.bits == 8 and not render.near_infrared


def run_picture(workspace: Workspace, task: Task) -> Outcome:
    """Render one picture, and read the same light out as a raw frame where that is asked for."""
    p = task.parameters_as(PictureParameters)
    image, sensor = p.image, p.render.sensor
    light = irradiance(_scene_of(p), image, p.render)
    if p.raw is not None:
        frame = raw_frame(light, image, sensor, p.raw, p.seed)
        workspace.publish(f"raw/{image.name}{TIFF_ENDING}", tiff_bytes(frame))
    pixels: PixelArray = exposed(light, image, sensor, p.seed)
    jpeg = writes_jpeg(p.render, p.jpeg_quality)
    data = jpeg_bytes(pixels, p.jpeg_quality) if jpeg else tiff_bytes(pixels)
    if p.exif is not None:
        data = with_exif(data, p.exif)
    workspace.publish(picture_path(image.name, jpeg), data)
    return workspace.outcome(result={"shape": list(pixels.shape)})


def run_calibration(workspace: Workspace, task: Task) -> Outcome:
    """One dark frame and one flat frame of a head."""
    p = task.parameters_as(FrameParameters)
    for kind, made in (("dark", dark_frame), ("flat", flat_frame)):
        frame = made(p.shape, p.head, p.number, p.sensor, p.raw, p.seed)
        workspace.publish(f"raw/calibration/{p.head}_{kind}_{p.number:02d}{TIFF_ENDING}", tiff_bytes(frame))
    return workspace.outcome()


def run_scan(workspace: Workspace, task: Task) -> Outcome:
    """Scan one tile from the air."""
    p = task.parameters_as(ScanParameters)
    scanned = town_lidar(town_of(p.seed, p.town), p.seed, p.lidar, p.bounds)
    crs = crs_of(resolve(p.crs))
    workspace.publish(f"lidar/{task.unit}.laz", write_points(scanned.points, crs=crs))
    truth = replace(scanned.points, classification=scanned.truth_class)
    workspace.publish(f"truth/lidar/{task.unit}.laz", write_points(truth, crs=crs))
    return workspace.outcome(result={"points": len(scanned.points)})


def run_truth(workspace: Workspace, task: Task) -> Outcome:
    """True heights, parts and units of one tile, and the cells that surfaces are judged in."""
    p = task.parameters_as(TruthParameters)
    reference: Reference = resolve(p.crs)
    grid = truth_grid(p.bounds, p.cell_m)
    rasters = _truth_layers(town_of(p.seed, p.town), grid)
    for name, raster in rasters.items():
        workspace.publish(f"truth/{name}/{task.unit}.tif", write_cog(raster, grid, reference, LAYERS[name][1]))
    return workspace.outcome(result={"cells": grid.rows * grid.cols})


def truth_grid(bounds: Bounds, cell_m: float) -> Grid:
    """The cells of a truth tile."""
    return Grid.covering(bounds, cell_m)


def _truth_layers(town: Town, grid: Grid) -> dict[str, NDArray[Any]]:
    """Seen with as much around as decides which cells are near an edge, so that no seam shows."""
    ring = int(np.ceil(RIM_M / grid.cell)) + 4
    wide = Grid(
        grid.x_min - ring * grid.cell,
        grid.y_max + ring * grid.cell,
        grid.cell,
        grid.rows + 2 * ring,
        grid.cols + 2 * ring,
    )
    truth: TruthRasters = truth_rasters(town, wide)
    judged: JudgedCells = judged_cells(truth, rim_m=RIM_M)
    layers: dict[str, NDArray[Any]] = {
        "dsm": truth.dsm, "dsm_bare": truth.dsm_bare, "dtm": truth.dtm, "part": truth.part, "unit": truth.unit + 1,
        "open_cells": judged.open_cells, "rim": judged.rim,
    }  # fmt: skip
    return {
        name: np.ascontiguousarray(layer[ring:-ring, ring:-ring].astype(LAYERS[name][0]))
        for name, layer in layers.items()
    }


def _scene_of(p: PictureParameters) -> Scene:
    town = town_of(p.seed, p.town)
    return scene_over(p.seed, town.parameters, scene_bounds(town, p.image))


@lru_cache(maxsize=1)
def scene_over(seed: int, parameters: TownParameters, bounds: Bounds) -> Scene:
    """A scene; kept, as the next picture of this worker often sees the same part."""
    return Scene(town_of(seed, parameters).mesh(bounds))


def scene_bounds(town: Town, image: OrientedImage) -> Bounds:
    """What of the town an image is rendered from: all of a small one, else what it sees and what throws shadows there."""
    whole = town.bounds
    if max(whole[2] - whole[0], whole[3] - whole[1]) <= WHOLE_TOWN_M:
        return whole
    middle = np.clip(image.centre[:2], whole[:2], whole[2:])
    quad = ground_quad(image, float(town.dtm(middle[:1], middle[1:])[0]) - BELOW_M)
    low = np.floor((quad.min(axis=0) - SHADOW_M) / SCENE_STEP_M) * SCENE_STEP_M
    high = np.ceil((quad.max(axis=0) + SHADOW_M) / SCENE_STEP_M) * SCENE_STEP_M
    (x_0, y_0), (x_1, y_1) = np.maximum(low, whole[:2]).tolist(), np.minimum(high, whole[2:]).tolist()
    return x_0, y_0, x_1, y_1
