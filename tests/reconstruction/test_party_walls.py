from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import box

from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.geometry.polyhedron import face_areas, face_normals, volume
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.assemble import assemble
from cityflow.reconstruction.extruded import extrude
from cityflow.reconstruction.partition_values import RoofPartition
from cityflow.reconstruction.party_walls import cut_party_walls, wall_areas
from cityflow.reconstruction.subdivision import CutLine, Subdivision
from roof_cases import edges_are_matched


def house(
    x0: float, x1: float, along: str, floor: float, eave: float, slope: float = 0.8, ridge: float = 0.5
) -> Polyhedron:
    """A gabled house over x0–x1, 0–8; `ridge` says where across the ridge lies."""
    division = Subdivision.of_polygon(box(x0, 0, x1, 8))
    axis, start, width = (1, 0.0, 8.0) if along == "x" else (0, x0, x1 - x0)
    middle = start + ridge * width
    line = CutLine(float(axis == 0), float(axis == 1), middle, -100.0, 100.0, 1.0)
    up, down = np.zeros(3), np.zeros(3)
    up[axis], up[2] = slope, eave - slope * start
    down[axis], down[2] = -slope, eave + slope * (2 * middle - start)
    division.cut(0, line)
    labels = {
        c: int(line.side(*np.mean([division.xy[v] for v in r[0]], axis=0)) > 0) for c, r in division.cells.items()
    }
    return assemble(RoofPartition.of_subdivision(division, labels), np.array([up, down]), floor, (0.0, 0.0, 0.0))


def block(x0: float, x1: float, floor: float, top: float) -> Polyhedron:
    return extrude(box(x0, 0, x1, 8), floor, top)


def marked(solid: Polyhedron, neighbour: str) -> list[Face]:
    return [f for f in solid.faces if f.neighbour == neighbour]


def vertex_sets(solid: Polyhedron, neighbour: str) -> list[list[tuple[float, ...]]]:
    return sorted(sorted(tuple(v) for v in solid.ring(f.rings[0]).tolist()) for f in marked(solid, neighbour))


def area_of(solid: Polyhedron, faces: list[Face]) -> float:
    return float(face_areas(Polyhedron(solid.vertices, tuple(faces))).sum())


A = house(0, 6, "x", 0.0, 5.0)
PAIRS = {
    "the same house": (A, house(6, 12, "x", 0.0, 5.0), 8 * 5 + 8 * 3.2 / 2),
    "higher and on higher ground": (A, house(6, 12, "x", 0.5, 6.0), 8 * 4.5 + 8 * 3.2 / 2),
    "roofs that cross": (A, house(6, 12, "x", -1.0, 6.0, slope=0.5, ridge=0.7), None),
    "gable to eaves": (A, house(6, 12, "y", 0.0, 6.0), 8 * 5 + 2 * 1.25 * 1 / 2 + 5.5 * 1),
    "higher block": (A, block(6, 12, 0.0, 20.0), 8 * 5 + 8 * 3.2 / 2),
    "lower block": (A, block(6, 12, 0.0, 3.0), 24.0),
    "block between eaves and ridge": (A, block(6, 12, 0.0, 7.0), 8 * 5 + 2 * 2.5 * 2 / 2 + 3 * 2),
    "heights within a millimetre": (A, house(6, 12, "x", 0.001, 5.001), 8 * 5 + 8 * 3.2 / 2),
}


@pytest.mark.parametrize("name", sorted(PAIRS))
def test_common_part_is_a_face_of_both(name: str) -> None:
    a, b, shared = PAIRS[name]
    cut = cut_party_walls({"a": a, "b": b})
    for unit, solid in cut.items():
        assert check_polyhedron(solid) == []
        assert edges_are_matched(solid)
        assert volume(solid) == pytest.approx(volume({"a": a, "b": b}[unit]), abs=0.02)
    assert len(marked(cut["a"], "b")) == len(marked(cut["b"], "a")) == 1
    area = area_of(cut["a"], marked(cut["a"], "b"))
    assert area == pytest.approx(area_of(cut["b"], marked(cut["b"], "a")), abs=0.02)
    if shared is not None:
        assert area == pytest.approx(shared, abs=0.02)
    if name != "heights within a millimetre":
        assert vertex_sets(cut["a"], "b") == vertex_sets(cut["b"], "a")


def test_strip_below_a_higher_floor_is_free() -> None:
    units = {"a": house(0, 6, "x", 0.0, 5.0), "b": house(6, 12, "x", 0.008, 5.0)}
    cut = cut_party_walls(units)
    assert vertex_sets(cut["a"], "b") == vertex_sets(cut["b"], "a")
    assert all(check_polyhedron(s) == [] for s in cut.values())
    assert len(cut["a"].faces) == len(units["a"].faces) + 1


def test_faces_of_both_look_at_each_other() -> None:
    cut = cut_party_walls({"a": A, "b": house(6, 12, "y", 0.0, 6.0)})
    for unit, other, x in (("a", "b", 1.0), ("b", "a", -1.0)):
        solid = cut[unit]
        assert face_normals(Polyhedron(solid.vertices, tuple(marked(solid, other))))[0] == pytest.approx((x, 0, 0))


def test_areas_of_walls() -> None:
    cut = cut_party_walls({"a": A, "b": block(6, 12, 0.0, 3.0)})
    areas = wall_areas(cut["a"])
    assert areas.shared == pytest.approx(24)
    assert areas.outer == pytest.approx(2 * 6 * 5 + 2 * (40 + 12.8) - 24)


def test_one_above_the_other_shares_nothing() -> None:
    units = {"a": A, "b": block(6, 12, 20.0, 25.0)}
    assert all(f.neighbour is None for s in cut_party_walls(units).values() for f in s.faces)


def test_no_neighbour_changes_nothing() -> None:
    far = block(7, 12, 0.0, 3.0)
    cut = cut_party_walls({"a": A, "b": far})
    assert cut["a"].faces == A.faces
    assert np.array_equal(cut["b"].vertices, far.vertices)


def test_a_unit_depends_on_its_neighbours_only() -> None:
    row = {f"h{k}": house(6 * k, 6 * k + 6, "x", 0.3 * k, 5 + 0.4 * (k % 3), ridge=0.4 + 0.05 * k) for k in range(5)}
    every = cut_party_walls(row)
    backwards = cut_party_walls(dict(reversed(row.items())))
    some = cut_party_walls({k: row[k] for k in ("h1", "h2", "h3")})
    for other in (backwards, some):
        assert other["h2"].faces == every["h2"].faces
        assert other["h2"].vertices.tobytes() == every["h2"].vertices.tobytes()
    assert all(check_polyhedron(s) == [] for s in every.values())


heights, slopes = st.floats(4, 9), st.floats(-0.3, 1.2)


@given(
    st.lists(
        st.tuples(st.sampled_from("xy"), st.floats(0, 2), heights, slopes, st.floats(0.2, 0.8)), min_size=2, max_size=4
    )
)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_any_row_of_houses_stays_valid(row: list[tuple[str, float, float, float, float]]) -> None:
    units = {f"h{k}": house(6 * k, 6 * k + 6, *shape) for k, shape in enumerate(row)}
    cut = cut_party_walls(units)
    for unit, solid in cut.items():
        assert check_polyhedron(solid) == []
        assert edges_are_matched(solid)
        assert volume(solid) == pytest.approx(volume(units[unit]), rel=1e-3)
    for k in range(len(row) - 1):
        left, right = cut[f"h{k}"], cut[f"h{k + 1}"]
        a, b = area_of(left, marked(left, f"h{k + 1}")), area_of(right, marked(right, f"h{k}"))
        assert a == pytest.approx(b, abs=0.3)
        assert a > 1
    walls = [f for s in cut.values() for f in s.faces if f.neighbour is not None]
    assert all(f.semantic is Semantic.WALL for f in walls)
