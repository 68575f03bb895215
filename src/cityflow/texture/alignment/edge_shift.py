"""By how many pixels a photograph lies beside the edges of the models that it shows.

Brightness is sampled across each edge. All shifts within reach are tried, and the one with the strongest steps at the edges is refined by least squares:
each sample says where the nearest step is across its edge. Samples of one edge err together, so edges count, not samples.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.colour_image import COLOURS, ColourImage, sampled
from cityflow.texture.alignment.model_edges import EdgeSamples
from cityflow.texture.ranking.field_of_view import in_frame
from cityflow.texture.visibility.scene import Scene

STEP_PX, TRIED_PX = 0.5, 1.0
"""Between samples across an edge, and between shifts that are tried; set by hand, as are those below."""
BLUR_PX = 0.8
"""Brightness across an edge is smoothed by this: models are no better known."""
AROUND_PX = 1.5
"""So far from the best shift a step may be that refines it."""
OFF_M = 0.04
"""Samples are looked at from so far outside of their faces."""
FEW_EDGES, FEW_SAMPLES = 6, 60
"""Fewer tell nothing."""
FEW_TELLING = 5
"""Of these, that tell two shifts apart."""
BETTER, UNRIVALLED = 2.0, 1.5
"""Standard deviations by which the best shift must be better than none, and than any that differs from it by more than two pixels. On a flight of seed 3021, of
which these were chosen, poses that are sound reach 1.6 at most, most of those that are off more than 2."""
APART_PX = 2.0
LEAST_PX, SURE = 1.0, 4.0
"""A shift is significant from this size on, and from so many of its standard deviations."""
MOST_SIGMA_PX = 0.5
"""Of a shift, in the direction in which it is known least."""
ROUNDS = 4


@dataclass(frozen=True, slots=True)
class EdgeShift:
    """Where a photograph shows the edges of models, less where its pose has them.

    Attributes
    ----------
    shift : (2,) pixels to the right and down;  covariance : (2, 2) square pixels
    edges : that tell it
    is_significant : whether it is large, certain, and clearly the best one
    """

    shift: FloatArray
    covariance: FloatArray
    edges: int
    is_significant: bool


def edge_shift(colour: ColourImage, samples: EdgeSamples, scene: Scene, reach_px: float) -> EdgeShift | None:
    """Of one photograph; None where it shows too few edges.

    Parameters
    ----------
    scene : what may stand before the edges
    reach_px : largest shift along each axis that is tried, pixels
    """
    kept, uv, across = _shown(colour.image, samples, scene, reach_px)
    if len(kept) < FEW_SAMPLES or len(np.unique(samples.edge[kept])) < FEW_EDGES:
        return None
    edge = np.unique(samples.edge[kept], return_inverse=True)[1]
    steps = _steps(colour, uv, across, reach_px)
    return _fitted(steps, across, edge, reach_px)


def shifted(colour: ColourImage, shift: FloatArray) -> ColourImage:
    """The photograph with its principal point moved, so that the models' edges fall where it shows them."""
    camera = colour.image.camera
    right, down = (float(v) for v in shift)
    moved = replace(camera, cx=camera.cx + right, cy=camera.cy + down)
    return replace(colour, image=replace(colour.image, camera=moved))


def _shown(
    image: OrientedImage, samples: EdgeSamples, scene: Scene, reach_px: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Numbers of the samples that the image shows, their (K, 2) image coordinates, and (K, 2) unit vectors across the edge in the image."""
    towards = image.centre - samples.xyz
    facing = np.einsum("skj,sj->sk", samples.normals[samples.edge], towards) > 0
    near = np.flatnonzero(facing.any(axis=1) & in_frame(image, samples.xyz))
    uv = image.project(samples.xyz[near])[0]
    whole = image.holds(uv, _half(reach_px) * np.sqrt(2.0) + 2.0)
    near, uv = near[whole], uv[whole]
    if not len(near):
        return near, uv, uv
    outward = np.einsum("sk,skj->sj", facing[near].astype(np.float64), samples.normals[samples.edge[near]])
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    middle = towards[near].mean(axis=0)
    free = scene.visible(samples.xyz[near] + OFF_M * outward, middle / np.linalg.norm(middle), image.centre)
    near, uv = near[free], uv[free]
    ahead = image.project(samples.xyz[near] + 0.05 * samples.along[near])[0] - uv
    length = np.linalg.norm(ahead, axis=1)
    drawn = length > 1e-6
    across = np.column_stack([-ahead[drawn, 1], ahead[drawn, 0]]) / length[drawn, None]
    return near[drawn], uv[drawn], across


def _half(reach_px: float) -> float:
    """How far across an edge brightness is sampled, pixels."""
    return reach_px * float(np.sqrt(2.0)) + AROUND_PX + 2 * BLUR_PX


def _steps(colour: ColourImage, uv: FloatArray, across: FloatArray, reach_px: float) -> FloatArray:
    """(K, T) how strong the step of brightness is at each place across the edge, 0 to 1; T places from -half to half."""
    count = int(np.ceil(_half(reach_px) / STEP_PX))
    at = np.arange(-count, count + 1) * STEP_PX
    places = uv[:, None, :] + at[None, :, None] * across[:, None, :]
    u, v = (np.ascontiguousarray(places[..., k].reshape(-1)) for k in range(2))
    grey = sampled(colour.pixels, u, v, 0)[:, :COLOURS].mean(axis=1).reshape(len(uv), -1).astype(np.float64)
    slope = np.abs(gaussian_filter1d(grey, BLUR_PX / STEP_PX, axis=1, order=1))
    usual = max(float(np.median(slope)), 1e-6)
    return np.asarray(slope / (slope + 2.0 * usual))


def _fitted(steps: FloatArray, across: FloatArray, edge: IntArray, reach_px: float) -> EdgeShift | None:
    count = max(int(reach_px / TRIED_PX), 1)
    one = np.arange(-count, count + 1) * TRIED_PX
    tried = np.stack(np.meshgrid(one, one, indexing="ij"), axis=-1).reshape(-1, 2)
    edges = int(edge[-1]) + 1
    # (D, E) sums over the samples of each edge
    scores = np.stack([np.bincount(edge, _at(steps, across @ d), minlength=edges) for d in tried])
    total = scores.sum(axis=1)
    best = int(np.argmax(total))
    far = np.linalg.norm(tried - tried[best], axis=1) > APART_PX
    rival = int(np.flatnonzero(far)[np.argmax(total[far])])
    none = int(np.argmin(np.linalg.norm(tried, axis=1)))
    shift, covariance = _refined(steps, across, edge, tried[best])
    certain = best != none and all(
        _surer(scores[best] - scores[k], _told(across @ (tried[best] - tried[k]), edge)) >= least
        for k, least in ((none, BETTER), (rival, UNRIVALLED))
    )
    size = float(np.linalg.norm(shift))
    sigma = float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
    away = float(np.sqrt(shift @ np.linalg.solve(covariance, shift)))
    inside = float(np.abs(tried[best]).max()) < count * TRIED_PX
    significant = certain and inside and size >= LEAST_PX and away >= SURE and sigma <= MOST_SIGMA_PX
    return EdgeShift(shift, covariance, edges, significant)


def _told(apart: FloatArray, edge: IntArray) -> BoolArray:
    """(E,) which edges tell two shifts apart, (K,) pixels apart across each sample's edge."""
    return np.asarray(np.bincount(edge, np.abs(apart)) >= LEAST_PX * np.bincount(edge))


def _surer(gain: FloatArray, told: BoolArray) -> float:
    """Mean of what the edges that tell gain, over its standard deviation."""
    own = gain[told]
    if len(own) < FEW_TELLING:
        return 0.0
    return float(own.mean() / max(float(own.std(ddof=1)) / np.sqrt(len(own)), 1e-12))


def _at(steps: FloatArray, t: FloatArray) -> FloatArray:
    """(K,) steps at (K,) places across, pixels, between those that were sampled."""
    place = t / STEP_PX + (steps.shape[1] - 1) / 2
    low = np.clip(place.astype(np.int64), 0, steps.shape[1] - 2)
    part = place - low
    rows = np.arange(len(steps))
    return np.asarray(steps[rows, low] * (1 - part) + steps[rows, low + 1] * part)


def _refined(steps: FloatArray, across: FloatArray, edge: IntArray, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Shift and covariance by least squares of the nearest strong steps, robustly."""
    middle = (steps.shape[1] - 1) // 2
    half = int(AROUND_PX / STEP_PX)
    window = np.arange(-half, half + 1)
    shift = start.copy()
    rows = np.arange(len(steps))[:, None]
    inverse, influence = np.eye(2) * 1e3, np.zeros((1, 2))
    for _ in range(ROUNDS):
        centre = np.rint(across @ shift / STEP_PX).astype(np.int64) + middle
        place = np.clip(centre[:, None] + window, 1, steps.shape[1] - 2)
        strength = steps[rows, place]
        peak = np.argmax(strength, axis=1)
        found = place[rows[:, 0], peak]
        low, top, high = (steps[rows[:, 0], found + k] for k in (-1, 0, 1))
        bend = np.minimum(low - 2 * top + high, -1e-9)
        t = (found - middle + np.clip((low - high) / (2 * bend), -0.5, 0.5)) * STEP_PX
        left = t - across @ shift
        usable = _is_peak(low, top, high)
        scale = max(1.4826 * float(np.median(np.abs(left[usable]))) if usable.any() else 1.0, 0.15)
        weight = usable * top / (1.0 + (left / (2 * scale)) ** 2)
        inverse = np.linalg.inv(np.einsum("k,ki,kj->ij", weight, across, across) + 1e-6 * np.eye(2))
        shift = shift + inverse @ np.einsum("k,ki,k->i", weight, across, left)
        left = t - across @ shift
        influence = np.stack(
            [np.bincount(edge, weight * across[:, i] * left, minlength=int(edge.max()) + 1) for i in range(2)], axis=1
        )
    covariance = inverse @ (influence.T @ influence) @ inverse
    return shift, np.asarray(covariance + 1e-4 * np.eye(2))


def _is_peak(low: FloatArray, top: FloatArray, high: FloatArray) -> BoolArray:
    return np.asarray((top >= low) & (top >= high))
