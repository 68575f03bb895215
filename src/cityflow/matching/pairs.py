"""Pairs of a reference image: rectified, judged as a whole at a coarse level, with their vertical parallax corrected."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cityflow.core.camera import OrientedImage
from cityflow.matching.grey import GreyImage
from cityflow.matching.lattice import LatticeParameters, PairLattice
from cityflow.matching.parallax import VerticalParallax, vertical_parallax
from cityflow.matching.rectification import UnusablePair, rectify
from cityflow.matching.sgm import SgmClock

PARALLAX_LEVEL = 2
"""Vertical parallax is measured at a quarter of the size, over the whole image; set by hand, to save time."""
UNMEASURED_SHARE = 0.3
"""Share of matched pixels from which a pair is taken whose parallax cannot be measured; set by hand."""
PLANE_LEAN = 1.0
"""Reference plane: 0 level, 1 parallel to the reference image, which is kinder to façades (docs/matching.md)."""
LEAST_MATCHED = 0.05
"""A pair with a smaller share of matched pixels at the coarse level is refused; set by hand."""


@dataclass(frozen=True, slots=True)
class PairReport:
    """What became of one partner.

    Attributes
    ----------
    used : False where it was refused;  reason : why
    parallax_px, parallax_90_px : median and 90 % of the absolute vertical parallax before correction; NaN where it was not measured
    parallax_rest_px : median of the absolute rest after correction
    disparities : lowest and highest disparity searched at level 0, pixels
    matched : share of the pixels of this pair that were matched at level 0 that have a disparity
    """

    partner: str
    used: bool
    reason: str = ""
    parallax_px: float = float("nan")
    parallax_90_px: float = float("nan")
    parallax_rest_px: float = float("nan")
    disparities: tuple[int, int] = (0, 0)
    matched: float = 0.0


def prepared_pair(
    reference: OrientedImage, partner: OrientedImage, images: tuple[GreyImage, GreyImage], heights: tuple[float, float],
    parameters: LatticeParameters, most_parallax_px: float, clock: SgmClock,
) -> tuple[PairLattice | None, PairReport]:  # fmt: skip
    """A pair's lattice, matched from the coarsest level to `coarse_level` over the whole image, or None; and what was found."""
    low, high = heights
    try:
        pair = rectify(reference, partner, low + 0.2 * (high - low), PLANE_LEAN)
    except UnusablePair as error:
        return None, PairReport(partner.name, False, error.problem)
    draft = PairLattice(pair, images, heights, parameters, clock)
    level = coarse_level(draft)
    share = _matched_share(draft, level)
    if share < LEAST_MATCHED:
        return None, PairReport(partner.name, False, f"only {share:.1%} of the pixels could be matched", matched=share)
    parallax = vertical_parallax(draft, level)
    if parallax is None:
        # much that matches both ways is no accident, even where no patch has texture across the rows
        reason = f"vertical parallax could not be measured; {share:.1%} of the pixels match"
        good = share >= UNMEASURED_SHARE
        return draft if good else None, PairReport(partner.name, good, reason, matched=share)
    report = PairReport(partner.name, True, "", parallax.median_px, parallax.ninety_px, parallax.rest_px, matched=share)
    if _too_far(parallax, most_parallax_px):
        reason = f"vertical parallax {parallax.ninety_px:.2f} px (90 %), {parallax.rest_px:.2f} px after correction"
        return None, replace(report, used=False, reason=reason)
    # coarse levels stay as they were matched: the correction is a fraction of their pixels
    blocks = {key: found for key, found in draft.blocks.items() if key[0] >= level}
    ranges = {key: found for key, found in draft.ranges.items() if key[0] >= level}
    return replace(draft, pair=pair.moved(parallax.offset), ranges=ranges, blocks=blocks), report


def coarse_level(lattice: PairLattice) -> int:
    """The level at which a pair is judged as a whole, however wide its ranges; what is found there and above is kept."""
    return min(PARALLAX_LEVEL, lattice.usual)


def _too_far(parallax: VerticalParallax, most_px: float) -> bool:
    return parallax.ninety_px > most_px or parallax.rest_px > 0.25 * most_px


def _matched_share(lattice: PairLattice, level: int) -> float:
    """Share of matched pixels among the blocks of a level that the partner sees."""
    down, right = lattice.grid(level)
    known = total = 0
    for block in [(i, j) for i in range(down) for j in range(right)]:
        if lattice.range(level, block) is not None:
            part = lattice.disparity(level, block)
            known, total = known + int(np.isfinite(part).sum()), total + part.size
    return known / max(total, 1)
