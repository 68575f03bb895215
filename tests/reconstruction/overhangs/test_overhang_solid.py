"""Solids with overhangs: valid, in their roof's own planes, walls where they were, neighbours untouched."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
import shapely
from shapely import LineString, Polygon

from cityflow.core.building import EdgeOverhang, Polyhedron, Semantic
from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.polygon_overlap import overlap_volume
from cityflow.geometry.polyhedron import volume
from cityflow.geometry.straight_edges import wall_edges
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.extruded import extrude
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.overhang_solid import with_overhangs
from cityflow.reconstruction.partition.partition_values import RoofCell, RoofPartition
from cityflow.reconstruction.party.party_walls import cut_party_walls, differing_walls
from cityflow.reconstruction.solids.assemble import assemble

FLOOR, SLAB = 10.0, OverhangParameters().slab_m
ORIGIN = (1000.0, 2000.0, 0.0)
Ring = Sequence[tuple[float, float]]


def solid_of(
    outline: Ring, inner: Ring, cells: Sequence[tuple[Sequence[int], tuple[float, float, float]]]
) -> Candidate:
    """A solid from roof polygons (vertex numbers) and their planes z = a·x + b·y + c, local."""
    vertices = np.array([*outline, *inner])
    partition = RoofPartition(vertices, len(outline), tuple(RoofCell((tuple(r),), k) for k, (r, _) in enumerate(cells)))
    world = Polygon(np.asarray(outline) + ORIGIN[:2])
    solid = assemble(partition, np.array([p for _, p in cells]), FLOOR, ORIGIN, world)
    assert check_polyhedron(solid) == []
    return Candidate("test", solid)


def hip() -> tuple[Candidate, Polygon]:
    outline = [(0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0)]
    cells = [
        ((0, 1, 5, 4), (0.0, 0.5, 13.0)), ((1, 2, 5), (-0.5, 0.0, 18.0)),
        ((2, 3, 4, 5), (0.0, -0.5, 16.0)), ((3, 0, 4), (0.5, 0.0, 13.0)),
    ]  # fmt: skip
    return solid_of(outline, [(3.0, 3.0), (7.0, 3.0)], cells), Polygon(np.asarray(outline) + ORIGIN[:2])


def gable(x: float = 0.0, eave: float = 13.0) -> tuple[Candidate, Polygon]:
    """Ridge along x; 8 m wide from `x`, 6 m deep."""
    outline = [(x, 0.0), (x + 8, 0.0), (x + 8, 6.0), (x, 6.0)]
    vertices = [(x, 3.0), (x + 8, 3.0)]
    cells = [((0, 1, 5, 4), (0.0, 0.7, eave)), ((4, 5, 2, 3), (0.0, -0.7, eave + 4.2))]
    return solid_of(outline, vertices, cells), Polygon(np.asarray(outline) + ORIGIN[:2])


def valley() -> tuple[Candidate, Polygon]:
    """An L whose two sheds fall towards its inner corner."""
    outline = [(0.0, 0.0), (4.0, 0.0), (4.0, 5.0), (9.0, 5.0), (9.0, 9.0), (0.0, 9.0)]
    cells = [((0, 1, 2, 5), (-0.4, 0.0, 16.6)), ((2, 3, 4, 5), (0.0, 0.4, 13.0))]
    return solid_of(outline, [], cells), Polygon(np.asarray(outline) + ORIGIN[:2])


def stepped() -> tuple[Candidate, Polygon]:
    """Two level roofs of different heights side by side."""
    outline = [(0.0, 0.0), (9.0, 0.0), (9.0, 6.0), (0.0, 6.0)]
    cells = [((0, 4, 5, 3), (0.0, 0.0, 16.0)), ((4, 1, 2, 5), (0.0, 0.0, 14.0))]
    vertices = [(5.0, 0.0), (5.0, 6.0)]
    return solid_of(outline, vertices, cells), Polygon(np.asarray(outline) + ORIGIN[:2])


def courtyard() -> tuple[Candidate, Polygon]:
    ring = shapely.box(1000, 2000, 1012, 2012).difference(shapely.box(1004, 2004, 1008, 2008))
    ring = shapely.geometry.polygon.orient(ring)
    return Candidate("extruded", extrude(ring, FLOOR, 15.0)), ring


SHAPES = {"hip": hip, "gable": gable, "valley": valley, "stepped": stepped, "courtyard": courtyard}


def out(outline: Polygon, reaches: Sequence[float], party: Sequence[LineString] = ()) -> tuple[EdgeOverhang, ...]:
    edges = wall_edges(outline, party)
    return tuple(EdgeOverhang(e.line, reaches[k % len(reaches)]) for k, e in enumerate(edges))


def evidence(outline: Polygon, party: Sequence[LineString] = ()) -> Evidence:
    return Evidence("u", outline, PointCloud.empty(), FLOOR, party=tuple(party))


def plan_area(solid: Polyhedron, semantic: Semantic) -> float:
    faces = [Polygon(solid.ring(f.rings[0])[:, :2], [solid.ring(r)[:, :2] for r in f.rings[1:]]) for f in solid.of_semantic(semantic)]  # fmt: skip
    return float(sum(f.area for f in faces))


@pytest.mark.parametrize("name", sorted(SHAPES))
@pytest.mark.parametrize("reaches", [(0.5,), (0.3, 0.8, 0.0, 0.5), (1.0, 0.0)])
def test_solids_are_valid_and_only_grow_beyond_their_walls(name: str, reaches: tuple[float, ...]) -> None:
    candidate, outline = SHAPES[name]()
    before = candidate.solid
    done = with_overhangs(candidate, out(outline, reaches), evidence(outline))
    assert before is not None
    assert done.solid is not None
    assert done.notes["overhangs_left"] == 0
    assert check_polyhedron(done.solid) == []
    beyond = plan_area(done.solid, Semantic.OUTER_CEILING)
    assert beyond > 1.0
    assert plan_area(done.solid, Semantic.ROOF) == pytest.approx(outline.area + beyond, abs=0.01)
    assert volume(done.solid) == pytest.approx(volume(before) + SLAB * beyond, rel=1e-4)


def test_the_ground_face_stays_bit_for_bit() -> None:
    candidate, outline = hip()
    done = with_overhangs(candidate, out(outline, (0.6,)), evidence(outline))
    for solid in (candidate.solid, done.solid):
        assert solid is not None
        (ground,) = solid.of_semantic(Semantic.GROUND)
        assert {tuple(p) for p in solid.ring(ground.rings[0]).tolist()} == {
            (x, y, FLOOR) for x, y in shapely.get_coordinates(outline.exterior)
        }


def test_roofs_go_on_in_their_own_planes_and_hips_run_on() -> None:
    candidate, outline = hip()
    done = with_overhangs(candidate, out(outline, (0.6,)), evidence(outline))
    assert done.solid is not None
    roofs = done.solid.of_semantic(Semantic.ROOF)
    assert [len(f.rings[0]) for f in roofs] == [4, 3, 4, 3]
    low = [done.solid.ring(f.rings[0])[:, 2].min() for f in roofs]
    assert low == pytest.approx([13.0 - 0.3] * 4, abs=1e-3)
    tops = {tuple(p) for f in roofs for p in np.round(done.solid.ring(f.rings[0]), 3).tolist()}
    assert (999.4, 1999.4, 12.7) in tops


def test_a_valley_runs_on_to_where_both_rims_cross() -> None:
    candidate, outline = valley()
    done = with_overhangs(candidate, out(outline, (0.5,)), evidence(outline))
    assert done.solid is not None
    roofs = done.solid.of_semantic(Semantic.ROOF)
    ends = [{tuple(p) for p in np.round(done.solid.ring(f.rings[0]), 3).tolist()} for f in roofs]
    assert (1004.5, 2004.5, 14.8) in ends[0] & ends[1]


def test_the_underside_is_parallel_to_the_roof() -> None:
    candidate, outline = gable()
    done = with_overhangs(candidate, out(outline, (0.4,)), evidence(outline))
    assert done.solid is not None
    for face in done.solid.of_semantic(Semantic.OUTER_CEILING):
        _, y, z = done.solid.ring(face.rings[0]).T
        front = y.mean() < 2003
        plane = 13.0 + 0.7 * (y - 2000) if front else 17.2 - 0.7 * (y - 2000)
        assert np.abs(z - (plane - SLAB)).max() < 1e-3
    upright = done.solid.of_semantic(Semantic.WALL)
    assert len(upright) > 4


def test_shared_walls_keep_their_roof_and_neighbours_meet() -> None:
    (left, a), (right, b) = gable(0.0, 13.0), gable(8.0, 13.4)
    wall = LineString([(1008.0, 2000.0), (1008.0, 2006.0)])
    solids = {}
    for name, candidate, outline in (("a", left, a), ("b", right, b)):
        done = with_overhangs(candidate, out(outline, (0.5,)), evidence(outline, [wall]))
        assert done.solid is not None
        solids[name] = done.solid
    assert solids["a"].vertices[:, 0].max() == 1008.0
    assert solids["b"].vertices[:, 0].min() == 1008.0
    cut = cut_party_walls(solids)
    assert differing_walls(cut) == []
    assert any(f.neighbour == "b" for f in cut["a"].faces)
    assert all(check_polyhedron(s) == [] for s in cut.values())
    assert overlap_volume(cut["a"], cut["b"]) < 0.01


def test_an_overhang_that_spoils_the_solid_is_left_and_said_so() -> None:
    """A slab thicker than the wall is high."""
    outline = shapely.box(1000, 2000, 1008, 2006)
    low = Candidate("extruded", extrude(outline, FLOOR, FLOOR + 0.55))
    done = with_overhangs(low, out(outline, (0.5,)), evidence(outline))
    assert done.solid is not None
    assert check_polyhedron(done.solid) == []
    assert done.solid.vertices[:, 0].max() == 1008.0
    assert all(o.reach_m == 0.0 for o in done.overhangs)
    assert done.notes["overhangs_left"] == 4
    assert "too low" in str(done.notes["overhang_reason"])


def test_without_overhangs_the_solid_is_the_same() -> None:
    candidate, outline = hip()
    assert with_overhangs(candidate, out(outline, (0.0,)), evidence(outline)).solid is candidate.solid
    nothing = Candidate("x", None)
    assert with_overhangs(nothing, out(outline, (0.5,)), evidence(outline)).solid is None
