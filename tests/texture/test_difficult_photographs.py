"""Photographs that are burnt out, darker than others, or show nothing of a wall: textures against the house's true colours, in CIEDE2000."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from skimage.color import deltaE_ciede2000, rgb2lab

from box_rays import through_box
from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Grid
from cityflow.core.pixels import ArrayPixels
from cityflow.core.texture import FIRST_IMAGE, INTERPOLATED, FaceKey, FacePlane, Patch
from cityflow.texture.comparisons import FaceSamples
from cityflow.texture.plain_colours import WallColours
from cityflow.texture.planes import face_planes
from cityflow.texture.source_image import LinearModel
from cityflow.texture.unit import DOUBTFUL, Surroundings, TexturedUnit, TextureParameters, texture_unit
from cityflow.texture.unit_radiometry import balance
from texture_scenes import GROUND, X, Y, house, looking, surface

WIDE, TALL = 12.0, 8.0
SOUTH: FaceKey = ("solid", 2)
NORTH: FaceKey = ("solid", 4)
WALL, STRIPE, ROOF, GRASS = (190.0, 170.0, 140.0), (120.0, 95.0, 80.0), (150.0, 80.0, 65.0), (70.0, 130.0, 45.0)
SMALL = Camera(420, 280, 560.0, 560.0, 210.0, 140.0)
HEDGE_M = 4.0
"""What grass and hedges hide of the walls where a scene has them."""


def solid() -> Polyhedron:
    return house(-WIDE / 2, -WIDE / 2, WIDE, WIDE, TALL)


def true_colours(xyz: FloatArray) -> FloatArray:
    """(N, 3) of places on the house, metres from the scene's corner: walls with a stripe every two metres, roof, else grass."""
    out = np.tile(np.array(GRASS), (len(xyz), 1))
    out[xyz[:, 2] > GROUND + 0.01] = WALL
    along = np.where(np.abs(np.abs(xyz[:, 1]) - WIDE / 2) < 1e-3, xyz[:, 0], xyz[:, 1])
    out[(xyz[:, 2] > GROUND + 0.01) & (np.mod(along, 2.0) < 0.5)] = STRIPE
    out[xyz[:, 2] > GROUND + TALL - 1e-3] = ROOF
    return out


def shot(image: OrientedImage, gain: float = 1.0, hedge_m: float = 0.0) -> ColourImage:
    """A photograph of the house, exposed by a factor and cut off at white; the walls' lowest metres show grass where a hedge stands."""
    camera = image.camera
    rows, cols = np.mgrid[0 : camera.height, 0 : camera.width]
    rays = image.rays(np.column_stack([cols.ravel() + 0.5, rows.ravel() + 0.5]))
    centre = image.centre - np.array([X, Y, 0.0])
    low, high = np.array([-WIDE / 2, -WIDE / 2, GROUND]), np.array([WIDE / 2, WIDE / 2, GROUND + TALL])
    enters, far = through_box(centre, rays, low, high)
    near = enters.max(axis=0)
    hit = (near < far) & (near > 0)
    colours = np.tile(np.array(GRASS), (len(rays), 1))
    xyz = centre + near[hit, None] * rays[hit]
    colours[hit] = true_colours(xyz)
    colours[np.flatnonzero(hit)[xyz[:, 2] < GROUND + hedge_m]] = GRASS
    values = np.clip(np.rint(gain * colours), 0, 255).reshape(camera.height, camera.width, 3)
    return ColourImage(image, ArrayPixels(values.astype(np.uint8)))


def seen_from(south_m: float, east_m: float, high_m: float, name: str) -> OrientedImage:
    return looking(np.array([east_m, -south_m, GROUND + high_m]), np.array([0.0, 0.0, GROUND + 3.0]), SMALL, name)


def textured(
    images: Sequence[ColourImage], heights: FloatArray | None = None, wall_sigma_m: float = 0.1
) -> TexturedUnit:
    grid, level = surface(0.5)
    around = Surroundings([solid()], [], level if heights is None else heights, grid, wall_sigma_m)
    return texture_unit(planes(), images, around, TextureParameters())


def planes() -> list[FacePlane]:
    return list(face_planes(solid(), None))


def errors(made: TexturedUnit, key: FaceKey, of: int | None = None) -> FloatArray:
    """(N,) CIEDE2000 of the pixels of a face that images have painted, or that were made up (`of` INTERPOLATED)."""
    patch = next(p for p in made.texture.rectified if p.key == key)
    face = next(f for f in planes() if f.key == key)
    chosen = inner(patch) & (patch.index >= FIRST_IMAGE if of is None else patch.index == of)
    row, col = np.nonzero(chosen)
    corner, cell = patch.corners[0], front_cell(patch, face)
    st = face.on_plane(face.rings[0][:1])[0] + (np.column_stack([col, row]) + 0.5 - corner[0, :2]) * [cell, -cell]
    truth = true_colours(face.world(st) - np.array([X, Y, 0.0]))
    return _delta_e(patch.pixels[chosen].astype(float), truth)


def _delta_e(one: FloatArray, two: FloatArray) -> FloatArray:
    """(N,) CIEDE2000 between (N, 3) colours, 0 to 255."""
    return np.asarray(deltaE_ciede2000(rgb2lab(one / 255), rgb2lab(two / 255)))


def inner(patch: Patch) -> BoolArray:
    """Pixels of the face well away from its rim."""
    rows, cols = patch.mask.shape
    found = np.zeros((rows, cols), bool)
    found[6:-6, 6:-6] = patch.mask[6:-6, 6:-6]
    return found


def front_cell(patch: Patch, face: FacePlane) -> float:
    st, px = face.on_plane(face.rings[0]), patch.corners[0][:, :2]
    return float(np.ptp(st[:, 0]) / np.ptp(px[:, 0]))


def sides() -> dict[str, OrientedImage]:
    """The finest image of the south wall, two others of it, and one each of the other walls."""
    return {
        "finest": seen_from(26.0, 0.0, 18.0, "finest"),
        "left": seen_from(30.0, -14.0, 24.0, "left"),
        "right": seen_from(30.0, 14.0, 24.0, "right"),
        "east": looking(np.array([32.0, -6.0, GROUND + 24.0]), np.array([0.0, 0.0, GROUND + 3.0]), SMALL, "east"),
        "west": looking(np.array([-32.0, -6.0, GROUND + 24.0]), np.array([0.0, 0.0, GROUND + 3.0]), SMALL, "west"),
    }


def photographed(gains: Mapping[str, float]) -> list[ColourImage]:
    return [shot(image, gains.get(name, 1.0)) for name, image in sides().items()]


def test_images_that_are_exposed_alike_stay_as_they_are() -> None:
    """Some images share nothing but the plain roof with the finest one, which tells no contrast: a line through its rim put the wall off by 3.9."""
    made = textured(photographed({}))
    for wall in (SOUTH, ("solid", 3), ("solid", 5)):
        assert np.median(errors(made, wall)) < 0.5


@pytest.mark.parametrize("seed", [1, 2])
def test_noise_is_no_difference_of_exposure(seed: int) -> None:
    rng = np.random.default_rng(seed)
    images = []
    for clean in photographed({}):
        values = clean.pixels.window((0, SMALL.height), (0, SMALL.width), 0) + rng.normal(
            0, 3, (SMALL.height, SMALL.width, 3)
        )
        images.append(ColourImage(clean.image, ArrayPixels(np.clip(np.rint(values), 0, 255).astype(np.uint8))))
    patch = next(p for p in textured(images).texture.rectified if p.key == SOUTH)
    wall = inner(patch) & (np.abs(patch.pixels.astype(float) - WALL) < 20).all(axis=2)
    assert np.median(patch.pixels[wall], axis=0) == pytest.approx(WALL, abs=4.0)


def test_a_burnt_out_image_and_a_dark_one_leave_the_wall_as_it_is() -> None:
    """The finest image of the wall is burnt out, of the others one is darker by half: without looking at what is burnt the wall was 20 off."""
    made = textured(photographed({"finest": 1.9, "left": 0.5}))
    found = errors(made, SOUTH)
    assert np.median(found) < 1.5
    assert np.percentile(found, 90) < 4.0
    pixels = next(p for p in made.texture.rectified if p.key == SOUTH)
    assert (pixels.pixels[inner(pixels)].min(axis=1) >= 250).mean() < 0.001, "nothing is white"


def test_bright_walls_that_the_balance_lifts_beyond_white_stay_below_it() -> None:
    """All photographs are below white, the survey's balance makes them brighter by 40 %, and its shoulder ends where the wall does."""
    ends = 1.4 * max(WALL) / 255
    lifted = [replace(image, gain=(1.4,), shoulder=(ends - 0.97) / ends**2) for image in photographed({})]
    patch = next(p for p in textured(lifted).texture.rectified if p.key == SOUTH)
    wall = inner(patch) & (patch.index >= FIRST_IMAGE)
    assert (patch.pixels[wall].max(axis=1) == 255).mean() < 0.01
    # as coloured as the paint, which 1.4 times as bright would be red beyond white
    assert np.median(patch.pixels[wall] / patch.pixels[wall].max(axis=1, keepdims=True), axis=0) == pytest.approx(
        np.array(WALL) / max(WALL), abs=0.02
    )


def test_a_wall_that_is_seen_only_from_steeply_above_has_the_colour_of_the_others() -> None:
    """Its place is known to 0.35 m, so that the picture may be of the grass before it; well known, it is taken from the same photograph."""
    above = looking(np.array([0.0, WIDE / 2 + 4.0, GROUND + 46.0]), np.array([0.0, 0.0, GROUND + 3.0]), SMALL, "above")
    images = [*photographed({}), shot(above)]
    plain = textured(images, wall_sigma_m=0.35).texture.plain
    assert plain[NORTH].reason == DOUBTFUL
    assert _delta_e(np.array([plain[NORTH].colour], float), np.array([WALL]))[0] < 4.0
    assert set(plain) == {NORTH}
    assert not textured(images, wall_sigma_m=0.01).texture.plain


def test_what_is_white_in_all_images_stays() -> None:
    made = textured(photographed(dict.fromkeys(sides(), 1.9)))
    patch = next(p for p in made.texture.rectified if p.key == SOUTH)
    assert (patch.index[inner(patch)] >= FIRST_IMAGE).mean() > 0.95


def test_a_root_of_more_contrast_stretches_nothing_beyond_white() -> None:
    """Of six images the one with most pixels has twice the contrast of the others: these stay as they are, and it becomes like them."""
    rng = np.random.default_rng(2)
    truth = rng.uniform(40, 215, (500, 3))
    colours = np.stack([truth + rng.normal(0, 2, truth.shape) for _ in range(6)]).astype(np.float32)
    colours[0] = 2.0 * truth - 120.0
    colours[0][(colours[0] < 0).any(axis=1) | (colours[0] > 250).any(axis=1)] = np.nan
    models = balance([FaceSamples(tuple(range(6)), colours, np.array([900.0, *[500.0] * 5]))])
    for value in (45.0, 110.0, 215.0):
        grey = np.full((1, 3), value, np.float32)
        for image in range(1, 6):
            assert models[image].applied(grey)[0] == pytest.approx([value] * 3, abs=5.0)
        assert models[0].applied(2.0 * grey - 120.0)[0] == pytest.approx([value] * 3, abs=8.0)


def behind_a_hedge() -> tuple[Grid, FloatArray]:
    """The surface with a hedge of half the walls' height close around the house."""
    grid, heights = surface(0.5)
    x, y = np.meshgrid(grid.x_centres() - X, grid.y_centres() - Y)
    away = np.maximum(np.abs(x), np.abs(y)) - WIDE / 2
    return grid, np.where((away > 0.3) & (away < 2.5), GROUND + HEDGE_M - 1.0, heights)


def test_what_no_image_sees_of_a_wall_is_plain_and_not_grass() -> None:
    """The hedge in the pictures is higher than that of the surface, so that its colour is the last that images show above what is hidden."""
    images = [shot(image, hedge_m=HEDGE_M) for image in sides().values()]
    made = textured(images, behind_a_hedge()[1])
    hidden = errors(made, SOUTH, INTERPOLATED)
    assert len(hidden) > 300
    patch = next(p for p in made.texture.rectified if p.key == SOUTH)
    row, _ = np.nonzero(inner(patch) & (patch.index == INTERPOLATED))
    lowest = row > np.percentile(row, 50)
    assert np.median(hidden[lowest]) < 8.0
    assert _delta_e(np.array([GRASS]), np.array([WALL]))[0] > 25.0


def test_a_wall_nobody_saw_has_the_colour_of_the_others() -> None:
    made = textured([shot(image, hedge_m=1.5) for name, image in sides().items() if name != "finest"])
    plain = made.texture.plain[NORTH]
    assert _delta_e(np.array([plain.colour], float), np.array([WALL]))[0] < 4.0


def test_own_and_common_colours_by_hand() -> None:
    def wall(*cells: tuple[float, float, float]) -> FaceSamples:
        return FaceSamples((0,), np.array([cells], np.float32), np.array([float(len(cells))]))

    white, dark, green = (200.0, 200.0, 190.0), (60.0, 60.0, 70.0), (80.0, 120.0, 60.0)
    doubled = {0: LinearModel(np.full(3, 0.5), np.zeros(3))}
    walls = [
        (SOUTH, wall(*[white] * 30, *[green] * 40), 0.5, 10.0),
        (NORTH, wall(*[dark] * 30), 1.0, 20.0),
        (("solid", 3), wall(*[green] * 30), 0.5, 10.0),
        (("solid", 5), wall(*[white] * 30), 0.05, 10.0),
    ]
    found = WallColours(walls, {})
    assert found.of(SOUTH) == (200, 200, 190)
    assert found.of(NORTH) == (60, 60, 70) == found.common
    assert found.of(("solid", 3)) == found.common, "plants are no wall"
    assert found.of(("solid", 5)) == found.common, "a rim is no wall"
    assert WallColours(walls, doubled).of(SOUTH) == (100, 100, 95)
    assert WallColours(walls[2:3], {}).of(("solid", 3)) == (80, 120, 60), "a green house"
    assert WallColours([], {}).of(SOUTH) is None
