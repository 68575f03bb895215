"""Frames of a sequence, measured one after another: each is tracked from the last sharp one; no more than a few are in memory."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cityflow.adjustment.frame_tracking import Motion, SmallFrame, grey_of, motion, sharpness, small_frame, thumbnail
from cityflow.core.arrays import FloatArray
from cityflow.core.pixels import PixelArray

SUSPECT = 0.8
"""A frame less sharp than this share of those before it is not tracked on from."""
ENDS_KEPT = 8
"""Former pieces of a sequence that a new one may continue."""


@dataclass(frozen=True, slots=True)
class SequenceFrame:
    """A frame as it is measured: number from 0 on, seconds since the start, and what is needed of its pixels.

    Attributes
    ----------
    sharpness : see `frame_tracking.sharpness`;  thumbnail : (n,)
    parent : number of the frame that it was tracked from, -1 where it shows nothing of one
    motion : from that one;  way_px : by which points moved since the sequence's first frame that it hangs together with
    """

    number: int
    time_s: float
    sharpness: float
    thumbnail: NDArray[np.float32]
    parent: int
    motion: Motion | None
    way_px: float


@dataclass
class FrameTracker:
    """Frames one after another; a blurred one is not tracked on from."""

    around: int
    frames: list[SequenceFrame] = field(default_factory=list)
    last: tuple[int, SmallFrame] | None = None
    ends: list[tuple[int, SmallFrame]] = field(default_factory=list)
    step: FloatArray = field(default_factory=lambda: np.eye(3))

    def add(self, time_s: float, pixels: PixelArray) -> tuple[int, int]:
        """Measure the next frame; its rows and columns as tracked."""
        number, grey = len(self.frames), grey_of(pixels)
        small, sharp = small_frame(grey), sharpness(grey)
        parent, moved = self._tracked(small)
        way = 0.0 if moved is None else self.frames[parent].way_px + moved.shift_px
        self.frames.append(SequenceFrame(number, time_s, sharp, thumbnail(grey), parent, moved, way))
        before = [f.sharpness for f in self.frames[-1 - self.around : -1]]
        if self.last is None or sharp >= SUSPECT * float(np.median(before)):
            if moved is not None and self.last is not None and parent == self.last[0]:
                self.step = moved.homography if number - parent == 1 else np.eye(3)
            elif self.last is not None:
                self.ends = [*self.ends, self.last][-ENDS_KEPT:]
                self.step = np.eye(3)
            self.last = number, small
        return small.grey.shape[0], small.grey.shape[1]

    def _tracked(self, small: SmallFrame) -> tuple[int, Motion | None]:
        if self.last is None:
            return -1, None
        number, before = self.last
        ahead = np.linalg.matrix_power(self.step, len(self.frames) - number)
        starts = [ahead] if np.allclose(ahead, np.eye(3)) else [ahead, np.eye(3)]
        for start in starts:
            moved = motion(before, small, start)
            if moved is not None:
                return number, moved
        for end, frame in reversed(self.ends):
            moved = motion(frame, small)
            if moved is not None:
                return end, moved
        return -1, None
