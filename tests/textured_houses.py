"""Textures whose pixels say what they show: red names the face, green and blue the place on it.

So whatever reads an export can be asked, at any point of any face, whether it shows the right pixel.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from cityflow.core.building import Building, Face, Lod, Polyhedron, Semantic
from cityflow.core.texture import (
    BuildingTexture,
    Drape,
    FaceFigures,
    FaceKey,
    FaceTexture,
    PlainFace,
    TexturePage,
    TextureSet,
)  # fmt: skip
from cityflow.geometry.polyhedron import face_areas, face_normals

CELL, CELLS = 96, 3
SIDE = CELL * CELLS
RED_STEP = 6
LOW, SPAN = 40.0, 170.0
"""Green and blue run from LOW to LOW + SPAN over a face; they go on beyond it, as padding does."""

TEXTURES = "products/textures"


@dataclass(frozen=True)
class PaintedFace:
    """A face with its code, and the frame of its green and blue: share of the extent along two axes."""

    building: str
    key: FaceKey
    code: int
    page: int
    area: float
    origin: np.ndarray
    axes: np.ndarray

    def shares(self, xyz: np.ndarray) -> np.ndarray:
        """(N, 3) world → (N, 2), 0 to 1 over the face."""
        return np.asarray((xyz - self.origin) @ self.axes.T)


@dataclass(frozen=True)
class Painted:
    """A texture set with its pages' pixels, and what they show."""

    textures: TextureSet
    pixels: Mapping[str, np.ndarray]
    faces: Mapping[int, PaintedFace]

    def write(self, run: Path) -> None:
        for path, pixels in self.pixels.items():
            (run / path).parent.mkdir(parents=True, exist_ok=True)
            Image.fromarray(pixels).save(run / path)


def with_overhang(building: Building, x: float, y: float, eave: float, drop: float = 0.4362) -> Building:
    """A strip of roof half a metre beyond the south wall of a gable of ten metres, and its underside."""
    low, high = y - 0.5, round(eave - drop, 4)
    xyz = np.array([[x, y, eave], [x + 10, y, eave], [x + 10, low, high], [x, low, high]]).round(4)
    faces = (Face(((3, 2, 1, 0),), Semantic.ROOF, plane=0), Face(((0, 1, 2, 3),), Semantic.OUTER_CEILING))
    return Building(
        building.id, building.footprint, building.ground_height, building.solids, building.planes,
        building.attributes, building.status, building.reason, building.overhangs, Polyhedron(xyz, faces),
    )  # fmt: skip


def textured(face: Face) -> bool:
    return face.neighbour is None and face.semantic is not Semantic.GROUND


def paint(buildings: Sequence[Building], rectified: bool, plain: FaceKey = ("solid", 1)) -> Painted:
    """Every face that is neither ground nor party wall gets a cell of a page; face `plain` of the first has a colour.

    Not rectified patches are seen obliquely: their cell shows the face in perspective.
    """
    pages: list[np.ndarray] = []
    faces: dict[int, PaintedFace] = {}
    known: dict[str, BuildingTexture] = {}
    for building in buildings:
        found: dict[FaceKey, FaceTexture] = {}
        for key, shell, face in _faces(building):
            if building is buildings[0] and key == plain:
                continue
            number = len(faces)
            page, cell = divmod(number, CELLS * CELLS)
            if page == len(pages):
                pages.append(np.full((SIDE, SIDE, 3), 255, np.uint8))
            painted = _frame(building.id, key, number + 1, page, shell, key[1])
            homography = _place(cell, painted, shell, rectified)
            _paint_cell(pages[page], cell, homography, painted.code)
            faces[painted.code] = painted
            found[key] = FaceTexture(page, _rings(shell, face, painted, homography, rectified), _figures(number))
        known[building.id] = BuildingTexture(found, _plain(building, found, plain))
    kind = "rectified" if rectified else "raw"
    named = [TexturePage(f"{TEXTURES}/{kind}/{i}.png", SIDE, SIDE, "image/png") for i in range(len(pages))]
    pixels = {p.path: a for p, a in zip(named, pages, strict=True)}
    return Painted(TextureSet(rectified, tuple(named), known), pixels, faces)


def painted_drape(vertices: np.ndarray, run: Path) -> Drape:
    """An ortho over a terrain whose green and blue are the place from west and from south."""
    (x_0, y_0), (x_1, y_1) = vertices[:, :2].min(axis=0) - 1, vertices[:, :2].max(axis=0) + 1
    u, v = np.meshgrid((np.arange(SIDE) + 0.5) / SIDE, 1 - (np.arange(SIDE) + 0.5) / SIDE)
    pixels = np.stack([np.full_like(u, 250), LOW + SPAN * u, LOW + SPAN * v], axis=-1).round().astype(np.uint8)
    page = TexturePage(f"{TEXTURES}/ortho/tile.png", SIDE, SIDE, "image/png")
    (run / page.path).parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(pixels).save(run / page.path)
    return Drape(page, (x_0, y_0, x_1, y_1))


def sample(image: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """(N, 3) colours at u, v from the lower left corner, between pixels linear in them."""
    height, width = image.shape[:2]
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    at = (x[:, None].astype(np.float32), y[:, None].astype(np.float32))
    return cv2.remap(image[..., :3].astype(np.float32), *at, cv2.INTER_LINEAR)[:, 0]


def places(colours: np.ndarray) -> np.ndarray:
    """(N, 2) shares that green and blue say."""
    return (colours[:, 1:] - LOW) / SPAN


def codes(colours: np.ndarray) -> np.ndarray:
    """(N,) codes of faces that red says; must be whole."""
    found = colours[:, 0] / RED_STEP
    assert np.abs(found - found.round()).max() < 0.02
    return found.round().astype(int)


def _faces(building: Building) -> Iterator[tuple[FaceKey, Polyhedron, Face]]:
    shells = {"solid": building.solids.get(Lod.LOD22), "beyond": building.beyond}
    for name, shell in shells.items():
        for i, face in enumerate(() if shell is None else shell.faces):
            if textured(face):
                yield ("solid" if name == "solid" else "beyond", i), shell, face  # type: ignore[misc]


def _plain(building: Building, found: Mapping[FaceKey, FaceTexture], plain: FaceKey) -> dict[FaceKey, PlainFace]:
    """The face that no image saw, and those that nobody wants textured."""
    colours: dict[FaceKey, PlainFace] = {}
    shells = {"solid": building.solids.get(Lod.LOD22), "beyond": building.beyond}
    for name, shell in shells.items():
        for i, face in enumerate(() if shell is None else shell.faces):
            key: FaceKey = ("solid" if name == "solid" else "beyond", i)
            if key not in found:
                unseen = textured(face)
                colours[key] = PlainFace(
                    (204, 102, 51) if unseen else (90, 90, 90), "no image sees it" if unseen else ""
                )
    return colours


def _frame(building: str, key: FaceKey, code: int, page: int, shell: Polyhedron, face: int) -> PaintedFace:
    normal = face_normals(shell)[face]
    right = np.cross([0, 0, 1], normal) if abs(normal[2]) < 0.99 else np.array([1.0, 0, 0])
    right /= np.linalg.norm(right)
    up = np.cross(normal, right)
    ring = shell.ring(shell.faces[face].rings[0])
    st = np.column_stack([ring @ right, ring @ up])
    low, size = st.min(axis=0), np.ptp(st, axis=0)
    axes = np.stack([right / size[0], up / size[1]])
    # the point of the plane at the lower left corner of the face's extent
    origin = ring[0] + (low[0] - st[0, 0]) * right + (low[1] - st[0, 1]) * up
    return PaintedFace(building, key, code, page, float(face_areas(shell)[face]), origin, axes)


def _place(cell: int, painted: PaintedFace, shell: Polyhedron, rectified: bool) -> np.ndarray:
    """(3, 3) from shares to pixels of the page, with the distance as third: straight, or obliquely seen."""
    row, col = divmod(cell, CELLS)
    left, top, inner = col * CELL + 12.0, row * CELL + 12.0, CELL - 24.0
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
    seen = [(0, 1), (1, 1), (1, 0), (0, 0)] if rectified else [(0.05, 1), (1, 0.8), (0.9, 0.35), (0, 0)]
    target = np.array(seen, np.float32) * inner + (left, top)
    homography = cv2.getPerspectiveTransform(square, target.astype(np.float32)).astype(np.float64)
    return homography if rectified else homography * (300.0 + painted.code)


def _paint_cell(page: np.ndarray, cell: int, homography: np.ndarray, code: int) -> None:
    row, col = divmod(cell, CELLS)
    x, y = np.meshgrid(np.arange(CELL) + col * CELL + 0.5, np.arange(CELL) + row * CELL + 0.5)
    shares = np.stack([x, y, np.ones_like(x)], axis=-1) @ np.linalg.inv(homography).T
    shares = shares[..., :2] / shares[..., 2:]
    part = page[row * CELL : (row + 1) * CELL, col * CELL : (col + 1) * CELL]
    part[..., 0] = code * RED_STEP
    part[..., 1:] = np.clip(LOW + SPAN * shares, 0, 255).round()


def _rings(
    shell: Polyhedron, face: Face, painted: PaintedFace, homography: np.ndarray, rectified: bool
) -> tuple[np.ndarray, ...]:
    rings = []
    for ring in face.rings:
        shares = painted.shares(shell.ring(ring))
        x, y, d = homography @ np.vstack([shares.T, np.ones(len(ring))])
        rings.append(np.column_stack([x / d / SIDE, 1 - y / d / SIDE, np.ones(len(ring)) if rectified else d]))
    return tuple(rings)


def _figures(number: int) -> FaceFigures:
    return FaceFigures(0.05 + number / 1000, 10.0 + number, 40, 3, 0.25, 0.125)
