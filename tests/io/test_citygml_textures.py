from __future__ import annotations

import io
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from citysmith import facts as citysmith_facts
from lxml import etree
from PIL import Image

from cityflow.core.building import Building
from cityflow.core.reference import Reference
from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.citygml import write_citygml
from citygml_schema import citygml_schema
from textured_houses import Painted, codes, paint, painted_drape, places, sample

NS = {
    "a": "http://www.opengis.net/citygml/appearance/2.0",
    "c": "http://www.opengis.net/citygml/2.0",
    "b": "http://www.opengis.net/citygml/building/2.0",
    "d": "http://www.opengis.net/citygml/relief/2.0",
    "g": "http://www.opengis.net/citygml/generics/2.0",
    "gml": "http://www.opengis.net/gml",
}
GML_ID = f"{{{NS['gml']}}}id"
FOLDER = "products/citygml"
READER = Path(__file__).with_name("citygml_looks.cpp")
Terrain = tuple[np.ndarray, np.ndarray]


@pytest.fixture
def painted(neighbours: list[Building]) -> Painted:
    return paint(neighbours, rectified=True)


@pytest.fixture
def path(tmp_path: Path, neighbours: list[Building], painted: Painted, terrain: Terrain, amersfoort: Reference) -> Path:
    painted.write(tmp_path)
    appearance = Appearance(FOLDER, painted.textures, painted_drape(terrain[0], tmp_path))
    file = tmp_path / FOLDER / "tile.gml"
    file.parent.mkdir(parents=True)
    with open(file, "wb") as target:
        write_citygml(target, neighbours, amersfoort, None, [("tile", *terrain)], appearance=appearance)
    return file


@pytest.fixture
def root(path: Path) -> etree._Element:
    return etree.parse(str(path)).getroot()


def test_it_follows_the_official_schemas(root: etree._Element) -> None:
    citygml_schema().assertValid(root)


def test_the_schema_of_appearances_does_refuse(path: Path) -> None:
    broken = path.read_bytes().replace(b"<app:wrapMode>clamp<", b"<app:wrapMode>tile<", 1)
    assert not citygml_schema().validate(etree.fromstring(broken))


def test_every_ring_has_its_pixels(root: etree._Element, path: Path, painted: Painted) -> None:
    rings = {e.get(GML_ID): _numbers(e[0], 3) for e in root.iterfind(".//b:boundedBy//gml:LinearRing[@gml:id]", NS)}
    polygons = {e.get(GML_ID): e for e in root.iterfind(".//b:boundedBy//gml:Polygon", NS)}
    seen: dict[int, int] = {}
    for texture in root.iterfind(".//b:Building/a:appearance//a:ParameterizedTexture", NS):
        image = _image(path, texture)
        for target in texture.iterfind("a:target", NS):
            polygon = polygons[str(target.get("uri"))[1:]]
            lists = target.findall(".//a:textureCoordinates", NS)
            assert len(lists) == len(polygon.findall(".//gml:LinearRing", NS))
            for coordinates in lists:
                uv, ring = _numbers(coordinates, 2), rings.pop(str(coordinates.get("ring"))[1:])
                assert uv.shape[0] == ring.shape[0]
                assert np.array_equal(uv[0], uv[-1])
                colours = sample(image, uv)
                (code,) = set(codes(colours))
                assert places(colours) == pytest.approx(painted.faces[code].shares(ring), abs=0.01)
                seen[code] = seen.get(code, 0) + 1
    assert not rings
    assert set(seen) == set(painted.faces)
    # the roof around the court has two rings, everything else one
    assert sorted(seen.values()) == [1] * 13 + [2]


@pytest.mark.skipif(
    shutil.which("g++") is None or not Path("/usr/include/citygml/citygml.h").exists(), reason="needs libcitygml-dev"
)
def test_libcitygml_shows_every_face_its_own_pixels(
    path: Path, painted: Painted, terrain: Terrain, tmp_path: Path
) -> None:
    areas, on_terrain = dict.fromkeys(painted.faces, 0.0), 0
    x_0, y_0, x_1, y_1 = painted_drape(terrain[0], tmp_path).bounds
    for image, triangle in _as_libcitygml_draws(path, tmp_path):
        weights = np.random.default_rng(5).dirichlet(np.ones(3), 10)
        xyz, colours = weights @ triangle[:, :3], sample(image, weights @ triangle[:, 3:])
        if colours[0, 0] == 250:
            on_terrain += 1
            truth = (xyz[:, :2] - (x_0, y_0)) / (x_1 - x_0, y_1 - y_0)
        else:
            (code,) = set(codes(colours))
            truth = painted.faces[code].shares(xyz)
            areas[code] += float(np.linalg.norm(np.cross(*(triangle[1:, :3] - triangle[0, :3])))) / 2
        assert places(colours) == pytest.approx(truth, abs=0.01)
    assert areas == pytest.approx({code: face.area for code, face in painted.faces.items()}, abs=1e-2)
    assert on_terrain == len(terrain[1])


def _as_libcitygml_draws(path: Path, folder: Path) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Image, and (3, 5) corners with u, v, of every textured triangle."""
    program = folder / "looks"
    subprocess.run(["g++", "-std=c++17", str(READER), "-o", str(program), "-lcitygml"], check=True, timeout=120)
    told = subprocess.run([str(program), str(path)], capture_output=True, text=True, timeout=60, check=True).stdout
    # polygons are in a boundary surface and, by reference, in the solid: equal lines are one polygon
    for url, numbers in dict.fromkeys(tuple(line.split("\t")[2::2]) for line in told.splitlines()):
        image = np.asarray(Image.open(path.parent / url)) if url else np.empty(0)
        for triangle in np.array(numbers.split(), float).reshape(-1, 3, 5) if url else ():
            # it closes triangles with a second one, without area, at their first corner
            if not np.array_equal(triangle[0], triangle[2]):
                yield image, triangle


def test_citysmith_finds_the_images_from_the_file(path: Path) -> None:
    known = citysmith_facts.file_facts(str(path)).appearance
    assert known["themes"] == {"photographs": 3}
    assert (known["parameterized_textures"], known["image_files"], known["image_files_missing"]) == (4, 3, 0)
    next(path.parent.parent.glob("textures/rectified/1.png")).unlink()
    assert citysmith_facts.file_facts(str(path)).appearance["image_files_missing"] == 1


def test_faces_without_texture_have_their_colour_and_a_reason(root: etree._Element, neighbours: list[Building]) -> None:
    gable = root.findall(".//b:Building", NS)[0]
    materials = {e.findtext("a:diffuseColor", namespaces=NS): e for e in gable.iterfind(".//a:X3DMaterial", NS)}
    targets = {colour: [t.text for t in e.iterfind("a:target", NS)] for colour, e in materials.items()}
    stem = "#p-0503_x20__x3C_west_x3E_-2"
    assert targets == {"0.8 0.4 0.2": [f"{stem}-1"], "0.3529 0.3529 0.3529": [f"{stem}-0", f"{stem}-2"]}
    said = [dict(_generic(e)) for e in gable.iterfind("b:boundedBy/*", NS)]
    assert said[0] == {}
    assert said[1] == {"texture_missing": "no image sees it"}
    assert said[2] == {"is_party_wall": "true", "neighbour": neighbours[1].id}


def test_every_textured_face_is_a_surface_that_says_how_it_is_founded(root: etree._Element) -> None:
    block = root.findall(".//b:Building", NS)[1]
    for surface in block.iterfind("b:boundedBy/*", NS):
        said = dict(_generic(surface))
        if "texture_gsd_m" in said:
            assert len(surface.findall(".//gml:Polygon", NS)) == 1
            assert (said["texture_images"], said["texture_candidates"]) == ("3", "40")
            assert (said["texture_occluded"], said["texture_interpolated"]) == ("0.25", "0.125")
    kinds = {name: e.tag.rsplit("}")[1] for e in block.iterfind(".//g:*[@name]", NS) if (name := e.get("name"))}
    assert (kinds["texture_gsd_m"], kinds["texture_images"]) == ("doubleAttribute", "intAttribute")


def test_raw_textures_are_refused(neighbours: list[Building], local: Reference) -> None:
    raw = Appearance(FOLDER, paint(neighbours, rectified=False).textures)
    with pytest.raises(ValueError, match="rectified"):
        write_citygml(io.BytesIO(), neighbours, local, appearance=raw)


def test_textured_files_stream_and_repeat_themselves(neighbours: list[Building], local: Reference) -> None:
    target, again = io.BytesIO(), io.BytesIO()
    look = Appearance(FOLDER, paint(neighbours, rectified=True).textures)

    def one_after_the_other() -> Iterator[Building]:
        yield neighbours[0]
        assert b"look-0503_x20__x3C_west_x3E_-t0" in target.getvalue()
        yield neighbours[1]

    write_citygml(target, one_after_the_other(), local, appearance=look)
    write_citygml(again, neighbours, local, appearance=look)
    assert target.getvalue() == again.getvalue()


def _generic(element: etree._Element) -> Iterator[tuple[str, str]]:
    for attribute in element.iterfind("g:*[@name]", NS):
        yield str(attribute.get("name")), str(attribute[0].text)


def _numbers(element: etree._Element, columns: int) -> np.ndarray:
    return np.array((element.text or "").split(), float).reshape(-1, columns)


def _image(path: Path, texture: etree._Element) -> np.ndarray:
    assert texture.findtext("a:mimeType", namespaces=NS) == "image/png"
    return np.asarray(Image.open(path.parent / str(texture.findtext("a:imageURI", namespaces=NS))))
