from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.openings import FaceOpenings, Opening, UnitOpenings


def opening(face: int, bounds: tuple[float, float, float, float]) -> Opening:
    return Opening(("solid", face), np.zeros((4, 3)), bounds, "window", 0.9)


def test_the_area_is_that_of_the_rectangle() -> None:
    assert opening(1, (-1.0, 2.5, 0.5, 4.5)).area == pytest.approx(3.0)


def test_a_unit_has_the_openings_of_its_walls_in_their_order() -> None:
    first, second, third = (opening(f, (0.0, 0.0, 1.0, 1.0 + f)) for f in (4, 4, 2))
    faces = (
        FaceOpenings(("solid", 4), (first, second), 1, 20.0, 20.0, 0.1),
        FaceOpenings(("solid", 3), (), 0, 5.0, 0.0, None, "unseen"),
        FaceOpenings(("solid", 2), (third,), 1, 9.0, 9.0, 0.3),
    )
    assert UnitOpenings(faces, 1, 0.2).openings == (first, second, third)
    assert UnitOpenings((), None, None).openings == ()
