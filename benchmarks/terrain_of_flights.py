"""Terrain of finished flights over synthetic towns against their truth, by the distance from houses.

    python benchmarks/terrain_of_flights.py RUN SURVEY [RUN SURVEY ...]        # SURVEY: what `cityflow synth` left

Median and 90th percentile of the absolute error, metres, of the cells of the terrain under true houses and beside them.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import rasterio
from rasterio.warp import Resampling, reproject
from scipy.ndimage import distance_transform_edt

from cityflow.core.arrays import Float32Array, FloatArray

BANDS = ((-99.0, -4.0), (-4.0, -1.0), (-1.0, 0.0), (0.0, 0.5), (0.5, 1.0), (1.0, 4.0), (4.0, 99.0))
"""Metres from the outline, negative inside."""


def errors_and_distances(run: Path, survey: Path) -> tuple[FloatArray, FloatArray]:
    """(rows, cols) metres, both; errors are NaN where either terrain is not known."""
    with rasterio.open(run / "products" / "dtm.vrt") as made:
        found = made.read(1, masked=True).filled(np.nan)
        truth, unit = (
            _like(survey / "truth" / f"{name}.vrt", made, how)
            for name, how in (("dtm", Resampling.bilinear), ("unit", Resampling.nearest))
        )
        cell = float(made.transform.a)
    house = np.nan_to_num(unit) > 0
    away = np.where(house, -distance_transform_edt(house), distance_transform_edt(~house)) * cell
    return np.asarray(found - truth, np.float64), away


def _like(path: Path, made: rasterio.DatasetReader, how: Resampling) -> Float32Array:
    out = np.full(made.shape, np.nan, np.float32)
    with rasterio.open(path) as true:
        values = true.read(1, masked=True).astype(np.float32).filled(np.nan)
        reproject(
            values, out, src_transform=true.transform, dst_transform=made.transform, src_crs=made.crs, dst_crs=made.crs,
            resampling=how, src_nodata=np.nan, dst_nodata=np.nan,
        )  # fmt: skip
    return out


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("pairs", nargs="+", type=Path, metavar="RUN SURVEY")
    pairs = options.parse_args().pairs
    if len(pairs) % 2:
        options.error("each RUN wants its SURVEY")
    print("|", " | ".join(["run", *(f"{low:g} to {high:g} m" for low, high in BANDS)]), "|")
    for run, survey in zip(pairs[::2], pairs[1::2], strict=True):
        error, away = errors_and_distances(run, survey)
        told = [np.abs(error[(away > low) & (away <= high) & np.isfinite(error)]) for low, high in BANDS]
        print("|", " | ".join([str(run), *(f"{np.median(e):.2f}, {np.percentile(e, 90):.2f}" if len(e) else "none" for e in told)]), "|")  # fmt: skip


if __name__ == "__main__":
    main()
