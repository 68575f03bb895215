"""Exposure balance of all images of a survey; computed once for the whole survey, so it does not depend on an area of interest."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.catalog.colour_reading import COLOURS, ColourJob
from cityflow.catalog.file_questions import Reading, told_of
from cityflow.catalog.height_ranges import low_points, within
from cityflow.catalog.plan_index import PlanIndex
from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.grid import Bounds
from cityflow.imagery.colour_samples import PointColours, SampleParameters, pair_samples
from cityflow.imagery.highlights import Tone, tone
from cityflow.imagery.radiometry import Balance, RadiometryParameters, block_adjustment, exposure_groups
from cityflow.io.catalog.stac import ImageAsset, united
from cityflow.io.orientation.oriented_images import LeftOut
from cityflow.io.tables.feature_ids import listing
from cityflow.orientation.views import View, footprint, footprints

POINTS_PER_IMAGE = 400
"""Common points that are compared, in the mean of an image; bounds time; set by hand."""
PROBES = 25
"""Images on which is counted how many points one sees; set by hand, as are those below."""
GRID_ALONG = 14
"""Points on the ground along a footprint."""
MOST_GROUND = 1_000_000
"""Places of the ground that are compared at most; bounds memory."""
NEAREST = 5
"""Low tie points that tell the height of a point on the ground."""
ALONE = RadiometryParameters(gamma_sigma=0.0, falloff_sigma=0.0)
"""For a first look, which tells groups of exposure."""
DIGITS = 6
"""Gains are kept with so many decimals."""
LEAST_SIDE_PX = 64
"""Small pictures are compared on a finer level, where they still show something: without contrast there is no gamma."""


@dataclass(frozen=True, slots=True)
class Balanced:
    """Images with what balances them, those that turned out to be damaged, and what to know of it."""

    images: tuple[ImageAsset, ...]
    damaged: tuple[LeftOut, ...]
    notes: tuple[str, ...]


def balanced(assets: Sequence[ImageAsset], xyz: FloatArray, reading: Reading) -> Balanced:
    """Find gains, gammas, the fall-off and the shoulder; every image is decoded once, at a coarse level.

    Parameters
    ----------
    xyz : (N, 3) tie points, world metres; the lowest ground's level where there are none
    """
    points, asked = PlanIndex(_points(assets, xyz)), _sampling(assets)
    near = [points.inside(box) for box in _boxes(assets)]
    jobs = (ColourJob(a.href, a.oriented, points.xyz[n], asked, a.white) for a, n in zip(assets, near, strict=True))
    found = reading.answers(COLOURS, jobs, len(assets), sum(a.size for a in assets))
    seen: list[PointColours] = []
    good: list[ImageAsset] = []
    damaged = []
    for asset, at, colours in zip(assets, near, found, strict=True):
        if isinstance(colours, PointColours):
            seen.append(replace(colours, point=at[colours.point], burnt=at[colours.burnt]))
            good.append(asset)
        else:
            problem = told_of(colours, asset.href)
            damaged.append(LeftOut(asset.name, problem.problem.split(":")[0], problem.remedy))
    images, notes = _with_balance(good, seen, asked.brightest_share)
    return Balanced(tuple(images), tuple(damaged), tuple(notes))


def _boxes(assets: Sequence[ImageAsset]) -> list[Bounds]:
    """Around all that each image may see between its lowest ground and its highest object, as `heights.within`; NaN where it sees none."""
    views = [View(a.oriented, a.heights) for a in assets]
    planes = [footprints(views, np.array([a.heights[k] for a in assets])) for k in (0, 1)]
    boxes = np.array([shapely.bounds(np.array(shapes, object)) for shapes in planes])
    low, high = np.fmin.reduce(boxes[..., :2], axis=0), np.fmax.reduce(boxes[..., 2:], axis=0)
    return [(x_0, y_0, x_1, y_1) for (x_0, y_0), (x_1, y_1) in zip(low.tolist(), high.tolist(), strict=True)]


def _sampling(assets: Sequence[ImageAsset]) -> SampleParameters:
    usual = SampleParameters()
    side = min((min(a.oriented.camera.width, a.oriented.camera.height) for a in assets), default=LEAST_SIDE_PX)
    return SampleParameters(level=int(np.clip(np.log2(side / LEAST_SIDE_PX), 0, usual.level)))


def _with_balance(
    assets: list[ImageAsset], seen: list[PointColours], brightest: float
) -> tuple[list[ImageAsset], list[str]]:
    """Images of as many bands are balanced among themselves: first gains alone, which tell groups of exposure, then all with a curve for each group.

    `brightest`: where highlights end, share of the white level.
    """
    done: dict[str, ImageAsset] = {}
    notes: list[str] = []
    for bands in sorted({a.bands for a in assets}):
        chosen = [i for i, a in enumerate(assets) if a.bands == bands]
        names = [assets[i].name for i in chosen]
        shown = [seen[i] for i in chosen]
        pairs = pair_samples(shown)
        first = block_adjustment(pairs, len(chosen), parameters=ALONE)
        groups = exposure_groups(first.gain)
        balance = block_adjustment(pairs, len(chosen), groups)
        alike = tone(shown, balance, brightest * min(_white(assets[i]) for i in chosen))
        done |= {assets[i].name: _balanced_asset(assets[i], balance, k, alike) for k, i in enumerate(chosen)}
        notes += _in_words(names, groups, first.gain)
    return [done[a.name] for a in assets], notes


def _white(asset: ImageAsset) -> float:
    """The value that is shown as white, share of the dtype's greatest."""
    return asset.white / float(np.iinfo(asset.dtype).max) if asset.white else 1.0


def _balanced_asset(asset: ImageAsset, balance: Balance, number: int, alike: Tone) -> ImageAsset:
    gain, gamma = (_rounded(of) for of in (alike.gain * balance.gain[number], balance.gamma[number]))
    falloff, shoulder = _rounded([balance.falloff, alike.shoulder])
    return replace(
        asset, gain=gain, gamma=() if all(g == 1.0 for g in gamma) else gamma, falloff=falloff, shoulder=shoulder
    )


def _rounded(values: Iterable[float]) -> tuple[float, ...]:
    return tuple(round(float(v), DIGITS) for v in values)


def _in_words(names: Sequence[str], groups: IntArray, gain: FloatArray) -> list[str]:
    """Groups of exposures, where there are several."""
    count = int(groups.max(initial=0)) + 1
    if count < 2:
        return []
    members = [[n for n, g in zip(names, groups, strict=True) if g == k] for k in range(count)]
    stops = [float(np.log2(gain[groups == k]).mean()) for k in range(count)]
    parts = [
        f"{len(m)} images by {s:+.2f} ({listing(m[:3])}{' …' if len(m) > 3 else ''})"
        for m, s in zip(members, stops, strict=True)
    ]
    return [f"{count} groups of exposures are made alike, in stops: {'; '.join(parts)}"]


def _points(assets: Sequence[ImageAsset], xyz: FloatArray) -> FloatArray:
    """(M, 3) points on which colours are compared, sorted by x: a few hundred an image, tie points and ground."""
    if not len(assets):
        return np.empty((0, 3))
    order = xyz[np.lexsort((xyz[:, 2], xyz[:, 1], xyz[:, 0]))]
    if len(order):
        probes = assets[:: max(1, len(assets) // PROBES)]
        usual = float(np.median([len(within(order, a.oriented, a.heights)) for a in probes]))
        order = order[:: max(1, int(usual / POINTS_PER_IMAGE))]
    points = np.concatenate([order, _ground(assets, low_points(xyz))])
    return points[np.lexsort((points[:, 2], points[:, 1], points[:, 0]))]


def _ground(assets: Sequence[ImageAsset], low: FloatArray) -> FloatArray:
    """A grid of points on the ground: tie points are rare where images have no partner that looks alike."""
    step = float(np.median([np.sqrt(footprint(View(a.oriented, a.heights)).area) for a in assets])) / GRID_ALONG
    x_min, y_min, x_max, y_max = united([a.bounds for a in assets])
    step = max(step, float(np.sqrt((x_max - x_min) * (y_max - y_min) / MOST_GROUND)), 1e-3)
    x, y = np.meshgrid(np.arange(x_min, x_max, step), np.arange(y_min, y_max, step), indexing="ij")
    xy = np.column_stack([x.ravel(), y.ravel()])
    if len(low) >= NEAREST:
        z = np.median(low[cKDTree(low[:, :2]).query(xy, NEAREST)[1], 2], axis=1)
    else:
        z = np.full(len(xy), float(np.median([a.heights[0] for a in assets])))
    return np.column_stack([xy, z])
