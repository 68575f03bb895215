"""What is seen when a viewer of 3D Tiles goes from a coarse content to what it stands for: python benchmarks/coarse_switch.py RUN [--pixels 16]

Viewers switch where the stated geometric error covers `--pixels` of the screen. Random places on the finer surfaces (outside, no floors, no party
walls) are held against the coarse ones: their distance in pixels of the screen there, seen square to it, which is the most that any view shows; and the
difference of colours, both averaged over cubes one pixel wide (CIE76). Of buildings' roofs, walls and ground apart, by area.
"""

from __future__ import annotations

import argparse
import io
import json
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import open3d as o3d
from PIL import Image

from glb_reading import Glb

Array = np.ndarray
SPACING_M = 0.3
MOST_SAMPLES = 200_000
ROOF, WALL, GROUND = PARTS = ("roofs", "walls", "ground")
ZUP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


@dataclass(frozen=True)
class Surface:
    """Triangles (T, 3, 3) in metres, part of each, and what colours it: linear light of the corners (T, 3, 3), or uv (T, 3, 2) on one of the pages."""

    corners: Array
    part: Array
    colour: Array
    uv: Array
    page: Array
    pages: list[Array]

    def colours(self, triangle: Array, weights: Array) -> Array:
        """(N, 3) linear light at places, by triangle and barycentric weights (N, 3)."""
        found: Array = np.einsum("nk,nkc->nc", weights, self.colour[triangle])
        uv = np.einsum("nk,nkc->nc", weights, self.uv[triangle])
        for number, page in enumerate(self.pages):
            on = self.page[triangle] == number
            rows, cols = page.shape[:2]
            col = np.clip((uv[on, 0] * cols).astype(int), 0, cols - 1)
            row = np.clip((uv[on, 1] * rows).astype(int), 0, rows - 1)
            found[on] = _linear(page[row, col])
        return found


def joined(several: list[Surface]) -> Surface:
    pages: list[Array] = []
    page = []
    for one in several:
        page.append(np.where(one.page >= 0, one.page + len(pages), -1))
        pages += one.pages
    return Surface(
        np.concatenate([one.corners for one in several]),
        np.concatenate([one.part for one in several]),
        np.concatenate([one.colour for one in several]),
        np.concatenate([one.uv for one in several]),
        np.concatenate(page),
        pages,
    )


def read(path: Path, transform: Array) -> Surface:
    """A content in the frame that `transform` leads to."""
    glb = Glb.of(path.read_bytes())
    matrix = np.array(glb.document["nodes"][0].get("matrix", np.eye(4).reshape(-1)), float).reshape(4, 4).T
    whole = transform @ ZUP @ matrix
    found = []
    for primitive in glb.primitives:
        attributes, triangles = glb.attributes(primitive), glb.triangles(primitive)
        xyz = attributes["POSITION"].astype(float) @ whole[:3, :3].T + whole[:3, 3]
        part = np.full(len(triangles), GROUND, object)
        if "_FEATURE_ID_1" in attributes:
            table = glb.table(1)
            kinds = np.array([{"RoofSurface": ROOF, "WallSurface": WALL}.get(t, "") for t in table["type"]], object)
            if "neighbour" in table:
                kinds[[bool(n) for n in table["neighbour"]]] = ""
            part = kinds[attributes["_FEATURE_ID_1"][triangles[:, 0]].astype(int)]
        picture, pages = glb.picture(primitive), []
        if picture is not None:
            data = (
                glb.view(picture["bufferView"])
                if "bufferView" in picture
                else (path.parent / picture["uri"]).read_bytes()
            )
            pages = [np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))]
        uv = attributes.get("TEXCOORD_0", np.zeros((len(xyz), 2)))
        colour = _light(glb, primitive, attributes, len(xyz))
        keep = part != ""
        corners = triangles[keep]
        found.append(
            Surface(
                xyz[corners],
                part[keep],
                colour[corners].astype(float),
                uv[corners],
                np.full(len(corners), len(pages) - 1),
                pages,
            )
        )
    return joined(found)


def _light(glb: Glb, primitive: dict[str, Any], attributes: dict[str, Array], count: int) -> Array:
    """(count, 3) linear light of corners without a picture: their own, 16 bits, else their material's."""
    if "COLOR_0" in attributes:
        return attributes["COLOR_0"][:, :3] / 65535
    factor = glb.document["materials"][primitive["material"]]["pbrMetallicRoughness"].get("baseColorFactor", [1, 1, 1])
    return np.tile(factor[:3], (count, 1))


def switches(
    folder: Path, name: str = "tileset.json", transform: Array | None = None
) -> Iterator[tuple[str, float, Path, Array, list[tuple[Path, Array]]]]:
    """Of each tile that replaces: what it is (`tile`, `node`), stated error, content and those of its children, with the transforms."""
    root = json.loads((folder / name).read_text())["root"]
    yield from _below(folder, root, np.eye(4) if transform is None else transform)


def _below(
    folder: Path, tile: dict[str, Any], transform: Array
) -> Iterator[tuple[str, float, Path, Array, list[tuple[Path, Array]]]]:
    if "transform" in tile:
        transform = transform @ np.array(tile["transform"]).reshape(4, 4).T
    uri = tile.get("content", {}).get("uri", "")
    if uri.endswith(".json"):
        yield from switches((folder / uri).parent, Path(uri).name, transform)
        return
    if tile.get("refine") == "REPLACE" and uri:
        finer = [found for child in tile["children"] for found in _contents(folder, child, transform)]
        kind = "tile" if uri == "coarse.glb" else "node"
        yield kind, tile["geometricError"], folder / uri, transform, finer
    for child in tile.get("children", []):
        yield from _below(folder, child, transform)


def _contents(folder: Path, tile: dict[str, Any], transform: Array) -> Iterator[tuple[Path, Array]]:
    """Contents that are shown first below."""
    if "transform" in tile:
        transform = transform @ np.array(tile["transform"]).reshape(4, 4).T
    uri = tile.get("content", {}).get("uri", "")
    if uri.endswith(".json"):
        root = json.loads((folder / uri).read_text())["root"]
        yield from _contents((folder / uri).parent, root, transform)
    elif uri:
        yield folder / uri, transform
    else:
        for child in tile.get("children", []):
            yield from _contents(folder, child, transform)


def held_against(
    fine: Surface, coarse: Surface, pixel_m: float, rng: np.random.Generator
) -> dict[str, tuple[Array, Array]]:
    """By part: distances in pixels at random places, and differences of colour of cubes a pixel wide."""
    a, b, c = (fine.corners[:, k] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    count = min(int(area.sum() / SPACING_M**2), MOST_SAMPLES)
    triangle = rng.choice(len(area), count, p=area / area.sum())
    weights = rng.dirichlet(np.ones(3), count)
    places = np.einsum("nk,nkc->nc", weights, fine.corners[triangle])
    middle = coarse.corners.reshape(-1, 3).mean(axis=0)
    scene = o3d.t.geometry.RaycastingScene()
    vertices = (coarse.corners.reshape(-1, 3) - middle).astype(np.float32)
    scene.add_triangles(vertices, np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3))
    near = scene.compute_closest_points((places - middle).astype(np.float32))
    away = np.linalg.norm(near["points"].numpy() + middle - places, axis=1) / pixel_m
    u, v = near["primitive_uvs"].numpy().T.astype(float)
    there = coarse.colours(near["primitive_ids"].numpy().astype(int), np.column_stack([1 - u - v, u, v]))
    here = fine.colours(triangle, weights)
    found = {}
    for part in PARTS:
        mine = fine.part[triangle] == part
        if mine.sum() < 100:
            continue
        _, cube = np.unique(np.floor(places[mine] / pixel_m).astype(np.int64), axis=0, return_inverse=True)
        number = np.bincount(cube)
        means = [
            np.column_stack([np.bincount(cube, light[mine, k]) / number for k in range(3)]) for light in (here, there)
        ]
        unlike = np.linalg.norm(_lab(means[0]) - _lab(means[1]), axis=1)
        found[part] = away[mine], np.repeat(unlike, number)
    return found


def _linear(colour: Array) -> Array:
    v = np.asarray(colour, float) / 255
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def _lab(light: Array) -> Array:
    srgb = np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.clip(light, 0, 1) ** (1 / 2.4) - 0.055)
    return np.asarray(cv2.cvtColor(srgb.astype(np.float32)[None], cv2.COLOR_RGB2LAB)[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--pixels", type=float, default=16.0, help="error on the screen from which viewers switch")
    chosen = parser.parse_args()
    rng = np.random.default_rng(0)
    found: dict[tuple[str, str], list[tuple[Array, Array]]] = defaultdict(list)
    errors = defaultdict(list)
    for kind, error, content, transform, finer in switches(chosen.run / "products/tiles3d"):
        errors[kind].append(error)
        fine, coarse = joined([read(*one) for one in finer]), read(content, transform)
        for part, values in held_against(fine, coarse, error / chosen.pixels, rng).items():
            found[kind, part].append(values)
    for kind, stated in sorted(errors.items()):
        print(
            f"{len(stated)} {kind}s, stated error {min(stated):.2f} to {max(stated):.2f} m, in the median {np.median(stated):.2f}"
        )
    print("of      part    distance px: half, 95 %   colours ΔE: half, 95 %")
    for (kind, part), several in sorted(found.items()):
        away, unlike = (np.concatenate([v[k] for v in several]) for k in range(2))
        px, de = np.percentile(away, [50, 95]), np.percentile(unlike, [50, 95])
        print(f"{kind:7} {part:7} {px[0]:12.2f} {px[1]:9.2f} {de[0]:17.1f} {de[1]:8.1f}")


if __name__ == "__main__":
    main()
