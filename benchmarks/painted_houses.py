"""Textures of painted houses of random sizes, colours and cameras, against their paint (CIEDE2000).

    python benchmarks/painted_houses.py --seeds 101 113 [--kinds alike mild spoilt hedge bright steep]

Photographs have noise of 2 values, cameras are off by 3 cm. Kinds of surveys:

- alike: all exposed alike; mild: by factors that differ by 6 %; spoilt: one burnt out (1.9), one dark (0.5);
- hedge: plants of 1 to 4 m hide the foot of the walls, and the surface knows them;
- bright: a roof near white that no photograph cuts off, and a balance that lifts all of them by 15 % or so, with the tone that a survey of them has; against
  the paint in that tone, after a gain per house;
- steep: roofs stand out 0.3 m, walls are modelled below their rims, and those to the north are seen from steeply above alone;
- moved: the whole house is smaller or larger than its model by what the walls' standard deviation says, on ground of changing colour, seen as in `steep`.

Each kind gives, over houses, the median and the greatest of the houses' medians, means and 90th percentiles, of all that images painted; `hedge` of what no
image sees, `steep` and `moved` of the walls that are seen steeply alone; `others` are the medians of all other pixels. White is the share of painted pixels
that is cut off in some band where no photograph is.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from shapely import LineString
from skimage.color import deltaE_ciede2000, rgb2lab

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import OUTLINE_SIGMA_M, OutlineEdge, Semantic
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.pixels import ArrayPixels
from cityflow.core.texture import FIRST_IMAGE, INTERPOLATED, FacePlane, Patch
from cityflow.imagery.colour_samples import PointColours, SampleParameters
from cityflow.imagery.highlights import Tone, tone
from cityflow.imagery.radiometry import Balance
from cityflow.texture.doubtful import wall_sigma
from cityflow.texture.planes import face_planes
from cityflow.texture.unit import Surroundings, TexturedUnit, TextureParameters, texture_unit
from texture_scenes import GROUND, X, Y, house, looking, raised, surface

KINDS = ("alike", "mild", "spoilt", "hedge", "bright", "steep", "moved")
STEEP = ("steep", "moved")
SMALL = Camera(420, 280, 560.0, 560.0, 210.0, 140.0)
EAVES_M = 0.3
MOVED_M = 0.25
"""Standard deviation of walls that were found in images, metres."""
LIFT = 1.15
"""By which the balance makes near white roofs brighter."""
CUT_OFF = 255


@dataclass(frozen=True)
class House:
    """A box with stripes every two metres on its walls; `inset_m` of its walls inside the rim of its flat roof, hedges up to `hedge_m`; `moved_m` of all of it
    inside its model; colours of the ground change by a share of `patchy`, standard deviation."""

    wide: float
    tall: float
    wall: tuple[float, float, float]
    stripe: tuple[float, float, float]
    roof: tuple[float, float, float]
    grass: tuple[float, float, float]
    inset_m: float = 0.0
    hedge_m: float = 0.0
    moved_m: float = 0.0
    patchy: float = 0.0

    def faces(self) -> list[FacePlane]:
        half = self.wide / 2
        return list(face_planes(house(-half, -half, self.wide, self.wide, self.tall), None))

    def paint(self, xyz: FloatArray) -> FloatArray:
        """(N, 3) of places on the model, metres from the scene's corner."""
        out = np.tile(np.array(self.wall), (len(xyz), 1))
        along = np.where(np.abs(np.abs(xyz[:, 1]) - self.wide / 2) < 1e-3, xyz[:, 0], xyz[:, 1])
        out[np.mod(along, 2.0) < 0.5] = self.stripe
        out[xyz[:, 2] > GROUND + self.tall - 1e-3] = self.roof
        return out

    def seen(self, image: OrientedImage) -> FloatArray:
        """(rows, cols, 3) what a perfect photograph shows."""
        camera = image.camera
        rows, cols = np.mgrid[0 : camera.height, 0 : camera.width]
        rays = image.rays(np.column_stack([cols.ravel() + 0.5, rows.ravel() + 0.5]))
        centre = image.centre - np.array([X, Y, 0.0])
        ground = centre + ((GROUND - centre[2]) / rays[:, 2])[:, None] * rays
        colours = np.array(self.grass) * (1.0 + self.patchy * _patches(ground))[:, None]
        half = self.wide / 2 - self.inset_m - self.moved_m
        low, high = np.array([-half, -half, GROUND]), np.array([half, half, GROUND + self.tall])
        with np.errstate(divide="ignore", invalid="ignore"):
            one, two = (low - centre) / rays, (high - centre) / rays
            near, far = np.minimum(one, two).max(axis=1), np.maximum(one, two).min(axis=1)
            down = (GROUND + self.tall - centre[2]) / rays[:, 2]
        hit = (near < far) & (near > 0)
        at = centre + near[hit, None] * rays[hit]
        walls = at.copy()
        # stripes are painted where the model has its walls
        sides = np.abs(np.abs(at[:, :2]) - half) < 1e-6
        walls[:, :2] = np.where(sides, np.sign(at[:, :2]) * self.wide / 2, at[:, :2])
        colours[hit] = np.where((at[:, 2] < GROUND + self.hedge_m)[:, None], np.array(self.grass), self.paint(walls))
        on_roof = (np.abs((centre + down[:, None] * rays)[:, :2]) < self.wide / 2 - self.moved_m).all(axis=1) & (
            down > 0
        )
        colours[on_roof] = self.roof
        return colours.reshape(camera.height, camera.width, 3)


def _patches(at: FloatArray) -> FloatArray:
    """(N,) normal values, alike within squares of 0.3 m."""
    square = np.mod(np.floor(at[:, :2] / 0.3), 64).astype(np.int64)
    values: FloatArray = np.random.default_rng(0).normal(size=(64, 64))
    return np.asarray(values[square[:, 1], square[:, 0]])


@dataclass(frozen=True)
class Found:
    """Of one house: median, mean and 90th percentile of CIEDE2000, and the share that became white."""

    median: float
    mean: float
    worse: float
    white: float
    others: float = np.nan


def drawn(seed: int, kind: str) -> tuple[np.random.Generator, House, list[OrientedImage]]:
    """A house and its cameras."""
    rng = np.random.default_rng(seed)
    wide, tall = float(rng.uniform(8, 16)), float(rng.uniform(5, 12))
    wall, stripe, roof, grass = (tuple(rng.uniform(low, high, 3)) for low, high in ((90, 205), (40, 200), (50, 170), (30, 140)))  # fmt: skip
    number = int(rng.integers(5, 11))
    angles = rng.permutation(number) * 2 * np.pi / number + rng.uniform(0, 1)
    centres = []
    for angle in angles:
        away, high = rng.uniform(24, 36), rng.uniform(14, 30)
        centres.append(np.array([away * np.cos(angle), away * np.sin(angle), GROUND + high]))
    made = House(wide, tall, wall, stripe, roof, grass)
    if kind == "bright":
        made = replace(made, roof=tuple(rng.uniform(215, 240, 3)))
    if kind == "hedge":
        made = replace(made, hedge_m=float(rng.uniform(1, 4)), grass=(70.0, 130.0, 45.0))
    if kind == "moved":
        made = replace(made, moved_m=float(rng.normal(0, MOVED_M)), patchy=0.15)
    if kind == "steep":
        made = replace(made, inset_m=EAVES_M, grass=(70.0, 130.0, 45.0))
    if kind in STEEP:
        centres = [np.array([c[0], -abs(c[1]), c[2]]) for c in centres]
        near, far = (2, 6) if kind == "steep" else (8, 20)
        centres += [np.array([rng.uniform(-4, 4), wide / 2 + rng.uniform(near, far), GROUND + tall + rng.uniform(36, 48)]) for _ in range(3)]  # fmt: skip
    return rng, made, [looking(c, np.array([0, 0, GROUND + 3.0]), SMALL, f"i{k}") for k, c in enumerate(centres)]


def photograph(made: House, image: OrientedImage, gain: float, rng: np.random.Generator) -> ColourImage:
    moved = replace(image, centre=image.centre + rng.normal(0, 0.03, 3))
    values = gain * np.clip(np.rint(made.seen(moved)), 0, 255) + rng.normal(0, 2, (SMALL.height, SMALL.width, 3))
    return ColourImage(image, ArrayPixels(np.clip(np.rint(values), 0, 255).astype(np.uint8)))


def survey(made: House, images: list[OrientedImage], kind: str, rng: np.random.Generator) -> list[ColourImage]:
    gains = np.ones(len(images))
    if kind == "spoilt":
        gains[rng.permutation(len(images))[:2]] = 1.9, 0.5
    if kind == "mild":
        gains = np.exp(rng.normal(0, 0.06, len(images)))
    if kind == "bright":
        gains = np.minimum(np.exp(rng.normal(-0.06, 0.06, len(images))), 1.0)
    shown = [photograph(made, image, g, rng) for image, g in zip(images, gains, strict=True)]
    if kind != "bright":
        return shown
    lifts = LIFT / gains * np.exp(rng.normal(0, 0.02, len(images)))
    last = tone_of(shown, lifts)
    return [
        replace(one, gain=(float(lift * last.gain),), shoulder=last.shoulder)
        for one, lift in zip(shown, lifts, strict=True)
    ]


def tone_of(shown: list[ColourImage], lifts: FloatArray) -> Tone:
    """As a catalog finds it, from every pixel."""
    none, one = np.empty(0, np.int64), np.ones((len(shown), 3))
    values = [np.maximum(s.pixels.window((0, SMALL.height), (0, SMALL.width), 0), 1).reshape(-1, 3) for s in shown]
    seen = [PointColours(np.arange(len(v)), np.log(v / 255.0), np.zeros(len(v)), none) for v in values]
    return tone(seen, Balance(lifts[:, None] * one, one, 0.0, 0.0, 0.0), SampleParameters().brightest_share)


def measured(seed: int, kind: str) -> Found:
    rng, made, images = drawn(seed, kind)
    grid, heights = surface(0.5)
    if made.hedge_m:
        x, y = np.meshgrid(grid.x_centres() - X, grid.y_centres() - Y)
        away = np.maximum(np.abs(x), np.abs(y)) - made.wide / 2
        heights = np.where((away > 0.3) & (away < 2.5), GROUND + 0.75 * made.hedge_m, heights)
    if made.moved_m:
        half = made.wide / 2 - made.moved_m
        heights = raised(grid, heights, (-half, -half, half, half), made.tall)
    half = made.wide / 2
    solid = house(-half, -half, made.wide, made.wide, made.tall)
    sigma_m = MOVED_M if kind == "moved" else OUTLINE_SIGMA_M
    rim = OutlineEdge(LineString([(-half, half), (half, half)]), "roof" if kind == "steep" else "wall", sigma_m)
    around = Surroundings([solid], [], heights, grid, wall_sigma([rim], OUTLINE_SIGMA_M))
    shown = survey(made, images, kind, rng)
    return _compared(made, texture_unit(made.faces(), shown, around, TextureParameters()), kind, shown[0].shoulder)


def _compared(made: House, unit: TexturedUnit, kind: str, shoulder: float) -> Found:
    """Plain faces count by the pixels of a grid of 5 cm, as others do."""
    patches = {p.key: p for p in unit.texture.rectified}
    shown, truth, made_up, north = [], [], [], []
    for face in made.faces():
        colours: NDArray[np.integer[Any]]
        index: NDArray[np.integer[Any]]
        if face.key in patches:
            st, colours, index = _pixels(patches[face.key], face)
        elif face.key in unit.texture.plain:
            s_0, t_0, s_1, t_1 = face.polygon.buffer(-0.3).bounds
            st = np.stack(np.meshgrid(np.arange(s_0, s_1, 0.05), np.arange(t_0, t_1, 0.05)), axis=-1).reshape(-1, 2)
            colours, index = np.tile(unit.texture.plain[face.key].colour, (len(st), 1)), np.full(len(st), INTERPOLATED)
        else:
            continue
        shown.append(colours.astype(float))
        paint = made.paint(face.world(st) - np.array([X, Y, 0.0]))
        truth.append(paint * (1.0 - shoulder * LIFT * paint.max(axis=1, keepdims=True) / 255.0))
        made_up.append(index == INTERPOLATED)
        north.append(np.full(len(st), face.semantic is Semantic.WALL and face.normal[1] > 0.7))
    return _errors(kind, np.concatenate(shown), np.concatenate(truth), np.concatenate(made_up), np.concatenate(north))


def _errors(kind: str, shown: FloatArray, truth: FloatArray, made_up: BoolArray, north: BoolArray) -> Found:
    white = float(((shown.max(axis=1) >= CUT_OFF) & ~made_up).sum() / max((~made_up).sum(), 1))
    if kind == "bright":
        shown = shown / np.median(shown / truth)
    errors = deltaE_ciede2000(rgb2lab(np.clip(shown, 0, 255) / 255), rgb2lab(truth / 255))
    chosen = made_up if kind == "hedge" else north if kind in STEEP else ~made_up
    if not chosen.any():
        return Found(np.nan, np.nan, np.nan, white)
    others = float(np.median(errors[~chosen])) if (~chosen).any() else np.nan
    own = errors[chosen]
    return Found(float(np.median(own)), float(own.mean()), float(np.percentile(own, 90)), white, others)


def _pixels(patch: Patch, face: FacePlane) -> tuple[FloatArray, NDArray[np.uint8], NDArray[np.uint16]]:
    """Places on the face, colours and index of its pixels, away from its rim."""
    inner = np.zeros(patch.mask.shape, bool)
    inner[6:-6, 6:-6] = patch.mask[6:-6, 6:-6] & ((patch.index[6:-6, 6:-6] >= FIRST_IMAGE) | (patch.index[6:-6, 6:-6] == INTERPOLATED))  # fmt: skip
    row, col = np.nonzero(inner)
    st, px = face.on_plane(face.rings[0]), patch.corners[0][:, :2]
    cell = float(np.ptp(st[:, 0]) / np.ptp(px[:, 0]))
    places = st[:1] + (np.column_stack([col, row]) + 0.5 - px[0]) * [cell, -cell]
    return places, patch.pixels[inner], patch.index[inner]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs=2, default=(101, 113), help="first, and one behind the last")
    parser.add_argument("--kinds", nargs="+", default=KINDS, choices=KINDS)
    asked = parser.parse_args()
    for kind in asked.kinds:
        found = [measured(seed, kind) for seed in range(*asked.seeds)]
        columns = {
            name: np.array([getattr(f, name) for f in found]) for name in ("median", "mean", "worse", "others", "white")
        }
        white = columns.pop("white").mean()
        told = [
            f"{n} {np.nanmedian(v):.2f} (most {np.nanmax(v):.2f})" for n, v in columns.items() if np.isfinite(v).any()
        ]
        print(f"{kind:7}", *told, f"white {white:.4f}", sep="  ", flush=True)


if __name__ == "__main__":
    main()
