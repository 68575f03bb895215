"""Which pairs of images are searched for tie points: those that see much of the same ground, from a side that looks alike (Nex 2013 §2.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import Field

from cityflow.core.arrays import FloatArray
from cityflow.core.parameters import Parameters
from cityflow.orientation.views import View, footprints

ALIKE_DEG = 30.0
"""Images whose axes differ by less look alike; set by hand on synthetic flights, as is the next."""
MOST_TURN_DEG = 50.0
"""Descriptors match no more where axes differ by more."""


class PairParameters(Parameters):
    """How many pairs there are."""

    alike: int = Field(
        10, ge=1, le=200, description="images of the same viewing direction that an image is compared with"
    )
    turned: int = Field(
        8, ge=0, le=200, description="images of another viewing direction that an image is compared with"
    )
    least_overlap: float = Field(
        0.2, ge=0, le=1, description="least overlap of two compared images, as a share of the smaller footprint"
    )


def tie_pairs(views: Sequence[View], parameters: PairParameters) -> tuple[tuple[int, int], ...]:
    """Pairs of numbers of views, the smaller first, ascending.

    An image is compared with those that share most ground with it; half of them each of the wider and of the narrower bases, as the former make heights
    sure and the latter make long tracks.
    """
    flight = _Flight.of(views)
    pairs: set[tuple[int, int]] = set()
    for one in range(len(views)):
        pairs.update((min(one, k), max(one, k)) for k in flight.partners(one, parameters))
    return tuple(sorted(pairs))


def star_sample(views: Sequence[View], most: int, parameters: PairParameters) -> tuple[tuple[int, ...], ...]:
    """A few images far apart from each other, in each look direction, each with its partners behind it: numbers of views.

    Parameters
    ----------
    most : stars, dealt out to the look directions, the larger ones first
    parameters : of the partners
    """
    flight = _Flight.of(views)
    groups = [np.array(g) for g in _alike(flight.axes)]
    centres = np.array([v.image.centre[:2] for v in views]).reshape(-1, 2)
    share = [len(range(k, most, len(groups))) for k in range(len(groups))]
    chosen = [int(g[k]) for g, n in zip(groups, share, strict=True) for k in _far_apart(centres[g], n)]
    stars = ((one, *flight.partners(one, parameters)) for one in chosen)
    return tuple(star for star in stars if len(star) > 1)


@dataclass(frozen=True, slots=True)
class _Flight:
    """Footprints of all views with their areas, and the axes."""

    ground: NDArray[np.object_]
    area: FloatArray
    axes: FloatArray
    tree: shapely.STRtree

    @staticmethod
    def of(views: Sequence[View]) -> _Flight:
        ground = np.array(footprints(views), object)
        axes = np.array([v.image.axis for v in views]).reshape(-1, 3)
        return _Flight(ground, shapely.area(ground), axes, shapely.STRtree(ground))

    def partners(self, one: int, parameters: PairParameters) -> tuple[int, ...]:
        """Numbers of views with which one is compared; none where it sees no ground."""
        area, axes, found = self.area, self.axes, list[int]()
        if area[one] <= 0:
            return ()
        others = np.sort(self.tree.query(self.ground[one], predicate="intersects"))
        others = others[(others != one) & (area[others] > 0)]
        common = shapely.area(shapely.intersection(self.ground[one], self.ground[others]))
        share = common / np.minimum(area[one], area[others])
        turn = np.degrees(np.arccos(np.clip(axes[others] @ axes[one], -1, 1)))
        for low, high, most in ((0.0, ALIKE_DEG, parameters.alike), (ALIKE_DEG, MOST_TURN_DEG, parameters.turned)):
            fit = np.flatnonzero((share >= parameters.least_overlap) & (turn >= low) & (turn < high))
            best = fit[np.lexsort((others[fit], -np.round(share[fit], 6)))]
            near = best[: -(-most // 2)]
            rest = best[len(near) :]
            far = rest[:: max(1, len(rest) // max(most - len(near), 1))][: most - len(near)]
            found += others[np.concatenate([near, far])].tolist()
        return tuple(found)


def _alike(axes: FloatArray) -> list[list[int]]:
    """Numbers of axes that look the same way as the first of their group, the largest group first."""
    groups: list[list[int]] = []
    for k in range(len(axes)):
        near = [g for g in groups if axes[g[0]] @ axes[k] >= np.cos(np.radians(ALIKE_DEG))]
        if near:
            near[0].append(k)
        else:
            groups.append([k])
    return sorted(groups, key=lambda g: (-len(g), g[0]))


def _far_apart(places: FloatArray, most: int) -> list[int]:
    """Numbers of places: the one nearest to the middle, then each as far as can be from those before."""
    if not most:
        return []
    chosen = [int(np.argmin(np.linalg.norm(places - places.mean(axis=0), axis=1)))]
    away = np.linalg.norm(places - places[chosen[0]], axis=1)
    while len(chosen) < min(most, len(places)) and away.max() > 0:
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(places - places[chosen[-1]], axis=1))
    return chosen
