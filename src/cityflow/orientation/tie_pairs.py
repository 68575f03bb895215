"""Which pairs of images are searched for tie points: those that see much of the same ground, from a side that looks alike (Nex 2013 §2.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from pydantic import Field

from cityflow.core.parameters import Parameters
from cityflow.orientation.views import View, footprints

ALIKE_DEG = 30.0
"""Images whose axes differ by less look alike; set by hand on synthetic flights, as is the next."""
MOST_TURN_DEG = 50.0
"""Descriptors match no more where axes differ by more."""


class PairParameters(Parameters):
    """How many pairs there are."""

    alike: int = Field(10, ge=1, le=200, description="images that look the same way, with which one is compared")
    turned: int = Field(8, ge=0, le=200, description="images that look another way, with which one is compared")
    least_overlap: float = Field(0.2, ge=0, le=1, description="share of the smaller footprint that both see")


def tie_pairs(views: Sequence[View], parameters: PairParameters) -> tuple[tuple[int, int], ...]:
    """Pairs of numbers of views, the smaller first, ascending.

    An image is compared with those that share most ground with it; half of them each of the wider and of the narrower bases, as the former make heights
    sure and the latter make long tracks.
    """
    ground = np.array(footprints(views), object)
    area = shapely.area(ground)
    axes = np.array([v.image.axis for v in views]).reshape(-1, 3)
    tree = shapely.STRtree(ground)
    pairs: set[tuple[int, int]] = set()
    for one in range(len(views)):
        if area[one] <= 0:
            continue
        others = np.sort(tree.query(ground[one], predicate="intersects"))
        others = others[(others != one) & (area[others] > 0)]
        share = shapely.area(shapely.intersection(ground[one], ground[others])) / np.minimum(area[one], area[others])
        turn = np.degrees(np.arccos(np.clip(axes[others] @ axes[one], -1, 1)))
        for low, high, most in ((0.0, ALIKE_DEG, parameters.alike), (ALIKE_DEG, MOST_TURN_DEG, parameters.turned)):
            fit = np.flatnonzero((share >= parameters.least_overlap) & (turn >= low) & (turn < high))
            best = fit[np.lexsort((others[fit], -np.round(share[fit], 6)))]
            near = best[: -(-most // 2)]
            rest = best[len(near) :]
            far = rest[:: max(1, len(rest) // max(most - len(near), 1))][: most - len(near)]
            pairs.update((min(one, k), max(one, k)) for k in others[np.concatenate([near, far])].tolist())
    return tuple(sorted(pairs))
