"""Images that may be a source of a face."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.texture import SeenFace
from cityflow.texture.ranking.ranking_parameters import RankingParameters


def usable(seen: Sequence[SeenFace], parameters: RankingParameters) -> list[int]:
    """Places in `seen` of images that see something of the face, and not too obliquely."""
    return [
        k
        for k, one in enumerate(seen)
        if one.mask.count > 0 and one.view.incidence_deg <= parameters.steepest_deg and np.isfinite(one.view.gsd_m)
    ]


def grazing(one: SeenFace, parameters: RankingParameters) -> bool:
    """Whether an image is a last resort."""
    return one.view.incidence_deg > parameters.most_incidence_deg
