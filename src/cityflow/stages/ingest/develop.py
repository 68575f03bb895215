"""Converts an image file to the tiled image that all later stages read, strip by strip (Frommholz 2017 §2).

Dark signal, response and bad pixels are corrected in the sensor's own numbers; then the full range, the colours, the near infrared of a second head,
and last the distortion. Of a picture only some strips and the reduced levels are in memory.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cityflow.core.camera import Camera
from cityflow.core.pixels import PixelArray
from cityflow.errors import CatalogError
from cityflow.flow.store import Store
from cityflow.handover.array_file import decode_arrays
from cityflow.imagery.raw_calibration import Calibration
from cityflow.imagery.raw_frames import HALO_ROWS, demosaicked, evened, full_range
from cityflow.imagery.resampling import infrared_rows, pinhole_within, undistorted_rows
from cityflow.io.images.image_tiles import Strips, picture_strips, tile_strips
from cityflow.io.images.tiled_images import open_image
from cityflow.stages.ingest.camera_corrections import ROWS, numbers, rows_of, top_of
from cityflow.survey.raw_parameters import RawInput


@dataclass(frozen=True, slots=True)
class Corrections:
    """A camera's corrections as the calibration has left them: RUN-relative paths of files of `ROWS` rows each, and their whole size."""

    store: Store
    paths: Sequence[str]
    shape: tuple[int, int]

    @classmethod
    def of(cls, store: Store, paths: Sequence[str]) -> Corrections:
        """What `calibration.run` has written."""
        rows, cols = decode_arrays(store.read_bytes(paths[0]))[1]["shape"]
        return cls(store, paths, (int(rows), int(cols)))

    def rows(self, start: int, stop: int) -> Calibration:
        """Those of a half-open range of rows."""
        first, last = start // ROWS, (stop - 1) // ROWS
        found = rows_of([self.store.read_bytes(p) for p in self.paths[first : last + 1]])
        part = slice(start - first * ROWS, stop - first * ROWS)
        return Calibration(found.dark[part], found.gain[part], found.bad[part])


@dataclass(frozen=True, slots=True)
class Frame:
    """What belongs to one image.

    Attributes
    ----------
    path, where : the local file, and how it is called towards people
    camera : as the image was taken
    corrections : of its camera; None where none are asked for
    infrared, infrared_where : the same of the near-infrared picture; None where there is none
    """

    path: Path
    where: str
    camera: Camera
    corrections: Corrections | None = None
    infrared: Path | None = None
    infrared_where: str = ""


def develop(frame: Frame, raw: RawInput, target: Path, folder: Path) -> tuple[int, int, int]:
    """Write the tiled picture; returns its width, height and bands.

    Parameters
    ----------
    folder : for pictures between two steps

    Raises
    ------
    CatalogError
        The frame is damaged, or not what `raw` says; its calibration or its near-infrared picture does not fit.
    """
    with picture_strips(frame.path, ROWS) as stored:
        _refuse_other_kind(stored, frame, raw)
        picture = _coloured(stored, frame, raw)
        if frame.infrared is not None:
            picture = _with_infrared(picture, frame, raw, folder)
        if not raw.undistort or frame.camera.is_pinhole:
            tile_strips(picture, target)
            return picture.width, picture.height, picture.bands
        between = folder / "distorted.tif"
        tile_strips(picture, between, most_levels=1)
    return _undistorted(between, frame.camera, target)


def _coloured(stored: Strips, frame: Frame, raw: RawInput) -> Strips:
    """Pictures of full range; those that are pictures already stay as they are."""
    if not raw.makes_16_bits:
        return stored
    mosaic = raw.pattern is not None or frame.corrections is not None
    strips = _from_mosaic(stored, frame, raw) if mosaic else _ranged(stored, raw, frame.where)
    return Strips(stored.height, stored.width, 3 if raw.pattern else stored.bands, "uint16", strips)


def _ranged(stored: Strips, raw: RawInput, where: str) -> Iterator[tuple[int, PixelArray]]:
    for row, strip in stored.strips:
        values = numbers(strip, raw, where)
        yield row, full_range(values, top_of(values, raw).bit_length())


def _from_mosaic(stored: Strips, frame: Frame, raw: RawInput) -> Iterator[tuple[int, PixelArray]]:
    for row, above, strip, below in _haloed(stored.strips):
        values = numbers(np.concatenate([above, strip, below])[..., 0], raw, frame.where)
        start = row - len(above)
        found = frame.corrections.rows(start, start + len(values)) if frame.corrections else None
        even = evened(values, top_of(values, raw).bit_length(), found)
        colours = demosaicked(even, raw.pattern) if raw.pattern else even[..., None]
        yield row, colours[len(above) : len(above) + len(strip)]


def _haloed(
    strips: Iterable[tuple[int, PixelArray]],
) -> Iterator[tuple[int, PixelArray, PixelArray, PixelArray]]:
    """First row, rows above, the strip, rows below: files are read forwards only."""
    held: tuple[int, PixelArray, PixelArray] | None = None
    for row, strip in strips:
        if held is not None:
            yield *held, strip[:HALO_ROWS]
        above = strip[:0] if held is None else held[2][-HALO_ROWS:]
        held = row, above, strip
    if held is not None:
        yield *held, held[2][:0]


def _with_infrared(picture: Strips, frame: Frame, raw: RawInput, folder: Path) -> Strips:
    """A fourth band from the second head, whose picture is tiled first, as it is read out of order."""
    assert frame.infrared is not None
    assert raw.near_infrared is not None
    tiled = folder / "infrared.tif"
    with picture_strips(frame.infrared, ROWS) as stored:
        _refuse_other_infrared(stored, picture, frame, raw)
        strips = _ranged(stored, raw, frame.infrared_where) if raw.makes_16_bits else stored.strips
        tile_strips(Strips(stored.height, stored.width, 1, picture.dtype, strips), tiled, most_levels=1)
    homography = np.reshape(np.array(raw.near_infrared.infrared_from_colour, np.float64), (3, 3))
    strips = _joined(picture, tiled, homography)
    return Strips(picture.height, picture.width, picture.bands + 1, picture.dtype, strips)


def _joined(picture: Strips, infrared: Path, homography: np.ndarray) -> Iterator[tuple[int, PixelArray]]:
    pixels = open_image(infrared)
    for row, strip in picture.strips:
        laid = infrared_rows(pixels, homography, picture.width, (row, row + len(strip)))
        yield row, np.concatenate([strip, laid], axis=2)
    pixels.close()


def _undistorted(source: Path, camera: Camera, target: Path) -> tuple[int, int, int]:
    pixels, pinhole = open_image(source), pinhole_within(camera)
    starts = range(0, pinhole.height, ROWS)
    strips = (
        (row, undistorted_rows(pixels, camera, pinhole, (row, min(row + ROWS, pinhole.height)))) for row in starts
    )
    tile_strips(Strips(pinhole.height, pinhole.width, pixels.bands, str(pixels.dtype), strips), target)
    pixels.close()
    return pinhole.width, pinhole.height, pixels.bands


def _refuse_other_kind(stored: Strips, frame: Frame, raw: RawInput) -> None:
    """A raw frame has one band; its container holds its numbers; its camera's corrections are of its size."""
    if raw.pattern is not None and stored.bands != 1:
        raise CatalogError(
            f"raw.pattern is {raw.pattern}, but the image has {stored.bands} bands: it is a picture already",
            where=frame.where, remedy="leave raw.pattern out, or name the raw frames in the catalog",
        )  # fmt: skip
    if frame.corrections is not None and stored.bands != 1:
        raise CatalogError(
            f"raw.calibration corrects mosaics of one band, but the image has {stored.bands}",
            where=frame.where, remedy="leave raw.calibration out, or name the raw frames in the catalog",
        )  # fmt: skip
    size = stored.height, stored.width
    if frame.corrections is not None and frame.corrections.shape != size:
        rows, cols = frame.corrections.shape
        raise CatalogError(
            f"the image is {size[1]} x {size[0]} pixels, the calibration frames of its camera {cols} x {rows}",
            where=frame.where, remedy="take calibration frames at the setting of the flight; see raw.calibration.camera",
        )  # fmt: skip
    if raw.bits is not None and raw.bits > 8 * np.dtype(stored.dtype).itemsize:
        raise CatalogError(
            f"raw.bits is {raw.bits}, but the file holds {stored.dtype}",
            where=frame.where, remedy="set raw.bits to 8, or store the frames as uint16",
        )  # fmt: skip


def _refuse_other_infrared(stored: Strips, picture: Strips, frame: Frame, raw: RawInput) -> None:
    if stored.bands != 1 or picture.bands != 3:
        raise CatalogError(
            f"{stored.bands} bands beside an image of {picture.bands}: one is laid over three",
            where=frame.infrared_where, remedy="keep the infrared band alone, beside colour images",
        )  # fmt: skip
    if not raw.makes_16_bits and stored.dtype != picture.dtype:
        raise CatalogError(
            f"pixels of type {stored.dtype} beside an image of {picture.dtype}",
            where=frame.infrared_where, remedy="store both alike, or name their bits by raw.bits",
        )  # fmt: skip
