from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import trimesh
from trimesh.resolvers import FilePathResolver

from cityflow.core.building import Building
from cityflow.core.reference import Reference
from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.cityjson import Transform
from cityflow.io.city_models.obj import write_obj
from textured_houses import Painted, codes, paint, painted_drape, places, sample

ORIGIN = Transform(84000, 447000, 0)
FOLDER = "products/obj"
Terrain = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Drawn:
    """A triangle as a renderer gets it: corners (3, 3) in the world, texture coordinates (3, k), its image or colour."""

    corners: np.ndarray
    uv: np.ndarray
    image: np.ndarray | None
    colour: tuple[int, ...]


def _export(run: Path, buildings: list[Building], painted: Painted, terrain: Terrain, reference: Reference) -> Path:
    painted.write(run)
    appearance = Appearance(FOLDER, painted.textures, painted_drape(terrain[0], run))
    (run / FOLDER).mkdir(parents=True)
    files = write_obj("t", buildings, reference, ORIGIN, [("t", *terrain)], appearance=appearance)
    for name, data in files.items():
        (run / FOLDER / name).write_bytes(data)
    return run / FOLDER / "t.obj"


def _as_trimesh_draws(path: Path) -> Iterator[Drawn]:
    """All triangles of the file as trimesh finds them, with the images that it opened."""
    # trimesh opens images in other folders only when told so
    resolver = FilePathResolver(str(path), allow_anywhere=True)
    for mesh in trimesh.load_scene(str(path), process=False, resolver=resolver).geometry.values():
        material, corners = mesh.visual.material, mesh.vertices[mesh.faces] + [ORIGIN.x, ORIGIN.y, ORIGIN.z]
        image = None if getattr(material, "image", None) is None else np.asarray(material.image)
        uv = np.zeros((len(mesh.vertices), 2)) if mesh.visual.uv is None else np.asarray(mesh.visual.uv)
        for triangle, numbers in zip(corners, mesh.faces, strict=True):
            yield Drawn(triangle, uv[numbers], image, tuple(material.diffuse[:3]))


def _corners_in_file(path: Path) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Material, world corners and all numbers of the texture coordinates of every polygon."""
    v, vt, material = [], [], ""
    for line in path.read_text().splitlines():
        kind, *rest = line.split()
        if kind == "v":
            v.append([float(x) for x in rest])
        elif kind == "vt":
            vt.append([float(x) for x in rest])
        elif kind == "usemtl":
            material = rest[0]
        elif kind == "f" and "/" in rest[0]:
            pairs = np.array([corner.split("/") for corner in rest], int) - 1
            yield material, np.array(v)[pairs[:, 0]] + [ORIGIN.x, ORIGIN.y, ORIGIN.z], np.array(vt)[pairs[:, 1]]


def _weights(count: int) -> np.ndarray:
    return np.random.default_rng(5).dirichlet(np.ones(3), count)


def test_trimesh_shows_every_face_its_own_pixels(
    tmp_path: Path, neighbours: list[Building], terrain: Terrain, amersfoort: Reference
) -> None:
    painted = paint(neighbours, rectified=True)
    path = _export(tmp_path, neighbours, painted, terrain, amersfoort)
    areas = dict.fromkeys(painted.faces, 0.0)
    for drawn in _as_trimesh_draws(path):
        if drawn.image is None or drawn.image[0, 0, 0] == 250:
            continue
        weights = _weights(20)
        colours = sample(drawn.image, weights @ drawn.uv)
        (code,) = set(codes(colours))
        face = painted.faces[code]
        assert places(colours) == pytest.approx(face.shares(weights @ drawn.corners), abs=0.01)
        areas[code] += float(np.linalg.norm(np.cross(*(drawn.corners[1:] - drawn.corners[0])))) / 2
    assert areas == pytest.approx({code: face.area for code, face in painted.faces.items()}, abs=1e-3)


def test_plain_faces_are_coloured_and_party_walls_and_floors_as_ever(
    tmp_path: Path, neighbours: list[Building], terrain: Terrain, amersfoort: Reference
) -> None:
    path = _export(tmp_path, neighbours, paint(neighbours, rectified=True), terrain, amersfoort)
    assert "newmtl plain_c63\nKd 0.80 0.40 0.20\n" in path.with_suffix(".mtl").read_text()
    bare = {d.colour for d in _as_trimesh_draws(path) if d.image is None}
    # a wall that no image saw, floors, party walls
    assert bare == {(204, 102, 51), (115, 115, 115), (140, 133, 153)}


def test_the_ortho_lies_on_the_terrain(
    tmp_path: Path, neighbours: list[Building], terrain: Terrain, amersfoort: Reference
) -> None:
    path = _export(tmp_path, neighbours, paint(neighbours, rectified=True), terrain, amersfoort)
    x_0, y_0, x_1, y_1 = painted_drape(terrain[0], tmp_path).bounds
    found = [d for d in _as_trimesh_draws(path) if d.image is not None and d.image[0, 0, 0] == 250]
    assert len(found) == len(terrain[1])
    for drawn in found:
        weights = _weights(5)
        truth = ((weights @ drawn.corners)[:, :2] - (x_0, y_0)) / (x_1 - x_0, y_1 - y_0)
        assert places(sample(drawn.image, weights @ drawn.uv)) == pytest.approx(truth, abs=0.01)  # type: ignore[arg-type]


def test_triplets_are_right_everywhere_and_plain_coordinates_are_not(
    tmp_path: Path, neighbours: list[Building], terrain: Terrain, amersfoort: Reference
) -> None:
    painted = paint(neighbours, rectified=False)
    path = _export(tmp_path, neighbours, painted, terrain, amersfoort)
    images = list(painted.pixels.values())
    undivided = []
    seen = set()
    for material, corners, triplets in _corners_in_file(path):
        if material == "terrain":
            continue
        weights = _weights(20)
        u, v, d = (weights @ triplets[:3]).T
        image = images[int(material.removeprefix("page_"))]
        colours = sample(image, np.column_stack([u / d, v / d]))
        (code,) = set(codes(colours))
        truth = painted.faces[code].shares(weights @ corners[:3])
        assert places(colours) == pytest.approx(truth, abs=0.012)
        naive = sample(image, weights @ (triplets[:3, :2] / triplets[:3, 2:]))
        undivided.append(np.abs(places(naive) - truth).max())
        seen.add(code)
    assert seen == set(painted.faces)
    assert np.median(undivided) > 0.05


def test_the_header_says_who_has_to_divide(
    tmp_path: Path, neighbours: list[Building], terrain: Terrain, amersfoort: Reference
) -> None:
    raw = _export(tmp_path / "raw", neighbours, paint(neighbours, rectified=False), terrain, amersfoort)
    rectified = _export(tmp_path / "r", neighbours, paint(neighbours, rectified=True), terrain, amersfoort)
    assert "divide the first two by the third" in raw.read_text()
    assert "nothing to divide" in rectified.read_text()
    assert all(triplets[:, 2] == pytest.approx(1) for _, _, triplets in _corners_in_file(rectified))


def test_the_sidecar_tells_how_each_texture_is_founded(
    tmp_path: Path, neighbours: list[Building], terrain: Terrain, amersfoort: Reference
) -> None:
    path = _export(tmp_path, neighbours, paint(neighbours, rectified=True), terrain, amersfoort)
    said = json.loads(path.with_suffix(".json").read_text())
    assert said["textures"] == ["../textures/rectified/0.png", "../textures/rectified/1.png"]
    gable, block = said["objects"].values()
    assert gable["id"] == neighbours[0].id
    rows = [dict(zip(said["face_columns"], row, strict=True)) for row in gable["faces"]]
    assert [(r["shell"], r["face"]) for r in rows] == [*(("solid", i) for i in range(7)), ("beyond", 0), ("beyond", 1)]
    assert rows[1]["texture"] == {"texture_missing": "no image sees it"}
    assert rows[0]["texture"] == rows[2]["texture"] == {}
    assert rows[3]["texture"] == {
        "texture_gsd_m": 0.05, "texture_incidence_deg": 10.0, "texture_candidates": 40, "texture_images": 3,
        "texture_occluded": 0.25, "texture_interpolated": 0.125,
    }  # fmt: skip
    lines = path.read_text().split("\no ")[1:3]
    for part, thing in zip(lines, (gable, block), strict=True):
        assert sum(row[2] for row in thing["faces"]) == part.count("\nf ")


def test_textured_files_repeat_themselves(neighbours: list[Building], terrain: Terrain, local: Reference) -> None:
    def once() -> dict[str, bytes]:
        look = Appearance(FOLDER, paint(neighbours, rectified=False).textures)
        return write_obj("t", neighbours, local, ORIGIN, [("t", *terrain)], appearance=look)

    assert once() == once()
