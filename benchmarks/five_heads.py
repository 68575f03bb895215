"""A flight of five heads without pictures: what features and matches would be, mapped, placed and adjusted as ``cityflow orient`` does it.

    python benchmarks/five_heads.py --seed 5                  # GNSS noise of 0.1 m and 1 m, with five control points and without any

One nadir head and four that look 45° to the sides, 80 images of 0.75 MP, ground sampling distance 0.1 m below the nadir head. Each head has a lens of its own:
a focal length 1 % off what its files say (standard deviation), a principal point off the middle by 5 px, 1 % of distortion in the corners. Features are exact
to 0.4 px, 4 % of the matches are wrong. GNSS errors are those of the station: all heads share them; heights are 1.5 times worse. There are no pictures, so
that nothing is said of features and matching.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cityflow.adjustment.georeferencing import Positions, georeferenced
from cityflow.adjustment.mapping import MappedModel, MappingInput, mapped
from cityflow.adjustment.pair_geometry import pair_geometry, pycolmap_camera
from cityflow.adjustment.tracks import of_tracks
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.control_points import ControlPoint, ControlPoints, Mark, Role
from cityflow.evaluation.poses import pose_figures
from cityflow.geometry.rotations import from_omega_phi_kappa
from cityflow.io.crs import resolve
from cityflow.workflow.gnss_places import GnssPlaces
from cityflow.workflow.photo_placing import Placing, place

GSD_M, HEIGHT_M, WIDTH, ROWS = 0.1, 110.0, 1000, 750
TILTS = ((0.0, 0.0), (45.0, 0.0), (-45.0, 0.0), (0.0, 45.0), (0.0, -45.0))
"""Omega and phi of the heads, degrees."""
STATIONS, STRIPS, OVERLAP, SIDE = 4, 4, 0.7, 0.6
POINTS, FEATURE_PX, SEEN, MATCHED, WRONG = 9000, 0.4, 0.8, 0.7, 0.04
MOST_TURN_DEG = 38.0
"""Beyond this, descriptors of one place do not match any more."""
PARTNERS = 14
STATED_SIGMA = 0.01
MARK_PX, PLACE_M = 0.3, 0.01
ORIGIN = np.array([458000.0, 5428000.0, 100.0])
CRS = "EPSG:25832"


@dataclass(frozen=True)
class Flight:
    """True images by name, the focal length that files state for each head, heads and stations of the images, (P, 3) places."""

    images: tuple[OrientedImage, ...]
    stated: tuple[float, ...]
    head: np.ndarray
    station: np.ndarray
    xyz: np.ndarray


def flight(seed: int, apart_m: float) -> Flight:
    rng = np.random.default_rng(seed)
    focal = HEIGHT_M / GSD_M
    cameras, stated, offsets = [], [], []
    for _ in TILTS:
        f = focal * (1 + rng.normal(0, STATED_SIGMA))
        lens = (-0.06 + rng.normal(0, 0.01), 0.05 + rng.normal(0, 0.01), *rng.normal(0, 2e-4, 2))
        cx, cy = np.array([WIDTH, ROWS]) / 2 + rng.normal(0, 5, 2)
        cameras.append(Camera(WIDTH, ROWS, f, f, float(cx), float(cy), tuple(float(v) for v in lens)))
        stated.append(focal)
        offsets.append(rng.normal(0, apart_m, 3))
    level = from_omega_phi_kappa(0.0, 0.0, 0.0)
    mounts = [from_omega_phi_kappa(*np.radians([o, p, 0.0]) + rng.normal(0, 0.005, 3)) @ level.T for o, p in TILTS]
    forward, side = ROWS * GSD_M * (1 - OVERLAP), WIDTH * GSD_M * (1 - SIDE)
    images, head, station = [], [], []
    for strip in range(STRIPS):
        for along in range(STATIONS):
            turn = 180.0 * (strip % 2)
            body = from_omega_phi_kappa(*np.radians([0.0, 0.0, turn]) + rng.normal(0, 0.02, 3))
            middle = np.array([side * strip, forward * along, HEIGHT_M]) + rng.normal(0, 1.0, 3)
            for k, mount in enumerate(mounts):
                centre = middle + body.T @ offsets[k] + ORIGIN
                images.append(OrientedImage(f"s{strip}{along}h{k}", cameras[k], mount @ body, centre))
                head.append(k)
                station.append(strip * STATIONS + along)
    low, high = np.array([-110.0, -110.0]), np.array([side * (STRIPS - 1) + 110, forward * (STATIONS - 1) + 110])
    xy = rng.uniform(low, high, (POINTS, 2))
    block = np.floor(xy / 18.0).astype(np.int64)
    tall = np.random.default_rng(seed + 1).uniform(0, 22, 4000)
    heights = np.where((block.sum(axis=1) % 3) > 0, tall[(block[:, 0] * 61 + block[:, 1]) % 4000], 0.0)
    xyz = np.column_stack([xy, heights + 2.0 * np.sin(xy[:, 0] / 60)]) + ORIGIN
    return Flight(tuple(images), tuple(stated), np.array(head), np.array(station), xyz)


def features(f: Flight, rng: np.random.Generator) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """(N, 2) image coordinates, and (N,) numbers of their places, of each image."""
    points, places = [], []
    for image in f.images:
        uv, depth = image.project(f.xyz)
        seen = np.flatnonzero(image.holds(uv, 4.0) & (depth > 0) & (rng.random(len(uv)) < SEEN))
        points.append(uv[seen] + rng.normal(0, FEATURE_PX, (len(seen), 2)))
        places.append(seen)
    return points, places


def mapping(f: Flight, seed: int) -> tuple[MappedModel, list[np.ndarray], int]:
    rng = np.random.default_rng(seed + 100)
    points, places = features(f, rng)
    rays = [(f.xyz - i.centre) / np.linalg.norm(f.xyz - i.centre, axis=1, keepdims=True) for i in f.images]
    common = np.zeros((len(f.images),) * 2, np.int64)
    both: dict[tuple[int, int], np.ndarray] = {}
    for one in range(len(f.images)):
        for other in range(one + 1, len(f.images)):
            shared = np.intersect1d(places[one], places[other], assume_unique=True)
            near = np.sum(rays[one][shared] * rays[other][shared], axis=1) > np.cos(np.radians(MOST_TURN_DEG))
            both[one, other] = shared[near]
            common[one, other] = common[other, one] = near.sum()
    chosen = {
        (min(one, int(k)), max(one, int(k)))
        for one in range(len(common))
        for k in np.argsort(-common[one], kind="stable")[:PARTNERS]
        if common[one, k] >= 20
    }
    cameras = [(Camera(WIDTH, ROWS, s, s, WIDTH / 2, ROWS / 2), True) for s in f.stated]
    known = [pycolmap_camera(*c) for c in cameras]
    pairs = {}
    for one, other in sorted(chosen):
        shared = both[one, other][rng.random(len(both[one, other])) < MATCHED]
        matches = np.column_stack([np.searchsorted(places[k], shared) for k in (one, other)])
        wrong = rng.random(len(matches)) < WRONG
        matches[wrong, 1] = rng.permutation(matches[wrong, 1])
        found = pair_geometry((known[f.head[one]], known[f.head[other]]), (points[one], points[other]), matches)
        if found is not None:
            pairs[one, other] = found
    model = mapped(MappingInput(cameras, f.head.tolist(), points, pairs), "radial").models[0]
    return model, points, len(pairs)


def control_places(f: Flight, checks: Sequence[tuple[float, float]] = ()) -> np.ndarray:
    """(C, 3) five places in the corners and the middle of the stations' area, and further ones by their shares of it."""
    xy = np.array([i.centre[:2] for i in f.images])
    low, high = xy.min(axis=0), xy.max(axis=0)
    at = low + np.array([(0, 0), (1, 0), (0, 1), (1, 1), (0.5, 0.5), *checks]) * (high - low)
    return np.column_stack([at, ORIGIN[2] + 2.0 * np.sin((at[:, 0] - ORIGIN[0]) / 60)])


def stated_places(f: Flight, noise_m: float, seed: int) -> np.ndarray:
    """(N, 3) positions as given: of the antenna in the middle of the heads, with the error of its station."""
    rng = np.random.default_rng([seed, round(noise_m * 100)])
    errors = rng.normal(0, noise_m, (int(f.station.max()) + 1, 3)) * (1.0, 1.0, 1.5)
    middle = np.array(
        [np.mean([f.images[k].centre for k in np.flatnonzero(f.station == s)], axis=0) for s in range(len(errors))]
    )
    return np.asarray((middle + errors)[f.station])


def control(f: Flight, seed: int) -> ControlPoints:
    """Five control points, ten check points."""
    rng = np.random.default_rng(seed + 200)
    points = []
    for k, xyz in enumerate(control_places(f, rng.uniform(0.05, 0.95, (10, 2)).tolist())):
        marks = []
        for image in f.images:
            uv, depth = image.project(xyz[None])
            if depth[0] > 0 and image.holds(uv, 5.0)[0]:
                col, row = (uv[0] + rng.normal(0, MARK_PX, 2)).tolist()
                marks.append(Mark(image.name, col, row, MARK_PX))
        role, name = (Role.CONTROL, f"C{k}") if k < 5 else (Role.CHECK, f"K{k}")
        points.append(ControlPoint(name, xyz + rng.normal(0, PLACE_M, 3), (PLACE_M,) * 3, role, tuple(marks)))
    return ControlPoints(tuple(points))


def told(
    f: Flight, model: MappedModel, points: list[np.ndarray], noise_m: float, known: ControlPoints | None, seed: int, mounts: bool
) -> None:  # fmt: skip
    names = [i.name for i in f.images]
    images = [replace(i, name=names[k], head=str(f.head[k])) for i, k in zip(model.images, model.numbers, strict=True)]
    places = stated_places(f, noise_m, seed)
    nothing = np.full(places.shape, np.nan)
    gnss = GnssPlaces(tuple(names), places, nothing, nothing, resolve(CRS), "", ())
    put = place(images, model.xyz, gnss, Placing(), (known, resolve(CRS)) if known is not None else None)
    tracks = model.tracks.copy()
    tracks[:, 1] = np.searchsorted(np.array(model.numbers), tracks[:, 1])
    uv = [points[k] for k in model.numbers]
    ties = of_tracks(tracks, uv, [np.ones(len(p)) for p in uv])
    used = np.array([places[names.index(i.name)] for i in put.images])
    begun = time.process_time()
    stations = tuple(int(f.station[names.index(i.name)]) for i in put.images) if mounts else ()
    positions = Positions(used, nothing[: len(used)], stations=stations)
    found = georeferenced(put.images, ties, positions, known.points if known is not None else ())
    truth = [f.images[names.index(i.name)] for i in put.images]
    adjusted = found.refinement.adjusted
    print(f"\nGNSS noise {noise_m:g} m, {'five control points' if known is not None else 'no control points'}")
    for what, ours in (("similarity", put.images), ("adjusted", found.refinement.images)):
        figures = pose_figures(ours, truth)
        focal = {i.head: 100 * (i.camera.fx / t.camera.fx - 1) for i, t in zip(ours, truth, strict=True)}
        worst = max(focal.values(), key=abs)
        print(
            f"  {what:<12} centres RMSE {figures.centre_rmse_m / GSD_M:.2f} GSD, rotations {figures.angle_rmse_deg:.4f}°, worst focal length {worst:+.3f} %"
        )
    if found.refinement.control is not None:
        plan, up = found.refinement.control.rms(holds=False) or (np.nan, np.nan)
        print(
            f"  check points {plan / GSD_M:.2f} GSD in plan, {up / GSD_M:.2f} GSD in height; shift {np.round(adjusted.shift, 3)}"
        )
    print(
        f"  taken {found.is_taken}, positions {adjusted.position_sigma_m:.3f} m, image coordinates {adjusted.sigma_px:.3f} px, "
        f"focal lengths stated to {100 * float(adjusted.interior_sigmas[:, 0].max()):.3f} %, held {found.held_focals}, "
        f"{adjusted.ties.points} ties, kept-out ones {found.refinement.gain.before_px:.3f} → {found.refinement.gain.after_px:.3f} px, "
        f"{time.process_time() - begun:.0f} s", flush=True,
    )  # fmt: skip
    if found.mounts is not None:
        print(f"  mounts hold: {np.degrees(found.mounts.sigmas[0]):.4f}°, {found.mounts.sigmas[1]:.4f} m")
    if adjusted.arms.any():
        print(f"  arms {np.round(adjusted.arms, 3).tolist()}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument(
        "--apart",
        type=float,
        default=0.03,
        help="of the heads from the antenna, per axis, metres (std dev): unknown to the adjustment",
    )
    parser.add_argument(
        "--alone", action="store_true", help="do not hold the heads of a station together, as `cityflow orient` does"
    )
    parser.add_argument("--controlled", action="store_true", help="with control points only")
    asked = parser.parse_args()
    f = flight(asked.seed, asked.apart)
    begun = time.process_time()
    model, points, pairs = mapping(f, asked.seed)
    print(
        f"oriented {len(model.images)} of {len(f.images)}, {pairs} pairs, {len(model.xyz)} tie points, {model.reprojection_px:.3f} px, "
        f"{time.process_time() - begun:.0f} s without the mapping", flush=True,
    )  # fmt: skip
    points_known = control(f, asked.seed)
    for known in (points_known,) if asked.controlled else (points_known, None):
        for noise_m in (0.1, 1.0):
            told(f, model, points, noise_m, known, asked.seed, not asked.alone)


if __name__ == "__main__":
    main()
