"""Tiles from far away: blocks as high and as coloured as the models they stand for, terrain within its error, tilesets that replace."""

from __future__ import annotations

import json
import posixpath
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely

from cityflow.core.building import Building, Lod, Semantic
from cityflow.core.coarse import Coarse
from cityflow.core.reference import Reference
from cityflow.geometry.coarse_ground import CELLS, coarse_ground, heights_at
from cityflow.io.city_models.coarse_scene import PARTS, coarse_of
from cityflow.io.city_models.gltf_materials import linear
from cityflow.io.city_models.tiles3d import FOLDER, PORTABLE, RAW, SEEN_PX, SWITCH_PX, About, Scene, stated, tile_files
from cityflow.io.globe import globe_of
from cityflow.io.globe_frame import TileFrame, frame_at
from glb_reading import Glb
from painted_faces import painted

BOUNDS = (84960.0, 447490.0, 85060.0, 447590.0)
Terrain = tuple[np.ndarray, np.ndarray]
Read = Callable[[str], bytes]


@pytest.fixture
def frame(amersfoort: Reference) -> TileFrame:
    return frame_at(globe_of(amersfoort, BOUNDS), (85010.0, 447540.0, 0.0))


@pytest.fixture
def coarse(neighbours: list[Building], terrain: Terrain, tmp_path: Path) -> Coarse:
    paint = painted(neighbours)
    paint.save(tmp_path)
    return coarse_of(neighbours, *terrain, BOUNDS, paint.textures, None, lambda path: (tmp_path / path).read_bytes())


def _plane(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.asarray(3.0 + 0.02 * (x - 84960) - 0.05 * (y - 447490))


def _slope(n: int, kept: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Terrain:
    """A plane in n × n cells over `BOUNDS`, of which only some are surveyed."""
    x, y = np.meshgrid(np.linspace(BOUNDS[0], BOUNDS[2], n + 1), np.linspace(BOUNDS[1], BOUNDS[3], n + 1))
    at = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    triangles = np.concatenate([np.column_stack([at, at + 1, at + n + 1]), np.column_stack([at + 1, at + n + 2, at + n + 1])])  # fmt: skip
    vertices = np.column_stack([x.ravel(), y.ravel(), _plane(x.ravel(), y.ravel())])
    middles = vertices[triangles].mean(axis=1)
    return vertices, triangles[kept(middles[:, 0], middles[:, 1])]


def _area(vertices: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = (vertices[triangles[:, i], :2] for i in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    assert (area > 0).all()
    return float(area.sum() / 2)


def test_a_whole_plane_is_kept_exactly() -> None:
    vertices, triangles = coarse_ground(*_slope(91, lambda x, _: x > 0), BOUNDS)
    assert len(triangles) == 2 * CELLS**2
    assert _area(vertices, triangles) == pytest.approx(1e4)
    assert np.abs(vertices[:, 2] - _plane(*vertices[:, :2].T)).max() < 1e-6


def test_terrain_ends_where_the_survey_ends() -> None:
    """Two thirds of the tile are surveyed, up to an oblique line: less than 1 % of it is lost, and no node stands beyond."""
    surveyed = _slope(91, lambda x, y: (x - BOUNDS[0]) + 0.4 * (y - BOUNDS[1]) < 85)
    vertices, triangles = coarse_ground(*surveyed, BOUNDS)
    assert _area(vertices, triangles) == pytest.approx(_area(*surveyed), rel=0.01)
    assert np.abs(vertices[:, 2] - _plane(*vertices[:, :2].T)).max() < 1e-6
    inside = shapely.union_all(shapely.polygons(surveyed[0][surveyed[1]][:, :, :2])).buffer(1e-6)
    assert shapely.contains_xy(inside, vertices[:, 0], vertices[:, 1]).all()
    assert np.isnan(heights_at(vertices, triangles, np.array([[85059.0, 447589.0]]))).all()
    none = coarse_ground(surveyed[0], surveyed[1][:0], BOUNDS)
    assert len(none[1]) == 0


def test_blocks_are_as_high_as_roofs_in_the_mean(coarse: Coarse, neighbours: list[Building]) -> None:
    assert coarse.blocks.ids == tuple(b.id for b in neighbours)
    for building, (floor, top), plan in zip(neighbours, coarse.blocks.heights, coarse.blocks.plans, strict=True):
        vertices = building.solids[Lod.LOD22].vertices
        assert floor == building.ground_height
        assert vertices[:, 2].min() < top <= vertices[:, 2].max() + 1e-9
        assert plan.area == pytest.approx(building.footprint.area, rel=0.05)
    assert coarse.error >= 100 / PARTS


def test_blocks_have_the_mean_colours_of_their_photographs(coarse: Coarse, neighbours: list[Building]) -> None:
    paint = painted(neighbours)
    building, number = neighbours[1], 1
    solid = building.solids[Lod.LOD22]
    for k, semantic in enumerate((Semantic.ROOF, Semantic.WALL)):
        keys = [("solid", i) for i, f in enumerate(solid.faces) if f.semantic is semantic and f.neighbour is None]
        colours = np.array([paint.colours[building.id, key] for key in keys])  # type: ignore[index]
        light, found = linear(colours), linear(coarse.blocks.colours[number, k])
        assert (found > light.min(axis=0) - 0.02).all()
        assert (found < light.max(axis=0) + 0.02).all()


def test_where_viewers_go_on_to_the_models_blocks_are_off_by_few_pixels(
    coarse: Coarse, neighbours: list[Building]
) -> None:
    """At the 16 pixels that viewers let a stated error be, 95 % of the roofs' corners are no more than four pixels from their blocks in height."""
    pixel_m = stated(coarse.error) / SWITCH_PX
    off = np.concatenate([
        np.abs(face_z - top)
        for b, (_, top) in zip(neighbours, coarse.blocks.heights, strict=True)
        for face in b.solids[Lod.LOD22].of_semantic(Semantic.ROOF)
        for face_z in [b.solids[Lod.LOD22].vertices[np.array(face.rings[0]), 2]]
    ])  # fmt: skip
    assert off.max() > 0.5, "roofs are pitched"
    assert (off <= SEEN_PX * pixel_m + 1e-6).mean() >= 0.95
    assert pixel_m * SEEN_PX >= 100 / PARTS - 1e-6


def test_without_textures_blocks_have_the_colours_of_their_class(neighbours: list[Building], terrain: Terrain) -> None:
    bare = coarse_of(neighbours, *terrain, BOUNDS, None, None, lambda path: path.encode())
    assert np.unique(bare.blocks.colours[:, 0], axis=0).tolist() == [[178, 66, 51]]
    assert bare.picture is None


def test_a_tile_has_one_file_that_stands_for_all_others(
    coarse: Coarse, neighbours: list[Building], terrain: Terrain, frame: TileFrame
) -> None:
    flat, raw = painted(neighbours).textures, painted(neighbours, rectified=False).textures
    files = tile_files(Scene("t", neighbours, terrain, flat, raw, coarse=coarse), frame, About("Town"))
    data = files[f"{FOLDER}/t/coarse.glb"]
    for name in (PORTABLE, RAW):
        root = json.loads(files[f"{FOLDER}/t/{name}"])["root"]
        assert (root["refine"], root["content"]["uri"], root["geometricError"]) == (
            "REPLACE",
            "coarse.glb",
            stated(coarse.error),
        )
        assert all(child["geometricError"] == 0 for child in root["children"])
        near = [files[posixpath.join(FOLDER, "t", child["content"]["uri"])] for child in root["children"]]
        assert len(near) == 2
        box = np.array(root["boundingVolume"]["box"])
        for glb in map(Glb.of, (data, *near)):
            xyz = np.concatenate([glb.attributes(p)["POSITION"] for p in glb.primitives])
            local = np.column_stack([xyz[:, 0], -xyz[:, 2], xyz[:, 1]])
            assert (np.abs(local - box[:3]) < box[[3, 7, 11]]).all()
    far = Glb.of(data)
    ground, blocks = far.primitives
    assert len(far.triangles(ground)) <= 2 * CELLS**2
    # a gable of four corners, and a block with a court of four
    assert len(far.triangles(blocks)) <= 10 + 2 * 8 + 8
    ids = far.attributes(blocks)["_FEATURE_ID_0"]
    assert np.unique(ids).tolist() == [0, 1]
    assert far.table(0)["id"] == [b.id for b in neighbours]
    a, b, c = (far.attributes(blocks)["POSITION"][far.triangles(blocks)[:, i]] for i in range(3))
    normals = far.attributes(blocks)["NORMAL"][far.triangles(blocks)[:, 0]]
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), normals) > 0).all(), "every face is seen from outside"
