"""What textures of a synthetic town are judged in: its images as a run has them, its units as they truly are or as the run made them, and what rays meet."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.core.pixels import PixelArray, PixelsOf
from cityflow.core.texture import FaceKey, FacePlane, Patch
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.images.tiled_images import open_image
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.town import Town, make_town
from cityflow.texture.planes import face_planes
from cityflow.texture.ranking.field_of_view import in_frame
from cityflow.texture.unit import Surroundings, TexturedUnit, TextureParameters, texture_unit
from cityflow.texture.visibility.scene import Scene
from texture_visibility import BUILT, House, Truth, around, cut, run_houses, run_surface, true_houses, true_surface

NEAR_M = 0.25
"""A pixel shows what it lies on where that is no farther from the plane of the face; windows and doors are set back by up to 0.2 m."""
EAVES_M = 1.5
AROUND_M = 60.0
"""So much of the town around the surveyed area may stand before its houses."""
OFFSET = 8.0
"""Values of 0 to 255; of exposure errors, beside factors of light."""


@dataclass(frozen=True)
class World:
    """A survey, and its truth.

    Attributes
    ----------
    images : as the run opened and balanced them
    houses, surface : true, or those of the run
    true_hulls : which of these
    poses : true one of every image, by name; `images` have those that textures are made with
    """

    parameters: SynthParameters
    town: Town
    truth: Truth
    images: Sequence[ColourImage]
    houses: Sequence[House]
    surface: tuple[Grid, FloatArray]
    true_hulls: bool
    poses: Mapping[str, OrientedImage]

    @property
    def area(self) -> Bounds:
        return self.parameters.area


@dataclass(frozen=True)
class Done:
    """A unit with textures: its number among the houses, faces, the images that its index rasters count, and what was made of it."""

    number: int
    house: House
    faces: dict[FaceKey, FacePlane]
    images: Sequence[ColourImage]
    made: TexturedUnit

    def patches(self, name: str) -> dict[FaceKey, Patch]:
        texture = self.made.texture
        return {p.key: p for p in (texture.raw if name == "raw" else texture.rectified)}


def parameters_of(survey: Path) -> SynthParameters:
    return SynthParameters.model_validate(json.loads((survey / "synth.json").read_text())["parameters"])


def images_of(catalog: Path, run: Path) -> list[ColourImage]:
    """All images that a run ingested, with what its catalog says of their poses and balance."""
    found = []
    for a in read_catalog(catalog, allow_outside=True).images:
        file = next(iter(sorted((run / "work" / "ingest" / a.name).glob("*/image.tif"))), None)
        if file is not None:
            found.append(ColourImage(a.oriented, open_image(str(file)), a.gain, a.gamma, a.falloff, a.shoulder))
    return found


def worlds(asked: argparse.Namespace) -> list[World]:
    """With true hulls and surface, and with those of the run."""
    p = parameters_of(asked.survey)
    town = make_town(p.seed, p.whole_town)
    truth = Truth(town.mesh(grown(p.area, min(p.around_m, AROUND_M))))
    images = images_of(asked.catalog or asked.survey / "catalog", asked.run)
    poses = {image.name: image for image in p.images}
    found = []
    if "truth" in asked.geometry:
        surface = true_surface(town, grown(p.area, min(p.around_m, AROUND_M)), p.truth_cell_m)
        found.append(World(p, town, truth, images, true_houses(town), surface, True, poses))
    if "run" in asked.geometry:
        found.append(World(p, town, truth, images, run_houses(asked.run, town), run_surface(asked.run), False, poses))
    return found


def surroundings(world: World, number: int, p: TextureParameters) -> Surroundings:
    house = world.houses[number]
    grid, heights = cut(world.surface, grown(house.outline.bounds, p.halo_m))
    return Surroundings(house.all, around(world.houses, number, p.around_m), heights, grid)


def showing(house: House, images: Sequence[ColourImage], most: int) -> list[ColourImage]:
    """Images that have something of a house in their frame, the nearest ones, by name."""
    xyz = np.concatenate([s.vertices for s in house.all])
    near = [i for i in images if in_frame(i.image, xyz).any()]
    near.sort(key=lambda i: (float(np.linalg.norm(i.image.centre - xyz.mean(axis=0))), i.image.name))
    return sorted(near[:most], key=lambda i: i.image.name)


def textured(world: World, number: int, p: TextureParameters) -> Done:
    house = world.houses[number]
    faces = face_planes(*house.shells)
    images = showing(house, world.images, p.most_images)
    made = texture_unit(faces, images, surroundings(world, number, p), p)
    return Done(number, house, {f.key: f for f in faces}, images, made)


class Judge:
    """What images truly show of the faces of one unit."""

    def __init__(self, world: World, done: Done) -> None:
        self.world, self.done = world, done
        plan = shapely.buffer(done.house.outline, EAVES_M)
        shapely.prepare(plan)
        self.plan = plan
        near = surroundings(world, done.number, TextureParameters())
        self.models = Scene.of(np.full(near.grid.shape, np.nan), near.grid, near.own, near.others)

    def centre(self, image: int) -> FloatArray:
        return self.done.images[image].image.centre

    def sees(self, face: FacePlane):  # type: ignore[no-untyped-def]
        """Whether an image truly sees points of a face.

        With true hulls: nothing is between. With those of a run: no model is between, and what is there is built and near the face's plane.
        """

        def answer(image: int, xyz: FloatArray) -> BoolArray:
            seen = in_frame(self.done.images[image].image, xyz)
            towards = self.centre(image) - xyz
            seen &= towards @ face.normal > 0.05 * np.linalg.norm(towards, axis=1)
            if self.world.true_hulls:
                seen[seen] = self.world.truth.free(xyz[seen], face.normal, self.centre(image))
            else:
                seen[seen] = self.models.visible(xyz[seen], face.normal, self.centre(image))
                seen[seen] = self.own(face, NEAR_M)(image, xyz[seen])
            return seen

        return answer

    def own(self, face: FacePlane, near_m: float | None):  # type: ignore[no-untyped-def]
        """Whether the pixel of an image at a point shows what is built there: near the plane of the face, or anywhere of the house."""

        def answer(image: int, xyz: FloatArray) -> BoolArray:
            part, unit, met = self._met(image, xyz)
            built = np.isin(part, [int(p) for p in BUILT])
            built[built] = shapely.contains_xy(self.plan, *met[built, :2].T)
            if near_m is None:
                return np.asarray(built & (self._of_house(unit, met)))
            return np.asarray(built & (np.abs((met - face.origin) @ face.normal) <= near_m))

        return answer

    def _met(self, image: int, xyz: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]:
        truth, given = self.world.truth, self.done.images[image].image
        true = self.world.poses[given.name]
        centre = true.centre
        rays = true.rays(given.project(xyz)[0])
        triangle, length = truth.scene.first_hits(centre - truth.scene.origin, rays)
        none = triangle < 0
        part = np.where(none, 255, truth.mesh.part[triangle]).astype(np.int64)
        unit = np.where(none, -1, truth.mesh.unit[triangle]).astype(np.int64)
        return part, unit, centre + np.where(none, 1.0, length)[:, None] * rays

    def _of_house(self, unit: NDArray[np.int64], met: FloatArray) -> BoolArray:
        """Triangles of the true unit, or, as a house of the run may be several of them, within its walls."""
        near = shapely.contains_xy(shapely.buffer(self.done.house.outline, 0.3), met[:, 0], met[:, 1])
        return np.asarray((unit == self.done.house.index) | near)

    def parts(self, image: int, xyz: FloatArray) -> NDArray[np.int64]:
        """What else the image shows there."""
        return self._met(image, xyz)[0]


def part_name(part: int) -> str:
    return Part(part).name.lower() if part in set(Part) else "nothing"


@dataclass(frozen=True)
class Misexposed(PixelsOf):
    """An image that was exposed otherwise: its light times a factor, and an offset that haze or the file's maker left, cut off at white as sensors do."""

    factor: float
    offset: float

    def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int = 0) -> PixelArray:
        c = self.pixels.window(rows, cols, level).astype(np.float32) / 255.0
        light = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4) * self.factor
        tone = np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)
        return np.clip(np.rint(np.clip(tone, 0, 1) * 255.0 + self.offset), 0, 255).astype(np.uint8)


def misexposed(images: Sequence[ColourImage], seed: int) -> list[ColourImage]:
    """Every image by a factor of its own, 0.25 to 4, and an offset."""
    rng = np.random.default_rng(seed)
    found = []
    for image in images:
        factor, offset = float(2.0 ** rng.uniform(-2, 2)), float(rng.uniform(-OFFSET, OFFSET))
        found.append(replace(image, pixels=Misexposed(image.pixels, factor, offset)))
    return found


def colours_off(patch: Patch, reference: Patch, gain: FloatArray, offset: FloatArray) -> Float32Array:
    """(rows, cols, 3) how much a patch differs from that of images exposed alike, which has the same pixels, once the house's own exposure is taken out."""
    return (patch.pixels * gain + offset - reference.pixels).astype(np.float32)
