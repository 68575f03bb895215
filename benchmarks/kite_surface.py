"""The DSM of a kite survey at labelled places: how far it stands above the terrain on lawn and street, or off the plane on roofs.

    python benchmarks/kite_surface.py RUN                                  # squares of benchmarks/data/boruszyn_places.geojson; ochota_places beside it
    python benchmarks/kite_surface.py RUN --places FILE --against OTHER    # another run beside it

No truth is known here. The terrain is the run's own; a roof's plane is the one that its cells lie nearest to in the median.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import shapely
from scipy import ndimage

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid
from cityflow.io.rasters.surface_dataset import grids_of, read_layers

OFF_M = 1.0
SPIKE_M, SPIKE_M2 = 3.0, 4.0
PLACES = Path(__file__).with_name("data") / "boruszyn_places.geojson"
TRIES = 400


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("run", type=Path)
    options.add_argument("--places", type=Path, default=PLACES)
    options.add_argument("--against", type=Path, default=None)
    o = options.parse_args()
    places = [
        (f["properties"]["label"], int(f["properties"]["place"]), shapely.from_geojson(json.dumps(f["geometry"])))
        for f in json.loads(o.places.read_text())["features"]
    ]
    for run in [o.run, *([o.against] if o.against else [])]:
        print(run.name)
        _report(run, places)


def _report(run: Path, places: list[tuple[str, int, shapely.Polygon]]) -> None:
    off, holes, labels = [], [], []
    for label, number, polygon in places:
        difference = _difference(run, label, polygon)
        off.append(np.abs(difference) if label == "roof" else difference)
        holes.append(np.isnan(difference).mean())
        labels.append(label)
        wrong = float((off[-1] > OFF_M).mean())
        if wrong or holes[-1]:
            print(f"  place {number:>2} {label:<7} {wrong:7.2%} off by more than {OFF_M:g} m, {holes[-1]:7.2%} holes")
    for label in (*sorted(set(labels)), "all"):
        chosen = np.concatenate([v for v, n in zip(off, labels, strict=True) if label in ("all", n)])
        known = chosen[np.isfinite(chosen)]
        print(
            f"  {label:<7} {len(chosen):>6} cells: {np.mean(chosen > OFF_M):8.3%} off by more than {OFF_M:g} m, "
            f"{np.isfinite(chosen).mean():8.3%} measured, 95 % within {np.percentile(np.abs(known), 95):.2f} m"
        )
    number, cells = _spikes(run)
    print(
        f"  the whole run: {_measured(run):.3%} of the cells of its terrain are measured; {number} things of less than {SPIKE_M2:g} m² "
        f"stand {SPIKE_M:g} m and more above it, {cells} cells"
    )


def _difference(run: Path, label: str, polygon: shapely.Polygon) -> FloatArray:
    """(N,) height of the cells in a square over the terrain, or over the roof's plane; NaN in holes."""
    grid, layers = _layers(run, polygon.bounds)
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    inside = shapely.contains_xy(polygon, x, y)
    dsm = layers["dsm"].astype(np.float64)[inside]
    if label != "roof":
        return np.asarray(dsm - layers["dtm"][inside])
    at = np.column_stack([x[inside] - polygon.centroid.x, y[inside] - polygon.centroid.y, np.ones(inside.sum())])
    return np.asarray(dsm - at @ _plane(at[np.isfinite(dsm)], dsm[np.isfinite(dsm)]))


def _plane(at: FloatArray, z: FloatArray) -> FloatArray:
    """The plane through three of the cells with the least median distance of all."""
    rng, best = np.random.default_rng(0), np.inf
    found: FloatArray = np.zeros(3)
    for _ in range(TRIES if len(z) >= 3 else 0):
        three = rng.choice(len(z), 3, replace=False)
        if abs(np.linalg.det(at[three])) < 0.1:
            continue
        plane: FloatArray = np.asarray(np.linalg.solve(at[three], z[three]), np.float64)
        off = float(np.median(np.abs(z - at @ plane)))
        if off < best:
            best, found = off, plane
    return found


def _layers(run: Path, bounds: tuple[float, float, float, float]) -> tuple[Grid, dict[str, FloatArray]]:
    return read_layers(str(run / "surface.zarr"), grids_of(str(run / "surface.zarr"))[0], bounds, ("dsm", "dtm"))


def _whole(run: Path) -> Grid:
    return grids_of(str(run / "surface.zarr"))[1]


def _spikes(run: Path) -> tuple[int, int]:
    """Number and cells of what is high and small: spikes of matching, lamps, lone crowns; to compare two runs of one survey by."""
    grid, layers = _layers(run, _whole(run).bounds)
    label, _ = ndimage.label(layers["dsm"] - layers["dtm"] > SPIKE_M, np.ones((3, 3)))
    size = np.bincount(label.ravel())[1:]
    small = size[size * grid.cell**2 < SPIKE_M2]
    return len(small), int(small.sum())


def _measured(run: Path) -> float:
    _, layers = _layers(run, _whole(run).bounds)
    return float(np.isfinite(layers["dsm"])[np.isfinite(layers["dtm"])].mean())


if __name__ == "__main__":
    main()
