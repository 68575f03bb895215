"""The surfaces of a roof beyond the walls, beside a solid that ends at them."""

from __future__ import annotations

import io
import math
import re
from itertools import pairwise

import numpy as np
import pytest
import shapely
from shapely import LineString, Polygon

from cityflow.core.building import Building, EdgeOverhang, Lod, Semantic
from cityflow.geometry.polyhedron import rings_of
from cityflow.geometry.validity import check_polygons
from cityflow.io.city_models.citygml import write_citygml
from cityflow.io.city_models.cityjson import Transform, feature_line, read_feature
from cityflow.io.city_models.obj import write_obj
from cityflow.io.crs import resolve
from cityflow.reconstruction.choose import ReconstructParameters, choose
from cityflow.reconstruction.overhangs.overhang_solid import with_overhangs
from roof_scenes import OUTLINE as PLAN
from roof_scenes import gable, scan

REACH_M = 0.6
EVIDENCE = scan(gable, PLAN, 8.0, 0.02, 1)
OUTLINE = EVIDENCE.outline


def _overhangs(reach: float) -> tuple[EdgeOverhang, ...]:
    return tuple(EdgeOverhang(LineString(ends), reach, 0.02, 1.0) for ends in pairwise(OUTLINE.exterior.coords))


@pytest.fixture(scope="module")
def building() -> Building:
    best = choose(EVIDENCE, ReconstructParameters()).candidate
    extended = with_overhangs(best, _overhangs(REACH_M), EVIDENCE)
    assert best.solid is not None
    assert extended.solid is not None
    beyond = extended.beyond
    return Building(
        "a", OUTLINE, EVIDENCE.ground_height, {Lod.LOD22: best.solid}, best.planes,
        overhangs=_overhangs(REACH_M), beyond=beyond,
    )  # fmt: skip


def _plans(building: Building, semantic: Semantic) -> list[Polygon]:
    assert building.beyond is not None
    return [Polygon(building.beyond.ring(f.rings[0])[:, :2]) for f in building.beyond.of_semantic(semantic)]


def test_the_roofs_lie_in_their_planes_and_fill_the_ring_around_the_walls(building: Building) -> None:
    assert building.beyond is not None
    ring = shapely.buffer(OUTLINE, REACH_M, join_style="mitre").difference(OUTLINE)
    assert shapely.union_all(_plans(building, Semantic.ROOF)).symmetric_difference(ring).area < 0.01 * ring.area
    assert (
        shapely.union_all(_plans(building, Semantic.OUTER_CEILING)).symmetric_difference(ring).area < 0.01 * ring.area
    )
    for face in building.beyond.of_semantic(Semantic.ROOF):
        corners = building.beyond.ring(face.rings[0])
        plane = building.planes[face.plane]
        assert np.abs(corners[:, 2] - plane.z(corners[:, 0], corners[:, 1])).max() < 0.005


def test_every_surface_keeps_the_rules(building: Building) -> None:
    assert building.beyond is not None
    assert check_polygons(rings_of(building.beyond)) == []


def test_they_meet_the_solid_at_its_own_vertices(building: Building) -> None:
    assert building.beyond is not None
    of_solid = set(map(tuple, building.solids[Lod.LOD22].vertices.tolist()))
    roofs = {
        tuple(v) for f in building.beyond.of_semantic(Semantic.ROOF) for v in building.beyond.ring(f.rings[0]).tolist()
    }
    at_walls = [v for v in roofs if shapely.dwithin(shapely.Point(v[:2]), OUTLINE.exterior, 1e-6)]
    assert len(at_walls) >= 4
    corners = set(map(tuple, OUTLINE.exterior.coords))
    for vertex in at_walls:
        if vertex[:2] in corners:
            assert min(math.dist(vertex, other) for other in of_solid) < 0.003


def test_they_go_with_the_building_and_come_back(building: Building) -> None:
    again = read_feature(feature_line(building))
    assert again.beyond is not None
    assert building.beyond is not None
    assert [f.semantic for f in again.beyond.faces] == [f.semantic for f in building.beyond.faces]
    for mine, theirs in zip(building.beyond.faces, again.beyond.faces, strict=True):
        assert np.array_equal(building.beyond.ring(mine.rings[0]), again.beyond.ring(theirs.rings[0]))
    assert np.array_equal(
        np.sort(again.solids[Lod.LOD22].vertices, axis=0), np.sort(building.solids[Lod.LOD22].vertices, axis=0)
    )
    assert [o.reach_m for o in again.overhangs] == [REACH_M] * len(building.overhangs)


def test_without_overhangs_there_is_nothing() -> None:
    best = choose(EVIDENCE, ReconstructParameters()).candidate
    assert with_overhangs(best, _overhangs(0.0), EVIDENCE).beyond is None


def test_every_format_writes_them(building: Building) -> None:
    reference = resolve("EPSG:7415")
    buffer = io.BytesIO()
    write_citygml(buffer, [building], reference)
    gml = buffer.getvalue().decode()
    ids = re.findall(r'gml:id="([^"]+)"', gml)
    assert len(ids) == len(set(ids))
    assert building.beyond is not None
    ceilings = len(building.beyond.of_semantic(Semantic.OUTER_CEILING))
    assert gml.count("<bldg:OuterCeilingSurface") == ceilings > 0
    solid = gml[gml.index("<bldg:lod2Solid") : gml.index("</bldg:lod2Solid")]
    assert solid.count("xlink:href") == len(building.solids[Lod.LOD22].faces)
    obj = write_obj("a", [building], reference, Transform.over(OUTLINE.bounds))["a.obj"].decode()
    assert obj.count("usemtl outer_ceiling") >= 1
    vertices = sum(line.startswith("v ") for line in obj.splitlines())
    used = {int(i) for line in obj.splitlines() if line.startswith("f ") for i in line.split()[1:]}
    assert used == set(range(1, vertices + 1))
