"""Given poses with errors of known size: which standard deviations an adjustment estimates, and how far it leaves poses and points off.

    python benchmarks/pose_sigmas.py --seeds 33 41                   # errors of the preset "spoiled": 2 cm and 0.4 px in each pose by itself

No picture is rendered: 72 images of five heads see places on blocks of different heights, measured with normal errors of `--marks` pixels, a share of them
wrong. A line for each seed, as JSON.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence

import numpy as np

from cityflow.adjustment.block import Block
from cityflow.adjustment.bundle import AdjustmentParameters, adjusted
from cityflow.adjustment.refinement import CELLS
from cityflow.adjustment.tracks import Ties, spread
from cityflow.adjustment.triangulation import triangulated
from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic.flight_presets import preset
from cityflow.synthetic.pose_noise import PoseErrors, with_pose_noise

FLIGHT = preset("five_cameras", width_px=900, height_px=600, gsd_m=0.1, forward_overlap=0.6, side_overlap=0.5)
GSD_M = 0.1
PLACES, SEEN, WRONG = 12000, 0.35, 0.02
"""Places on the ground, the share that an image shows as a feature, and the share of these that are off by twelve times as much."""
BLOCK_M, TALL_M = 18.0, 22.0


def places_around(images: Sequence[OrientedImage], rng: np.random.Generator) -> FloatArray:
    """(P, 3) places on streets and on blocks of different heights."""
    centres = np.array([i.centre for i in images])
    xy = rng.uniform(centres[:, :2].min(axis=0) - 60, centres[:, :2].max(axis=0) + 60, (PLACES, 2))
    block = np.floor(xy / BLOCK_M).astype(np.int64)
    tall = rng.uniform(0, TALL_M, 4000)
    return np.column_stack(
        [xy, np.where(block.sum(axis=1) % 3 > 0, tall[(block[:, 0] * 61 + block[:, 1]) % 4000], 0.0)]
    )


def ties_of(images: Sequence[OrientedImage], seed: int, mark_px: float, wrong: float) -> Ties:
    """What the images would show."""
    rng = np.random.default_rng([seed, 5])
    xyz = places_around(images, rng)
    parts = []
    for number, image in enumerate(images):
        uv, depth = image.project(xyz)
        seen = np.flatnonzero(image.holds(uv, 4.0) & (depth > 0) & (rng.random(len(xyz)) < SEEN))
        off = rng.normal(0, mark_px, (len(seen), 2))
        off[rng.random(len(seen)) < wrong] *= 12
        parts.append(np.column_stack([seen, np.full(len(seen), number), uv[seen] + off]))
    rows = np.concatenate(parts)
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
    rows = rows[np.bincount(rows[:, 0].astype(np.int64), minlength=len(xyz))[rows[:, 0].astype(np.int64)] >= 2]
    point = np.unique(rows[:, 0], return_inverse=True)[1].reshape(-1)
    ties = Ties(point, rows[:, 1].astype(np.int64), np.arange(len(rows)), rows[:, 2:], np.ones(len(rows)))
    return spread(ties, [(i.camera.width, i.camera.height) for i in images], CELLS)


def figures(seed: int, errors: PoseErrors, mark_px: float, wrong: float) -> dict[str, object]:
    p = SynthParameters(seed=seed, size=(50.0, 40.0), flight=FLIGHT, given=errors)
    images, given = p.images, with_pose_noise(p.images, errors, seed)
    ties = ties_of(images, seed, mark_px, wrong)
    origin = np.asarray(np.round(np.mean([i.centre for i in images], axis=0)), np.float64)
    true, begun = Block.of(images, origin), time.process_time()
    found = adjusted(Block.of(given, origin), ties, AdjustmentParameters(calibrate=False))
    seconds = time.process_time() - begun
    off = found.block.centres - true.centres
    given_off = np.array([g.centre - i.centre for g, i in zip(given, images, strict=True)])
    variances = np.einsum("nii->ni", found.covariances)[:, 3:]
    focal = float(np.median([i.camera.fx for i in images]))
    angle = float(np.sqrt(np.mean([errors.angle_rad(i.camera) ** 2 for i in images])))
    points = found.block.xyz - triangulated(true, found.ties).xyz
    return {
        "seed": seed, "images": len(images), "points": ties.points,
        "positions, cm": 100 * found.position_sigma_m, "they are, cm": 100 * float(np.sqrt(np.mean(given_off**2))),
        "rotations, px": found.angle_sigma_rad * focal, "rotations, true px": angle * focal,
        "image coordinates, px": found.sigma_px, "true px": mark_px,
        "centres given, GSD": _rmse(given_off) / GSD_M, "centres adjusted, GSD": _rmse(off) / GSD_M,
        "centres over stated": float(np.sqrt(np.mean(off**2 / variances))),
        "points off as a whole, GSD": (np.median(points, axis=0) / GSD_M).round(3).tolist(), "seconds": seconds,
    }  # fmt: skip


def _rmse(off: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[33])
    parser.add_argument("--position", type=float, default=0.02, help="errors of positions, metres per axis")
    parser.add_argument("--angle", type=float, default=0.4, help="errors of rotations, pixels per axis")
    parser.add_argument("--marks", type=float, default=0.6, help="errors of image coordinates, pixels")
    parser.add_argument("--wrong", type=float, default=WRONG)
    asked = parser.parse_args()
    errors = PoseErrors(position_m=asked.position, angle_px=asked.angle)
    for seed in asked.seeds:
        row = figures(seed, errors, asked.marks, asked.wrong)
        print(json.dumps({k: round(v, 3) if isinstance(v, float) else v for k, v in row.items()}), flush=True)


if __name__ == "__main__":
    main()
