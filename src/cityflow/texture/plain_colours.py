"""Plain colour of a building's walls, for parts that no image sees: the median of the visible parts, without plants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.texture import Colour, FaceKey
from cityflow.texture.comparisons import FaceSamples
from cityflow.texture.source_image import SAME, LinearModel

OWN_SHARE = 0.1
"""A wall of which at least this share is seen has a colour of its own; others get the unit's; set by hand, as are those below."""
GREENER = 1.05
"""Cells whose green is so much more than their red and their blue show plants before a wall, unless most of the wall is like that."""
LEFT_SHARE = 0.25
"""Plants are told apart where so much of what is seen is left."""
FEWEST = 12
"""Fewer cells tell no colour."""


class WallColours:
    """Colours of the walls of a unit.

    Parameters
    ----------
    walls : of each the key, its cells as images show them, the share of it that one of them sees, 0 to 1, and its area, m²
    models : how images are made alike

    Attributes
    ----------
    own : of walls of which enough is seen that is no plant
    common : of all walls together; None where too little is seen
    """

    def __init__(
        self, walls: Sequence[tuple[FaceKey, FaceSamples, float, float]], models: Mapping[int, LinearModel]
    ) -> None:
        cells = [cell_colours(samples, models) for _, samples, _, _ in walls]
        self.own: dict[FaceKey, Colour] = {
            key: _colour(np.median(colours[built], axis=0))
            for (key, _, share, _), colours in zip(walls, cells, strict=True)
            if share >= OWN_SHARE and (built := _built(colours)).sum() >= max(FEWEST, LEFT_SHARE * len(colours))
        }
        seen_m2 = [share * area for _, _, share, area in walls]
        self.common = _common(cells, seen_m2) if sum(map(len, cells)) >= FEWEST else None

    def of(self, key: FaceKey) -> Colour | None:
        """The plain colour of a wall; None where no wall of the unit tells one."""
        return self.own.get(key, self.common)


def cell_colours(samples: FaceSamples, models: Mapping[int, LinearModel]) -> Float32Array:
    """(N, 3) of each cell that some image shows unsaturated, the median over its images, made alike."""
    if not samples.images:
        return np.empty((0, 3), np.float32)
    stacked = np.stack(
        [models.get(i, SAME).applied(colours) for i, colours in zip(samples.images, samples.colours, strict=True)]
    )
    known = ~np.isnan(stacked[..., 0]).all(axis=0)
    return np.asarray(np.nanmedian(stacked[:, known], axis=0), np.float32).reshape(-1, 3)


def _built(colours: Float32Array) -> BoolArray:
    """(N,) which colours are none of plants."""
    return np.asarray(colours[:, 1] <= GREENER * np.maximum(colours[:, 0], colours[:, 2]))


def _common(walls: Sequence[Float32Array], seen_m2: Sequence[float]) -> Colour:
    """The median over all that is seen of the walls, band by band: a wall counts by its area, not by its cells; plants do not, unless there is little else."""
    values = np.concatenate(walls)
    weight = np.concatenate(
        [np.full(len(colours), area / max(len(colours), 1)) for colours, area in zip(walls, seen_m2, strict=True)]
    )
    built = _built(values)
    if weight[built].sum() >= LEFT_SHARE * weight.sum():
        values, weight = values[built], weight[built]
    return _colour(np.array([_median(values[:, band], weight) for band in range(3)]))


def _median(values: Float32Array, weight: FloatArray) -> float:
    order = np.argsort(values, kind="stable")
    summed = np.cumsum(weight[order])
    return float(values[order[np.searchsorted(summed, 0.5 * summed[-1])]])


def _colour(values: FloatArray) -> Colour:
    red, green, blue = (int(v) for v in np.clip(np.rint(values), 0, 255))
    return red, green, blue
