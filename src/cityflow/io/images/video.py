"""Video files by OpenCV: frames one after another with their times, and writing of small ones."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

# The decoder would tell of every damaged frame in the middle of a progress line.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

import cv2
import numpy as np

from cityflow.core.pixels import PixelArray
from cityflow.errors import CatalogError

CODEC = "mp4v"
"""MPEG-4 part 2: what OpenCV's wheels can write anywhere."""
READABLE = "convert it with another program (ffmpeg -i FILE -c:v libx264 NEW.mp4), or fetch it again"


@dataclass(frozen=True, slots=True, eq=False)
class DecodedFrame:
    """A frame: its number from 0 on, seconds since the start of the video, (h, w, 3) pixels in the order red, green, blue."""

    number: int
    time_s: float
    pixels: PixelArray


def video_frames(path: Path, last: int | None = None) -> Iterator[DecodedFrame]:
    """Frames in their order, decoded by one thread; the last ones of a file that is cut off are missing.

    Parameters
    ----------
    last : number of the last frame that is wanted; None: all

    Raises
    ------
    CatalogError
        The file is missing, empty, or no video that can be decoded.
    """
    opened = _opened(path)
    rate = opened.get(cv2.CAP_PROP_FPS) or 25.0
    try:
        number, before = 0, -1.0
        while last is None or number <= last:
            is_there, pixels = opened.read()
            if not is_there:
                return
            time = opened.get(cv2.CAP_PROP_POS_MSEC) / 1000
            # files without time stamps have the same time in all frames
            time = time if time > before else number / rate
            yield DecodedFrame(number, round(time, 6), np.ascontiguousarray(pixels[..., ::-1]))
            number, before = number + 1, time
    finally:
        opened.release()


def stated_frames(path: Path) -> int:
    """Number of frames as the file states it; 0 where it does not. Raises CatalogError as `video_frames`."""
    opened = _opened(path)
    try:
        return max(0, int(opened.get(cv2.CAP_PROP_FRAME_COUNT)))
    finally:
        opened.release()


def _opened(path: Path) -> cv2.VideoCapture:
    if not path.is_file():
        raise CatalogError("no such video", where=str(path), remedy="check the path")
    size = path.stat().st_size
    if size == 0:
        raise CatalogError("the video is empty (0 bytes)", where=str(path), remedy="fetch it again")
    loud = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        opened = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG, [cv2.CAP_PROP_N_THREADS, 1])
    finally:
        cv2.utils.logging.setLogLevel(loud)
    if not opened.isOpened() or opened.get(cv2.CAP_PROP_FRAME_WIDTH) < 1:
        opened.release()
        problem = f"no video that can be decoded ({size:,} bytes): of another kind, damaged, or cut off"
        raise CatalogError(problem, where=str(path), remedy=READABLE)
    return opened


def write_video(path: Path, frames: Iterable[PixelArray], size: tuple[int, int], rate: float) -> int:
    """Write (h, w, 3) uint8 frames in the order red, green, blue; their number. The same frames give the same bytes.

    Parameters
    ----------
    size : width and height, pixels;  rate : frames a second

    Raises
    ------
    CatalogError
        No encoder is there.
    """
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*CODEC), rate, size)
    if not writer.isOpened():
        problem = f"no video of {size[0]} x {size[1]} pixels can be written"
        raise CatalogError(problem, where=str(path), remedy="install opencv-python-headless with FFMPEG")
    count = 0
    try:
        for pixels in frames:
            writer.write(np.ascontiguousarray(pixels[..., ::-1]))
            count += 1
    finally:
        writer.release()
    return count
