from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.building import Polyhedron
from cityflow.geometry.validity_solids import check_solid
from geometry_shapes import box, polyhedron


def cavity(solid: Polyhedron) -> Polyhedron:
    return Polyhedron(solid.vertices, tuple(replace(f, rings=tuple(r[::-1] for r in f.rings)) for f in solid.faces))


def bipyramid(half: float, centre: float = 5) -> Polyhedron:
    """Square equator at mid height with sides parallel to the axes, apexes 2 m above and below."""
    c, h = centre, half
    vertices = [
        (c - h, c - h, c),
        (c + h, c - h, c),
        (c + h, c + h, c),
        (c - h, c + h, c),
        (c, c, c + 2),
        (c, c, c - 2),
    ]
    faces = [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4), (1, 0, 5), (2, 1, 5), (3, 2, 5), (0, 3, 5)]
    return polyhedron(vertices, [(f,) for f in faces])


def codes(*shells: Polyhedron) -> set[int]:
    return {f.code for f in check_solid(shells)}


def test_cavities_inside_are_fine() -> None:
    assert codes(box()) == set()
    assert codes(box(), cavity(box(2, 2, 2, 3)), cavity(box(6, 6, 6, 3))) == set()


def test_cavity_may_touch_the_outer_shell_in_a_point() -> None:
    tip = bipyramid(2)
    high = Polyhedron(tip.vertices + np.array([0, 0, 3]), tip.faces)
    assert codes(box(), cavity(high)) == set()


@pytest.mark.parametrize(
    ("inner", "code"),
    [
        (cavity(box(8, 2, 2, 4)), 401),
        (cavity(box(0, 2, 2, 4)), 401),
        (cavity(box(10, 2, 2, 4)), 401),
        (cavity(box()), 402),
        (cavity(box(20, 2, 2, 4)), 403),
        (cavity(bipyramid(5)), 404),
        (box(2, 2, 2, 3), 405),
    ],
)
def test_one_code_each(inner: Polyhedron, code: int) -> None:
    assert codes(box(), inner) == {code}


def test_outer_shell_inside_out() -> None:
    assert codes(cavity(box())) == {405}


@pytest.mark.parametrize("second", [box(4, 4, 4, 3), box(2.5, 2.5, 2.5, 1)])
def test_cavities_that_overlap_or_lie_in_each_other(second: Polyhedron) -> None:
    assert codes(box(), cavity(box(2, 2, 2, 3)), cavity(second)) == {401}


def test_faults_of_a_shell_say_which() -> None:
    broken = Polyhedron(box(2, 2, 2, 3).vertices, box().faces[1:])
    faults = check_solid([box(), cavity(broken)])
    assert {f.code for f in faults} == {302}
    assert all(f.where.startswith("shell=1|face=") for f in faults)
    assert check_solid([])[0].code == 902
