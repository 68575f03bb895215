"""The synthetic town as geometry: what stands in it, that it fits together, and that it never depends on what is asked for."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from cityflow.synthetic.caster import Scene
from cityflow.synthetic.mesh import Part, TownMesh
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_houses import HOUSE_SHAPES
from cityflow.synthetic.town_terraces import RowGaps
from cityflow.synthetic.town_truth import PASSING_PARTS, without

SPECIAL_SHAPES = {"church", "hall", "stepped", "tower", "slab", "garage", "terrace gable", "terrace flat"}


@pytest.fixture(scope="module")
def town() -> Town:
    return make_town(2)


@pytest.fixture(scope="module")
def large_town() -> Town:
    return make_town(2, TownParameters(width_m=500, height_m=500))


@pytest.fixture(scope="module")
def mesh(town: Town) -> TownMesh:
    return town.mesh()


def _rows(mesh: TownMesh, inside: tuple[float, float, float, float]) -> np.ndarray:
    """Every triangle with all that belongs to it as one row, of those with a corner inside; sorted."""
    corners = mesh.vertices[mesh.triangles]
    x, y = corners[..., 0], corners[..., 1]
    chosen = np.any((x > inside[0]) & (x < inside[2]) & (y > inside[1]) & (y < inside[3]), axis=1)
    rest: list[np.ndarray] = [mesh.part, mesh.material, mesh.unit, mesh.seed]
    frames: list[np.ndarray] = [mesh.texture_origin, mesh.texture_u, mesh.texture_v, mesh.tint]
    rows: np.ndarray = np.hstack([corners.reshape(-1, 9), np.column_stack(rest), *frames])[chosen]
    return rows[np.lexsort(rows.T)]


def test_same_seed_same_bytes_other_seed_other_town() -> None:
    small = TownParameters(width_m=120, height_m=120)
    first, again, other = (make_town(seed, small).mesh() for seed in (5, 5, 6))
    for name in TownMesh.__slots__:
        assert getattr(first, name).tobytes() == getattr(again, name).tobytes()
    assert first.vertices.tobytes() != other.vertices.tobytes()


def test_objects_do_not_depend_on_the_bounds(town: Town, mesh: TownMesh) -> None:
    x, y = town.bounds[:2]
    inner = (x + 90, y + 80, x + 150, y + 130)
    wide = (x + 70, y + 60, x + 175, y + 150)
    part, more = town.mesh(inner), town.mesh(wide)
    assert 0 < len(part.triangles) < len(more.triangles) < len(mesh.triangles)
    assert np.array_equal(_rows(part, inner), _rows(mesh, inner))
    assert np.array_equal(_rows(more, inner), _rows(mesh, inner))


def test_all_shapes_stand_in_a_few_towns(large_town: Town) -> None:
    towns = [make_town(1, TownParameters(width_m=500, height_m=500)), large_town]
    shapes = {u.shape for t in towns for u in t.units}
    assert set(HOUSE_SHAPES) <= shapes
    assert shapes >= SPECIAL_SHAPES
    assert {"round cone", "round flat"} & shapes
    assert {"curved gable", "curved flat"} & shapes
    assert {"corner flat", "corner pyramid"} & shapes
    assert any(g.tree for t in towns for g in t.gaps)
    assert any(not g.tree for t in towns for g in t.gaps)
    kinds = {v.kind for t in towns for u in t.units for v in u.volumes}
    assert {"main", "dormer", "chimney"} <= kinds


def test_all_parts_are_in_the_mesh(mesh: TownMesh) -> None:
    assert set(np.unique(mesh.part).tolist()) == {int(p) for p in Part} - {Part.WATER, Part.BRIDGE}


@pytest.mark.parametrize("relief", [0.0, 1.0])
def test_terrain_follows_relief(relief: float) -> None:
    t = make_town(4, TownParameters(relief=relief))
    x, y = np.meshgrid(np.linspace(*t.bounds[::2], 60), np.linspace(*t.bounds[1::2], 60))
    z = t.dtm(x, y)
    assert np.ptp(z) < 0.01 if relief == 0 else np.ptp(z) > 8
    assert np.abs(z - t.terrain.z(x, y)).max() < 0.02


def test_units_do_not_overlap_and_are_noded(town: Town) -> None:
    outlines = np.array([u.wall_outline for u in town.units], dtype=object)
    assert shapely.is_valid(outlines).all()
    a, b = shapely.STRtree(outlines).query(outlines, predicate="dwithin", distance=1e-5)
    pairs = np.column_stack([a, b])[a < b]
    assert len(pairs) > 30
    overlap = shapely.area(shapely.intersection(outlines[pairs[:, 0]], outlines[pairs[:, 1]]))
    assert overlap.max() < 1e-6
    for i, j in pairs:
        corners = shapely.get_coordinates(outlines[j])
        touching = shapely.distance(shapely.points(corners), outlines[i].exterior) < 1e-5
        own = {tuple(c) for c in shapely.get_coordinates(outlines[i]).tolist()}
        assert all(tuple(c) in own for c in corners[touching].tolist())


def test_no_ray_enters_a_building(mesh: TownMesh, town: Town) -> None:
    """Whatever is met first is met from outside: walls, roofs and ground close, and all triangles face outwards."""
    hard = without(mesh, PASSING_PARTS)
    scene = Scene(hard)
    rng = np.random.default_rng(7)
    count, b = 200_000, town.bounds
    x, y = rng.uniform(b[0] + 25, b[2] - 25, count), rng.uniform(b[1] + 25, b[3] - 25, count)
    aim = np.column_stack([x, y, town.dtm(x, y) + rng.uniform(0, 10, count)])
    turn, rise = rng.uniform(0, 2 * np.pi, count), np.radians(rng.uniform(25, 90, count))
    ray = -np.column_stack([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)])
    triangle, length = scene.first_hits(aim - 150 * ray - scene.origin, ray)
    assert (triangle >= 0).all()
    from_inside = np.sum(scene.surfaces.normal[triangle] * ray, axis=1) > 1e-6
    assert from_inside.mean() < 2e-5
    assert np.isfinite(length).all()


def test_walls_meet_the_ground(town: Town) -> None:
    for wall in town.walls:
        if town.units[wall.unit].volumes[wall.volume].bottom is None:
            ends = np.array([wall.a, wall.b])
            assert wall.bottom < town.dtm(*ends.T).min() - 0.3


def test_twins_are_alike_but_for_the_facade(town: Town) -> None:
    twins = [u for u in town.units if u.twin_of >= 0]
    assert len(twins) > 5
    for unit in twins:
        other = town.units[unit.twin_of]
        assert unit.base_m == other.base_m
        assert unit.ridge_m == pytest.approx(other.ridge_m, abs=1e-9)
        assert unit.style.roof == other.style.roof
        assert max(abs(p - q) for p, q in zip(unit.style.facade.tint, other.style.facade.tint, strict=True)) >= 40
        shift = np.subtract(unit.volumes[0].ring[0], other.volumes[0].ring[0])
        for mine, theirs in zip(unit.volumes, other.volumes, strict=True):
            for f, g in zip(mine.faces, theirs.faces, strict=True):
                moved = np.subtract(f.ring[0], g.ring[0])
                assert np.allclose(moved, shift, atol=2e-6)
                assert (f.slope_u, f.slope_v) == pytest.approx((g.slope_u, g.slope_v))


def test_overhangs_reach_from_none_to_a_metre(large_town: Town) -> None:
    reach = np.array(
        [
            shapely.distance(shapely.points(shapely.get_coordinates(u.roof_outline)), u.wall_outline).max()
            for u in large_town.units
            if u.shape in HOUSE_SHAPES
        ]
    )
    assert reach.min() < 1e-6
    assert reach.max() > 0.8
    assert reach.max() < 1.0 * np.sqrt(2) + 1e-6  # corners lie on the diagonal


def test_gaps_are_as_wide_as_stated(town: Town) -> None:
    assert len(town.gaps) >= 3
    for gap in town.gaps:
        a, b = (town.units[k].wall_outline for k in gap.between)
        assert 0.8 - 1e-6 <= a.distance(b) <= 2.0 + 1e-6


def test_windows_are_recessed_and_free(town: Town) -> None:
    """Panes lie 0.1 to 0.2 m behind their wall, and half a metre before them there is no building."""
    windows = town.windows
    assert len(windows.unit) > 500
    assert windows.is_door.sum() > 0.6 * len(town.units)
    middle = windows.corners.mean(axis=1)
    edge = windows.corners[:, 1] - windows.corners[:, 0]
    outward = np.column_stack([edge[:, 1], -edge[:, 0]]) / np.linalg.norm(edge[:, :2], axis=1)[:, None]
    outlines = [u.wall_outline for u in town.units]
    plain = np.array([town.units[k].shape in {"gable", "hip", "terrace gable", "slab"} for k in windows.unit])
    depth = np.array(
        [
            outlines[k].exterior.distance(shapely.Point(p))
            for k, p in zip(windows.unit[plain], middle[plain, :2], strict=True)
        ]
    )
    on_outline = depth < 0.25  # the others are in dormers and annexes
    assert on_outline.mean() > 0.8
    assert depth[on_outline].min() >= 0.1 - 1e-6
    assert depth[on_outline].max() <= 0.2 + 1e-6
    before = middle[:, :2] + 0.5 * outward
    hit = shapely.STRtree(outlines).query(shapely.points(before), predicate="within")
    foreign = windows.unit[hit[0]] != hit[1]
    low = np.array([town.units[k].eave_m for k in hit[1][foreign]])
    assert np.all(middle[hit[0][foreign], 2] > low)


def test_trees_stand_beside_walls_and_cars_on_streets(town: Town) -> None:
    tree = shapely.STRtree([u.wall_outline for u in town.units])
    feet = shapely.points(town.trees.x, town.trees.y)
    assert len(tree.query(feet, predicate="within")[0]) == 0
    assert len(tree.query(town.cars.polygons(), predicate="intersects")[0]) == 0
    assert len(town.cars) > 20


def test_texture_frames_lie_in_their_triangles(mesh: TownMesh) -> None:
    corners = mesh.vertices[mesh.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    real = size > 1e-6
    normal = normal[real] / size[real, None]
    u, v = mesh.texture_u[real], mesh.texture_v[real]
    assert np.allclose(np.linalg.norm(u, axis=1), 1)
    assert np.allclose(np.linalg.norm(v, axis=1), 1)
    assert np.abs(np.sum(u * v, axis=1)).max() < 1e-6
    assert np.abs(np.sum(u * normal, axis=1)).max() < 1e-3
    assert np.abs(np.sum(v * normal, axis=1)).max() < 1e-3


@pytest.mark.parametrize("roofed", [0.0, 1.0])
def test_gaps_of_rows_are_as_asked(roofed: float) -> None:
    """As wide as asked between the walls; verges cover as much of them as asked, and never overlap."""
    asked = RowGaps(share=0.6, width_m=(0.6, 1.2), roofed_share=roofed)
    t = make_town(3, TownParameters(width_m=150, height_m=150, row_gaps=asked))
    assert len(t.gaps) > 8
    assert not any(g.tree for g in t.gaps)
    closed = 0
    for gap in t.gaps:
        a, b = (t.units[k] for k in gap.between)
        assert 0.59 < shapely.distance(a.wall_outline, b.wall_outline) < 1.21
        assert shapely.intersection(a.roof_outline, b.roof_outline).area < 1e-2
        closed += shapely.distance(a.roof_outline, b.roof_outline) < 0.01
    gabled = sum(t.units[k].shape == "terrace gable" == t.units[n].shape for k, n in (g.between for g in t.gaps))
    assert closed == (gabled if roofed else 0)
