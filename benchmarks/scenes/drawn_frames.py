"""Surfaces and true orthos of five look directions over a synthetic town, drawn from the truth with the errors of a good matcher.

To match a town from pictures takes an hour; what splitting and outlines are to be tried on need not. Heights and colours come from parallel rays;
what dense matching makes of them was measured on a matched town (`HeightNoise`). Every cell's errors belong to the cell, so that another area of
the same town gives the same surface where both overlap, a rim of `RIM_M` apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from cityflow.core.arrays import Float32Array, FloatArray, IntArray
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.core.local_frame import LocalFrame
from cityflow.core.parameters import Parameters
from cityflow.core.splitting import FrameRasters
from cityflow.synthetic.ambient import AmbientParameters
from cityflow.synthetic.caster import NOTHING, Scene
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.render import RenderParameters
from cityflow.synthetic.sensor import blurred, noisy, toned
from cityflow.synthetic.town import Town
from cityflow.synthetic.town_truth import without
from scenes.drawn_heights import FLAT, LEAVES, UPRIGHT, HeightNoise, TrueView, matched_heights
from scenes.drawn_noise import smooth_noise
from scenes.drawn_views import ParallelView, grid_over_area, parallel_heights, parallel_view

NADIR, COMPASS = "nadir", ("north", "east", "south", "west")
ORIGIN_STEP_M = 1000.0
AROUND_M = 60.0
"""What stands this far around still throws shadows on the area, and hides it from tilted views."""
RIM_M = 3.0
FILLED_CELLS = 5
"""Narrower holes are filled before an ortho is coloured."""
UPRIGHT_SHARE = 0.3
"""A face whose normal rises by less than this is a wall."""
IMAGE_PATCH_M = 25.0
"""So wide are the parts of an ortho that come from one image."""
FOLIAGE = (Part.FOLIAGE, Part.TRUNK)


NADIR_NOISE = HeightNoise(
    level_gsd=0.15,
    coarse_share=0.5,
    rounded_cells=1.0,
    widened_cells=1.0,
    frayed=0.05,
    leaf_missing=0.1,
    leaf_sunk=0.5,
    gap_m=1.3,
    slit_m=0.5,
)
"""Many more rays meet from above, and under wider angles; small crowns drown in the ground around them."""


class DrawnParameters(Parameters):
    """Which look directions are drawn, how fine, and how badly."""

    oblique_cell_m: float = Field(0.12, ge=0.02, le=1, description="cells of the tilted local frames, metres")
    tilt_deg: float = Field(45.0, gt=10, lt=80, description="of the tilted views, from straight down, degrees")
    heading_deg: float = Field(
        20.0, ge=-45, le=45, description="the tilted views look this much clockwise of the compass points, degrees"
    )
    nadir: HeightNoise = Field(NADIR_NOISE, description="errors of the nadir surface")
    tilted: HeightNoise = Field(HeightNoise(), description="errors of the tilted surfaces")
    blur_px: float = Field(0.7, ge=0, le=5, description="blur of the ortho (Gaussian), cells")
    colour_noise: float = Field(
        0.012, ge=0, le=0.5, description="noise of each band beyond the sensor's, share of white"
    )
    lean_deg: float = Field(
        5.0,
        ge=0,
        le=30,
        description="images look this far off the local frame's direction (standard deviation), degrees: wrong heights shift the ortho",
    )
    render: RenderParameters = Field(
        RenderParameters(ambient=AmbientParameters(rays=8)), description="light and sensor"
    )


@dataclass(frozen=True, slots=True)
class DrawnFrame:
    """A local frame's rasters with what is true of its cells.

    Attributes
    ----------
    rasters : what matching would leave
    true_height : (rows, cols) float64, local frame metres
    triangle : (rows, cols) int64 of the mesh that it was drawn from, -1 for none
    kind : (rows, cols) uint8, `FLAT`, `UPRIGHT` or `LEAVES`
    """

    rasters: FrameRasters
    true_height: FloatArray
    triangle: IntArray
    kind: NDArray[np.uint8]


def drawn_frames(
    town: Town, bounds: Bounds, gsd_m: float = 0.08, seed: int = 0, parameters: DrawnParameters | None = None
) -> tuple[FrameRasters, ...]:
    """Rasters of the nadir frame and four tilted ones over `bounds` (world metres); the same seed gives the same.

    Parameters
    ----------
    gsd_m : cell of the nadir frame; those of the tilted ones are in the parameters
    seed : of the errors; the town has its own
    """
    return tuple(f.rasters for f in drawn_with_truth(town, bounds, gsd_m, seed, parameters))


def drawn_with_truth(
    town: Town, bounds: Bounds, gsd_m: float = 0.08, seed: int = 0, parameters: DrawnParameters | None = None
) -> tuple[DrawnFrame, ...]:
    """As `drawn_frames`, with the truth beside."""
    p = parameters or DrawnParameters()
    area = grown(bounds, RIM_M)
    mesh = town.mesh(grown(bounds, AROUND_M))
    scenes = Scene(mesh), Scene(without(mesh, FOLIAGE))
    return tuple(
        _drawn(scenes, frame, (bounds, area), (cell, seed + 100 * (k + 1)), p)
        for k, (frame, cell) in enumerate(look_frames(bounds, gsd_m, p))
    )


def look_frames(bounds: Bounds, gsd_m: float, parameters: DrawnParameters) -> list[tuple[LocalFrame, float]]:
    """The nadir frame and the tilted ones, with their cells (metres)."""
    middle = np.array([(bounds[0] + bounds[2]) / 2, (bounds[1] + bounds[3]) / 2])
    origin = np.array([*(np.round(middle / ORIGIN_STEP_M) * ORIGIN_STEP_M), 0.0])
    frames = [(LocalFrame(NADIR, np.eye(3), origin), gsd_m)]
    tilt = np.radians(parameters.tilt_deg)
    for k, compass in enumerate(COMPASS):
        azimuth = np.radians(parameters.heading_deg + 90.0 * k)
        level = np.sin(tilt)
        looking = np.array([level * np.sin(azimuth), level * np.cos(azimuth), -np.cos(tilt)])
        name = f"{compass}_{round(parameters.tilt_deg):02d}"
        frames.append((LocalFrame(name, _rotation(looking), origin), parameters.oblique_cell_m))
    return frames


def _rotation(looking: FloatArray) -> FloatArray:
    """(3, 3) frame_from_world: z against the view, x level, y as upright as can be."""
    z = -looking
    y = np.array([0.0, 0.0, 1.0]) - z[2] * z
    y /= np.linalg.norm(y)
    return np.array([np.cross(y, z), y, z])


def _drawn(
    scenes: tuple[Scene, Scene],
    frame: LocalFrame,
    areas: tuple[Bounds, Bounds],
    drawing: tuple[float, int],
    p: DrawnParameters,
) -> DrawnFrame:
    """One local frame of a scene, which is given once more without trees."""
    (scene, bare), (cell, seed) = scenes, drawing
    heights = float(scene.mesh.vertices[:, 2].min()), float(scene.mesh.vertices[:, 2].max())
    grid = grid_over_area(frame, areas[1], heights, cell)
    view = parallel_view(scene, frame, grid, areas[1], p.render)
    signal = _exposed(view.light, p)
    behind = parallel_heights(bare, frame, grid)
    true = TrueView(grid, view.height, behind, _kinds(scene, view), ~view.lit, _contrast(signal))
    dsm = matched_heights(true, p.nadir if frame.name == NADIR else p.tilted, seed)
    ortho = _ortho(signal, dsm, true, seed, p)
    known = np.isfinite(view.height)
    whole = DrawnFrame(FrameRasters(frame, grid, dsm, ortho, ortho[0] > 0), view.height, view.triangle, true.kind)
    core = grid_over_area(frame, areas[0], heights, cell) if frame.name == NADIR else _trimmed(grid, known)
    return _cut(whole, core)


def _trimmed(grid: Grid, known: np.ndarray) -> Grid:
    rows, cols = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    if not len(rows):
        return grid
    top, left = int(rows[0]), int(cols[0])
    height, width = int(rows[-1]) + 1 - top, int(cols[-1]) + 1 - left
    return Grid(grid.x_min + left * grid.cell, grid.y_max - top * grid.cell, grid.cell, height, width)


def _cut(drawn: DrawnFrame, grid: Grid) -> DrawnFrame:
    part = drawn.rasters.grid.slices(grid)
    return DrawnFrame(cut_rasters(drawn.rasters, grid), drawn.true_height[part], drawn.triangle[part], drawn.kind[part])


def cut_rasters(rasters: FrameRasters, grid: Grid) -> FrameRasters:
    """The part of a local frame's rasters over a smaller grid of the same lattice."""
    rows, cols = rasters.grid.slices(grid)
    ortho = None if rasters.ortho is None else rasters.ortho[:, rows, cols].copy()
    seen = None if rasters.seen is None else rasters.seen[rows, cols].copy()
    return replace(rasters, grid=grid, dsm=rasters.dsm[rows, cols].copy(), ortho=ortho, seen=seen)


def _kinds(scene: Scene, view: ParallelView) -> NDArray[np.uint8]:
    met = view.triangle != NOTHING
    upright = np.abs(scene.surfaces.normal[:, 2]) < UPRIGHT_SHARE
    kind = np.where(upright, UPRIGHT, FLAT).astype(np.uint8)
    kind[np.isin(scene.surfaces.part, [int(part) for part in FOLIAGE])] = LEAVES
    return np.where(met, kind[view.triangle], FLAT).astype(np.uint8)


def _exposed(light: Float32Array, p: DrawnParameters) -> Float32Array:
    """(rows, cols, bands) light as share of saturation, blurred."""
    return blurred(light, p.blur_px) * np.float32(p.render.sensor.exposure)


def _contrast(signal: Float32Array) -> Float32Array:
    """(rows, cols) standard deviation of grey values (of 255) over 5 x 5 cells."""
    grey = 255.0 * np.clip(signal, 0, 1).mean(axis=2) ** np.float32(1 / 2.2)
    mean = cv2.blur(grey, (5, 5))
    return np.sqrt(np.maximum(cv2.blur(grey * grey, (5, 5)) - mean * mean, 0.0)).astype(np.float32)


def _ortho(signal: Float32Array, dsm: Float32Array, true: TrueView, seed: int, p: DrawnParameters) -> NDArray[np.uint8]:
    """(bands, rows, cols) colours: moved where heights are wrong, noisy, black in wide holes."""
    grid, cell = true.grid, true.grid.cell
    error = np.nan_to_num(dsm - true.height).astype(np.float32)
    lean = np.float32(np.tan(np.radians(p.lean_deg)))
    across = [lean * smooth_noise(grid, seed + 50 + k, 0.5 * IMAGE_PATCH_M / cell) for k in range(2)]
    row, col = np.indices(grid.shape, np.float32)
    towards = col - error * across[0] / cell, row + error * across[1] / cell
    moved = np.asarray(cv2.remap(signal, *towards, cv2.INTER_LINEAR), np.float32)
    rng = np.random.default_rng([seed, 3])
    sensor = p.render.sensor
    values = toned(noisy(moved, sensor, rng), sensor)
    extra = np.stack([smooth_noise(grid, seed + 60 + b, 0.0) for b in range(values.shape[2])], axis=2)
    values = np.clip(values + np.float32(p.colour_noise) * extra, 1.0 / 255.0, 1.0)
    holes = cv2.morphologyEx(
        np.isnan(dsm).astype(np.uint8), cv2.MORPH_OPEN, np.ones((FILLED_CELLS, FILLED_CELLS), np.uint8)
    )
    values[(holes > 0) | np.isnan(true.height)] = 0.0
    return np.ascontiguousarray(np.rint(values * 255.0).astype(np.uint8).transpose(2, 0, 1))
