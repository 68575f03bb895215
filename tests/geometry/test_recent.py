"""A solid is triangulated and checked once; another one never gets its answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from shapely import box

from cityflow.geometry.polyhedron import triangulate
from cityflow.geometry.recent import MOST, remembered
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.extruded import extrude


def test_the_same_object_is_asked_for_once_and_only_the_last_few_are_kept() -> None:
    asked: list[int] = []

    @remembered
    def total(values: list[int]) -> int:
        asked.append(len(asked))
        return sum(values)

    many = [[k] for k in range(MOST + 1)]
    assert [total(v) for v in many + many[1:]] == [*range(MOST + 1), *range(1, MOST + 1)]
    assert len(asked) == MOST + 1
    assert total([5]) == total([5]) == 5
    assert len(asked) == MOST + 3


def test_solids_keep_their_own_triangles_and_faults() -> None:
    low, high = extrude(box(0, 0, 4, 3), 0.0, 2.0), extrude(box(0, 0, 4, 3), 0.0, 5.0)
    assert triangulate(low) is triangulate(low)
    assert triangulate(low).vertices[:, 2].max() == 2.0
    assert triangulate(high).vertices[:, 2].max() == 5.0
    open_box = replace(low, faces=low.faces[1:])
    for _ in range(2):
        assert check_polyhedron(low) == []
        assert [f.name for f in check_polyhedron(open_box)]
    check_polyhedron(low).append(check_polyhedron(open_box)[0])
    assert check_polyhedron(low) == []
    assert np.array_equal(triangulate(replace(low)).triangles, triangulate(low).triangles)
