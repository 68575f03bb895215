"""Textures of walls with openings: what a reader samples at a window is the window that was painted there."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jsonschema_rs
import numpy as np
import pytest
from lxml import etree

from cityflow.core.building import Building, Lod, Polyhedron
from cityflow.core.openings import FaceOpenings, Opening, UnitOpenings
from cityflow.core.reference import Reference
from cityflow.core.texture import FaceFigures, FaceTexture, PlainFace, TexturePage
from cityflow.io.city_models.appearance import BARE, Appearance
from cityflow.io.city_models.citygml import write_citygml
from cityflow.io.city_models.cityjson import Transform, feature_line, read_feature
from cityflow.io.city_models.cityjson_sequence import document, header_line
from cityflow.io.city_models.opening_looks import OpenedLook, opened_look, texture_map
from citygml_schema import citygml_schema
from textured_houses import RED_STEP, Painted, codes, paint, places, sample

NS = {
    "a": "http://www.opengis.net/citygml/appearance/2.0", "b": "http://www.opengis.net/citygml/building/2.0",
    "gml": "http://www.opengis.net/gml",
}  # fmt: skip
GML_ID, HREF = f"{{{NS['gml']}}}id", "{http://www.w3.org/1999/xlink}href"
SCHEMAS = Path(__file__).parents[1] / "data" / "schemas" / "cityjson-2.0.2"
READER = Path(__file__).with_name("citygml_looks.cpp")
SURVEY = Transform(84000, 447000, 0)
FOLDER = "products/files"
LOW, SIZE = np.array([(0.2, 0.3), (0.6, 0.45)]), np.array([0.2, 0.25])
"""Lower left corners and size of windows, shares of their walls."""
WALLS = ((1, 3, 4), (1, 5))
"""With windows: of the gable one without a texture, an eave's and the one below the gable; of the block an outer one and one towards the court."""
PAGE = TexturePage("a.png", 2000, 1000, "image/png")
FIGURES = FaceFigures(0.1, 0.0, 1, 1, 0.0, 0.0)


@dataclass(frozen=True)
class Shown:
    """A polygon of a file: rings with their texture coordinates (None where they have none), image or colour."""

    kind: str
    rings: Sequence[np.ndarray]
    uv: Sequence[np.ndarray | None]
    image: str = ""
    colour: tuple[float, ...] = ()


Polygons = Mapping[str, Mapping[str, Sequence[Shown]]]
"""Building → level of detail → its polygons."""


def windows_in(shell: Polyhedron, number: int) -> FaceOpenings:
    ring = shell.ring(shell.faces[number].rings[0])
    size = np.linalg.norm(ring[1] - ring[0]), np.ptp(ring[:, 2])
    axes = (ring[1] - ring[0]) / size[0], np.array([0, 0, 1.0])
    made: list[Opening] = []
    for low in LOW:
        (s_0, t_0), (s_1, t_1) = (low * size).tolist(), ((low + SIZE) * size).tolist()
        corners = np.array([(s_0, t_0), (s_1, t_0), (s_1, t_1), (s_0, t_1)]) @ np.array(axes) + ring[0]
        kind = "door" if made else "window"
        made.append(Opening(("solid", number), corners.round(4), (s_0, t_0, s_1, t_1), kind, 0.9))  # type: ignore[arg-type]
    return FaceOpenings(("solid", number), tuple(made), 1, 50.0, 50.0, 0.1)


@pytest.fixture
def found(neighbours: list[Building]) -> dict[str, UnitOpenings]:
    return {
        b.id: UnitOpenings(tuple(windows_in(b.solids[Lod.LOD22], n) for n in walls), 1, 0.1)
        for b, walls in zip(neighbours, WALLS, strict=True)
    }


@pytest.fixture
def painted(neighbours: list[Building], found: dict[str, UnitOpenings]) -> Painted:
    """Every wall with black boxes where its windows are, by what its own pixels say of their place."""
    painted = paint(neighbours, rectified=True)
    for face in painted.faces.values():
        page = painted.pixels[painted.textures.pages[face.page].path]
        for opening in (o for o in found[face.building].openings if o.face == face.key):
            corners = face.shares(opening.ring)
            at = places(page.reshape(-1, 3).astype(float)).reshape(*page.shape[:2], 2)
            inside = ((at > corners.min(axis=0)) & (at < corners.max(axis=0))).all(axis=-1)
            page[inside & (page[..., 0] == face.code * RED_STEP)] = 0
    return painted


@pytest.fixture(params=["lines", "document", "citygml"])
def polygons(
    request: pytest.FixtureRequest, neighbours: list[Building], found: dict[str, UnitOpenings], painted: Painted,
    amersfoort: Reference,
) -> Polygons:  # fmt: skip
    look = Appearance(FOLDER, painted.textures)
    if request.param == "citygml":
        return of_citygml(citygml(neighbours, amersfoort, look, found))
    lines = [header_line(amersfoort, None, SURVEY), *(feature_line(b, SURVEY, look, found) for b in neighbours)]
    if request.param == "document":
        return of_cityjson([json.loads(document(lines))])
    return of_cityjson([{**json.loads(line), "transform": SURVEY.json} for line in lines[1:]])


def citygml(
    buildings: list[Building], reference: Reference, look: Appearance, found: Mapping[str, UnitOpenings]
) -> etree._Element:
    target = io.BytesIO()
    write_citygml(target, buildings, reference, None, appearance=look, openings=found)
    return etree.fromstring(target.getvalue())


def of_cityjson(files: Sequence[Any]) -> dict[str, dict[str, list[Shown]]]:
    made: dict[str, dict[str, list[Shown]]] = {}
    for file in files:
        scale, shift = (np.array(file["transform"][k]) for k in ("scale", "translate"))
        vertices, look = np.array(file["vertices"]) * scale + shift, file["appearance"]
        for name, thing in file["CityObjects"].items():
            for geometry in thing["geometry"]:
                if "semantics" in geometry:
                    made.setdefault(name, {}).setdefault(geometry["lod"], []).extend(_shown(geometry, vertices, look))
    return made


def _shown(geometry: Any, vertices: np.ndarray, look: Any) -> Iterator[Shown]:
    solid, faces, values = geometry["type"] == "Solid", geometry["boundaries"], geometry["semantics"]["values"]
    textures, colours = (
        geometry.get(kind, {}).get("photographs", {"values": None})["values"] for kind in ("texture", "material")
    )
    if solid:
        faces, values, textures, colours = (part and part[0] for part in (faces, values, textures, colours))
    uv = np.array(look["vertices-texture"])
    for n, (rings, value) in enumerate(zip(faces, values, strict=True)):
        said = textures[n] if textures else [[None]] * len(rings)
        assert len(said) == len(rings)
        (texture,) = {row[0] for row in said}
        colour = None if not colours else colours[n]
        yield Shown(
            geometry["semantics"]["surfaces"][value]["type"], [vertices[r] for r in rings],
            [None if row[0] is None else uv[np.array(row[1:])] for row in said],
            "" if texture is None else look["textures"][texture]["image"],
            () if colour is None else tuple(look["materials"][colour]["diffuseColor"]),
        )  # fmt: skip


def of_citygml(root: etree._Element) -> dict[str, dict[str, list[Shown]]]:
    known = {str(p.get(GML_ID)): p for p in root.iter(f"{{{NS['gml']}}}Polygon")}
    made: dict[str, dict[str, list[Shown]]] = {}
    for house in root.iter(f"{{{NS['b']}}}Building"):
        images, uv, colours = _of_appearance(house)
        levels = made.setdefault(str(house.findtext("gml:name", namespaces=NS)), {})
        for level, path in (("2.2", "b:lod2MultiSurface"), ("3", "b:lod3MultiSurface")):
            for surface in house.iterfind(f"b:boundedBy//{path}", NS):
                for member in surface.iter(f"{{{NS['gml']}}}surfaceMember"):
                    polygon = known[str(member.get(HREF))[1:]] if member.get(HREF) else member[0]
                    rings = list(polygon.iter(f"{{{NS['gml']}}}LinearRing"))
                    name, parent = str(polygon.get(GML_ID)), surface.getparent()
                    assert parent is not None
                    levels.setdefault(level, []).append(Shown(
                        etree.QName(parent).localname, [_numbers(r[0], 3) for r in rings],
                        [uv.get((name, str(r.get(GML_ID)))) for r in rings],
                        images.get(name, ""), colours.get(name, ()),
                    ))  # fmt: skip
    return made


def _of_appearance(house: etree._Element) -> tuple[dict[str, str], dict[tuple[str, str], np.ndarray], dict[str, Any]]:
    images: dict[str, str] = {}
    uv: dict[tuple[str, str], np.ndarray] = {}
    colours: dict[str, Any] = {}
    for texture in house.iterfind("a:appearance//a:ParameterizedTexture", NS):
        for target in texture.iterfind("a:target", NS):
            name = str(target.get("uri"))[1:]
            images[name] = str(texture.findtext("a:imageURI", namespaces=NS))
            for ring in target.iterfind(".//a:textureCoordinates", NS):
                uv[name, str(ring.get("ring"))[1:]] = _numbers(ring, 2)
    for material in house.iterfind("a:appearance//a:X3DMaterial", NS):
        said = tuple(map(float, str(material.findtext("a:diffuseColor", namespaces=NS)).split()))
        colours |= {str(t.text)[1:]: said for t in material.iterfind("a:target", NS)}
    return images, uv, colours


def _numbers(element: etree._Element, width: int) -> np.ndarray:
    """Corners of a ring, without the first one again at its end."""
    rows = np.array(str(element.text).split(), float).reshape(-1, width)
    assert np.array_equal(rows[0], rows[-1])
    return rows[:-1]


def test_every_ring_of_a_textured_polygon_has_a_place_for_every_corner(polygons: Polygons) -> None:
    for levels in polygons.values():
        for p in levels["3"]:
            assert len({uv is None for uv in p.uv}) == 1
            assert all(len(uv) == len(ring) for uv, ring in zip(p.uv, p.rings, strict=True) if uv is not None)
            assert (p.uv[0] is None) == (p.image == "")
            assert not (p.image and p.colour)
    assert sum(len(p.rings) == 3 and p.image != "" for levels in polygons.values() for p in levels["3"]) == 4


def test_faces_look_at_lod3_as_they_do_at_lod2(polygons: Polygons) -> None:
    for levels in polygons.values():
        walls = [p for p in levels["3"] if p.kind not in ("Window", "Door")]
        fine, coarse = ({_corners(p): p for p in found} for found in (walls, levels["2.2"]))
        assert fine.keys() == coarse.keys()
        assert len(fine) == len(walls) == len(levels["2.2"])
        for where, p in coarse.items():
            assert (fine[where].image, fine[where].colour) == (p.image, p.colour)
            for ours, theirs in zip(fine[where].uv, p.uv, strict=False):
                assert ours is theirs is None or np.array_equal(np.asarray(ours), np.asarray(theirs))
    assert any(p.colour == (0.8, 0.4, 0.2) and len(p.rings) == 3 for p in polygons["0503 <west>"]["3"])


def _corners(p: Shown) -> tuple[float, ...]:
    return tuple(p.rings[0].round(4).ravel().tolist())


def about_middle(ring: np.ndarray, factor: float) -> np.ndarray:
    """A ring made smaller or larger."""
    middle = ring.mean(axis=0)
    return np.asarray(middle + factor * (ring - middle))


def test_windows_show_what_was_painted_where_they_are(polygons: Polygons, painted: Painted) -> None:
    images = {f"../textures/rectified/{n}.png": pixels for n, pixels in enumerate(painted.pixels.values())}
    by_code = {(f.building, f.key): f.code for f in painted.faces.values()}
    seen = []
    for name, levels in polygons.items():
        for p in levels["3"]:
            first = {"Window": 0, "Door": 0, "WallSurface": 1}.get(p.kind, len(p.rings))
            for ring, uv in zip(p.rings[first:], p.uv[first:], strict=True):
                if uv is not None:
                    assert sample(images[p.image], about_middle(uv, 0.7)).max() < 1, p.kind
                    outside = sample(images[p.image], about_middle(uv, 1.4))
                    (code,) = set(codes(outside))
                    assert places(outside) == pytest.approx(
                        painted.faces[code].shares(about_middle(ring, 1.4)), abs=0.01
                    )
                    seen.append((name, code, p.kind))
    expected = []
    for name, numbers in zip(polygons, WALLS, strict=True):
        for n in numbers:
            code = by_code.get((name, ("solid", n)))
            expected += [(name, code, kind) for kind in ("Window", "Door", *["WallSurface"] * 2) if code]
    assert sorted(seen) == sorted(expected)


def test_windows_of_a_wall_without_texture_have_none(polygons: Polygons) -> None:
    bare = [p for levels in polygons.values() for p in levels["3"] if p.kind in ("Window", "Door") and not p.image]
    assert [p.kind for p in bare] == ["Window", "Door"]
    assert all(p.uv == [None] and p.colour == () for p in bare)


def test_files_follow_their_schemas(
    neighbours: list[Building], found: dict[str, UnitOpenings], painted: Painted, amersfoort: Reference
) -> None:
    look = Appearance(FOLDER, painted.textures)
    root = citygml(neighbours, amersfoort, look, found)
    citygml_schema().assertValid(root)
    ids = [str(e.get(GML_ID)) for e in root.iter() if e.get(GML_ID)]
    named = {str(t.get("uri") or t.text)[1:] for t in root.iter(f"{{{NS['a']}}}target")}
    rings = {str(t.get("ring"))[1:] for t in root.iter(f"{{{NS['a']}}}textureCoordinates")}
    assert len(set(ids)) == len(ids)
    assert named | rings <= set(ids)
    schemas = [json.loads(path.read_text()) for path in sorted(SCHEMAS.glob("*.schema.json"))]
    registry = jsonschema_rs.Registry([(schema["$id"], schema) for schema in schemas])
    lines = [header_line(amersfoort, None, SURVEY), *(feature_line(b, SURVEY, look, found) for b in neighbours)]
    for kind, values in {"cityjsonfeature": lines[1:], "cityjson": [document(lines)]}.items():
        schema = next(s for s in schemas if s["$id"].endswith(f"/{kind}.schema.json"))
        for value in values:
            jsonschema_rs.validator_for(schema, registry=registry).validate(json.loads(value))


@pytest.mark.skipif(
    shutil.which("g++") is None or not Path("/usr/include/citygml/citygml.h").exists(), reason="needs libcitygml-dev"
)
def test_libcitygml_finds_the_right_pixel_all_over_walls_and_windows(
    neighbours: list[Building], found: dict[str, UnitOpenings], amersfoort: Reference, tmp_path: Path
) -> None:
    """As viewers that stand on it draw them, triangle by triangle; the windows are not painted here."""
    painted = paint(neighbours, rectified=True)
    root = citygml(neighbours, amersfoort, Appearance(FOLDER, painted.textures), found)
    (tmp_path / "a.gml").write_bytes(etree.tostring(root))
    program = [str(tmp_path / "looks")]
    subprocess.run(["g++", "-std=c++17", str(READER), "-o", *program, "-lcitygml"], check=True, timeout=120)
    told = subprocess.run([*program, str(tmp_path / "a.gml")], capture_output=True, text=True, timeout=60, check=True)
    rows = (line.split("\t") for line in told.stdout.splitlines())
    opened = {row[1]: row for row in rows if row[1].startswith(("w-", "o-")) and row[2]}
    # four walls with a texture, two openings each; the fifth has none
    assert sorted(name[0] for name in opened) == ["o"] * 8 + ["w"] * 4
    for _, _, image, _, numbers in opened.values():
        pixels = painted.pixels[f"products/{image.removeprefix('../')}"]
        for triangle in np.array(numbers.split(), float).reshape(-1, 3, 5):
            at = np.random.default_rng(5).dirichlet(np.ones(3), 10) @ triangle
            colours = sample(pixels, at[:, 3:])
            (code,) = set(codes(colours))
            assert places(colours) == pytest.approx(painted.faces[code].shares(at[:, :3]), abs=0.01)


def test_texture_vertices_grow_by_the_corners_of_windows_alone(
    neighbours: list[Building], found: dict[str, UnitOpenings], painted: Painted
) -> None:
    look = Appearance(FOLDER, painted.textures)
    for building, walls in zip(neighbours, (2, 2), strict=True):
        plain, opened = (json.loads(feature_line(building, SURVEY, look, o)) for o in ({}, found))
        count = [len(f["appearance"]["vertices-texture"]) for f in (plain, opened)]
        assert count[1] - count[0] == walls * len(LOW) * 4


def test_without_textures_nothing_is_said_of_looks(
    neighbours: list[Building], found: dict[str, UnitOpenings], amersfoort: Reference, painted: Painted
) -> None:
    assert next(citygml(neighbours, amersfoort, BARE, found).iter(f"{{{NS['a']}}}*"), None) is None
    for building in neighbours:
        bare = feature_line(building, SURVEY, openings=found)
        assert b"appearance" not in bare
        assert b"texture" not in bare
        worn = feature_line(building, SURVEY, Appearance(FOLDER, painted.textures), found)
        assert feature_line(read_feature(worn, SURVEY), SURVEY) == feature_line(building, SURVEY)


def wall(wide: float, high: float, turn: float) -> tuple[np.ndarray, FaceTexture]:
    """A wall far from the origin, rounded to 0.1 mm, its texture five centimetres a pixel by its unrounded corners."""
    st = np.array([(0, 0), (wide, 0), (wide, high), (0.4 * wide, high + 2), (0, high)])
    along = np.array([(np.cos(turn), np.sin(turn), 0), (0, 0, 1)])
    xyz = st @ along + np.array([684967.5731, 5447497.4452, 12.3])
    uv = (st / 0.05 + 7) / (PAGE.width, PAGE.height)
    return xyz.round(4), FaceTexture(0, (np.column_stack([uv, np.ones(len(uv))]),), FIGURES)


@pytest.mark.parametrize("turn", [0.0, 0.7, 2.9])
@pytest.mark.parametrize("size", [(14.0, 6.0), (0.6, 2.5), (40.0, 9.0)])
def test_the_map_is_within_a_hundredth_of_a_pixel(size: tuple[float, float], turn: float) -> None:
    ring, texture = wall(*size, turn)
    found = texture_map([ring], texture, PAGE)
    assert found is not None
    assert found.residual_px < 0.01
    off = (found(ring)[:, :2] - texture.rings[0][:, :2]) * (PAGE.width, PAGE.height)
    assert np.hypot(*off.T).max() == pytest.approx(found.residual_px)
    middle = found((ring[:1] + ring[2:3]) / 2)[0, :2]
    assert middle * (PAGE.width, PAGE.height) == pytest.approx(np.array(size) / 2 / 0.05 + 7, abs=0.01)


def test_no_texture_rather_than_a_wrong_one() -> None:
    ring, texture = wall(14.0, 6.0, 0.7)
    assert opened_look(texture, [ring], (), [PAGE]).wall is not None
    bent = texture.rings[0].copy()
    bent[3, 0] += 3 / PAGE.width
    assert opened_look(replace(texture, rings=(bent,)), [ring], (), [PAGE]) == OpenedLook()
    line = ring[:1] + np.outer(np.linspace(0, 1, 5), ring[2] - ring[0])
    assert texture_map([line], texture, PAGE) is None
    assert opened_look(texture, [line], (), [PAGE]) == OpenedLook()
    assert opened_look(PlainFace((1, 2, 3), "unseen"), [line], (), [PAGE]) == OpenedLook(PlainFace((1, 2, 3), "unseen"))
    assert opened_look(None, [line], (), [PAGE]) == OpenedLook()
