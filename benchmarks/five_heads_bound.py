"""What a perfect adjustment would reach on the flight of five heads: the Cramér-Rao bound of the block, and the estimate with true weights from the truth.

    python benchmarks/five_heads_bound.py --seed 7

Unknown are poses, tie points, eight numbers of each camera, the common shift of the positions, the antenna's arm and the mounts, which are rigid. Known are
the true standard deviations of all observations, which of these are wrong, and that the heads of a station share one error of their position. Two sets of
observations: the tie points that the adjustment uses, and every point that two images show, matched without fault.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cityflow.adjustment.block import INTERIOR, Block, residuals
from cityflow.adjustment.control import Control, control_of, joined
from cityflow.adjustment.given_poses import Exactness, Unknowns, prior_of
from cityflow.adjustment.mounts import mounts_of
from cityflow.adjustment.normal_equations import Normal
from cityflow.adjustment.refinement import CELLS, KEPT_OUT
from cityflow.adjustment.tracks import Ties, of_tracks, spread
from five_heads import (
    FEATURE_PX,
    GSD_M,
    ORIGIN,
    ROWS,
    WIDTH,
    Flight,
    control,
    control_places,
    features,
    flight,
    mapping,
    stated_places,
)

RIGID = (1e-6, 1e-4)
"""Radians and metres by which mounts give way."""
OPEN = 0.1
"""What cameras may be off beforehand: more than any is."""
DRAWS = 4000


@dataclass(frozen=True)
class Observed:
    """Ties, the place that each point truly is, and which observations show it."""

    ties: Ties
    place: np.ndarray
    right: np.ndarray


def observed(ties: Ties, places: Sequence[np.ndarray]) -> Observed:
    """A tie point is the place that most of its observations show."""
    shown = np.array([places[i][k] for i, k in zip(ties.image, ties.feature, strict=True)])
    first = np.flatnonzero(np.diff(ties.point, prepend=-1))
    place = np.array([np.bincount(part).argmax() for part in np.split(shown, first[1:])])
    return Observed(ties, place, shown == place[ties.point])


def every_feature(points: Sequence[np.ndarray], places: Sequence[np.ndarray]) -> Ties:
    image = np.concatenate([np.full(len(p), k) for k, p in enumerate(places)])
    point = np.unique(np.concatenate(places), return_inverse=True)[1]
    feature = np.concatenate([np.arange(len(p)) for p in places])
    kept = np.bincount(point)[point] >= 2
    point = np.unique(point[kept], return_inverse=True)[1]
    return of_tracks(np.column_stack([point, image[kept], feature[kept]]), points, [np.ones(len(p)) for p in points])


def told(f: Flight, of: Observed, holding: Control, noise_m: float, seed: int) -> str:
    images = [replace(i, head=str(f.head[k])) for k, i in enumerate(f.images)]
    true = Block.of(images, ORIGIN)
    block = replace(true, xyz=np.concatenate([f.xyz[of.place], control_places(f)[: len(holding.names)]]) - ORIGIN)
    every = joined(of.ties, holding)
    mounts = mounts_of(true, np.zeros((len(images), 6, 6)), f.station.tolist())
    assert mounts is not None
    sigmas = np.where(f.head[:, None] == 0, (1.0, 1.0, 1.5), np.inf)
    lens, arms = np.full((len(block.cameras), INTERIOR), OPEN), np.zeros((len(block.cameras), 3))
    exact = Exactness(sigmas, np.full(len(images), np.inf), lens, arms, arms_open=True, mounts=replace(mounts, sigmas=RIGID))  # fmt: skip
    given = replace(true, centres=(stated_places(f, noise_m, seed)) - ORIGIN)
    prior = prior_of(given, Unknowns(block, np.zeros(3), arms, exact.mounts), (noise_m, 1.0), exact, holding, True)
    weight = np.concatenate([np.where(of.right, 1.0 / FEATURE_PX**2, 1e-9), 1.0 / holding.marks.sigma**2])
    normal = Normal(block, every, residuals(block, every)[0], weight, prior, calibrated=True)
    poses = 6 * len(images)
    step = normal.step()[0]
    centres = step[:poses].reshape(-1, 6)[:, 3:]
    focal = step[poses : poses + INTERIOR * len(block.cameras) : INTERIOR]
    bound = np.sqrt(np.mean(np.einsum("nii->n", normal.covariances()[:, 3:, 3:])))
    sigma = np.sqrt(normal.interior_covariances()[:, 0, 0])
    # heads are drawn one by one: what they share makes the worst of them smaller
    worst = np.median(np.abs(np.random.default_rng(0).normal(size=(DRAWS, len(sigma))) * sigma).max(axis=1))
    return (
        f"GNSS {noise_m:g} m: {of.ties.points} tie points, {len(of.right)} observations; bound: centres {bound / GSD_M:.2f} GSD, focal lengths "
        f"{100 * sigma.min():.3f} to {100 * sigma.max():.3f} %, worst head in the median of draws {100 * worst:.3f} %; with the errors of this seed: centres "
        f"{np.sqrt(np.mean(np.sum(centres**2, axis=1))) / GSD_M:.2f} GSD, focal lengths {np.round(100 * focal, 3).tolist()} %, in standard deviations "
        f"{np.round(focal / sigma, 1).tolist()}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--apart", type=float, default=0.03, help="as in five_heads.py")
    parser.add_argument("--cells", type=int, default=CELLS, help="of the grid in which ties are spread")
    asked = parser.parse_args()
    f = flight(asked.seed, asked.apart)
    model, points, _ = mapping(f, asked.seed)
    places = features(f, np.random.default_rng(asked.seed + 100))[1]
    mapped = model.tracks.copy()
    sizes = [(WIDTH, ROWS)] * len(f.images)
    chosen = spread(of_tracks(mapped, points, [np.ones(len(p)) for p in points]), sizes, asked.cells)
    used = chosen.of_points(np.arange(chosen.points) % KEPT_OUT != KEPT_OUT - 1)
    names = {i.name: k for k, i in enumerate(f.images)}
    known = control_of(control(f, asked.seed).points, names, ORIGIN)
    holding = known.of_points(known.holds)
    for what, ties in (("tie points that the adjustment uses", used), ("every point, matched without fault", every_feature(points, places))):  # fmt: skip
        print(what)
        for noise_m in (0.1, 1.0):
            print(" ", told(f, observed(ties, places), holding, noise_m, asked.seed), flush=True)


if __name__ == "__main__":
    main()
