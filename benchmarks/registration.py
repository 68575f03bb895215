"""Photographs of a synthetic town, registered to a scan of it: how far the block is off afterwards, and what is refused.

    python benchmarks/registration.py FOLDER --seed 71                  # the block 5 m and 3 degrees off, the scan of the same town
    python benchmarks/registration.py FOLDER --seed 71 --scan-of 72     # the scan of another town: must be refused
    python benchmarks/registration.py FOLDER --seed 71 --levelled       # as photographs without GNSS positions: any direction, any place

No picture is rendered: tie points are true points (ground, roofs, walls, trees, cars) that three images or more see, measured with errors in these and
triangulated with poses that are each off by a little, as a block has them after its adjustment. FOLDER keeps what was measured. Each line is one JSON value.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from cityflow.adjustment.block import Block
from cityflow.adjustment.coarse_registration import BY_SCALE, OF_A_BLOCK
from cityflow.adjustment.placing import levelled
from cityflow.adjustment.registration import RegistrationError, registered
from cityflow.adjustment.tracks import Ties
from cityflow.adjustment.triangulation import triangulated, well_placed
from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.evaluation.poses import angle_deg, pose_figures
from cityflow.geometry.similarity import Similarity, similarity_between
from cityflow.stages.synth.synthetic_survey import SynthParameters, town_of
from cityflow.synthetic.caster import Scene
from cityflow.synthetic.flight_presets import preset
from cityflow.synthetic.pose_noise import PoseErrors, with_pose_noise
from cityflow.synthetic.town_lidar import TownLidarParameters, town_lidar

FLIGHT = preset("five_cameras", width_px=900, height_px=600, gsd_m=0.1, forward_overlap=0.6, side_overlap=0.5)
OFF = PoseErrors(shift_m=5.0, turn_deg=3.0)
EACH = PoseErrors(position_m=0.01, angle_px=0.15)
"""Of each pose, as refinement leaves them (docs/orient.md)."""
MARK_PX, WRONG_SHARE, WRONG_PX = 0.5, 0.02, 6.0
"""Errors of image coordinates: of all, and of a share of them."""
AROUND_M = 40.0
"""The scan goes on so far beyond the area that is flown over; oblique images see further yet."""
PER_IMAGE = 250
"""Points that are looked for in each image."""


def parameters_of(seed: int, size: tuple[float, float]) -> SynthParameters:
    return SynthParameters(seed=seed, size=size, flight=FLIGHT, lidar=TownLidarParameters(density_m2=8.0), given=OFF)


def measured(p: SynthParameters) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(N, 3) tie points as the block has them that is off as a whole, (N, 3) where they are, and (M, 3) points of the scan."""
    town = town_of(p.seed, p.whole_town)
    scene = Scene(town.mesh(town.bounds))
    rng = np.random.default_rng([p.seed, 71])
    true = np.concatenate([_shown(scene, i, rng) for i in p.images])
    rows = np.concatenate([_observed(scene, k, i, true, rng) for k, i in enumerate(p.images)])
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
    enough = np.bincount(rows[:, 0].astype(np.int64), minlength=len(true)) >= 3
    rows = rows[enough[rows[:, 0].astype(np.int64)]]
    point = np.unique(rows[:, 0], return_inverse=True)[1].reshape(-1)
    ties = Ties(point, rows[:, 1].astype(np.int64), np.arange(len(rows)), rows[:, 2:], np.ones(len(rows)))
    origin = np.array([*p.origin, 0.0])
    block = triangulated(Block.of(_given(p), origin), ties)
    kept = well_placed(block, ties, float(np.radians(5.0)))
    x_min, y_min, x_max, y_max = p.area
    around = x_min - AROUND_M, y_min - AROUND_M, x_max + AROUND_M, y_max + AROUND_M
    scan = town_lidar(town, p.seed, p.lidar, around).points.xyz
    return block.xyz[kept] + origin, true[enough][kept], scan


def _given(p: SynthParameters) -> tuple[OrientedImage, ...]:
    move = p.given_move
    assert move is not None
    return tuple(map(move.moved_image, with_pose_noise(p.images, EACH, p.seed)))


def _shown(scene: Scene, image: OrientedImage, rng: np.random.Generator) -> FloatArray:
    """(N, 3) what an image shows at places anywhere in it."""
    uv = rng.uniform((5, 5), (image.camera.width - 5, image.camera.height - 5), (PER_IMAGE, 2))
    rays = image.rays(uv)
    far = scene.first_hits(image.centre - scene.origin, rays)[1]
    hit = np.isfinite(far)
    return np.asarray(image.centre + rays[hit] * far[hit, None])


def _observed(
    scene: Scene, number: int, image: OrientedImage, true: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """(K, 4) number of the point and of the image, and where the image shows it."""
    uv, depth = image.project(true)
    inside = np.flatnonzero(image.holds(uv) & (depth > 0))
    far = scene.first_hits(image.centre - scene.origin, image.rays(uv[inside]))[1]
    seen = inside[np.abs(far - depth[inside]) < 0.05]
    off = rng.normal(0.0, MARK_PX, (len(seen), 2))
    off[rng.random(len(seen)) < WRONG_SHARE] *= WRONG_PX / MARK_PX
    return np.column_stack([seen, np.full(len(seen), number), uv[seen] + off])


def kept(folder: Path, p: SynthParameters) -> tuple[FloatArray, FloatArray, FloatArray]:
    path = folder / f"measured_{p.seed}_{p.size[0]:g}x{p.size[1]:g}.npz"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        ties, true, scan = measured(p)
        np.savez(path, ties=ties, true=true, scan=scan)
    with np.load(path) as arrays:
        return arrays["ties"], arrays["true"], arrays["scan"]


def judged(p: SynthParameters, by: Similarity, ties: FloatArray, true: FloatArray) -> dict[str, object]:
    """The given block after a similarity: its points against true ones, as a whole and each; its poses against true ones."""
    moved = by.moved(ties)
    off = moved - true
    near = np.linalg.norm(off, axis=1) < 0.5
    middle = true[near].mean(axis=0)
    whole = similarity_between(true[near] - middle, moved[near] - middle)
    poses = pose_figures([by.moved_image(i) for i in _given(p)], p.images)
    return {
        "points off as a whole, m": whole.shift.round(4).tolist(), "and turned, deg": angle_deg(whole.rotation, np.eye(3)), "and scaled": whole.scale,
        "points off median, m": float(np.median(np.linalg.norm(off, axis=1))),
        "centres RMSE, m": poses.centre_rmse_m, "centres plan, m": poses.plan_rmse_m, "centres height, m": poses.height_rmse_m,
        "rotations RMSE, deg": poses.angle_rmse_deg, "rotations median, deg": poses.angle_median_deg,
    }  # fmt: skip


def after(first: Similarity, second: Similarity) -> Similarity:
    """Both, one after the other."""
    return Similarity(second.scale * first.scale, second.rotation @ first.rotation, second.moved(first.shift[None])[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=71)
    parser.add_argument("--size", default="60x50")
    parser.add_argument("--scan-of", type=int)
    parser.add_argument("--levelled", action="store_true")
    asked = parser.parse_args()
    width, height = (float(v) for v in asked.size.split("x"))
    p = parameters_of(asked.seed, (width, height))
    ties, true, scan = kept(asked.folder, p)
    if asked.scan_of is not None:
        scan = kept(asked.folder, parameters_of(asked.scan_of, (width, height)))[2]
    given, search, origin = _given(p), OF_A_BLOCK, np.array([*p.origin, 0.0])
    before = Similarity(1.0, np.eye(3), -origin)
    if asked.levelled:
        # stated height over the ground: 5 % off
        height_m = 1.05 * float(np.median([i.centre[2] for i in p.images]) - np.percentile(ties[:, 2], 10))
        before, search = levelled(given, ties, height_m), BY_SCALE
    begun = time.process_time()
    row: dict[str, object] = {
        "seed": p.seed,
        "scan of": asked.scan_of or p.seed,
        "levelled": asked.levelled,
        "ties": len(ties),
        "scan": len(scan),
    }
    try:
        found = registered(before.moved(ties), scan - origin, search)
    except RegistrationError as error:
        row |= {"refused": str(error), "remedy": error.remedy}
    else:
        by = found.similarity
        row |= judged(p, after(before, Similarity(by.scale, by.rotation, by.shift + origin)), ties, true)
        sigmas = np.sqrt(np.diag(found.fit.covariance))
        row |= {
            "overlap": found.overlap, "raised": found.raised, "agreement": found.agreement, "second": found.second, "coarse": found.coarse,
            "matched": int(found.fit.matched.sum()), "distance, m": found.fit.sigma_m, "open, m": float(found.fit.openness_m[0]),
            "sigma shift, m": sigmas[:3].tolist(), "sigma turn, deg": np.degrees(sigmas[3:6]).tolist(), "sigma scale": float(sigmas[6]),
            "sigma at centres, m": float(np.sqrt(np.mean(found.fit.sigmas_at(np.array([i.centre for i in p.images]) - origin) ** 2))),
        }  # fmt: skip
    row["seconds"] = time.process_time() - begun
    print(json.dumps({k: round(v, 5) if isinstance(v, float) else v for k, v in row.items()}), flush=True)


if __name__ == "__main__":
    main()
