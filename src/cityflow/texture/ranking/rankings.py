"""Rankings by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from cityflow.core.texture import FacePlane, SeenFace
from cityflow.texture.ranking import share_angle_gsd, worst_gsd
from cityflow.texture.ranking.ranking_parameters import RankingParameters

Rank = Callable[[FacePlane, Sequence[SeenFace], RankingParameters], list[int]]

METHODS: Mapping[str, Rank] = {worst_gsd.METHOD: worst_gsd.rank, share_angle_gsd.METHOD: share_angle_gsd.rank}
