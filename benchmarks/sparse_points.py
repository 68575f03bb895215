"""The surface of a run against the tie points of its orientation: no check points, but thousands, and in every survey.

    python benchmarks/sparse_points.py RUN [--picture FILE.png]

They come from the same poses, stand on trees and walls, and a point on a wall or under a crown is metres below the highest surface; so
the figures are given for all, and for those where heights within 5 × 5 cells differ by less than a metre.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from cityflow.catalog.check_images import sparse_points
from cityflow.evaluation.checkpoint_residuals import heights_at
from cityflow.evaluation.statistics import nmad
from cityflow.io.rasters.surface_dataset import grids_of, read_layers
from cityflow.runs.run_folder import open_run
from cityflow.survey.surface_source import ZARR

AROUND_CELLS, LEVEL_M = 5, 1.0


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("run")
    options.add_argument("--picture", type=Path, default=None, help="residuals over the surface, red above the points")
    chosen = options.parse_args()
    run = open_run(chosen.run)
    xyz = sparse_points(run.catalog)
    store = run.store.zarr_store(ZARR)
    whole, grid = grids_of(store)
    _, layers = read_layers(store, whole, grid.bounds, ["dsm", "ortho_seen"])
    dsm = layers["dsm"]
    off = heights_at(dsm, grid, xyz[:, :2]) - xyz[:, 2]
    known = np.isfinite(off)
    filled = np.where(np.isfinite(dsm), dsm, np.inf)
    low = minimum_filter(filled, AROUND_CELLS)
    high = maximum_filter(np.where(np.isfinite(dsm), dsm, -np.inf), AROUND_CELLS)
    row, col = (np.clip(i, 0, n - 1) for i, n in zip(grid.indices(xyz[:, 0], xyz[:, 1]), grid.shape, strict=True))
    level = known & (high - low < LEVEL_M)[row, col]
    print(
        f"cells {grid.shape} of {grid.cell:g} m; measured {np.isfinite(dsm).mean():.1%}, coloured {layers['ortho_seen'].mean():.1%}"
    )
    print(f"points on measured cells: {int(known.sum())} of {len(xyz)}")
    for name, mask in (("all", known), ("level", level)):
        print(
            f"{name:<6} {int(mask.sum()):>7} points: median {np.median(off[mask]):+.3f} m, NMAD {nmad(off[mask]):.3f} m"
        )
    if chosen.picture:
        _draw(chosen.picture, dsm, row[known], col[known], off[known])


def _draw(path: Path, dsm: np.ndarray, row: np.ndarray, col: np.ndarray, off: np.ndarray) -> None:
    fall = np.nan_to_num(np.diff(dsm, axis=1, append=dsm[:, -1:]))
    grey = np.clip(140 + 400 * np.tanh(fall), 0, 255).astype(np.uint8)
    picture = cv2.cvtColor(np.where(np.isfinite(dsm), grey, 60).astype(np.uint8), cv2.COLOR_GRAY2BGR)
    for r, c, d in zip(row.tolist(), col.tolist(), off.tolist(), strict=True):
        cv2.circle(picture, (c, r), 3, (0, 0, 255) if d > 1 else (255, 0, 0) if d < -1 else (0, 200, 0), -1)
    cv2.imwrite(str(path), picture)


if __name__ == "__main__":
    main()
