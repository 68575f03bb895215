"""``cityflow raster``: one raster of the whole city on coarser cells, its relief, or its difference from another RUN."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from cityflow.errors import RunError
from cityflow.evaluation.statistics import error_statistics
from cityflow.flow.lazy_arrays import computing
from cityflow.flow.store import Store
from cityflow.io.crs import resolve
from cityflow.runs.run_folder import DESCRIPTION
from cityflow.survey.surface_source import ZARR
from cityflow.workflow.printed import print_json

if TYPE_CHECKING:
    import xarray as xr

LONGEST_SIDE, MOST_CELLS = 8192, 400_000_000
"""Of a raster whose cell nobody chose; of any raster, since all of it is in the memory of this process: 1.6 GB."""


@dataclass(frozen=True, slots=True)
class RasterRequest:
    """What is wanted.

    Attributes
    ----------
    layer : dsm, dtm or ndsm
    cell_m : cell in metres; 0: the finest with at most `LONGEST_SIDE` cells along a side
    relief : shaded, in place of heights
    minus : another RUN, whose heights are taken away; empty for none
    """

    layer: str = "dsm"
    cell_m: float = 0.0
    relief: bool = False
    minus: str = ""


def write_city_raster(
    run: str,
    out: Path,
    request: RasterRequest,
    scheduler: str,
    workers: int,
    console: Console,
    *,
    in_json: bool = False,
) -> None:
    """Write a GeoTIFF with overviews, and print its figures.

    Raises
    ------
    RunError
        There is no surface, the cell does not fit, or the two runs have nothing in common.
    """
    surface = _surface(run)
    factor = _factor(surface, request.cell_m, run)
    cell = factor * float(surface.attrs["cell"])
    with computing(scheduler, workers or os.cpu_count() or 1) as compute:
        heights = _heights(surface, request, factor, cell, run)
        raster = _computed(compute, heights, request, cell)
    _write(raster, out, surface, request)
    tree = _figures(raster, cell, out)
    if in_json:
        print_json(tree)
        return
    for line in _lines(tree):
        console.print(line, markup=False, highlight=False, soft_wrap=True)


def _surface(run: str) -> xr.Dataset:
    from cityflow.io.rasters.surface_dataset import chunked_surface

    store = Store.open(run)
    if not store.exists(f"{ZARR}/zarr.json"):
        problem = "no surface here yet" if store.exists(DESCRIPTION) else "no run here (run.json is missing)"
        raise RunError(problem, where=run, remedy="run a workflow first: cityflow run … --out")
    return chunked_surface(store.zarr_store(ZARR))


def _factor(surface: xr.Dataset, cell_m: float, run: str) -> int:
    """How many cells of the surface one of the raster is wide: a divisor of a tile's, so that no cell lies in two tiles."""
    own, tile = float(surface.attrs["cell"]), int(surface.attrs["chunk_cells"])
    longest = max(surface.sizes["y"], surface.sizes["x"])
    fitting = [n for n in range(1, tile + 1) if tile % n == 0]
    fits = (n for n in fitting if (abs(n * own - cell_m) < 1e-6 * own if cell_m else longest / n <= LONGEST_SIDE))
    chosen = next(fits, 0 if cell_m else tile)
    if not chosen:
        cells = ", ".join(f"{n * own:g}" for n in fitting)
        raise RunError(
            f"cells of {cell_m:g} m do not fit into its tiles", where=run, remedy=f"choose --cell from {cells}"
        )
    count = surface.sizes["y"] * surface.sizes["x"] / chosen**2
    if count > MOST_CELLS:
        raise RunError(
            f"cells of {chosen * own:g} m are {count / 1e6:,.0f} million; at most {MOST_CELLS / 1e6:.0f} million fit",
            where=run, remedy="choose a larger --cell, or use the tiles under products/",
        )  # fmt: skip
    return chosen


def _heights(surface: xr.Dataset, request: RasterRequest, factor: int, cell: float, run: str) -> xr.DataArray:
    from cityflow.surface.lazy_city_raster import coarser, difference

    ours = coarser(surface[request.layer], factor)
    if not request.minus:
        return ours
    other = _surface(request.minus)
    if other.attrs["crs"] != surface.attrs["crs"]:
        raise RunError(
            f"{other.attrs['crs']} there, {surface.attrs['crs']} in {run}", where=request.minus, remedy="compare runs of one CRS"
        )  # fmt: skip
    try:
        theirs = coarser(other[request.layer], _factor(other, cell, request.minus))
        return difference(ours, theirs, cell)
    except ValueError as error:
        raise RunError(str(error), where=request.minus, remedy="compare runs of one area and lattice") from error


def _computed(
    compute: Callable[[Any], Any], heights: xr.DataArray, request: RasterRequest, cell: float
) -> xr.DataArray:
    from cityflow.surface.lazy_city_raster import relief

    found: xr.DataArray = compute(relief(heights, cell) if request.relief else heights)
    return found


def _write(raster: xr.DataArray, out: Path, surface: xr.Dataset, request: RasterRequest) -> None:
    from cityflow.io.rasters.city_geotiff import write_geotiff

    # above terrain, and between two epochs, no datum counts
    heights = request.layer != "ndsm" and not (request.relief or request.minus)
    nodata = 0 if request.relief else float("nan")
    write_geotiff(raster, resolve(str(surface.attrs["crs"])), out, nodata, heights=heights)


def _figures(raster: xr.DataArray, cell: float, out: Path) -> dict[str, Any]:
    values = raster.values
    known = values != 0 if raster.name == "relief" else values == values
    tree: dict[str, Any] = {
        "written": str(out), "cell_m": cell, "cells": list(values.shape), "known_share": round(float(known.mean()), 4)
    }  # fmt: skip
    if raster.name == "relief" or not known.any():
        return tree
    found = error_statistics(values)
    figures = {
        "lowest": float(values[known].min()),
        "highest": float(values[known].max()),
        "mean": found.mean,
        "median": found.bias,
        "nmad": found.nmad,
    }
    return tree | {f"{name}_m": round(value, 3) for name, value in figures.items()}


def _lines(tree: Mapping[str, Any]) -> Iterator[str]:
    """The figures for a person."""
    rows, cols = tree["cells"]
    yield f"Written: {tree['written']}"
    yield f"{rows:,} × {cols:,} cells of {tree['cell_m']:g} m, {100 * tree['known_share']:.1f} % of them known"
    words = {
        "lowest_m": "lowest",
        "highest_m": "highest",
        "mean_m": "mean",
        "median_m": "median",
        "nmad_m": "robust deviation (NMAD)",
    }
    if figures := [f"{word} {tree[name]:.2f}" for name, word in words.items() if name in tree]:
        yield f"Metres: {', '.join(figures)}"
