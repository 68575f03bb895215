from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, box

from cityflow.core.arrays import FloatArray
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.volumetric import VolumetricParameters, reconstruct
from cityflow.reconstruction.volumetric_parts.hull_lines import outline_walls
from roof_scenes import scan


def test_walls_of_an_outline_look_outwards() -> None:
    walls = outline_walls(box(0, 0, 12, 8))
    assert len(walls) == 4
    for wall in walls:
        x, y = wall.at((wall.start + wall.end) / 2)
        assert not box(0, 0, 12, 8).contains(Polygon([(x, y), (x + wall.nx, y + wall.ny), (x + wall.nx, y)]).centroid)
    ends = {tuple(np.round(w.at(t), 9) + 0.0) for w in walls for t in (w.start, w.end)}
    assert ends == {(0.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0)}


@pytest.mark.parametrize("seed", range(4))
def test_step_beside_a_jog_of_centimetres_leaves_no_sliver(seed: int) -> None:
    def levels(x: FloatArray, y: FloatArray) -> FloatArray:
        return np.where(x < 7, 6.0, 9.0)

    outline = Polygon([(0, 0), (7, 0), (7.001, -0.07), (12, -0.07), (12, 8), (7.0015, 8.0), (7, 8.06), (0, 8.06)])
    candidate = reconstruct(scan(levels, outline, 30.0, 0.03, seed), VolumetricParameters())
    assert candidate.solid is not None
    assert check_polyhedron(candidate.solid) == []
    assert candidate.notes["times_simplified"] == 0
    assert candidate.notes["columns"] == 2
