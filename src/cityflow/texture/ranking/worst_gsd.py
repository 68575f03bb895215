"""Ranks images by their worst sampling distance on the face (Frommholz 2017, section 5)."""

from __future__ import annotations

from collections.abc import Sequence

from cityflow.core.texture import FacePlane, SeenFace
from cityflow.texture.ranking.ranking_parameters import RankingParameters
from cityflow.texture.ranking.usable import grazing, usable

METHOD = "worst_gsd"


def rank(face: FacePlane, seen: Sequence[SeenFace], parameters: RankingParameters) -> list[int]:  # noqa: ARG001 (all rankings have one signature)
    """Places in `seen`, the best first; images that see nothing or look too obliquely are left out, those that merely graze it come last.

    Equals stand in the order of their images' numbers.
    """

    def place(k: int) -> tuple[bool, float, int]:
        return grazing(seen[k], parameters), seen[k].view.gsd_m, seen[k].view.image

    return sorted(usable(seen, parameters), key=place)
