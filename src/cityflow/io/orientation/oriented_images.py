"""Result of every reader of orientations: oriented images, sparse points, unusable images."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage

Sizes = Mapping[str, tuple[int, int]]
"""Image file, relative to the folder of images → width, height in pixels; for formats that do not state it."""


FARTHEST_M = 1e9
"""No coordinate of any reference is farther from its origin, geocentric ones included."""


@dataclass(frozen=True, slots=True)
class LeftOut:
    """An image that is not used: its file's name in the model, why, and what to do."""

    name: str
    problem: str
    remedy: str = ""

    def __str__(self) -> str:
        return f"{self.name}: {self.problem}" + (f" → {self.remedy}" if self.remedy else "")


@dataclass(frozen=True, slots=True)
class OrientationModel:
    """Oriented images as a file of orientations tells them.

    Attributes
    ----------
    images : their names are those of the files, as the model writes them (``strip1/a.jpg``); sorted, each once
    sparse : (N, 3) float64 tie points, world metres; empty where the format has none
    left_out : images that cannot be used
    notes : what a user should know of the whole
    pixel_mm : camera's pixel size in millimetres by image name, where known
    crs_wkt : the reference that the model itself states, None where it does not
    """

    images: tuple[OrientedImage, ...]
    sparse: FloatArray = field(default_factory=lambda: np.empty((0, 3)), repr=False)
    left_out: tuple[LeftOut, ...] = ()
    notes: tuple[str, ...] = ()
    pixel_mm: Mapping[str, float] = field(default_factory=dict)
    crs_wkt: str | None = None

    def moved(self, origin: tuple[float, float, float]) -> OrientationModel:
        """The model with `origin` added to all coordinates."""
        if not any(origin):
            return self
        images = tuple(replace(i, centre=i.centre + origin) for i in self.images)
        return replace(self, images=images, sparse=self.sparse + origin)


def in_order(images: list[OrientedImage]) -> tuple[tuple[OrientedImage, ...], list[LeftOut]]:
    """Images by name, each once; of those that come twice, only the first stays, and none that is where no camera can be."""
    kept: dict[str, OrientedImage] = {}
    twice = []
    for image in images:
        if not (np.abs(image.centre) <= FARTHEST_M).all():
            place = ", ".join(f"{v:g}" for v in image.centre)
            twice.append(LeftOut(image.name, f"its centre is no place on Earth ({place})", "orient the image again"))
        elif image.name in kept:
            twice.append(
                LeftOut(image.name, "the model has this image more than once", "the first orientation is used")
            )
        else:
            kept[image.name] = image
    return tuple(kept[name] for name in sorted(kept)), twice
