from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, box

from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.geometry.polygon_overlap import overlap_volume
from cityflow.geometry.polyhedron import face_areas, face_normals, volume
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.extruded import extrude
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.partition_values import RoofPartition
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.party import party_walls
from cityflow.reconstruction.party.party_walls import cut_party_walls, differing_walls, wall_areas
from cityflow.reconstruction.solids.assemble import assemble
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
    assert vertex_sets(cut["a"], "b") == vertex_sets(cut["b"], "a")
    assert differing_walls(cut) == []


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


def gable(outline: np.ndarray, axis: int, floor: float, eave: float, slope: float, ridge: float = 0.5) -> Polyhedron:
    """A roof of two planes over any quadrangle, its eaves at `eave` where the outline begins along the axis."""
    start, width = outline[:, axis].min(), np.ptp(outline[:, axis])
    middle = start + ridge * width
    division = Subdivision.of_polygon(Polygon(outline))
    division.cut(0, CutLine(float(axis == 0), float(axis == 1), middle, -100.0, 100.0, 1.0))
    labels = {c: int(line_side(division, r[0], axis) > middle) for c, r in division.cells.items()}
    planes = np.zeros((2, 3))
    planes[:, axis] = slope, -slope
    planes[:, 2] = eave - slope * start, eave + slope * (2 * middle - start)
    return assemble(RoofPartition.of_subdivision(division, labels), planes, floor, (0.0, 0.0, 0.0))


def line_side(division: Subdivision, ring: Sequence[int], axis: int) -> float:
    return float(np.mean([division.xy[v][axis] for v in ring]))


def block_of_houses(rng: np.random.Generator, columns: int, rows: int, jitter: float) -> dict[str, Polyhedron]:
    """Houses on a skew grid, so that four meet in each inner corner; nearly equal roofs where `jitter` is small."""
    grid = np.stack(np.meshgrid(np.arange(columns + 1) * 6.5, np.arange(rows + 1) * 8.3, indexing="ij"), -1)
    grid = np.round(grid + rng.uniform(-1, 1, grid.shape), 4)
    names = rng.permutation(columns * rows)
    houses = {}
    for i in range(columns):
        for j in range(rows):
            outline = grid[[i, i + 1, i + 1, i], [j, j, j + 1, j + 1]]
            floor, eave = round(rng.choice([0, 0.01, 0.5]), 2), 5 + jitter * rng.uniform(-1, 1)
            axis, slope, ridge = (int(rng.integers(2)), rng.uniform(-0.3, 1.2), rng.uniform(0.2, 0.8))
            if jitter < 1:
                axis, slope, ridge = 1, 0.6 + 0.1 * jitter * rng.uniform(-1, 1), 0.5
            houses[f"h{names[i * rows + j]}"] = gable(outline, axis, floor, eave, slope, ridge)
    return {k: s for k, s in houses.items() if check_polyhedron(s) == []}


@given(
    st.integers(0, 2**32 - 1),
    st.integers(2, 3),
    st.integers(1, 2),
    st.sampled_from([0.0, 0.0005, 0.001, 0.003, 0.01, 0.05, 2.0]),
)
@settings(max_examples=40, deadline=None)
def test_neighbours_have_the_same_vertices(seed: int, columns: int, rows: int, jitter: float) -> None:
    units = block_of_houses(np.random.default_rng(seed), columns, rows, jitter)
    cut = cut_party_walls(units)
    assert differing_walls(cut) == []
    for unit, solid in cut.items():
        assert check_polyhedron(solid) == []
        assert edges_are_matched(solid)
        assert volume(solid) == pytest.approx(volume(units[unit]), abs=0.0015 * Polygon(footprint(solid)).area)
        for other in {f.neighbour for f in solid.faces if f.neighbour is not None}:
            assert vertex_sets(solid, other) == vertex_sets(cut[other], unit)
            assert overlap_volume(solid, cut[other]) < 0.001


def footprint(solid: Polyhedron) -> np.ndarray:
    return solid.ring(solid.of_semantic(Semantic.GROUND)[0].rings[0])[:, :2]


@pytest.mark.parametrize("seed", range(4))
def test_tied_roofs_leave_no_strips(seed: int) -> None:
    """A row of roofs that differ by less than 3 mm is cut into one common face per wall, and nothing else."""
    rng = np.random.default_rng(seed)
    grid = np.arange(6) * 6.5
    units = {
        f"h{k}": gable(
            np.array([[a, 0], [a + 6.5, 0], [a + 6.5, 8], [a, 8]]), 1, 0.0, 5 + rng.uniform(-0.0014, 0.0014), 0.6
        )
        for k, a in enumerate(grid)
    }
    cut = cut_party_walls(units)
    assert differing_walls(cut) == []
    for unit, solid in cut.items():
        assert check_polyhedron(solid) == []
        assert len(solid.faces) == len(units[unit].faces)
        assert volume(solid) == pytest.approx(volume(units[unit]), abs=0.0015 * 6.5 * 8)


def test_units_that_touch_in_a_corner_agree_without_the_rest() -> None:
    """Each house of a block of four comes out the same with a fifth one, which it does not touch, or without."""
    units = block_of_houses(np.random.default_rng(3), 3, 2, 2.0)
    everything = cut_party_walls(units)
    for unit in units:
        own = {tuple(p) for p in footprint(units[unit]).tolist()}
        touching = {k: s for k, s in units.items() if own & {tuple(p) for p in footprint(s).tolist()}}
        alone = cut_party_walls(dict(reversed(touching.items())))[unit]
        assert alone.faces == everything[unit].faces
        assert alone.vertices.tobytes() == everything[unit].vertices.tobytes()


def test_ridge_near_the_other_ridge_becomes_one() -> None:
    units = {"a": house(0, 6, "x", 0.0, 5.0, ridge=0.5), "b": house(6, 12, "x", 0.0, 5.0, ridge=0.50015)}
    cut = cut_party_walls(units)
    assert differing_walls(cut) == []
    assert len(marked(cut["a"], "b")) == 1
    assert all(len(s.faces) == len(units[u].faces) and check_polyhedron(s) == [] for u, s in cut.items())


def test_third_unit_at_the_end_of_a_wall_is_seen_from_all_three() -> None:
    """Two houses side by side, a long one behind both: its height splits their common edge, and theirs its wall."""
    back = extrude(Polygon([(0, 8), (6, 8), (12, 8), (12, 14), (0, 14)]), 0.0, 3.0)
    units = {"a": block(0, 6, 0.0, 6.0), "b": block(6, 12, 0.01, 9.0), "c": back}
    cut = cut_party_walls(units)
    assert differing_walls(cut) == []
    for unit, solid in cut.items():
        assert check_polyhedron(solid) == []
        assert {f.neighbour for f in solid.faces if f.neighbour} == set(units) - {unit}
    assert all((6.0, 8.0, 3.0) in {tuple(v) for v in s.vertices.tolist()} for s in cut.values())


def test_a_wall_that_cannot_be_cut_is_marked_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    units = {"a": A, "b": house(6, 12, "y", 0.0, 6.0), "c": block(-6, 0, 0.0, 3.0)}
    few = len(units["b"].faces)

    def b_is_spoilt_by_a(solid: Polyhedron) -> bool:
        return check_polyhedron(solid) == [] and not (len(solid.faces) > few and marked(solid, "a"))

    monkeypatch.setattr(party_walls, "is_valid", b_is_spoilt_by_a)
    cut = cut_party_walls(units)
    assert differing_walls(cut) == [("a", "b")]
    assert len(cut["b"].faces) == few
    assert len(marked(cut["b"], "a")) == 1
    assert vertex_sets(cut["a"], "c") == vertex_sets(cut["c"], "a")


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
        assert a == pytest.approx(b, abs=1e-6)
        assert a > 1
    walls = [f for s in cut.values() for f in s.faces if f.neighbour is not None]
    assert all(f.semantic is Semantic.WALL for f in walls)
