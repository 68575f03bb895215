"""Stages of ``cityflow synth``: the pictures, the LiDAR tiles and the truth tiles of a made town, a task each.

A task makes the part of the town that it needs from the seed; nothing travels between tasks, so a town of any size is made by any number of
workers, and each file depends on the parameters alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cached_property, lru_cache

import cv2
import numpy as np
from pydantic import Field

from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds, Grid, Tile, tiles_over
from cityflow.core.parameters import Parameters
from cityflow.core.reference import Reference
from cityflow.flow.task import Limits, Outcome, Record, Task, digest_of
from cityflow.flow.workspace import Workspace
from cityflow.io.las_write import write_points
from cityflow.io.raster import write_cog
from cityflow.io.reference import crs_of, resolve
from cityflow.stages.oriented import of_json, to_json
from cityflow.synthetic.caster import Scene
from cityflow.synthetic.flight import FlightParameters, plan_flight
from cityflow.synthetic.flight_presets import PRESETS
from cityflow.synthetic.footprints import ground_quad
from cityflow.synthetic.render import RenderParameters, render
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_lidar import TownLidarParameters, town_lidar
from cityflow.synthetic.town_truth import judged_cells, truth_rasters

PICTURE, SCAN, TRUTH = "picture", "scan", "truth"
VERSION = 1
TILE_M = 250.0
SHADOW_M = 60.0
"""What stands this far outside a picture may throw a shadow into it."""
JPEG_QUALITY = 95
LIMITS = Limits(time_s=3600, memory_mb=8000)


class SynthParameters(Parameters):
    """A made survey."""

    seed: int = Field(1, ge=0, description="everything follows from it")
    crs: str = Field("EPSG:7415", description="EPSG:n, or local")
    origin: tuple[float, float] = Field(
        (85000.0, 447000.0), description="south-west corner of the surveyed area, metres"
    )
    size: tuple[float, float] = Field(
        (250.0, 250.0), description="extent of the surveyed area eastwards and northwards, metres"
    )
    surroundings_m: float = Field(
        80.0, ge=0, le=1000, description="the town goes on so far beyond the surveyed area, metres"
    )
    town: TownParameters = TownParameters()
    flight: FlightParameters | None = Field(PRESETS["five_cameras"], description="how pictures are taken; null: none")
    render: RenderParameters = RenderParameters()
    lidar: TownLidarParameters | None = Field(None, description="how the town is scanned; null: not at all")
    truth_cell_m: float = Field(0.08, ge=0.02, le=1, description="cell of the truth rasters, metres")

    @property
    def area(self) -> Bounds:
        """The surveyed area."""
        (x, y), (width, height) = self.origin, self.size
        return x, y, x + width, y + height

    @property
    def whole_town(self) -> TownParameters:
        """The town with its surroundings."""
        (x, y), (width, height), more = self.origin, self.size, self.surroundings_m
        extent = {
            "origin_x": x - more,
            "origin_y": y - more,
            "width_m": width + 2 * more,
            "height_m": height + 2 * more,
        }
        return self.town.model_copy(update=extent)


def made_town(parameters: SynthParameters) -> Town:
    """The town with its surroundings; kept, as several things are asked of it."""
    return _town(parameters.seed, parameters.whole_town)


class SynthSource:
    """The tasks of one made survey; none waits for another."""

    def __init__(self, parameters: SynthParameters) -> None:
        self.parameters = parameters

    @cached_property
    def images(self) -> tuple[OrientedImage, ...]:
        """What is flown, with true poses."""
        p = self.parameters
        if p.flight is None:
            return ()
        town = made_town(p)
        x, y = (p.area[0] + p.area[2]) / 2, (p.area[1] + p.area[3]) / 2
        ground = round(float(town.dtm(np.array([x]), np.array([y]))[0]), 1)
        return plan_flight(p.area, ground, p.flight)

    def initial(self) -> Iterator[Task]:
        """Everything."""
        p = self.parameters
        town = {"seed": p.seed, "town": p.whole_town.model_dump(mode="json")}
        for image in self.images:
            render_how = p.render.model_dump(mode="json")
            yield _task(PICTURE, image.name, {**town, "render": render_how, "image": to_json(image)})
        for tile in tiles_over(p.area, TILE_M):
            place = {"bounds": list(_clipped(tile, p.area)), "crs": p.crs}
            if p.lidar is not None:
                yield _task(
                    SCAN, tile.name, {**town, **place, "lidar": p.lidar.model_dump(mode="json"), "area": list(p.area)}
                )
            yield _task(TRUTH, tile.name, {**town, **place, "cell_m": p.truth_cell_m})

    def after(self, _task: Task, _record: Record) -> Iterable[Task]:
        return ()


def _task(stage: str, unit: str, parameters: dict[str, object]) -> Task:
    return Task(stage, unit, f"cityflow.stages.synth:run_{stage}", VERSION, parameters, limits=LIMITS, in_place=True)


def _clipped(tile: Tile, area: Bounds) -> Bounds:
    x_min, y_min, x_max, y_max = tile.bounds
    return max(x_min, area[0]), max(y_min, area[1]), min(x_max, area[2]), min(y_max, area[3])


@lru_cache(maxsize=2)
def _town(seed: int, parameters: TownParameters) -> Town:
    return make_town(seed, parameters)


def _town_of(task: Task) -> Town:
    return _town(task.parameters["seed"], TownParameters.model_validate(task.parameters["town"]))


def picture_path(name: str, eight_bits: bool) -> str:
    """Where a picture is written, relative to the survey's folder."""
    return f"images/{name}.{'jpg' if eight_bits else 'tif'}"


def run_picture(workspace: Workspace, task: Task) -> Outcome:
    """Render one picture: JPEG of 8 bits, else TIFF."""
    image, town = of_json(task.parameters["image"]), _town_of(task)
    how = RenderParameters.model_validate(task.parameters["render"])
    quad = ground_quad(image, float(town.dtm(*(np.array([c]) for c in image.centre[:2]))[0]) - 5.0)
    low, high = quad.min(axis=0) - SHADOW_M, quad.max(axis=0) + SHADOW_M
    scene = Scene(town.mesh((float(low[0]), float(low[1]), float(high[0]), float(high[1]))))
    pixels = render(scene, image, how, task.parameters["seed"])
    colour = pixels[..., [2, 1, 0, *range(3, pixels.shape[2])]] if pixels.shape[2] >= 3 else pixels
    jpeg = pixels.dtype == np.uint8 and pixels.shape[2] <= 3
    ending, options = (".jpg", [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]) if jpeg else (".tif", [])
    done, data = cv2.imencode(ending, colour, options)
    if not done:
        raise ValueError(f"{image.name} could not be written as {ending}")
    workspace.publish(picture_path(image.name, jpeg), data.tobytes())
    return workspace.outcome(result={"shape": list(pixels.shape)})


def run_scan(workspace: Workspace, task: Task) -> Outcome:
    """Scan one tile from the air."""
    p = task.parameters
    how = TownLidarParameters.model_validate(p["lidar"])
    scanned = town_lidar(_town_of(task), p["seed"], how, tuple(p["bounds"]))
    workspace.publish(f"lidar/{task.unit}.laz", write_points(scanned.points, crs=crs_of(resolve(p["crs"]))))
    truth = replace(scanned.points, classification=scanned.truth_class)
    workspace.publish(f"truth/lidar/{task.unit}.laz", write_points(truth, crs=crs_of(resolve(p["crs"]))))
    return workspace.outcome(result={"points": len(scanned.points)})


def run_truth(workspace: Workspace, task: Task) -> Outcome:
    """True DSM, DTM, parts and units of one tile."""
    p = task.parameters
    grid = Grid.covering(tuple(p["bounds"]), p["cell_m"])
    reference: Reference = resolve(p["crs"])
    truth = truth_rasters(_town_of(task), grid)
    judged = judged_cells(truth)
    rasters: dict[str, np.ndarray] = {
        "dsm": truth.dsm.astype(np.float32), "dsm_bare": truth.dsm_bare.astype(np.float32), "dtm": truth.dtm.astype(np.float32),
        "part": truth.part, "unit": truth.unit.astype(np.int32), "open_cells": judged.open_cells, "rim": judged.rim,
    }  # fmt: skip
    for name, raster in rasters.items():
        nodata = float("nan") if raster.dtype == np.float32 else None
        workspace.publish(f"truth/{name}/{task.unit}.tif", write_cog(raster, grid, reference, nodata))
    return workspace.outcome(result={"cells": grid.rows * grid.cols, "digest": digest_of(list(grid.bounds))})
