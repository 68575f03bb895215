"""Stage ``fuse``: the depth maps of a ground tile become one surface at the resolution of the images."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cityflow.core.building import Status
from cityflow.core.depth_map import ImagePoints, joined, points_of
from cityflow.core.grid import Bounds, Grid, bounds_meet, grown
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.workspace import Workspace
from cityflow.io.array_file import decode_arrays, encode_arrays
from cityflow.io.depth_map import decode_depth_map
from cityflow.stages.oriented import of_json, to_json
from cityflow.stages.survey import Survey
from cityflow.surface.fuse import Fused, FuseParameters
from cityflow.surface.fused_tile import FusedTile, fused_tile

STAGE = "fuse"
VERSION = 1
FUSED = "fused.cfa"
UNMATCHED = "without the depths of {}"
POINTS_KEPT = 15_000_000
"""Of some 40 bytes each."""


def task(survey: Survey, name: str) -> Task:
    """The fused surface of one tile, from the depth maps of the tile and of those around whose points it needs."""
    maps = survey.depth_maps(survey.near(name, survey.parameters.image_surface.fuse.halo_m))
    images = {
        i: to_json(survey.images.flown[i].image) for i in sorted({survey.images.flight_tile(u).base for u in maps})
    }
    failed = survey.unmatched([name])
    return Task(
        STAGE, name, "cityflow.stages.fuse:run", VERSION,
        parameters=survey.parameters_for(STAGE, name, survey.parameters.image_surface.fuse),
        inputs={
            **dict(maps.values()), **{f"failed {u}": "missing" for u in failed}, "poses": digest_of(images), "grid": survey.place,
        },
        arguments={
            "bounds": list(survey.tiles[name].bounds), "maps": [path for path, _ in maps.values()], "images": list(images.values()),
            "failed": failed, "cell_m": survey.product_grid.cell, "factor": survey.overview_factor, "bands": survey.images.bands,
        },
        limits=survey.limits(STAGE),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Fuse, and keep heights, precision and colours for whoever needs the surface of this tile."""
    a = task.arguments
    parameters = FuseParameters.model_validate(task.parameters)
    bounds: Bounds = tuple(a["bounds"])
    reach = parameters.halo_m + 2 * a["cell_m"] * a["factor"]
    around = grown(bounds, reach)
    reader = DepthReader(workspace.store, a["maps"], a["images"], a["bands"], around)
    made = fused_tile(reader, bounds, a["cell_m"], a["factor"], parameters)
    workspace.write(FUSED, _encoded(made))
    status, reason = (Status.DEGRADED, UNMATCHED.format(", ".join(a["failed"]))) if a["failed"] else (Status.DONE, "")
    seen = np.isfinite(made.surface.dsm)
    sigma = float(np.median(made.surface.sigma[seen])) if seen.any() else None
    return workspace.outcome(status, reason, {"completeness": float(seen.mean()), "median_sigma_m": sigma})


class DepthReader:
    """Points of depth maps within bounds, in a fixed order; as many maps are kept as memory allows, the others are read again.

    Parameters
    ----------
    paths : of the depth maps in the RUN;  images : their base images as JSON;  bands : of the colours
    around : nothing beyond is ever asked for
    """

    def __init__(
        self, store: Store, paths: Sequence[str], images: Sequence[Mapping[str, Any]], bands: int, around: Bounds
    ) -> None:
        self._store, self._paths, self._bands, self._around = store, list(paths), bands, around
        self._images = {tree["name"]: of_json(tree) for tree in images}
        self._kept: dict[str, ImagePoints] = {}
        self._extent: dict[str, Bounds] = {}

    def __call__(self, bounds: Bounds) -> ImagePoints:
        parts = []
        for path in self._paths:
            if path in self._extent and not bounds_meet(self._extent[path], bounds):
                continue
            points = self._points(path)
            parts.append(points.take(within(points, bounds)))
        return joined(parts, self._bands)

    def _points(self, path: str) -> ImagePoints:
        if path in self._kept:
            return self._kept[path]
        depth_map = decode_depth_map(self._store.read_bytes(path))
        whole = points_of(depth_map, self._images[depth_map.image])
        points = whole.take(within(whole, self._around))
        self._extent[path] = _extent(points)
        if sum(len(p) for p in self._kept.values()) + len(points) <= POINTS_KEPT:
            self._kept[path] = points
        return points


def within(points: ImagePoints, bounds: Bounds) -> NDArray[np.bool_]:
    """Which points stand in `bounds`, half-open."""
    x, y = points.xyz[:, 0], points.xyz[:, 1]
    return np.asarray((x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3]))


def _extent(points: ImagePoints) -> Bounds:
    if not len(points):
        return np.inf, np.inf, -np.inf, -np.inf
    low, high = points.xyz.min(axis=0), points.xyz.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _encoded(tile: FusedTile) -> bytes:
    grid, surface = tile.grid, tile.surface
    said = {"x_min": grid.x_min, "y_max": grid.y_max, "cell": grid.cell, "factor": tile.factor}
    arrays: dict[str, NDArray[Any]] = {
        "dsm": surface.dsm, "count": surface.count, "sigma": surface.sigma, "filled": tile.filled, "colour": tile.colour,
    }  # fmt: skip
    return encode_arrays(arrays, said)


def read_fused(store: Store, path: str) -> FusedTile:
    """What a fuse task wrote."""
    arrays, said = decode_arrays(store.read_bytes(path))
    grid = Grid(said["x_min"], said["y_max"], said["cell"], *arrays["dsm"].shape)
    surface = Fused(grid, arrays["dsm"], arrays["count"], arrays["sigma"])
    return FusedTile(surface, arrays["filled"], said["factor"], arrays["colour"])
