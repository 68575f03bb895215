"""``cityflow evaluate``: a run's surface and ortho against check points."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds, Grid
from cityflow.core.json_values import rounded
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError, RunError
from cityflow.evaluation.checkpoint_residuals import heights_at, ortho_shift
from cityflow.evaluation.statistics import ErrorStatistics, error_statistics
from cityflow.flow.store import Store
from cityflow.io.crs import vertical_datum
from cityflow.io.rasters.surface_dataset import read_layers
from cityflow.io.tables.checkpoints import Checkpoints, read_checkpoints
from cityflow.reporting.checkpoint_rows import CHECKPOINTS
from cityflow.runs.run_folder import open_run
from cityflow.survey.surface_source import IMAGES, ZARR
from cityflow.survey.survey import Survey
from cityflow.workflow.printed import print_json

BLOCK_M = 100.0
"""Heights are read in windows of this size, so that points far apart do not load the city."""
AROUND_CELLS = 2
"""Rim of what is read around points: a height is interpolated between four cells."""
OTHER_DATUM_M = 10.0
"""A median difference of heights beyond this is doubted: no surface is so wrong, and ellipsoidal heights differ by more in most of Europe; set by hand."""
ALL = "all"


@dataclass(frozen=True, slots=True)
class Evaluation:
    """What was found: a note for each doubt, and residuals (N,) metres of each point, NaN where there is nothing."""

    points: Checkpoints
    height: FloatArray
    place: FloatArray
    has_ortho: bool
    notes: tuple[str, ...]


def evaluate_run(run_url: str, checkpoints: str, console: Console, in_json: bool = False) -> None:
    """Print residuals by kind of point and keep them as ``checkpoints.json`` in the RUN.

    Raises
    ------
    CatalogError, RunError
        The points cannot be read, no surface is there, or no point lies on it.
    """
    run = open_run(run_url)
    reference = run.catalog.reference
    points = read_checkpoints(checkpoints, reference)
    found = evaluated(run.store, run.source().survey, points, reference)
    tree = as_json(found)
    run.store.write_bytes(CHECKPOINTS, (json.dumps(tree, indent=1, sort_keys=True, ensure_ascii=False) + "\n").encode())
    if in_json:
        print_json(tree)
        return
    console.print(_table(tree))
    for note in (*found.notes, f"written: {CHECKPOINTS} in {run.store.root}"):
        console.print(f"Note: {note}", markup=False, highlight=False, soft_wrap=True)


def evaluated(store: Store, survey: Survey, points: Checkpoints, reference: Reference) -> Evaluation:
    """Residuals of every point: measured surface minus point, and where the ortho shows it minus where it is."""
    grid = survey.lattice.product_grid
    covered = survey.lattice.extent(grid.cell)
    surface = _sampled(store, grid, points.xyz, covered.bounds)
    height = surface - points.xyz[:, 2]
    if not np.isfinite(height).any():
        raise CatalogError(
            f"none of {len(height)} points has a measured surface under it; the surface covers {_extent(covered.bounds)}, "
            f"the points {_extent((*points.xyz[:, :2].min(axis=0), *points.xyz[:, :2].max(axis=0)))}",
            remedy="check the points' CRS and the order of X and Y",
        )
    centres = _ortho_centres(survey, points.xyz) if survey.source.kind == IMAGES else None
    place = np.full((len(height), 2), np.nan)
    if centres is not None:
        place = ortho_shift(points.xyz, height, centres)
    return Evaluation(points, height, place, centres is not None, tuple(_notes(height, covered, points, reference)))


def _sampled(store: Store, grid: Grid, xyz: FloatArray, covered: Bounds) -> FloatArray:
    """(N,) bilinear heights of the DSM as measured, block by block."""
    found = np.full(len(xyz), np.nan)
    margin = AROUND_CELLS * grid.cell
    if not store.exists(f"{ZARR}/zarr.json"):
        raise RunError("no surface here yet", where=store.root, remedy="run the workflow first")
    for bounds, chosen in _blocks(xyz, covered, margin):
        window, layers = read_layers(store.zarr_store(ZARR), grid, bounds, ["dsm"])
        found[chosen] = heights_at(layers["dsm"], window, xyz[chosen, :2])
    return found


def _blocks(xyz: FloatArray, covered: Bounds, margin: float) -> Iterable[tuple[Bounds, list[int]]]:
    x_min, y_min, x_max, y_max = covered
    groups: defaultdict[tuple[int, int], list[int]] = defaultdict(list)
    for k, (x, y) in enumerate(xyz[:, :2].tolist()):
        if x_min <= x < x_max and y_min <= y < y_max:
            groups[int(x // BLOCK_M), int(y // BLOCK_M)].append(k)
    for _, chosen in sorted(groups.items()):
        low, high = xyz[chosen, :2].min(axis=0) - margin, xyz[chosen, :2].max(axis=0) + margin
        yield (float(low[0]), float(low[1]), float(high[0]), float(high[1])), chosen


def _ortho_centres(survey: Survey, xyz: FloatArray) -> FloatArray:
    """(N, 3) centre of the steepest image of the tile's ortho that holds each point, NaN where there is none."""
    centres, steepest = np.full(xyz.shape, np.nan), np.full(len(xyz), np.inf)
    for tile in survey.lattice.tiles.values():
        x_min, y_min, x_max, y_max = tile.bounds
        inside = np.flatnonzero((xyz[:, 0] >= x_min) & (xyz[:, 0] < x_max) & (xyz[:, 1] >= y_min) & (xyz[:, 1] < y_max))
        for name in survey.images.ortho_images(tile) if len(inside) else ():
            image = survey.images.views[name].image
            uv, depth = image.project(xyz[inside])
            to_camera = image.centre - xyz[inside]
            lean = np.hypot(to_camera[:, 0], to_camera[:, 1]) / np.maximum(to_camera[:, 2], 1e-9)
            better = image.holds(uv) & (depth > 0) & (lean < steepest[inside])
            steepest[inside[better]] = lean[better]
            centres[inside[better]] = image.centre
    return centres


def _notes(height: FloatArray, grid: Grid, points: Checkpoints, reference: Reference) -> Iterable[str]:
    x_min, y_min, x_max, y_max = grid.bounds
    x, y = points.xyz[:, 0], points.xyz[:, 1]
    outside = ~((x >= x_min) & (x < x_max) & (y >= y_min) & (y < y_max))
    holes = ~outside & ~np.isfinite(height)
    if outside.any():
        yield f"{int(outside.sum())} points outside the surface, {_named(points, outside)}: not counted"
    if holes.any():
        yield f"{int(holes.sum())} points where the surface has no measurement beside them, {_named(points, holes)}: not counted"
    bias = float(np.nanmedian(height))
    if abs(bias) > OTHER_DATUM_M:
        yield (
            f"the surface is {bias:+.1f} m off the points in the median: are their heights in another datum? "
            f"Those of the run are in {vertical_datum(reference)}"
        )


def _named(points: Checkpoints, chosen: np.ndarray) -> str:
    names = [points.names[k] or f"point {k + 1}" for k in np.flatnonzero(chosen)]
    return ", ".join(names[:5]) + (" …" if len(names) > 5 else "")


def _extent(b: Bounds) -> str:
    return f"{b[0]:.0f} … {b[2]:.0f}, {b[1]:.0f} … {b[3]:.0f}"


def as_json(found: Evaluation) -> dict[str, Any]:
    """``{product: {kind: figures}}`` with ``residuals`` of every point beside; metres."""
    series = {"dsm": found.height}
    if found.has_ortho:
        series |= {"ortho east": found.place[:, 0], "ortho north": found.place[:, 1]}
    kinds = np.array(found.points.kinds)
    groups = {ALL: np.ones(len(kinds), bool), **{k: kinds == k for k in sorted({*found.points.kinds} - {"", ALL})}}
    figures = {
        name: {group: _figures(error_statistics(values[mask])) for group, mask in groups.items()}
        for name, values in series.items()
    }
    points = [
        {
            "name": name, "kind": kind, "xyz": xyz, "dsm": rounded(dz, 5),
            "ortho_east": rounded(shift[0], 5), "ortho_north": rounded(shift[1], 5),
        }
        for name, kind, xyz, dz, shift in zip(
            found.points.names, found.points.kinds, found.points.xyz.tolist(), found.height, found.place, strict=True
        )
    ]  # fmt: skip
    return {**figures, "points": points, "notes": list(found.notes)}


def _figures(s: ErrorStatistics) -> dict[str, float | int | None]:
    values = {"bias": s.bias, "mean": s.mean, "nmad": s.nmad, "rmse": s.rmse, "le95": s.le95}
    return {"n": s.count, "missing": s.missing, **{k: rounded(v, 5) for k, v in values.items()}}


def _table(tree: Mapping[str, Any]) -> Table:
    table = Table(title="Residuals at checkpoints, metres (product minus point; bias is the median)")
    for name in ("product", "points", "n", "missing", "bias", "NMAD", "RMSE", "LE95"):
        table.add_column(name, justify="left" if name in ("product", "points") else "right")
    for product, groups in tree.items():
        for kind, f in groups.items() if isinstance(groups, dict) else ():
            cells = [f"{f[k]:+.3f}" if f[k] is not None else "–" for k in ("bias",)]
            cells += [f"{f[k]:.3f}" if f[k] is not None else "–" for k in ("nmad", "rmse", "le95")]
            table.add_row(product, kind, str(f["n"]), str(f["missing"]), *cells)
    return table
