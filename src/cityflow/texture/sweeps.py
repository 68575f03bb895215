"""Every image of a house compared with the middle of all that see the same cells, sweep by sweep.

Where two groups of images share few cells, the middle of most cells is that of the own group, and a sweep that makes each image like the middle closes a
small part of what is between the groups. So the brightness of all images is changed together: by as much that each is like the middle after the middles have
moved with them (Newton's method; a median moves with the image that it is taken from). Contrast, of which few cells tell, goes one sweep at a time.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.texture.comparisons import UnitCells
from cityflow.texture.linear_fit import LEAST_CELLS, MOST_GAIN, fitted
from cityflow.texture.source_image import SAME, WHITE, LinearModel

CELLS_OF_SWEEP = 6_000
"""Cells of a unit that a sweep looks at; bounds time."""
CELLS_OF_IMAGE = 1_500
"""Cells of all images, and of one, that are compared with the middle of all at most; set by hand, to save time."""
NOT_JOINED = 1e-6
"""Groups of images that share less of their cells stay as bright beside each other as they are."""


def settled(
    cells: UnitCells, models: Mapping[int, LinearModel], leading: Collection[int], root: int, sweeps: int
) -> dict[int, LinearModel]:
    """The models (image → model) after so many sweeps, relative to the root's; the leading images alone make the middle."""
    names = [image for image in cells.images if image in models]
    rows = [k for k, image in enumerate(cells.images) if image in models]
    leads = np.array([name in leading for name in names])
    colours = cells.colours[rows][:, :: max(1, cells.colours.shape[1] // CELLS_OF_SWEEP)]
    seen = ~np.isnan(colours[..., 0])
    colours = colours[:, (seen.sum(axis=0) >= 2) & seen[leads].any(axis=0)]
    found = [models[name] for name in names]
    for _ in range(sweeps if len(names) > 2 and colours.size else 0):
        found = _swept(colours, found, leads)
        back = found[names.index(root)].inverse
        found = [SAME if name == root else back.after(model) for name, model in zip(names, found, strict=True)]
    return dict(zip(names, found, strict=True))


def bounded(model: LinearModel) -> LinearModel:
    """The model, with a gain and an offset that exposures may have."""
    return LinearModel(np.clip(model.gain, 1 / MOST_GAIN, MOST_GAIN), np.clip(model.offset, -WHITE, WHITE))


def _swept(colours: Float32Array, models: Sequence[LinearModel], leads: BoolArray) -> list[LinearModel]:
    shown = np.stack([model.applied(c) for model, c in zip(models, colours, strict=True)])
    middle = np.asarray(np.nanmedian(shown[leads], axis=0), np.float32)
    fits = [_refitted(c, middle, model) for model, c in zip(models, colours, strict=True)]
    usual = [np.nanmedian(c, axis=0, keepdims=True) if len(c) else np.ones((1, 3), np.float32) for c in _known(colours)]
    brighter = np.stack([
        np.log(np.maximum(fit.applied(grey)[0], 1.0) / np.maximum(old.applied(grey)[0], 1.0))
        for fit, old, grey in zip(fits, models, usual, strict=True)
    ])  # fmt: skip
    together = np.linalg.lstsq(np.eye(len(models)) - _told_by(shown, leads), brighter, rcond=NOT_JOINED)[0]
    further = np.exp(np.clip(together - brighter, -np.log(MOST_GAIN), np.log(MOST_GAIN)))
    return [LinearModel(gain, np.zeros(3)).after(fit) for gain, fit in zip(further, fits, strict=True)]


def _known(colours: Float32Array) -> list[Float32Array]:
    """Of each image the (cells, 3) that it sees."""
    return [c[~np.isnan(c[:, 0])] for c in colours]


def _refitted(colours: Float32Array, middle: Float32Array, before: LinearModel) -> LinearModel:
    """The model that makes an image like the middle; the one before where too few cells tell."""
    seen = np.flatnonzero(~np.isnan(colours[:, 0]))
    if len(seen) < LEAST_CELLS:
        return before
    seen = seen[:: max(1, len(seen) // CELLS_OF_IMAGE)]
    x, y = colours[seen].astype(np.float64), middle[seen].astype(np.float64)
    bands = np.array([fitted(x[:, b], y[:, b]) for b in range(3)])
    return bounded(LinearModel(bands[:, 0].copy(), bands[:, 1].copy()))


def _told_by(shown: Float32Array, leads: BoolArray) -> FloatArray:
    """(n, n) share of the cells of an image (row) whose middle is taken from another one (column), or from itself."""
    seen = ~np.isnan(shown[..., 0])
    grey = np.where(seen & leads[:, None], shown.mean(axis=2), np.inf)
    order, count = np.argsort(grey, axis=0, kind="stable"), np.isfinite(grey).sum(axis=0)
    taken, cell = np.zeros(grey.shape), np.arange(grey.shape[1])
    for place in ((count - 1) // 2, count // 2):
        np.add.at(taken, (order[place, cell], cell), 0.5)
    return np.asarray(seen @ taken.T / np.maximum(seen.sum(axis=1, keepdims=True), 1))
