"""What errors of pictures cost the depth maps of single images, poses being true: blur, noise and JPEG, each by itself and together.

    python benchmarks/picture_errors.py SURVEY CATALOG FOLDER       # SURVEY of `cityflow synth`, CATALOG of its true poses

The survey's own pictures are read back as light, spoiled, and written to FOLDER. Reference images are those nearest to the middle, one of each look
direction; their depths are held against those of the town's mesh, three pixels and more from depth steps (`scenes/matched_images.py`).
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from cityflow.core.arrays import ByteArray
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.catalog.stac_assets import ImageAsset
from cityflow.matching.match import MatchParameters
from cityflow.synthetic.sensor import SensorParameters, blurred, noisy, toned
from scenes.matched_images import depth_figures, match_whole, reference_views, tiled_pixels, true_views
from town_images import parameters_of

PERFECT = {"blur_px": 0.0, "exposure": 1.0, "noise": False}
ALMOST = 97
"""Quality of a JPEG that hardly loses anything."""
CASES = {
    "as they are": None,
    "blur of 0.7 px": ({"blur_px": 0.7}, ALMOST),
    "full well of 5,000 e": ({"noise": True, "full_well_e": 5000.0}, ALMOST),
    "JPEG 60": ({}, 60),
    "blur and noise": ({"blur_px": 0.7, "noise": True, "full_well_e": 5000.0}, ALMOST),
    "blur, noise and JPEG 90": ({"blur_px": 0.7, "noise": True, "full_well_e": 5000.0}, 90),
    "blur, noise and JPEG 60": ({"blur_px": 0.7, "noise": True, "full_well_e": 5000.0}, 60),
}
SHOWN = {"away_nmad": "NMAD, GSD", "away_known": "known", "away_within": "within 3 GSD"}


def spoiled(asset: ImageAsset, case: str, folder: Path) -> ImageAsset:
    """The image as a case has it: its file is made where there is none."""
    change = CASES[case]
    if change is None:
        return asset
    path = folder / f"{asset.name}.jpg"
    if not path.exists():
        sensor = SensorParameters(**{**PERFECT, **change[0]})
        shown = cv2.imread(asset.href)
        assert shown is not None, asset.href
        light = blurred(_light(np.asarray(shown, np.uint8)), sensor.blur_px)
        seed = int.from_bytes(asset.name.encode()[-6:], "big")
        values = noisy(light, sensor, np.random.default_rng(seed)) if sensor.noise else light
        folder.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(
            str(path), np.rint(255 * toned(values, sensor)).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, change[1]]
        )
    return replace(asset, href=str(path))


def _light(shown: ByteArray) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    """What the sRGB curve was applied to; white is 1."""
    share = np.arange(256) / 255.0
    curve = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.asarray(curve.astype(np.float32)[shown])


def main(words: Sequence[str] | None = None) -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("survey", "catalog", "folder"):
        options.add_argument(name, type=Path)
    options.add_argument("--images", type=int, default=4)
    options.add_argument("--only", nargs="+", choices=list(CASES), default=list(CASES))
    asked = options.parse_args(words)
    asked.folder.mkdir(parents=True, exist_ok=True)
    catalog = read_catalog(str(asked.catalog))
    views = reference_views(catalog, asked.images, 6)
    names = sorted({n for v in views for n in (v.image.name, *(p.name for p in v.partners))})
    truths = true_views(parameters_of(asked.survey), [v.image for v in views], asked.folder)
    print(f"{'':<26}" + "".join(f"{v.direction:>24}" for v in views) + f"   ({', '.join(SHOWN.values())})")
    for case in asked.only:
        folder = asked.folder / case.replace(" ", "_").replace(",", "")
        used = [a if a.name not in names else spoiled(a, case, folder) for a in catalog.images]
        pixels = tiled_pixels(replace(catalog, images=tuple(used)), names, folder / "tiled")
        cells = []
        for view, truth in zip(views, truths, strict=True):
            depth_map = match_whole(view, pixels, MatchParameters())[1]
            assert depth_map is not None, view.image.name
            found = depth_figures(depth_map, truth)
            cells.append(f"{found['away_nmad']:.2f} {100 * found['away_known']:.1f} {100 * found['away_within']:.1f} %")
        print(f"{case:<26}" + "".join(f"{c:>24}" for c in cells), flush=True)


if __name__ == "__main__":
    main()
