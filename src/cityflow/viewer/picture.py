"""A picture of the report: JPEG bytes of limited size, with its caption."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass

import numpy as np
from PIL import Image

from cityflow.core.arrays import ByteArray
from cityflow.core.grid import Bounds

MOST_PIXELS = 1200
"""Longest side of a picture."""
MOST_BYTES = 420_000
"""Eight such pictures as base64 stay within 5 MB of page."""
QUALITIES = (88, 82, 74, 64, 52, 40)


@dataclass(frozen=True, slots=True)
class Picture:
    """One picture.

    Attributes
    ----------
    title, caption : what it shows, how to read it
    jpeg : bytes;  width, height : pixels
    key : (meaning, colour as ``#rrggbb``) in the order to be listed
    wide : shown over the whole width of the page;  half : two of them beside each other
    bounds : of its edges, world metres; None where it is no map
    """

    title: str
    caption: str
    jpeg: bytes
    width: int
    height: int
    key: tuple[tuple[str, str], ...] = ()
    wide: bool = False
    half: bool = False
    bounds: Bounds | None = None

    @property
    def address(self) -> str:
        """The picture as a data URL."""
        return "data:image/jpeg;base64," + base64.b64encode(self.jpeg).decode()


def picture(
    title: str,
    caption: str,
    pixels: ByteArray,
    key: tuple[tuple[str, tuple[int, int, int]], ...] = (),
    wide: bool = False,
) -> Picture:
    """Encode (rows, cols, 3) pixels with the best quality that stays within `MOST_BYTES`; the same pixels give the same bytes."""
    image = Image.fromarray(np.ascontiguousarray(pixels))
    data = b""
    for quality in QUALITIES:
        buffer = io.BytesIO()
        image.save(buffer, "JPEG", quality=quality, optimize=True)
        data = buffer.getvalue()
        if len(data) <= MOST_BYTES:
            break
    colours = tuple((text, "#{:02x}{:02x}{:02x}".format(*colour)) for text, colour in key)
    return Picture(title, caption, data, image.width, image.height, colours, wide)
