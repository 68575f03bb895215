"""A star of images, read and tied to measure how far their poses contradict each other; for a check of a catalog and for a task of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from cityflow.adjustment.descriptor_matching import MatchingParameters
from cityflow.adjustment.features import FeatureParameters, Features, find_features
from cityflow.adjustment.guided_matching import guided_matches
from cityflow.adjustment.pair_check import agreeing
from cityflow.adjustment.relative_error import RelativeError, Systematic, combined, height_difference, parallax_of
from cityflow.core.arrays import IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.pixels import ArrayPixels, level_shape, reduced
from cityflow.errors import CityflowError
from cityflow.flow.typed import TaskInputs
from cityflow.handover.field_types import OrientedField
from cityflow.handover.source_file import SourceFile
from cityflow.io.catalog.stac_assets import ImageAsset
from cityflow.io.fetch import local_file
from cityflow.io.images.image_header import check_against, image_header
from cityflow.io.images.image_tiles import picture_strips
from cityflow.orientation.sights import looks_level
from cityflow.orientation.tie_pairs import PairParameters, star_sample
from cityflow.orientation.views import View, gsd

STARS, SHARE = 8, 8
"""Stars of a large flight; a small one has one for each so many images, so that a sample is never more than half of it. Set by hand, as are those below."""
FEWEST = 3
"""Images from the air below which there is nothing to adjust."""
PAIRS = PairParameters(alike=2, turned=1)
QUICK_PX, CAREFUL_PX = 1_500_000, 6_000_000
"""Pixels of an image in which points are looked for, by a check and before a run: coarser levels of larger images bound the time, and tell less."""
BOUND_PX = 12.0
"""A match lies this near to where poses have it, pixels of the image."""
LEAST_BOUND_PX = 5.0
"""And of its level."""
FEATURES, MATCHING = FeatureParameters(per_image=2500, least_px=100), MatchingParameters()
ROWS = 512
"""That are decoded at once."""


@dataclass(frozen=True, slots=True)
class StarImage(TaskInputs):
    """An image; lowest ground and highest object, metres; the value that is shown as white, 0 for the brightest in it."""

    file: SourceFile
    image: OrientedField
    heights: tuple[float, float]
    white: float


@dataclass(frozen=True, slots=True)
class Star(TaskInputs):
    """An image and its partners."""

    images: tuple[StarImage, ...]


class SeenImage(NamedTuple):
    """An image as a level of its pyramid has it, and its points there."""

    image: OrientedImage
    features: Features
    level: int


@dataclass(frozen=True, slots=True)
class StarTies:
    """What a star shows.

    Attributes
    ----------
    parallax : of the first image with each partner, pixels, None without ties; heights : of the first with two partners each, ground pixels
    unread : names of images that could not be read, with the reason
    """

    parallax: tuple[Systematic | None, ...]
    heights: tuple[Systematic | None, ...]
    unread: tuple[tuple[str, str], ...] = ()


def flown_of(assets: Sequence[ImageAsset]) -> tuple[ImageAsset, ...]:
    """Images from the air: those from the street are not tied to them."""
    return tuple(a for a in assets if not looks_level(a.oriented, a.heights[1]))


def stars_of(assets: Sequence[ImageAsset]) -> tuple[Star, ...]:
    """A sample of images over the survey and over look directions, with partners; the same for the same catalog."""
    views = [View(a.oriented, a.heights) for a in assets]
    most = min(max(len(views) // SHARE, 1), STARS)
    return tuple(Star(tuple(_star_image(assets[k]) for k in star)) for star in star_sample(views, most, PAIRS))


def star_ties(star: Star, most_px: int, *, checked: bool) -> StarTies:
    """Read the images of a star and measure their ties; who cannot be read is left out.

    Parameters
    ----------
    most_px : pixels of an image in which points are looked for
    checked : hold files against their checksums
    """
    known: dict[str, SeenImage] = {}
    unread = []
    for given in star.images:
        try:
            known[given.image.name] = points_of(given, most_px, checked=checked)
        except (CityflowError, OSError) as error:
            unread.append((given.image.name, str(error)))
    first, *others = star.images
    if first.image.name not in known:
        return StarTies((), (), tuple(unread))
    matches = [_matches(first, other, known) for other in others if other.image.name in known]
    own = known[first.image.name]
    seen = [known[o.image.name] for o in others if o.image.name in known]
    parallax, heights = [], []
    for theirs, found in zip(seen, matches, strict=True):
        part = parallax_of((own.image, theirs.image), (own.features.uv[found[:, 0]], theirs.features.uv[found[:, 1]]))
        parallax.append(_scaled(part, 2.0**theirs.level))
    for (one, a), (other, b) in pairwise(zip(seen, matches, strict=True)):
        both, i, j = np.intersect1d(a[:, 0], b[:, 0], return_indices=True)
        uv = own.features.uv[both], one.features.uv[a[i, 1]], other.features.uv[b[j, 1]]
        part = height_difference((own.image, one.image, other.image), uv)
        heights.append(_scaled(part, 1.0 / gsd(View(first.image, first.heights))))
    return StarTies(tuple(parallax), tuple(heights), tuple(unread))


def error_of(found: Sequence[StarTies]) -> RelativeError:
    """Of all stars of a sample."""
    return combined([p for s in found for p in s.parallax], [h for s in found for h in s.heights])


def _star_image(asset: ImageAsset) -> StarImage:
    white = asset.white or float(np.iinfo(asset.dtype).max)
    return StarImage(SourceFile(asset.href, asset.size, asset.checksum), asset.oriented, asset.heights, white)


def points_of(given: StarImage, most_px: int, *, checked: bool) -> SeenImage:
    """The image as a level of its pyramid has it, its points there, and the level. Raises CatalogError, OSError."""
    camera, level = given.image.camera, 0
    while np.prod(level_shape(camera.height, camera.width, level)) > most_px:
        level += 1
    with local_file(given.file.href) as path:
        if checked:
            given.file.refuse_other(path)
        check_against(image_header(path), camera)
        with picture_strips(path, ROWS) as picture:
            pixels = np.concatenate([reduced(strip, level) for _, strip in picture.strips])
    found = find_features(ArrayPixels(pixels), given.white or float(pixels.max()), FEATURES)
    return SeenImage(replace(given.image, camera=camera.reduced(level)), found, level)


def _matches(first: StarImage, other: StarImage, known: dict[str, SeenImage]) -> IntArray:
    """(N, 2) numbers of points of both that agree with one relative orientation."""
    one, two = known[first.image.name], known[other.image.name]
    heights = min(first.heights[0], other.heights[0]), max(first.heights[1], other.heights[1])
    bound = max(BOUND_PX / 2.0**two.level, LEAST_BOUND_PX)
    pair = one.image, two.image
    found = guided_matches(pair, (one.features, two.features), heights, bound, MATCHING)
    return found[agreeing(pair, (one.features.uv[found[:, 0]], two.features.uv[found[:, 1]]), bound)]


def _scaled(part: Systematic | None, factor: float) -> Systematic | None:
    return None if part is None else Systematic(part.square * factor**2, part.noise * factor, part.count)
