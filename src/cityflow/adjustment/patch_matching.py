"""Where pictures show the patches of a scan: moved along the normal until the pictures agree, then each picture shifted onto all (least squares matching)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from cityflow.adjustment.survey_patches import Heights, Kind, Patches, axes_of
from cityflow.adjustment.tracks import Ties
from cityflow.core.arrays import Float32Array, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.pixels import Pixels

CELLS = 15
"""Of a patch along its edge; set by hand, as are those below."""
OFFSETS = 0.4 * np.arange(-15, 16)
"""Along the normal, in cells."""
LEAST_LIKE, LEAST_SHIFTED = 0.6, 0.7
"""Two pictures of a patch that correlate by less show different things; and a picture and the mean of all after the shift."""
LEAST_CONTRAST = 0.008
"""Standard deviation of grey values, share of white: less is no texture."""
LEAST_RAD, MOST_RAD = np.radians((12.0, 75.0))
"""Rays of two pictures that are compared meet at such angles."""
MOST_PICTURES, FEWEST = 48, 3
"""Pictures of a patch, the most upright ones; with fewer it is not used."""
SHIFTS, MOST_SHIFT, ONE_SHIFT = 4, 2.0, 0.5
"""Steps of the shift; in cells at most in all, and in one."""
SOLVABLE = 100.0
"""Condition of its equations at most: an edge alone leaves it open."""
MARGIN_PX = 2


@dataclass(frozen=True, slots=True)
class Crop:
    """What an image shows around a patch: grey values, place of their first pixel and their size in pixels of the image."""

    grey: Float32Array
    first: FloatArray
    size: float

    def at(self, uv: FloatArray) -> FloatArray:
        """Grey values at (..., 2) image coordinates."""
        col, row = np.moveaxis((uv - self.first) / self.size - 0.5, -1, 0)
        return np.asarray(map_coordinates(self.grey, [row, col], order=1, mode="nearest"), np.float64)


@dataclass(frozen=True, slots=True)
class Sides:
    """Sides of patches, walls with both.

    Attributes
    ----------
    patch : (S,) number of the patch;  xyz, normals : (S, 3) middles, metres; unit normals towards the pictures
    kind : (S,) `Kind`
    seen : (V, 2) side and picture that is looked at, by side, pictures ascending
    """

    patch: IntArray
    xyz: FloatArray
    normals: FloatArray
    kind: IntArray
    seen: IntArray

    def __len__(self) -> int:
        return len(self.patch)

    def of(self, picture: int) -> IntArray:
        """Numbers of the sides that a picture is looked at for."""
        return self.seen[self.seen[:, 1] == picture, 0]


@dataclass(frozen=True, slots=True)
class PatchTies:
    """Tie points on patches: `ties` of points 0 to P - 1, (P,) numbers of their sides."""

    ties: Ties
    side: IntArray


def sides_of(patches: Patches, heights: Heights, images: Sequence[OrientedImage]) -> Sides:
    """Sides of patches, and which images are looked at for each: the most upright ones of those that see it.

    Parameters
    ----------
    heights : of the scan
    images : in its frame
    """
    centres = np.array([i.centre for i in images])
    both = [
        (k, sign) for k in range(len(patches.xyz)) for sign in ((1.0, -1.0) if patches.kind[k] == Kind.WALL else (1.0,))
    ]
    patch = np.array([k for k, _ in both], np.int64)
    normals = np.array([sign * patches.normals[k] for k, sign in both]).reshape(-1, 3)
    xyz, seen = patches.xyz[patch], []
    for k in range(len(both)):
        some = np.flatnonzero(heights.sees(xyz[k], normals[k], centres))
        ray = centres[some] - xyz[k]
        upright = ray @ normals[k] / np.linalg.norm(ray, axis=1)
        chosen = np.sort(some[np.argsort(-upright, kind="stable")[:MOST_PICTURES]])
        seen.append(np.column_stack([np.full(len(chosen), k), chosen]))
    table = np.concatenate(seen) if seen else np.empty((0, 2))
    return Sides(patch, xyz, normals, patches.kind[patch], table.astype(np.int64))


def crops_of(
    sides: Sides, wanted: IntArray, image: OrientedImage, pixels: Pixels, white: float, cell_m: float
) -> dict[int, Crop]:
    """What an image shows around the wanted sides, by number of the side; sides that are not wholly in its frame are left out.

    Parameters
    ----------
    image : in the scan's frame, off by less than half a patch
    white : the pixels' value that is shown as white;  cell_m : of patches, metres
    """
    found = {}
    for k in wanted.tolist():
        crop = _crop(image, pixels, white, _Side.of(sides, k).swept(cell_m), cell_m)
        if crop is not None:
            found[k] = crop
    return found


def patch_ties(
    sides: Sides, crops: Sequence[Mapping[int, Crop]], images: Sequence[OrientedImage], cell_m: float
) -> PatchTies:
    """Find patches in pictures; of a wall's two sides, the one that more pictures agree on.

    Parameters
    ----------
    crops : of each image, by side
    """
    pictures: list[dict[int, Crop]] = [{} for _ in range(len(sides))]
    for number, own in enumerate(crops):
        for k, crop in own.items():
            pictures[k][number] = crop
    best: dict[int, tuple[float, IntArray, FloatArray, int]] = {}
    for k, shown in enumerate(pictures):
        found, patch = _found(_Side.of(sides, k), shown, images, cell_m), int(sides.patch[k])
        if found is not None and (patch not in best or found[0] > best[patch][0]):
            best[patch] = (*found, k)
    chosen = [best[patch] for patch in sorted(best)]
    point = np.repeat(np.arange(len(chosen)), [len(each[1]) for each in chosen])
    picture = np.concatenate([each[1] for each in chosen]) if chosen else np.empty(0, np.int64)
    uv = np.concatenate([each[2] for each in chosen]) if chosen else np.empty((0, 2))
    ties = Ties(point, picture, np.full(len(point), -1), uv, np.ones(len(point)))
    return PatchTies(ties, np.array([each[3] for each in chosen], np.int64))


@dataclass(frozen=True, slots=True)
class _Side:
    """One side of a patch."""

    place: FloatArray
    normal: FloatArray

    @classmethod
    def of(cls, sides: Sides, number: int) -> _Side:
        return cls(sides.xyz[number], sides.normals[number])

    def grid(self, cell_m: float) -> FloatArray:
        """(CELLS², 3) places of the patch."""
        along, across = axes_of(self.normal)
        step = (np.arange(CELLS) - (CELLS - 1) / 2) * cell_m
        return np.asarray((self.place + step[None, :, None] * along + step[:, None, None] * across).reshape(-1, 3))

    def swept(self, cell_m: float) -> FloatArray:
        """(O, CELLS², 3) the same at all offsets."""
        return np.asarray(self.grid(cell_m) + (OFFSETS * cell_m)[:, None, None] * self.normal)


def _crop(image: OrientedImage, pixels: Pixels, white: float, places: FloatArray, cell_m: float) -> Crop | None:
    """What an image shows of some places, at the level of its pyramid whose pixels are nearest to a cell; None: not all of them."""
    uv, depth = image.project(places.reshape(-1, 3))
    if (depth <= 0).any() or not image.holds(uv, 2 * MARGIN_PX).all():
        return None
    pixel_m = float(np.median(depth)) / float(np.sqrt(image.camera.fx * image.camera.fy))
    level = max(int(np.floor(np.log2(max(cell_m / pixel_m, 1.0)))), 0)
    size = 1 << level
    low = np.maximum(np.floor(uv.min(axis=0) / size).astype(int) - MARGIN_PX, 0)
    shape = -(-pixels.width // size), -(-pixels.height // size)
    high = np.minimum(np.ceil(uv.max(axis=0) / size).astype(int) + MARGIN_PX, shape)
    part = pixels.window((int(low[1]), int(high[1])), (int(low[0]), int(high[0])), level)
    grey = part[..., :3].astype(np.float32).mean(axis=2) / np.float32(white)
    return Crop(np.asarray(grey, np.float32), low * float(size), float(size))


def _found(
    side: _Side, crops: Mapping[int, Crop], images: Sequence[OrientedImage], cell_m: float
) -> tuple[float, IntArray, FloatArray] | None:
    """How well pictures agree on one side of a patch, which do, and where they show its middle."""
    places, numbers, values = side.swept(cell_m), [], []
    for number, crop in crops.items():
        uv = images[number].project(places.reshape(-1, 3))[0].reshape(*places.shape[:2], 2)
        grey = crop.at(uv)
        if grey[len(OFFSETS) // 2].std() >= LEAST_CONTRAST:
            numbers.append(number)
            values.append(_normed(grey))
    if len(numbers) < FEWEST:
        return None
    table, count = np.array(values), len(numbers)
    alike = np.einsum("ioc,joc->ijo", table, table) / table.shape[2]
    rays = np.array([images[k].centre for k in numbers]) - side.place
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    angle = np.arccos(np.clip(rays @ rays.T, -1.0, 1.0))
    fit = (angle >= LEAST_RAD) & (angle <= MOST_RAD) & (alike.max(axis=2) >= LEAST_LIKE)
    fit &= np.arange(count)[:, None] < np.arange(count)
    if not fit.any():
        return None
    total = alike[fit].mean(axis=0)
    best = int(total.argmax())
    if best in (0, len(OFFSETS) - 1) or total[best] < LEAST_LIKE:
        return None
    before, peak, after = total[best - 1 : best + 2]
    more = 0.5 * (before - after) / (before - 2 * peak + after)
    offset = (OFFSETS[best] + more * (OFFSETS[1] - OFFSETS[0])) * cell_m
    agree = ((fit | fit.T) & (alike[:, :, best] >= LEAST_LIKE)).any(axis=1)
    kept = [numbers[k] for k in np.flatnonzero(agree)]
    shifted = _shifted(side, offset, kept, crops, images, cell_m) if len(kept) >= FEWEST else None
    return None if shifted is None else (float(fit.sum() * total[best]), *shifted)


def _shifted(
    side: _Side, offset: float, numbers: list[int], crops: Mapping[int, Crop], images: Sequence[OrientedImage], cell_m: float
) -> tuple[IntArray, FloatArray] | None:  # fmt: skip
    """Numbers of the pictures that agree, and (K, 2) where they show the middle, each shifted onto the median of all."""
    away = offset * side.normal
    grid, middle = side.grid(cell_m) + away, side.place + away
    axes = np.array(axes_of(side.normal))
    about = np.concatenate([middle[None], middle + 0.5 * cell_m * axes, middle - 0.5 * cell_m * axes])
    uv = [images[k].project(grid)[0] for k in numbers]
    shown = np.array([images[k].project(about)[0] for k in numbers])
    # pixels per cell along both axes of the patch
    slope = np.swapaxes(shown[:, 1:3] - shown[:, 3:5], 1, 2)
    shift = np.zeros((len(numbers), 2))
    for _ in range(SHIFTS):
        values = np.array([_normed(crops[k].at(uv[i] + slope[i] @ shift[i])) for i, k in enumerate(numbers)])
        mean = np.median(values, axis=0)
        down, right = np.gradient(mean.reshape(CELLS, CELLS))
        design = np.column_stack([right.reshape(-1), down.reshape(-1)])
        normal = design.T @ design
        if np.linalg.cond(normal) > SOLVABLE:
            return None
        shift += np.clip(np.linalg.solve(normal, design.T @ (mean - values).T).T, -ONE_SHIFT, ONE_SHIFT)
        shift -= np.median(shift, axis=0)
    like = (values * mean).mean(axis=1) / max(float(mean.std()), 1e-6)
    good = np.flatnonzero((like >= LEAST_SHIFTED) & (np.abs(shift).max(axis=1) < MOST_SHIFT))
    if len(good) < FEWEST:
        return None
    places = shown[good, 0] + np.einsum("kij,kj->ki", slope[good], shift[good])
    return np.array(numbers, np.int64)[good], places


def _normed(grey: FloatArray) -> FloatArray:
    """Grey values of (..., CELLS²) patches with mean 0 and standard deviation 1."""
    spread = np.maximum(grey.std(axis=-1, keepdims=True), 1e-6)
    return np.asarray((grey - grey.mean(axis=-1, keepdims=True)) / spread)
