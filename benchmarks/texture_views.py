"""Textured models and the truth, both as cameras see them that took no picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.texture import FIRST_IMAGE, FacePlane
from cityflow.geometry.polygon_triangulation import triangulate_polygon
from cityflow.geometry.polyhedron import triangulate
from cityflow.geometry.textured_view import TexturedTriangles, TexturedView, draw_textured
from cityflow.synthetic.render import RenderParameters, render, truth_depth
from cityflow.texture.pages import corners_on_page, pages_of, uvd
from cityflow.texture.placement.place import PlacementParameters, place
from image_similarity import Similarity, image_similarity
from texture_visibility import BUILT
from texture_world import Done, World

SIZE_PX = (720, 560)
"""Width and height of held-out views: the middle of what a survey's camera shows, at its resolution."""
LOW_M, LOW_AWAY_M = 22.0, 75.0
FINER = 2
"""Samples per pixel and axis when textured models are drawn, as a renderer smooths edges."""
GREY = 120


def held_out(world: World) -> dict[str, OrientedImage]:
    """Between two stations of the flight, a view of every head, and one from low beside the town; all look at its middle."""
    x_0, y_0, x_1, y_1 = world.area
    middle = np.array([(x_0 + x_1) / 2, (y_0 + y_1) / 2, float(np.median([h.shells[0].vertices[:, 2].min() for h in world.houses])) + 3.0])  # fmt: skip
    images = [world.poses[i.image.name] for i in world.images]
    views = {}
    for head in sorted({i.name.split("_")[2] for i in images}):
        near = [i for i in images if i.name.split("_")[2] == head]
        # the station whose axis passes nearest to the middle, and the one after or before it on its strip
        near.sort(key=lambda i: _passes(i, middle))
        best = near[0]
        beside = min((i for i in near[1:] if i.name[:3] == best.name[:3]), key=lambda i: float(np.linalg.norm(i.centre - best.centre)))  # fmt: skip
        views[head] = _cropped(replace(best, name=f"held_{head}", centre=(best.centre + beside.centre) / 2), middle)
    views["low"] = _low(middle)
    return views


def _passes(image: OrientedImage, point: FloatArray) -> float:
    away = point - image.centre
    return float(np.linalg.norm(away - (away @ image.axis) * image.axis))


def _cropped(image: OrientedImage, middle: FloatArray) -> OrientedImage:
    (u, v), c = image.project(middle[None])[0][0], image.camera
    wide, tall = SIZE_PX
    return replace(image, camera=Camera(wide, tall, c.fx, c.fy, c.cx - round(u) + wide // 2, c.cy - round(v) + tall // 2))  # fmt: skip


def _low(middle: FloatArray) -> OrientedImage:
    """From a little above the roofs, south-east of the middle, where a pixel is as large as in the survey."""
    centre = middle + np.array([0.7 * LOW_AWAY_M, -0.714 * LOW_AWAY_M, LOW_M])
    z = (middle - centre) / np.linalg.norm(middle - centre)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    wide, tall = SIZE_PX
    f = float(np.linalg.norm(middle - centre)) / 0.08
    return OrientedImage("held_low", Camera(wide, tall, f, f, wide / 2, tall / 2), np.array([x, np.cross(z, x), z]), centre)  # fmt: skip


@dataclass(frozen=True)
class Seen:
    """The truth of a view.

    Attributes
    ----------
    colours : (rows, cols, 3) without noise
    unit : (rows, cols) true unit of what is built there, -1 elsewhere
    """

    colours: Float32Array
    unit: NDArray[np.int64]


def true_view(world: World, image: OrientedImage) -> Seen:
    given: RenderParameters = world.parameters.render
    sensor = given.sensor.model_copy(update={"noise": False, "vignetting": 0.0, "exposure_sigma": 0.0})
    perfect = given.model_copy(update={"sensor": sensor})
    colours = render(world.truth.scene, image, perfect, world.parameters.seed)[..., :3].astype(np.float32)
    _, triangle = truth_depth(world.truth.scene, image)
    mesh = world.truth.mesh
    built = (triangle >= 0) & np.isin(mesh.part[triangle], [int(p) for p in BUILT])
    return Seen(colours, np.where(built, mesh.unit[triangle], -1).astype(np.int64))


def scene_of(world: World, done: Sequence[Done], name: str) -> TexturedTriangles:
    """The textured units, each on an atlas of its own, and all others in grey."""
    textured = {unit.number for unit in done}
    parts = [_unit(unit, name) for unit in done]
    parts += [_grey(s) for k, h in enumerate(world.houses) if k not in textured for s in h.all]
    pages = np.cumsum([0, *(len(p.pages) for p in parts)]).tolist()
    moved = [replace(p, page=np.where(p.page >= 0, p.page + n, -1)) for p, n in zip(parts, pages[:-1], strict=True)]
    return _joined(moved, [page for p in parts for page in p.pages])


def _joined(parts: Sequence[TexturedTriangles], pages: Sequence[NDArray[np.uint8]]) -> TexturedTriangles:
    """One after the other; their pages are numbered as in `pages`."""
    start = np.cumsum([0, *(len(p.xyz) for p in parts)]).tolist()
    return TexturedTriangles(
        np.concatenate([p.xyz for p in parts]), np.concatenate([p.uvd for p in parts]),
        np.concatenate([p.triangles + n for p, n in zip(parts, start[:-1], strict=True)]),
        np.concatenate([p.page for p in parts]), np.concatenate([p.colour for p in parts]), pages,
    )  # fmt: skip


def _unit(unit: Done, name: str) -> TexturedTriangles:
    patches = list(unit.patches(name).values())
    placement = place([p.mask for p in patches], PlacementParameters(effort=0)) if patches else None
    pages = pages_of(patches, placement) if placement else ()
    numbers = {p.key: k for k, p in enumerate(patches)}
    parts = []
    for key, face in unit.faces.items():
        if key in numbers and placement:
            spot, patch = placement.spots[numbers[key]], patches[numbers[key]]
            texel = np.concatenate([uvd(corners_on_page(c, patch.mask.shape, spot), placement.pages[spot.page]) for c in patch.corners])  # fmt: skip
            parts.append(_face(face, texel, spot.page, (0, 0, 0)))
        else:
            parts.append(_face(face, np.ones((sum(map(len, face.rings)), 3)), -1, unit.made.texture.plain[key].colour))
    for shell, of in zip(unit.house.shells, ("solid", "beyond"), strict=True):
        if shell is not None:
            parts.append(_grey(shell, {k[1] for k in unit.faces if k[0] == of}))
    return _joined(parts, [page.pixels for page in pages])


def _face(face: FacePlane, texel: FloatArray, page: int, colour: tuple[int, int, int]) -> TexturedTriangles:  # fmt: skip
    triangles = np.asarray(triangulate_polygon([face.on_plane(r) for r in face.rings]), np.int64)
    many = len(triangles)
    return TexturedTriangles(np.concatenate(face.rings), texel, triangles, np.full(many, page), np.tile(colour, (many, 1)), [])  # fmt: skip


def _grey(shell: Polyhedron, hidden: set[int] | None = None) -> TexturedTriangles:
    """Faces that have no texture and want none."""
    kept = [f for k, f in enumerate(shell.faces) if not hidden or k not in hidden]
    mesh = triangulate(Polyhedron(shell.vertices, tuple(kept)))
    triangles, many = mesh.triangles.astype(np.int64), len(mesh.triangles)
    nowhere = np.ones((len(mesh.vertices), 3))
    return TexturedTriangles(mesh.vertices, nowhere, triangles, np.full(many, -1), np.full((many, 3), GREY), [])


def drawn(image: OrientedImage, scene: TexturedTriangles) -> TexturedView:
    """With smooth edges."""
    c = image.camera
    finer = Camera(c.width * FINER, c.height * FINER, c.fx * FINER, c.fy * FINER, c.cx * FINER, c.cy * FINER)
    view = draw_textured(replace(image, camera=finer), scene)
    small = cv2.resize(view.colour, (c.width, c.height), interpolation=cv2.INTER_AREA)
    there = cv2.resize((view.triangle >= 0).astype(np.float32), (c.width, c.height), interpolation=cv2.INTER_AREA)
    return TexturedView(
        np.asarray(small, np.float32), view.depth[::FINER, ::FINER], np.where(there >= 0.5, 0, -1).astype(np.int32)
    )


def compared(seen: Seen, view: TexturedView, units: Sequence[int]) -> tuple[Similarity, BoolArray]:
    """On pixels where the truth shows one of the units; what the model lacks there stays black."""
    of = np.isin(seen.unit, list(units))
    return image_similarity(view.colour, seen.colours, of), of


def picture(path: Path, seen: Seen, view: TexturedView, found: tuple[Similarity, BoolArray]) -> None:
    """Truth, textured model in front of the truth, and what differs, side by side."""
    alike, of = found
    shown = np.clip(view.colour * np.array(alike.gain, np.float32), 0, 255)
    model = np.where(of[..., None], shown, 0.35 * seen.colours + 150)
    reference = np.where(of[..., None], seen.colours, 0.35 * seen.colours + 150)
    off = np.where(of[..., None], np.clip(128 + (shown - seen.colours), 0, 255), 255)
    cv2.imwrite(str(path), np.hstack([reference, model, off])[..., ::-1].astype(np.uint8))


def page_picture(path: Path, done: Sequence[Done]) -> None:
    """All raw patches on a page, and beside it which image each texel came from, a colour for each; white is free, black interpolated."""
    patches = [patch for unit in done for patch in unit.patches("raw").values()]
    names = sorted({i.image.name for unit in done for i in unit.images})
    page = next(pages_of(patches, place([patch.mask for patch in patches])))
    number = np.array([names.index(i.image.name) for unit in done for i in unit.images])
    first = np.cumsum([0, *(len(unit.images) for unit in done)])
    of_patch = np.concatenate([np.full(len(unit.patches("raw")), n) for unit, n in zip(done, first[:-1], strict=True)])
    seen = page.index >= FIRST_IMAGE
    shown = np.zeros((*page.index.shape, 3), np.uint8)
    image = number[page.index[seen].astype(np.int64) - FIRST_IMAGE + of_patch[page.owner[seen].astype(np.int64) - 1]]
    hues = (image * 67 % 180).astype(np.uint8)
    shown[seen] = cv2.cvtColor(np.stack([hues, np.full_like(hues, 150), np.full_like(hues, 220)], axis=-1)[None], cv2.COLOR_HSV2RGB)[0]  # fmt: skip
    free = page.owner == 0
    both = np.hstack([np.where(free[..., None], 255, page.pixels), np.where(free[..., None], 255, shown)])
    cv2.imwrite(str(path), both[..., ::-1].astype(np.uint8))
