"""Writes images: JPEG and PNG for colours of 8 bits, TIFF for everything else."""

from __future__ import annotations

import warnings

import cv2
import numpy as np
from rasterio.errors import NotGeoreferencedWarning
from rasterio.io import MemoryFile

from cityflow.core.pixels import PixelArray

JPEG_ENDING, PNG_ENDING, TIFF_ENDING = ".jpg", ".png", ".tif"
BLOCK_PX = 256


def jpeg_bytes(pixels: PixelArray, quality: int, full_colour: bool = False) -> bytes:
    """A JPEG of (rows, cols, 1 or 3) uint8 pixels.

    Parameters
    ----------
    full_colour : as many values of colour as of brightness (4:4:4), so that colours mix within blocks of 8 pixels and not of 16; else a quarter (4:2:0)

    Raises
    ------
    ValueError
        JPEG has no such pixels.
    """
    if pixels.dtype != np.uint8 or pixels.shape[2] not in (1, 3):
        raise ValueError(f"no JPEG of {pixels.shape[2]} bands of {pixels.dtype}")
    colour = np.ascontiguousarray(pixels[..., ::-1])
    sampling = [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444] if full_colour else []
    done, data = cv2.imencode(JPEG_ENDING, colour, [cv2.IMWRITE_JPEG_QUALITY, quality, *sampling])
    if not done:
        raise ValueError(f"no JPEG of shape {pixels.shape}")
    return data.tobytes()


def png_bytes(pixels: PixelArray) -> bytes:
    """A PNG of (rows, cols, 1 or 3) uint8 or uint16 pixels."""
    done, data = cv2.imencode(PNG_ENDING, np.ascontiguousarray(pixels[..., ::-1]), [cv2.IMWRITE_PNG_COMPRESSION, 6])
    if not done:
        raise ValueError(f"no PNG of shape {pixels.shape} and {pixels.dtype}")
    return data.tobytes()


def tiff_bytes(pixels: PixelArray) -> bytes:
    """A lossless tiled TIFF of (rows, cols, bands) uint8 or uint16 pixels; a fourth band is near infrared, not transparency."""
    bands = pixels.shape[2]
    edge = {"tiled": True, "blockxsize": BLOCK_PX, "blockysize": BLOCK_PX} if min(pixels.shape[:2]) >= BLOCK_PX else {}
    profile = {
        "driver": "GTiff", "height": pixels.shape[0], "width": pixels.shape[1], "count": bands, "dtype": pixels.dtype,
        "compress": "DEFLATE", "predictor": 2, "interleave": "pixel", "photometric": "RGB" if bands >= 3 else "MINISBLACK",
        **({"alpha": "NO"} if bands == 4 else {}), **edge,
    }  # fmt: skip
    with MemoryFile() as memory, warnings.catch_warnings():
        # an image stands nowhere; its pose does
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        with memory.open(**profile) as dataset:
            dataset.write(np.moveaxis(pixels, 2, 0))
        return bytes(memory.getbuffer())
