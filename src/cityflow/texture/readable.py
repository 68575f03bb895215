"""Unreadable images found while textures are made: they are recorded, so that a unit can be made without them."""

from __future__ import annotations

from collections.abc import MutableMapping, Sequence
from dataclasses import dataclass, replace

from cityflow.core.colour_image import ColourImage
from cityflow.core.pixels import PixelArray, PixelsOf
from cityflow.errors import CityflowError


@dataclass(frozen=True)
class WatchedPixels(PixelsOf):
    """Pixels of an image, as they are.

    Attributes
    ----------
    lost : image name → what was wrong; gets this image when reading it fails
    """

    name: str
    lost: MutableMapping[str, str]

    def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int = 0) -> PixelArray:
        """As in `Pixels`; what goes wrong is noted and raised."""
        try:
            return self.pixels.window(rows, cols, level)
        except CityflowError as error:
            self.lost[self.name] = str(error)
            raise


def watched(images: Sequence[ColourImage], lost: MutableMapping[str, str]) -> list[ColourImage]:
    """The images, each noting in `lost` when it cannot be read."""
    return [replace(i, pixels=WatchedPixels(i.pixels, i.image.name, lost)) for i in images]
