from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import Polygon

from cityflow.core.building import Building, Face, Lod, Polyhedron, Semantic
from cityflow.core.openings import TOO_LITTLE, FaceOpenings, UnitOpenings
from cityflow.core.texture import FIRST_IMAGE, FaceFigures, FaceKey, FacePlane, Patch, UnitTexture
from cityflow.handover.texture_files import Rings, decode_unit, encode_unit, faces_of
from cityflow.handover.window_files import decode_openings, encode_openings, wall_lines
from cityflow.stages.export.tile_openings import openings_on, with_window_figures
from cityflow.stages.windows import figures, planes_of
from cityflow.texture.placement.place import PlacementParameters
from cityflow.texture.planes import face_planes
from cityflow.windows.find_windows import find_unit_windows
from cityflow.windows.window_parameters import WindowParameters
from scenes.drawn_facades import DrawnFacade, draw_facade
from scenes.facade_errors import ImageErrors

CELL_M = 0.06


@pytest.fixture(scope="module")
def drawn() -> DrawnFacade:
    return draw_facade("plain", ImageErrors(gsd_m=CELL_M, noise=2.0), np.random.default_rng(4))


@pytest.fixture(scope="module")
def house(drawn: DrawnFacade) -> Building:
    """A block whose first wall is as large as the drawn façade."""
    (wide, high), x, y = drawn.size_m, 85000.0, 447000.0
    xy = np.array([[x, y], [x + wide, y], [x + wide, y + 8], [x, y + 8]])
    vertices = np.round(np.concatenate([np.column_stack([xy, np.full(4, z)]) for z in (1.0, 1.0 + high)]), 4)
    walls = [Face(((k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k),), Semantic.WALL) for k in range(4)]
    faces = (Face(((3, 2, 1, 0),), Semantic.GROUND), *walls, Face(((4, 5, 6, 7),), Semantic.ROOF))
    return Building("house", Polygon(xy), 1.0, {Lod.LOD22: Polyhedron(vertices, faces)})


def patch_of(face: FacePlane, drawn: DrawnFacade) -> Patch:
    at = (face.on_plane(face.rings[0]) - (face.polygon.bounds[0], face.polygon.bounds[3])) / (CELL_M, -CELL_M)
    index = np.full(drawn.seen.shape, FIRST_IMAGE, np.uint16)
    corners = (np.column_stack([at, np.ones(len(at))]),)
    return Patch(
        face.key, drawn.pixels, index, np.ones(index.shape, bool), corners, FaceFigures(CELL_M, 40, 1, 1, 0, 0)
    )


@pytest.fixture(scope="module")
def texture_file(house: Building, drawn: DrawnFacade) -> bytes:
    """What a texture task leaves of the house: one wall with its texture."""
    faces = face_planes(house.solids[Lod.LOD22], None)
    patch = patch_of(faces[0], drawn)
    rings: dict[FaceKey, Rings] = {
        f.key: tuple(tuple((x, y, z) for x, y, z in r.tolist()) for r in f.rings) for f in faces
    }
    return encode_unit(UnitTexture(("an image",), (patch,), (patch,)), rings, PlacementParameters())


@pytest.fixture(scope="module")
def found(texture_file: bytes) -> tuple[UnitOpenings, dict[FaceKey, Rings]]:
    texture, rings = decode_unit(texture_file)
    return find_unit_windows(planes_of(rings), {p.key: p for p in texture.rectified}, WindowParameters()), rings


def test_windows_of_a_texture_file_are_where_they_were_drawn(
    found: tuple[UnitOpenings, dict[FaceKey, Rings]], house: Building, drawn: DrawnFacade
) -> None:
    """In the world: along the wall from its left end, and above its foot."""
    corner = house.solids[Lod.LOD22].vertices[0]
    left = np.sort([(o.ring[0] - corner)[0] for o in found[0].openings if o.kind == "window"])
    sills = np.sort([(o.ring[0] - corner)[2] for o in found[0].openings if o.kind == "window"])
    true = drawn.openings[drawn.openings[:, 4] == 0]
    assert len(true) >= 4
    assert left == pytest.approx(np.sort(true[:, 0]), abs=0.15)
    assert sills == pytest.approx(np.sort(true[:, 2]), abs=0.2)
    assert all(abs((o.ring - corner)[:, 1]).max() < 1e-3 for o in found[0].openings)


def test_a_file_read_again_says_the_same(found: tuple[UnitOpenings, dict[FaceKey, Rings]]) -> None:
    data = encode_openings(*found)
    again, rings = decode_openings(data)
    assert encode_openings(again, rings) == data
    assert figures(again) == figures(found[0])
    assert [o.ring.tolist() for o in again.openings] == [o.ring.tolist() for o in found[0].openings]


def test_a_person_reads_it_wall_by_wall(found: tuple[UnitOpenings, dict[FaceKey, Rings]], house: Building) -> None:
    """The wall of the house looks south; another, added here, could not be looked at."""
    openings, rings = found[0], {key: rings for rings, key in faces_of(house).items()}
    east = FaceOpenings(("solid", 2), (), 0, 40.0, 10.0, None, "too coarse")
    first, second = wall_lines(encode_openings(replace(openings, faces=(*openings.faces, east)), rings))
    (face,) = openings.faces
    windows = sum(o.kind == "window" for o in face.openings)
    assert first.startswith(f"solid face 1 (faces 180°, {face.area_m2:.1f} m²")
    assert f": {windows} windows (confidence " in first
    assert first.endswith(f"ratio {face.window_to_wall:.3f}")
    assert second == "solid face 2 (faces 90°, 40.0 m², 25 % seen): too coarse"


def test_walls_are_known_by_their_vertices(found: tuple[UnitOpenings, dict[FaceKey, Rings]], house: Building) -> None:
    data, solid = encode_openings(*found), house.solids[Lod.LOD22]
    other = replace(house, solids={Lod.LOD22: replace(solid, faces=solid.faces[::-1])})
    moved = openings_on(data, other)
    assert {f.key for f in moved.faces} == {("solid", 4)}
    assert {o.face for o in moved.openings} == {("solid", 4)}
    gone = replace(house, solids={Lod.LOD22: replace(solid, vertices=solid.vertices + 0.01)})
    assert openings_on(data, gone).openings == ()


def test_the_building_says_its_figures(found: tuple[UnitOpenings, dict[FaceKey, Rings]], house: Building) -> None:
    said = with_window_figures(house, found[0]).attributes
    windows = [o for o in found[0].openings if o.kind == "window"]
    assert said.get("storeys_by_windows") == found[0].storeys
    assert said.get("window_to_wall_ratio") == (
        None if found[0].window_to_wall_ratio is None else round(found[0].window_to_wall_ratio, 3)
    )
    assert said["windows"] == len(windows) >= 4
    assert said["windows_confidence"] == round(float(np.mean([o.confidence for o in windows])), 3)
    given = house.with_attributes({"storeys": 7})
    assert with_window_figures(given, found[0]).attributes["storeys"] == 7, "the source's own figure stays"


def wall(number: int, area_m2: float, reason: str) -> FaceOpenings:
    return FaceOpenings(("solid", number), (), 0, area_m2, area_m2, None if reason else 0.0, reason)


def test_a_building_at_which_nobody_looked_counts_no_windows(house: Building) -> None:
    assert with_window_figures(house, None) is house
    assert with_window_figures(house, UnitOpenings((), None, None)) is house
    unseen = UnitOpenings((wall(1, 30, "unseen"), wall(2, 50, "too coarse"), wall(3, 30, "unseen")), None, None)
    none = {"windows_missing": "unseen", "windows_seen_share": 0.0}
    assert with_window_figures(house, unseen).attributes == {**house.attributes, **none}
    little = UnitOpenings((wall(1, 30, "unseen"), wall(2, 5, "")), None, None, 0.04)
    none = {"windows_missing": TOO_LITTLE, "windows_seen_share": 0.04}
    assert with_window_figures(house, little).attributes == {**house.attributes, **none}
    looked = UnitOpenings((wall(1, 30, "unseen"), wall(2, 50, "")), None, 0.0, 0.5)
    assert with_window_figures(house, looked).attributes["windows"] == 0, (
        "half of the walls were looked at and have none"
    )


def test_windows_of_a_wall_of_which_little_is_seen_count_but_have_no_share(
    found: tuple[UnitOpenings, dict[FaceKey, Rings]], house: Building
) -> None:
    said = with_window_figures(house, replace(found[0], window_to_wall_ratio=None, seen_share=0.1)).attributes
    assert said["windows"] == sum(o.kind == "window" for o in found[0].openings)
    assert said["window_to_wall_missing"] == TOO_LITTLE
    assert not {"window_to_wall_ratio", "windows_missing"} & set(said)


def test_figures_are_those_of_the_walls_that_are_left(
    found: tuple[UnitOpenings, dict[FaceKey, Rings]], house: Building
) -> None:
    """A wall that became a party wall takes its windows, its share and its rows with it."""
    solid = house.solids[Lod.LOD22]
    party = tuple(replace(f, neighbour="b") if k == 1 else f for k, f in enumerate(solid.faces))
    data = encode_openings(*found)
    whole = openings_on(data, house)
    assert (whole.storeys, whole.window_to_wall_ratio) == (found[0].storeys, found[0].window_to_wall_ratio)
    left = openings_on(data, replace(house, solids={Lod.LOD22: replace(solid, faces=party)}))
    assert (left.faces, left.storeys, left.window_to_wall_ratio) == ((), None, None)
    assert "windows" not in with_window_figures(house, left).attributes
