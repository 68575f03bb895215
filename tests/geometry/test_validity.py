"""One fault made by hand for each code; valid solids stay valid and faulty ones faulty however they are turned."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.geometry.faults import FAULT_NAMES, Tolerances
from cityflow.geometry.validity import check_polygon, check_polyhedron, is_valid
from geometry_shapes import SQUARE, VALID, YARD, box, extrude, gable, noded, polyhedron, tower_on_roof

Array = NDArray[np.float64]


def codes(solid: Polyhedron) -> set[int]:
    faults = check_polyhedron(solid)
    assert all(f.name == FAULT_NAMES[f.code] for f in faults)
    return {f.code for f in faults}


def with_roof(*rings: Sequence[tuple[float, float]]) -> Polyhedron:
    """A block of 10 × 10 × 5 m whose roof has these rings, exterior first where it is not the block's own."""
    block = extrude([SQUARE], 0, 5)
    vertices, loops = [tuple(v) for v in block.vertices], []
    for ring in rings:
        loops.append(tuple(range(len(vertices), len(vertices) + len(ring))))
        vertices += [(x, y, 5) for x, y in ring]
    faces = list(block.faces)
    faces[1] = Face((faces[1].rings[0], *loops), Semantic.ROOF)
    return Polyhedron(np.array(vertices, np.float64), tuple(faces))


def lifted(by: float) -> Polyhedron:
    """A block with a corner of its roof lifted."""
    block = box()
    vertices = block.vertices.copy()
    vertices[6, 2] += by
    return Polyhedron(vertices, block.faces)


def folded_roof() -> Polyhedron:
    """A block with a strip of 10 mm folded up by 5 mm in the middle of its roof, as one face."""
    xs = [(0, 5.0), (5, 5.0), (5.01, 5.005), (5.02, 5.0), (10, 5.0)]
    n = len(xs)
    vertices = [
        (0, 0, 0),
        (10, 0, 0),
        (10, 10, 0),
        (0, 10, 0),
        *[(x, 0, z) for x, z in xs],
        *[(x, 10, z) for x, z in xs],
    ]
    front, back = tuple(range(4, 4 + n)), tuple(range(4 + n, 4 + 2 * n))
    faces = [(3, 2, 1, 0), front + back[::-1], (0, 1, *front[::-1]), (2, 3, *back)]
    faces += [(1, 2, back[-1], front[-1]), (3, 0, front[0], back[0])]
    return polyhedron(vertices, [(f,) for f in faces])


def joined(a: Polyhedron, b: Polyhedron) -> Polyhedron:
    """Two shells as one, vertices in the same place made one by the validator."""
    n = len(a.vertices)
    more = tuple(replace(f, rings=tuple(tuple(i + n for i in r) for r in f.rings)) for f in b.faces)
    return Polyhedron(np.concatenate([a.vertices, b.vertices]), a.faces + more)


def replaced(solid: Polyhedron, face: int, *ring: int) -> Polyhedron:
    return with_faces(solid, lambda faces: faces.__setitem__(face, Face((ring,), Semantic.WALL)))


def with_faces(solid: Polyhedron, change: Callable[[list[Face]], None]) -> Polyhedron:
    faces = list(solid.faces)
    change(faces)
    return Polyhedron(solid.vertices, tuple(faces))


def reversed_face(face: Face) -> Face:
    return replace(face, rings=tuple(r[::-1] for r in face.rings))


def with_lid() -> Polyhedron:
    """A tower on a block, with a floor between them that belongs to neither."""
    return with_faces(tower_on_roof(), lambda faces: faces.append(Face((faces[5].rings[1][::-1],), Semantic.ROOF)))


def sunken_spire() -> Polyhedron:
    """A pyramid whose tip is pulled down through the floor: topology in order, geometry not."""
    vertices = [
        (0, 0, 0),
        (10, 0, 0),
        (10, 10, 0),
        (0, 10, 0),
        (0, 0, 5),
        (10, 0, 5),
        (10, 10, 5),
        (0, 10, 5),
        (5, 5, -3),
    ]
    faces = [(3, 2, 1, 0), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return polyhedron(vertices, [(f,) for f in [*faces, (4, 5, 8), (5, 6, 8), (6, 7, 8), (7, 4, 8)]])


def spire_to(x: float, y: float, z: float) -> Polyhedron:
    solid = sunken_spire()
    vertices = solid.vertices.copy()
    vertices[8] = x, y, z
    return Polyhedron(vertices, solid.faces)


def shrunk_step(gap: float) -> Polyhedron:
    """Two blocks joined by a bridge at the top; below they stand `gap` apart."""
    u = [(0, 0), (10, 0), (10, 5), (5 + gap, 5), (5 + gap, 1), (5, 1), (5, 5), (0, 5)]
    return extrude([u], 0, 5)


FAULTY: dict[str, tuple[Polyhedron, int]] = {
    "ring of two points": (replaced(box(), 2, 0, 1), 101),
    "point repeated": (replaced(box(), 2, 0, 1, 1, 5, 4), 102),
    "first point repeated at the end": (
        replaced(box(), 2, 0, 1, 5, 4, 0),
        102,
    ),
    "points half a millimetre apart": (extrude([[(0, 0), (10, 0), (10, 0.0005), (10, 10), (0, 10)]], 0, 5), 102),
    "bow tie": (replaced(box(), 1, 4, 5, 7, 6), 104),
    "spike": (replaced(box(), 1, 4, 5, 6, 7, 6, 7), 104),
    "collapsed triangle": (
        polyhedron(
            [(0, 0, 0), (5, 0, 0), (10, 0, 0), (5, 5, 5)], [((0, 1, 2),), ((1, 0, 3),), ((2, 1, 3),), ((0, 2, 3),)]
        ),
        104,
    ),
    "hole crosses the exterior": (with_roof([(8, 3), (8, 6), (12, 6), (12, 3)]), 201),
    "hole shares an edge with the exterior": (with_roof([(8, 3), (8, 6), (10, 6), (10, 3)]), 201),
    "holes cross": (with_roof([(1, 1), (1, 5), (5, 5), (5, 1)], [(4, 4), (4, 8), (8, 8), (8, 4)]), 201),
    "outside hole touches": (with_roof([(10, 5), (12, 6), (12, 4)]), 201),
    "same hole twice": (with_roof(YARD, YARD), 202),
    "corner lifted by 10 cm": (lifted(0.1), 203),
    "narrow fold": (folded_roof(), 204),
    "hole cuts the face in two": (with_roof([(5, 0), (4, 5), (5, 10), (6, 5)]), 205),
    "chain of holes cuts off a corner": (with_roof([(0, 5), (2, 7), (2, 6)], [(2, 7), (5, 10), (4, 8)]), 205),
    "hole outside": (with_roof([(12, 3), (12, 6), (14, 6), (14, 3)]), 206),
    "hole in a hole": (with_roof([(1, 1), (1, 8), (8, 8), (8, 1)], [(3, 3), (3, 5), (5, 5), (5, 3)]), 207),
    "hole turned like the exterior": (with_roof(YARD[::-1]), 208),
    "three faces": (with_faces(box(), lambda f: f.__delitem__(slice(3, None))), 301),
    "face missing": (with_faces(gable(), lambda f: f.__delitem__(3)), 302),
    "hole in the roof and nothing in it": (with_roof(YARD), 302),
    "vertex missing in a neighbour's edge": (
        with_faces(noded(box(), 2), lambda f: f.__setitem__(1, box().faces[1])),
        302,
    ),
    "floor between two rooms": (with_lid(), 303),
    "blocks that share an edge": (joined(box(), box(10, 10, 0)), 303),
    "blocks that share a vertex": (joined(box(), box(10, 10, 10)), 303),
    "two blocks": (joined(box(), box(20)), 305),
    "spire through the floor": (sunken_spire(), 306),
    "spire tip on the floor": (spire_to(5, 5, 0), 306),
    "spire tip out through a wall": (spire_to(14, 5, 3), 306),
    "spire tip on a wall": (spire_to(10, 5, 2.5), 306),
    "face turned": (with_faces(gable(), lambda f: f.__setitem__(5, reversed_face(f[5]))), 307),
    "all faces turned": (with_faces(gable(), lambda f: f.__setitem__(slice(None), [reversed_face(x) for x in f])), 405),
    "not a number": (Polyhedron(np.where(box().vertices == 10, np.nan, box().vertices), box().faces), 901),
    "index beyond the vertices": (
        replaced(box(), 0, 3, 2, 99),
        901,
    ),
    "nothing": (Polyhedron(np.empty((0, 3)), ()), 902),
}


@pytest.mark.parametrize("name", VALID)
@pytest.mark.parametrize("pieces", [1, 2, 3, 7])
def test_valid_solids_have_no_faults(name: str, pieces: int) -> None:
    assert check_polyhedron(noded(VALID[name], pieces)) == []


@pytest.mark.parametrize("name", FAULTY)
def test_each_fault_yields_exactly_its_code(name: str) -> None:
    solid, code = FAULTY[name]
    assert codes(solid) == {code}


def test_every_code_of_rings_polygons_and_shells_is_tried() -> None:
    tried = {code for _, code in FAULTY.values()} | {103}
    assert tried >= {code for code in FAULT_NAMES if code < 400}


@pytest.mark.parametrize(
    ("ring", "code"), [((), 101), ((0,), 101), ((0, 0, 0), 102), ((0, 1, 0, 1), 104), ((0, 4, 6, 6), 102)]
)
def test_degenerate_rings_do_not_stop_the_check(ring: tuple[int, ...], code: int) -> None:
    more = Face((ring,), Semantic.WALL)
    assert codes(Polyhedron(box().vertices, (*box().faces, more))) == {code}


@pytest.mark.parametrize(
    ("name", "where"),
    [("face turned", "face=5"), ("corner lifted by 10 cm", "face=1"), ("hole in a hole", "face=1|ring=2")],
)
def test_faults_say_where(name: str, where: str) -> None:
    assert [f.where for f in check_polyhedron(FAULTY[name][0])] == [where]


def test_one_polygon_in_space() -> None:
    square = np.array([(0, 0, 0), (10, 0, 10), (10, 10, 10), (0, 10, 0)], np.float64)
    hole = np.array([(3, 3, 3), (3, 6, 3), (6, 6, 6), (6, 3, 6)], np.float64)
    assert check_polygon([square, hole]) == []
    assert [f.code for f in check_polygon([square, hole[::-1]])] == [208]


def test_holes_may_touch_in_a_point() -> None:
    """A hole whose corner lies on the middle of an edge of another; together they cut nothing off."""
    flat = [np.c_[np.array(r, np.float64), np.zeros(len(r))] for r in (SQUARE, YARD, [(7, 5), (8, 6), (8, 4)])]
    assert check_polygon(flat) == []


@pytest.mark.parametrize(("by", "code"), [(0.0, set()), (0.019, set()), (0.05, {203})])
def test_planarity_is_told_by_the_distance_to_the_fitted_plane(by: float, code: set[int]) -> None:
    """Lifting a corner of a square by h leaves each corner h/4 off the fitted plane."""
    assert codes(lifted(by)) == code


def test_planarity_tolerance_can_be_set() -> None:
    assert is_valid(lifted(0.1), Tolerances(planarity_m=0.05))


@pytest.mark.parametrize("gap", [0.002, 0.01, 1])
def test_walls_close_to_each_other_do_not_touch(gap: float) -> None:
    assert codes(shrunk_step(gap)) == set()


@pytest.mark.parametrize("depth", [1e-4, 1e-3, 0.1])
def test_walls_that_pass_through_each_other_by_little(depth: float) -> None:
    """A leaning wall whose top edge passes another wall's plane by `depth`."""
    assert codes(spire_to(10 + depth, 5, 2.5)) == {306}
    assert codes(spire_to(10 - depth, 5, 2.5)) == set()


def test_a_thin_gap_at_an_acute_corner_is_no_contact() -> None:
    """Eaves: a roof that leaves the wall at a small angle."""
    needle = [(0, 0), (20, 0), (20, 0.02)]
    assert codes(extrude([needle], 0, 5)) == set()


@st.composite
def poses(draw: st.DrawFn) -> tuple[Array, Array, int]:
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    shift = np.array([draw(st.floats(-3e5, 3e5)), draw(st.floats(-6e6, 6e6)), draw(st.floats(-50, 500))])
    return Rotation.random(rng=rng).as_matrix(), shift, seed


def posed(solid: Polyhedron, pose: tuple[Array, Array, int]) -> Polyhedron:
    """Turned, moved, vertices and faces in another order, rings begun elsewhere."""
    turn, shift, seed = pose
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(solid.vertices))
    rank = np.argsort(order)
    faces = []
    for face in solid.faces:
        rings = tuple(tuple(int(rank[i]) for i in np.roll(r, rng.integers(0, len(r)))) for r in face.rings)
        faces.append(replace(face, rings=(rings[0], *(rings[i] for i in 1 + rng.permutation(len(rings) - 1)))))
    return Polyhedron(solid.vertices[order] @ turn.T + shift, tuple(faces[i] for i in rng.permutation(len(faces))))


@settings(max_examples=60, deadline=None, derandomize=True)
@given(pose=poses(), name=st.sampled_from(sorted(VALID)), pieces=st.integers(1, 4))
def test_valid_in_any_pose(pose: tuple[Array, Array, int], name: str, pieces: int) -> None:
    assert check_polyhedron(posed(noded(VALID[name], pieces), pose)) == []


POSABLE = sorted(name for name, (_, code) in FAULTY.items() if code < 900)


@settings(max_examples=120, deadline=None, derandomize=True)
@given(pose=poses(), name=st.sampled_from(POSABLE))
def test_same_fault_in_any_pose(pose: tuple[Array, Array, int], name: str) -> None:
    solid, code = FAULTY[name]
    assert codes(posed(solid, pose)) == {code}


@settings(max_examples=60, deadline=None, derandomize=True)
@given(name=st.sampled_from(sorted(VALID)), seed=st.integers(0, 2**32 - 1), kind=st.integers(0, 4))
def test_corrupted_solids_are_found_out(name: str, seed: int, kind: int) -> None:
    rng = np.random.default_rng(seed)
    solid = VALID[name]
    faces, vertices = list(solid.faces), solid.vertices.copy()
    chosen = int(rng.integers(0, len(faces)))
    if kind == 0:
        faces[chosen] = reversed_face(faces[chosen])
    elif kind == 1:
        del faces[chosen]
    elif kind == 2:
        faces.append(faces[chosen])
    elif kind == 3:
        direction = rng.normal(size=3)
        quads = [i for f in faces for r in f.rings for i in r if len(r) > 3]
        vertices[rng.choice(quads)] += 0.5 * np.sign(direction) * (0.2 + np.abs(direction) / np.abs(direction).max())
    else:
        ring = vertices[list(faces[chosen].rings[0])]
        away = 3 * (ring[1] - ring[0]) + 0.3 * (ring - ring.mean(axis=0))[::-1] + ring.mean(axis=0)
        hole = tuple(range(len(vertices), len(vertices) + len(ring)))
        faces[chosen] = replace(faces[chosen], rings=(*faces[chosen].rings, hole))
        vertices = np.concatenate([vertices, away])
    found = codes(Polyhedron(vertices, tuple(faces)))
    expected = {0: {307}, 1: {302}, 2: {303}, 3: {203, 204, 306, 104}, 4: {206}}[kind]
    assert found
    assert found <= expected


def city_block(cells: int) -> Polyhedron:
    """A block whose flat roof and floor are cut into cells, with steps: about 6 · cells faces, many coplanar."""
    rng = np.random.default_rng(cells)
    heights = rng.choice([4.0, 7.0, 10.0], cells)
    n = cells
    levels = sorted({0.0, *heights.tolist()})
    index: dict[tuple[int, float, float], int] = {}
    vertices: list[tuple[float, float, float]] = []
    for i in range(n + 1):
        for y in (0.0, 9.0):
            for z in levels:
                index[i, y, z] = len(vertices)
                vertices.append((2.0 * i, y, z))
    faces: list[tuple[int, ...]] = []

    def column(i: int, y: float, low: float, high: float) -> list[int]:
        return [index[i, y, z] for z in levels if low <= z <= high]

    for i, h in enumerate(heights):
        left = heights[i - 1] if i else 0.0
        right = heights[i + 1] if i + 1 < n else 0.0
        faces.append((index[i, 0.0, 0.0], index[i, 9.0, 0.0], index[i + 1, 9.0, 0.0], index[i + 1, 0.0, 0.0]))
        faces.append((index[i, 0.0, h], index[i + 1, 0.0, h], index[i + 1, 9.0, h], index[i, 9.0, h]))
        faces.append((*column(i, 0.0, 0, h)[::-1], *column(i + 1, 0.0, 0, h)))
        faces.append((*column(i, 9.0, 0, h), *column(i + 1, 9.0, 0, h)[::-1]))
        for at, other, flip in ((i, left, False), (i + 1, right, True)):
            for low, high in pairwise(levels):
                if other <= low and high <= h:
                    wall = (index[at, 9.0, low], index[at, 0.0, low], index[at, 0.0, high], index[at, 9.0, high])
                    faces.append(wall[::-1] if flip else wall)
    used = sorted({i for f in faces for i in f})
    rank = {v: k for k, v in enumerate(used)}
    return polyhedron([vertices[i] for i in used], [(tuple(rank[i] for i in f),) for f in faces])


def test_large_blocks_are_valid() -> None:
    for cells in (3, 12, 50):
        assert check_polyhedron(city_block(cells)) == []


def test_speed() -> None:
    """5 ms for a house, 50 ms for 300 faces, of processor time; threefold room for a busy machine."""
    house, block = noded(tower_on_roof(), 2), city_block(60)
    assert len(block.faces) >= 290
    for solid, limit in ((house, 0.005), (block, 0.05)):
        check_polyhedron(solid)
        times = []
        for _ in range(5):
            begin = time.process_time()
            check_polyhedron(solid)
            times.append(time.process_time() - begin)
        assert min(times) < 3 * limit
