"""How bright all images of a survey are shown together, so that nothing becomes white that most photographs show below white.

Balanced images are as bright as the mean exposure. What a shorter exposure shows just below white would be cut off. So one parabola for all images
makes colours darker by what lets the survey's highlights end at white: shadows little, highlights most. They keep their order and their hues.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray
from cityflow.core.colour_image import COLOURS
from cityflow.imagery.colour_samples import PointColours
from cityflow.imagery.radiometry import Balance

HIGHLIGHTS = 0.999
"""Share of the samples that stays below white; what is left are sparkles. Set by hand."""


class Tone(NamedTuple):
    """What comes after the balance, the same for all images: a further gain, and the shoulder of `core.colour_image.ColourImage`."""

    gain: float
    shoulder: float


def tone(seen: Sequence[PointColours], balance: Balance, white: float) -> Tone:
    """The tone of a survey: nothing is done where the balance leaves highlights below white.

    Parameters
    ----------
    seen : what the images show, in the order of the balance
    white : where highlights end, share of the dtype's greatest value
    """
    highlights = _highlights(seen, balance)
    if highlights <= white:
        return Tone(1.0, 0.0)
    # a parabola that ends at white does not fall before it if it begins at no more than twice of that
    gain = min(1.0, 2.0 * white / highlights)
    ends = gain * highlights
    return Tone(gain, (ends - white) / ends**2)


def _highlights(seen: Sequence[PointColours], balance: Balance) -> float:
    """How bright balanced images are where they are brightest, share of the greatest value; 0 without samples."""
    white = _white_points(seen)
    shown = [
        (s.log_colour * balance.gamma[i] + np.log(balance.gain[i]) + balance.falloff * s.radius2[:, None])[~white[s.point]]
        for i, s in enumerate(seen)
    ]  # fmt: skip
    brightest = np.concatenate([values[:, :COLOURS].max(axis=1) for values in shown]) if shown else np.empty(0)
    return float(np.exp(np.quantile(brightest, HIGHLIGHTS))) if len(brightest) else 0.0


def _white_points(seen: Sequence[PointColours]) -> BoolArray:
    """Points that most images show cut off: these may be white, whatever a much darker image shows."""
    nothing = np.empty(0, np.int64)
    well, burnt = (
        np.concatenate([nothing, *(s.point for s in seen)]),
        np.concatenate([nothing, *(s.burnt for s in seen)]),
    )
    points = 1 + int(max(well.max(initial=-1), burnt.max(initial=-1)))
    return np.asarray(np.bincount(burnt, minlength=points) > np.bincount(well, minlength=points))
