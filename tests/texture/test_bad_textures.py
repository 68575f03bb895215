"""What no survey should have and some do: a face gets a texture or a plain colour and a reason, never a black wall, never a crash."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from box_rays import through_box
from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Grid
from cityflow.core.pixels import ArrayPixels, PixelArray, Pixels
from cityflow.core.texture import FIRST_IMAGE, FaceKey, FacePlane, UnitTexture
from cityflow.errors import CatalogError
from cityflow.texture.pages import pages_of
from cityflow.texture.placement.place import place
from cityflow.texture.planes import face_planes
from cityflow.texture.unit import HIDDEN, NO_IMAGE, Surroundings, TexturedUnit, TextureParameters, texture_unit

WALL_GREY, ROOF_GREY, GROUND_GREY = 150, 90, 60
GRAIN = 12
WALLS: dict[str, FaceKey] = {"south": ("solid", 2), "east": ("solid", 3), "north": ("solid", 4), "west": ("solid", 5)}
ROOF: FaceKey = ("solid", 1)


def house(wide: float = 10.0, deep: float = 8.0, tall: float = 6.0) -> Polyhedron:
    x, y, z = wide / 2, deep / 2, tall
    low = [(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)]
    vertices = np.array([*low, *((a, b, z) for a, b, _ in low)])
    sides = [((k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k), Semantic.WALL) for k in range(4)]
    faces = [((3, 2, 1, 0), Semantic.GROUND), ((4, 5, 6, 7), Semantic.ROOF), *sides]
    return Polyhedron(vertices, tuple(Face((ring,), semantic) for ring, semantic in faces))


def looking(name: str, centre: Sequence[float], target: Sequence[float] = (0, 0, 3), f: float = 600.0, size: int = 400) -> OrientedImage:  # fmt: skip
    at = np.asarray(centre, float)
    z = np.asarray(target, float) - at
    z /= np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0]) if abs(z[2]) < 0.999 else np.array([1.0, 0.0, 0.0])
    x /= np.linalg.norm(x)
    return OrientedImage(name, Camera(size, size, f, f, size / 2, size / 2), np.array([x, np.cross(z, x), z]), at)


def shot(image: OrientedImage, solid: Polyhedron, bands: int = 3, dtype: type = np.uint8, gain: float = 1.0) -> ColourImage:  # fmt: skip
    """A photograph of the house on level ground: every kind of surface has its grey, with grain that hangs on the world."""
    rows, cols = np.mgrid[0 : image.camera.height, 0 : image.camera.width]
    rays = image.rays(np.column_stack([cols.ravel() + 0.5, rows.ravel() + 0.5]))
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    enters, far = through_box(image.centre, rays, low, high)
    near = enters.max(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ground = -image.centre[2] / rays[:, 2]
    hit = (near < far) & (near > 0)
    depth = np.where(hit, near, np.where(ground > 0, ground, 500.0))
    xyz = image.centre + depth[:, None] * rays
    top = hit & (np.abs(xyz[:, 2] - high[2]) < 1e-6)
    grey = np.where(top, ROOF_GREY, np.where(hit, WALL_GREY, GROUND_GREY)).astype(float)
    cell = np.floor(xyz * 2.0 + 1e-6).astype(np.int64)
    grain = ((cell * (73856093, 19349663, 83492791)).sum(axis=1) % (2 * GRAIN + 1)) - GRAIN
    value = np.clip(gain * (grey + grain), 0, 255)
    if dtype is np.uint16:
        value = value * 16.0
    array: NDArray[Any] = np.repeat(value.reshape(*rows.shape, 1), bands, axis=2).astype(dtype)
    return ColourImage(image, ArrayPixels(array))


def around_it(solid: Polyhedron, heights: float = 0.0) -> Surroundings:
    grid = Grid.covering((-60.0, -60.0, 60.0, 60.0), 0.5)
    return Surroundings([solid], [], np.full(grid.shape, heights), grid)


def four_sides(distance: float = 25.0, height: float = 22.0) -> list[OrientedImage]:
    towards = {"s": (0, -1), "e": (1, 0), "n": (0, 1), "w": (-1, 0)}
    return [looking(n, (distance * x, distance * y, height)) for n, (x, y) in towards.items()]


def made(images: Sequence[ColourImage], solid: Polyhedron | None = None, **changes: object) -> TexturedUnit:
    solid = solid or house()
    parameters = TextureParameters().model_copy(update=changes)
    result = texture_unit(face_planes(solid, None), images, around_it(solid), parameters)
    complete(result.texture, face_planes(solid, None))
    return result


def complete(texture: UnitTexture, faces: Sequence[FacePlane]) -> None:
    """Every face has both patches or a plain colour with a reason, and no patch has a black pixel on its face."""
    raw, rectified = ({p.key for p in patches} for patches in (texture.raw, texture.rectified))
    assert raw == rectified
    assert raw.isdisjoint(texture.plain)
    assert raw | set(texture.plain) == {f.key for f in faces}
    for plain in texture.plain.values():
        assert plain.reason
        assert min(plain.colour) > 20
    for patch in (*texture.raw, *texture.rectified):
        assert patch.pixels[patch.mask].max(axis=1).min() > 20
        assert (patch.index[patch.mask] > 0).all()
        assert patch.figures.images >= 1


def mean(result: TexturedUnit, key: tuple[str, int]) -> float:
    patch = next(p for p in result.texture.rectified if p.key == key)
    return float(patch.pixels[patch.mask].mean())


@dataclass(frozen=True)
class Unreadable:
    """A file that has gone, or of which a part is broken: reading windows of `levels` fails."""

    pixels: Pixels
    levels: tuple[int, ...] = tuple(range(16))
    height = width = 400
    bands = 3

    @property
    def dtype(self) -> np.dtype[Any]:
        return self.pixels.dtype

    def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int = 0) -> PixelArray:
        if level in self.levels:
            raise CatalogError("the file has gone", where="s.tif")
        return self.pixels.window(rows, cols, level)


def test_faces_that_no_image_sees() -> None:
    result = made([shot(four_sides()[0], house())])
    assert WALLS["north"] in result.texture.plain
    assert result.texture.plain[WALLS["north"]].reason in (HIDDEN, NO_IMAGE)
    assert {p.key for p in result.texture.raw} == {ROOF, WALLS["south"]}
    # the colour of walls that do have one
    assert result.texture.plain[WALLS["north"]].colour[0] == pytest.approx(WALL_GREY, abs=8)


def test_no_image_at_all() -> None:
    result = made([])
    assert len(result.texture.plain) == 5
    assert not result.texture.raw
    assert {p.reason for p in result.texture.plain.values()} == {NO_IMAGE}


@pytest.mark.parametrize("levels", [tuple(range(16)), (0,)])
def test_an_image_that_is_missing_when_it_is_wanted(levels: tuple[int, ...]) -> None:
    images = [shot(i, house()) for i in (*four_sides(), *four_sides(32.0, 28.0))]
    images = [replace(i, image=replace(i.image, name=f"{i.image.name}{k}")) for k, i in enumerate(images)]
    broken = [replace(images[0], pixels=Unreadable(images[0].pixels, levels)), *images[1:]]
    result = made(broken)
    assert dict(result.lost) == {"s0": str(CatalogError("the file has gone", where="s.tif"))}
    assert "s0" not in result.texture.images
    without = made(images[1:])
    for one, two in zip(result.texture.raw, without.texture.raw, strict=True):
        assert np.array_equal(one.pixels, two.pixels)


def test_the_only_image_is_missing() -> None:
    image = shot(four_sides()[0], house(), dtype=np.uint16)
    result = made([replace(image, pixels=Unreadable(image.pixels))])
    assert set(result.lost) == {"s"}
    assert len(result.texture.plain) == 5


def test_four_hundred_candidates() -> None:
    near = shot(four_sides()[0], house())
    ring = [
        replace(near, image=looking(f"i{k:03d}", (25 * np.sin(0.002 * k), -25 * np.cos(0.002 * k), 22 + 0.01 * k)))
        for k in range(400)
    ]
    result = made(ring, most_images=400)
    assert result.figures["candidates"] == 400
    assert result.figures["kept"] <= 12


def test_faces_of_a_pixel() -> None:
    tiny = house(0.06, 0.05, 0.05)
    image = [shot(looking(n, (25 * x, 25 * y, 20), (0, 0, 0)), tiny) for n, x, y in (("a", 0, -1), ("b", 1, 0), ("c", -1, 1))]  # fmt: skip
    result = made(image, tiny)
    patches = result.texture.raw
    assert patches
    assert max(max(p.mask.shape) for p in patches) < 16
    placement = place([p.mask for p in patches])
    assert sum(int((page.owner > 0).sum()) for page in pages_of(patches, placement)) == sum(
        int(p.mask.sum()) for p in patches
    )


def test_a_face_two_hundred_metres_long() -> None:
    long = house(200.0, 12.0, 8.0)
    images = [
        shot(looking(f"i{k}", (x, -40.0, 30.0), (x, 0, 4), f=500.0), long) for k, x in enumerate(range(-90, 91, 30))
    ]
    result = made(images, long)
    south = next(p for p in result.texture.rectified if p.key == WALLS["south"])
    assert south.figures.images >= 4
    assert south.figures.interpolated < 0.05
    assert mean(result, WALLS["south"]) == pytest.approx(WALL_GREY, abs=6)


@pytest.mark.parametrize(("bands", "dtype"), [(4, np.uint8), (1, np.uint8), (3, np.uint16), (1, np.uint16)])
def test_bands_and_depths(bands: int, dtype: type) -> None:
    result = made([shot(i, house(), bands, dtype) for i in four_sides()])
    assert len(result.texture.raw) == 5
    assert all(p.pixels.shape[2] == 3 for p in result.texture.raw)
    # 12 bits in 16: 16 times the values of 8 bits, and white is 4095
    assert mean(result, WALLS["east"]) == pytest.approx(WALL_GREY, abs=8)


def test_grey_and_deep_beside_colour() -> None:
    kinds = ((3, np.uint8), (1, np.uint8), (4, np.uint16), (1, np.uint16))
    mixed = [shot(i, house(), *kind) for i, kind in zip(four_sides(), kinds, strict=True)]
    result = made(mixed)
    assert len(result.texture.raw) == 5
    for key in WALLS.values():
        assert mean(result, key) == pytest.approx(WALL_GREY, abs=12)


@pytest.mark.parametrize("gain", [0.25, 0.5, 1.6])
def test_an_exposure_far_off(gain: float) -> None:
    wrong = [shot(i, house(), gain=gain if i.name == "e" else 1.0) for i in four_sides()]
    result = made(wrong)
    assert mean(result, WALLS["east"]) == pytest.approx(mean(result, WALLS["south"]), abs=12)


def test_an_overexposed_image_is_no_white_wall_where_others_see_it() -> None:
    images = [
        shot(looking("burnt", (0, -22, 20)), house(), gain=4.0),
        *(shot(i, house()) for i in four_sides(30.0, 26.0)),
    ]
    result = made(images)
    assert mean(result, WALLS["south"]) < 200


def test_cameras_inside_and_behind() -> None:
    inside = looking("inside", (0, 0, 3), (0, -4, 3))
    behind = looking("behind", (0, 0.5, 1.0), (0, 20, 1))
    away = looking("away", (0, -25, 22), (0, -60, 40))
    result = made([ColourImage(i, ArrayPixels(np.full((400, 400, 3), 255, np.uint8))) for i in (inside, behind, away)])
    assert not result.texture.raw
    seen = made([*(shot(i, house()) for i in four_sides()), ColourImage(inside, ArrayPixels(np.full((400, 400, 3), 255, np.uint8)))])  # fmt: skip
    assert mean(seen, WALLS["south"]) == pytest.approx(WALL_GREY, abs=6)


def test_a_horizontal_camera_close_to_a_wall() -> None:
    """It sees a part of the wall from 3 m; ground behind it is cut off by the camera's own plane."""
    near = shot(looking("street", (-2.0, -7.0, 1.6), (-2.0, 0.0, 1.6), f=300.0), house())
    far = [shot(i, house()) for i in four_sides()]
    result = made([near, *far])
    south = next(p for p in result.texture.rectified if p.key == WALLS["south"])
    names = {result.texture.images[i - FIRST_IMAGE] for i in np.unique(south.index[south.index >= FIRST_IMAGE])}
    assert "street" in names
    assert mean(result, WALLS["south"]) == pytest.approx(WALL_GREY, abs=8)
    alone = made([near])
    assert {p.key for p in alone.texture.raw} == {WALLS["south"]}


def test_black_files_are_no_texture() -> None:
    """An ortho's edge, or a frame that was turned, is black; nobody paints with that."""
    black = [ColourImage(i, ArrayPixels(np.zeros((400, 400, 3), np.uint8))) for i in four_sides()]
    assert not made(black).texture.raw
