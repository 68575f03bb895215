"""Measured figures of a run over a synthetic town: surface, façades, terrain, vegetation, time and memory.

Nothing is taken from the run but its products and, for time and memory, its records; truth comes from the town itself, by rays.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import laspy
import numpy as np
import shapely

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds, Grid
from cityflow.core.points import HIGH_VEGETATION, LOW_VEGETATION, MEDIUM_VEGETATION, NOISE
from cityflow.evaluation.dsm import DsmFigures, dsm_figures
from cityflow.evaluation.facade_coverage import FacadeFigures, WallSamples, facade_figures, wall_samples
from cityflow.evaluation.statistics import nmad, rmse
from cityflow.evaluation.terrain_accuracy import mask_scores
from cityflow.io.rasters.surface_dataset import grids_of, read_layers
from cityflow.synthetic.caster import Scene
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.town import Town
from cityflow.synthetic.town_facades import Wall
from cityflow.synthetic.town_truth import TruthRasters, judged_cells, truth_rasters

WITHIN_GSD = 3.0
BEFORE_WALL_M = 0.03
"""Rays start this far before a wall, so that they do not meet it."""
OVER_TOWN_M = 60.0
"""Images look at a wall past what stands this far around the judged area."""
PLANTS = (LOW_VEGETATION, MEDIUM_VEGETATION, HIGH_VEGETATION)
TREE_M = 2.0
GROUND = (Part.GROUND, Part.STREET)


@dataclass(frozen=True)
class Judge:
    """Truth over an area, against which any number of runs is held.

    Attributes
    ----------
    bounds : the judged area;  cell_m : of the DSM
    images : those of the survey, with true poses
    """

    town: Town
    bounds: Bounds
    cell_m: float
    images: Sequence[OrientedImage]

    @cached_property
    def grid(self) -> Grid:
        return Grid.covering(self.bounds, self.cell_m)

    @cached_property
    def truth(self) -> TruthRasters:
        return truth_rasters(self.town, self.grid)

    @cached_property
    def _walls(self) -> list[Wall]:
        """Those that reach into the area."""
        x_min, y_min, x_max, y_max = self.bounds
        box = shapely.box(x_min, y_min, x_max, y_max)
        return [w for w in self.town.walls if w.length > 0 and box.intersects(shapely.LineString([w.a, w.b]))]

    @cached_property
    def walls(self) -> list[FloatArray]:
        """Rings of the walls."""
        return [ring_of(w) for w in self._walls]

    @cached_property
    def samples(self) -> WallSamples:
        return wall_samples(self.walls)

    @cached_property
    def views(self) -> IntArray:
        """(N,) how many images see each sample of the walls; none beyond the area."""
        x_min, y_min, x_max, y_max = self.bounds
        far = (x_min - OVER_TOWN_M, y_min - OVER_TOWN_M, x_max + OVER_TOWN_M, y_max + OVER_TOWN_M)
        outward = np.array([[*w.outward, 0.0] for w in self._walls]).reshape(-1, 3)[self.samples.wall]
        found = views_of(Scene(self.town.mesh(far)), self.images, self.samples.xyz, outward)
        x, y = self.samples.xyz[:, 0], self.samples.xyz[:, 1]
        return np.where((x >= x_min) & (x < x_max) & (y >= y_min) & (y < y_max), found, 0)


def ring_of(wall: Wall) -> FloatArray:
    """(n, 3) world corners of an upright wall; its upper edge may have steps."""
    start, stop = wall.profile[:, [0, 2]], wall.profile[:, [1, 3]]
    upper = np.stack([start, stop], axis=1).reshape(-1, 2)
    flat = np.concatenate([[[0.0, wall.bottom], [wall.length, wall.bottom]], upper[::-1]])
    return np.column_stack([wall.a + flat[:, :1] * wall.along, flat[:, 1]])


def views_of(scene: Scene, images: Sequence[OrientedImage], xyz: FloatArray, outward: FloatArray) -> IntArray:
    """How many images see each place on a wall from the outside, nothing standing between."""
    views = np.zeros(len(xyz), np.int64)
    before = xyz + BEFORE_WALL_M * outward
    for image in images:
        uv, depth = image.project(xyz)
        ray = image.centre - before
        near = np.flatnonzero((depth > 0) & image.holds(uv) & (np.einsum("ij,ij->i", ray, outward) > 0))
        if near.size:
            views[near] += ~scene.occluded(before[near] - scene.origin, ray[near])
    return views


@dataclass(frozen=True, slots=True)
class Surface:
    """What a run says of the judged area.

    Attributes
    ----------
    dsm : (rows, cols) as measured, NaN in holes;  filled, dtm : metres;  klass : ASPRS classes;  seen : ortho has a colour
    """

    dsm: Float32Array
    filled: Float32Array
    dtm: Float32Array
    klass: IntArray
    seen: BoolArray


def read_surface(run: Path, bounds: Bounds) -> Surface:
    """The layers of `surface.zarr` over the judged area."""
    store = str(run / "surface.zarr")
    names = ("dsm", "dsm_filled", "dtm", "class", "ortho_seen")
    _, layers = read_layers(store, grids_of(store)[0], bounds, names)
    return Surface(*(layers[n] for n in names))


def surface_figures(found: Float32Array, judge: Judge) -> dict[str, float]:
    """The figures asked for, in cells; shares of measured cells, and of all with holes as misses."""
    judged = judged_cells(judge.truth)
    difference = (np.asarray(found, np.float64) - judge.truth.dsm) / judge.cell_m
    inner, rim = difference[judged.open_cells], difference[judged.rim]
    return {
        "nmad_gsd": nmad(inner), "bias_gsd": float(np.nanmedian(inner)),
        "within": _within(inner[np.isfinite(inner)]), "within_holes_missed": _within(inner),
        "completeness": float(np.isfinite(inner).mean()),
        "rim": _within(rim[np.isfinite(rim)]), "rim_holes_missed": _within(rim), "rim_completeness": float(np.isfinite(rim).mean()),
        "cells": float(inner.size), "rim_cells": float(rim.size),
    }  # fmt: skip


def _within(difference: FloatArray) -> float:
    return float((np.abs(difference) <= WITHIN_GSD).mean()) if difference.size else float("nan")


def other_surface_figures(found: Float32Array, judge: Judge) -> DsmFigures:
    """The same by `evaluation.dsm`, which needs no town: any step of a roof is a rim, and hidden ground counts."""
    part = judge.truth.part
    return dsm_figures(found, judge.truth.dsm, np.isin(part, (*GROUND, Part.ROOF)), part == Part.ROOF, judge.cell_m)


def read_points(run: Path, bounds: Bounds, with_noise: bool = True) -> FloatArray:
    """(N, 3) points of the run's cloud in the area and half a metre around."""
    x_min, y_min, x_max, y_max = bounds[0] - 0.5, bounds[1] - 0.5, bounds[2] + 0.5, bounds[3] + 0.5
    parts = [np.empty((0, 3))]
    for path in sorted((run / "products" / "points").glob("*.laz")):
        cloud = laspy.read(path)
        xyz = np.asarray(cloud.xyz)
        if not with_noise:
            xyz = xyz[~np.isin(cloud.classification, NOISE)]
        inside = (xyz[:, 0] >= x_min) & (xyz[:, 0] < x_max) & (xyz[:, 1] >= y_min) & (xyz[:, 1] < y_max)
        parts.append(xyz[inside])
    return np.concatenate(parts)


def wall_figures(run: Path, judge: Judge) -> FacadeFigures:
    return facade_figures(read_points(run, judge.bounds), judge.walls, judge.samples, judge.views)


def terrain_figures(found: Surface, judge: Judge) -> dict[str, float]:
    """RMSE of the DTM in the open and under what stands there, metres; vegetation's precision and recall."""
    truth = judge.truth
    ground = np.isin(truth.part, GROUND)
    built = (truth.unit >= 0) & ~ground
    off = np.asarray(found.dtm, np.float64) - truth.dtm
    plants = np.isin(found.klass, PLANTS)
    trees = (truth.part == Part.FOLIAGE) & (truth.dsm - truth.dtm > TREE_M)
    low = (truth.part == Part.FOLIAGE) & ~trees
    precision, recall = mask_scores(plants, trees, ~low & np.isfinite(truth.dsm))
    return {
        "dtm_open_rmse": rmse(off[ground]), "dtm_open_bias": float(np.nanmedian(off[ground])), "dtm_built_rmse": rmse(off[built]),
        "dtm_all_rmse": rmse(off), "plants_precision": precision, "plants_recall": recall, "ortho_seen": float(found.seen.mean()),
    }  # fmt: skip


def stage_figures(run: Path) -> dict[str, dict[str, float]]:
    """Tasks, seconds, highest memory and, for `match`, seconds inside the library, by stage; of the newest attempts."""
    figures: dict[str, dict[str, float]] = {}
    for folder in sorted((run / "records").iterdir()):
        newest = [sorted(unit.glob("*.json"))[-1] for unit in sorted(folder.iterdir()) if any(unit.glob("*.json"))]
        records = [json.loads(p.read_bytes()) for p in newest]
        figures[folder.name] = {
            "tasks": len(records), "seconds": sum(r["seconds"] for r in records), "peak_mb": max(r["peak_mb"] for r in records),
            "failed": sum(r["status"] == "failed" for r in records),
            "sgm_seconds": sum(r["result"].get("sgm_seconds", 0.0) for r in records),
        }  # fmt: skip
    return figures
