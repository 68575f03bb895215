"""An image as a source of textures: three bands of 8 bits, with balanced exposure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.colour_image import ColourImage, balanced, sampled
from cityflow.core.pixels import PixelArray, Pixels, level_shape
from cityflow.texture.missing_rim import MissingRim

WHITE = 255.0
"""The largest value of eight bits."""
COARSE_PX = 512
"""Pixels along the longer side of the level that tells how bright an image is; set by hand, as are those below."""
SATURATED = 0.98
"""Share of the white level from which a value may have been cut off."""


@dataclass(frozen=True, slots=True, eq=False)
class LinearModel:
    """What a colour of one image would be in the others: gain · value + offset, band by band.

    Attributes
    ----------
    gain : (3,) float64;  offset : (3,) float64, in values of 0 to 255
    """

    gain: FloatArray
    offset: FloatArray

    def applied(self, colours: Float32Array) -> Float32Array:
        """(N, 3) colours of the image → as the others show them."""
        return np.asarray(colours * self.gain.astype(np.float32) + self.offset.astype(np.float32), np.float32)

    def after(self, first: LinearModel) -> LinearModel:
        """The model that does `first` and then this."""
        return LinearModel(self.gain * first.gain, self.gain * first.offset + self.offset)

    @property
    def inverse(self) -> LinearModel:
        return LinearModel(1.0 / self.gain, -self.offset / self.gain)


SAME = LinearModel(np.ones(3), np.zeros(3))
"""The model of an image that is left as it is."""


@dataclass(frozen=True, slots=True)
class Source:
    """An image to make textures of.

    Attributes
    ----------
    colour : its orientation, pixels, and balance within the survey
    white : the value that becomes 255; of 16-bit images that use 12 of them, 4095
    rim : where it shows nothing
    """

    colour: ColourImage
    white: float
    rim: MissingRim = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rim", MissingRim(self.colour.pixels, self.white))

    @classmethod
    def of(cls, colour: ColourImage) -> Source:
        """With the white level that the image itself suggests."""
        return cls(colour, white_level(colour.pixels))

    @property
    def image(self) -> OrientedImage:
        return self.colour.image

    @property
    def most_level(self) -> int:
        """The highest pyramid level of at least some pixels."""
        pixels = self.colour.pixels
        return max(0, min(pixels.height, pixels.width).bit_length() - 3)

    def level_of(self, pixels_per_cell: float) -> int:
        """The pyramid level whose pixels are as large as cells of so many pixels."""
        return int(np.clip(np.rint(np.log2(max(pixels_per_cell, 1e-3))), 0, self.most_level))

    def is_burnt(self, uv: FloatArray, level: int) -> BoolArray:
        """(N,) where the sensor or the file may have cut a value off."""
        return np.asarray(self._colours(uv, level)[1] >= SATURATED * self.white)

    def colours(self, uv: FloatArray, level: int = 0) -> Float32Array:
        """(N, 3) red, green, blue, 0 to 255, at (N, 2) image coordinates; at centres of pixels and level 0, the pixels themselves.

        NaN where the file shows nothing: beyond the edge of an ortho, or of a frame that was turned. Black elsewhere is a colour.
        """
        return self._colours(uv, level)[0]

    def unsaturated(self, uv: FloatArray, level: int) -> Float32Array:
        """Like `colours`, NaN also where the sensor or the file may have cut a value off."""
        colours, brightest = self._colours(uv, level)
        colours[brightest >= SATURATED * self.white] = np.nan
        return colours

    def _colours(self, uv: FloatArray, level: int) -> tuple[Float32Array, Float32Array]:
        """(N, 3) colours, and (N,) the greatest value of the bands as they are in the file."""
        u, v = np.ascontiguousarray(uv[:, 0]), np.ascontiguousarray(uv[:, 1])
        values = sampled(self.colour.pixels, u, v, level)
        brightest = three_bands(values).max(axis=1)
        colours = three_bands(balanced(values, self.colour, u, v)) * np.float32(WHITE / self.white)
        colours[self.rim.holds(uv, brightest)] = np.nan
        return colours, brightest


def sources_of(images: Sequence[ColourImage]) -> list[Source]:
    """Images with white levels: the stated ones, else those of the same depth get the highest that any suggests, as one survey has one sensor."""
    levels = [image.white or white_level(image.pixels) for image in images]
    depths = [np.dtype(image.pixels.dtype).itemsize for image in images]
    of_depth = {depth: max(w for w, d in zip(levels, depths, strict=True) if d == depth) for depth in depths}
    return [Source(image, of_depth[depth]) for image, depth in zip(images, depths, strict=True)]


@dataclass(frozen=True, slots=True)
class UnitSources:
    """All images of a unit, and how they are made alike.

    Attributes
    ----------
    sources : by the index that `FaceView.image` counts
    models : by the same index; images without one stay as they are
    """

    sources: Sequence[Source]
    models: Mapping[int, LinearModel] = field(default_factory=dict)

    def colours(self, image: int, uv: FloatArray, level: int = 0) -> Float32Array:
        """(N, 3) colours of an image, made like the others."""
        return self.models.get(image, SAME).applied(self.sources[image].colours(uv, level))


def three_bands(values: Float32Array) -> Float32Array:
    """(N, bands) → (N, 3): grey thrice, near infrared left out.

    >>> three_bands(np.array([[7.0]], np.float32)).tolist()
    [[7.0, 7.0, 7.0]]
    """
    return np.repeat(values[:, :1], 3, axis=1) if values.shape[1] < 3 else values[:, :3].copy()


def white_level(pixels: Pixels) -> float:
    """The value that is shown as white: 255 of 8-bit images; of 16-bit ones a power of two less one above 99.9 % of their values.

    >>> from cityflow.core.pixels import ArrayPixels
    >>> white_level(ArrayPixels(np.full((8, 8, 1), 3000, np.uint16)))
    4095.0
    """
    if pixels.dtype == np.uint8:
        return WHITE
    level = max(0, int(np.ceil(np.log2(max(pixels.height, pixels.width) / COARSE_PX))))
    rows, cols = level_shape(pixels.height, pixels.width, level)
    return white_of(pixels.window((0, rows), (0, cols), level)[..., :3])


def white_of(values: PixelArray) -> float:
    """A power of two less one above 99.9 % of some values of 16 bits.

    >>> white_of(np.array([300, 900, 2000], np.uint16))
    2047.0
    """
    brightest = max(float(np.percentile(values, 99.9)), WHITE)
    return float(2 ** int(np.ceil(np.log2(brightest + 1.0))) - 1)
