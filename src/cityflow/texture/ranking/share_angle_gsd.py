"""Ranks images by seen share of the face, angle of incidence and sampling distance (Gross 2005, section 4.3)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.texture import FacePlane, SeenFace
from cityflow.texture.ranking.ranking_parameters import RankingParameters
from cityflow.texture.ranking.usable import grazing, usable

METHOD = "share_angle_gsd"


def rank(face: FacePlane, seen: Sequence[SeenFace], parameters: RankingParameters) -> list[int]:  # noqa: ARG001 (all rankings have one signature)
    """Places in `seen`, the best first; images that see nothing or look too obliquely are left out, those that merely graze it come last.

    The share that is seen counts from what any of the images sees, so that what stands before the face for all of them costs none of them anything.
    Equals stand in the order of their images' numbers.
    """
    kept = usable(seen, parameters)
    if not kept:
        return []
    total = int(np.count_nonzero(np.any([seen[k].mask.mask() for k in kept], axis=0)))
    finest = min(seen[k].view.gsd_m for k in kept)

    def score(k: int) -> float:
        view = seen[k].view
        return (
            parameters.visible_weight * seen[k].mask.count / total
            + parameters.angle_weight * float(np.cos(np.radians(view.incidence_deg)))
            + parameters.resolution_weight * finest / view.gsd_m
        )

    return sorted(kept, key=lambda k: (grazing(seen[k], parameters), -score(k), seen[k].view.image))
