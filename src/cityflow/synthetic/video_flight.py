"""A video of a flight over the town: the frames with their true poses, and what spoils videos (blur, hovering, a piece that comes twice)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from pydantic import Field, model_validator

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.grid import Bounds
from cityflow.core.parameters import Parameters
from cityflow.synthetic.flight import Head, head_rotation, small_rotation
from cityflow.synthetic.footprints import ground_quad

SHARP, BLURRED, HOVERING, REPEATED = "sharp", "blurred", "hovering", "repeated"
BLURRED_TOGETHER = 3
"""Frames after one another that a gust blurs."""
HOVER_AT, REPEAT_AT = 0.4, 0.75
"""Share of the flown frames after which the carrier hovers, and after which frames of before come again."""
LEAST_BELOW_DEG = 5.0
"""Below the horizon, what is highest in a frame."""


class VideoParameters(Parameters):
    """What is filmed."""

    width_px: int = Field(640, ge=64, le=8000, description="of a frame, pixels")
    height_px: int = Field(480, ge=64, le=8000, description="of a frame, pixels")
    focal_widths: float = Field(0.9, ge=0.4, le=6, description="focal length over the width of a frame")
    distortion: tuple[float, ...] = Field((-0.04, 0.01, 0.0, 0.0), description="OpenCV's perspective coefficients")
    seconds: float = Field(10.0, ge=0.2, le=600, description="length of the video")
    frames_a_second: float = Field(12.5, ge=1, le=60, description="frames a second")
    altitude_m: float = Field(60.0, gt=5, le=2000, description="above the ground in the middle of the area, metres")
    tilt_deg: float = Field(25.0, ge=0, le=70, description="angle of the camera from the nadir, ahead, degrees")
    speed_ms: float = Field(12.0, ge=0, le=100, description="speed of the carrier, metres a second; 0: it only turns")
    turn_deg: float = Field(
        270.0, ge=0, le=3600, description="angle that the carrier turns by in the whole flight, degrees"
    )
    attitude_deg: float = Field(1.0, ge=0, le=10, description="amplitude of periodic roll, pitch and yaw, degrees")
    blurred_share: float = Field(0.1, ge=0, le=0.9, description="share of the frames that are blurred by motion")
    blur_px: float = Field(9.0, ge=0, le=60, description="length of this blur, pixels")
    hover_s: float = Field(1.0, ge=0, le=60, description="the carrier stands still for so long, seconds")
    repeated_s: float = Field(0.8, ge=0, le=60, description="so many seconds of the video are repeated")
    subtitles: bool = Field(
        True, description="GNSS positions of the carrier beside the video, as drones write them (.srt)"
    )
    position_m: float = Field(0.3, ge=0, le=100, description="error of these positions, metres (standard deviation)")

    @model_validator(mode="after")
    def _can_be_flown(self) -> VideoParameters:
        if self.flown < 2:
            raise ValueError(
                f"nothing is flown: {self.frames} frames, of which {self.hovering} hover and {self.repeated} come again"
            )
        upper = math.degrees(math.atan(self.height_px / 2 / (self.focal_widths * self.width_px)))
        if self.tilt_deg + upper + 2 * self.attitude_deg > 90 - LEAST_BELOW_DEG:
            raise ValueError(
                f"a tilt of {self.tilt_deg:g}° shows the horizon: the upper edge lies {upper:.0f}° above the axis"
            )
        return self

    @property
    def frames(self) -> int:
        """All of them."""
        return max(1, round(self.seconds * self.frames_a_second))

    @property
    def hovering(self) -> int:
        """Frames that hover."""
        return round(self.hover_s * self.frames_a_second)

    @property
    def repeated(self) -> int:
        """Frames that come again."""
        return round(self.repeated_s * self.frames_a_second)

    @property
    def flown(self) -> int:
        """Frames with a place of their own."""
        return self.frames - self.hovering - self.repeated

    @property
    def camera(self) -> Camera:
        focal = self.focal_widths * self.width_px
        return Camera(
            self.width_px, self.height_px, focal, focal, self.width_px / 2, self.height_px / 2, self.distortion
        )


@dataclass(frozen=True, slots=True)
class VideoFrame:
    """A frame of the video.

    Attributes
    ----------
    time_s : since its start;  kind : one of the four above
    shows : number of the frame that has the same picture; its own number, but for repeated ones
    image : its true pose;  blur : (right, down) by which it is blurred, pixels
    """

    time_s: float
    kind: str
    shows: int
    image: OrientedImage
    blur: tuple[float, float] = (0.0, 0.0)


def plan_video(bounds: Bounds, ground_height: float, parameters: VideoParameters, seed: int) -> tuple[VideoFrame, ...]:
    """All frames in their order, on an arc about the middle of the area.

    Parameters
    ----------
    bounds : world metres;  ground_height : world metres, that the altitude counts from
    """
    p = parameters
    poses = _poses(bounds, ground_height, p, seed)
    blurs = _blurs(p, seed)
    hover, repeat = int(HOVER_AT * p.flown), int(REPEAT_AT * p.flown)
    frames: list[VideoFrame] = []

    def add(kind: str, pose: OrientedImage, shows: int, blur: tuple[float, float] = (0.0, 0.0)) -> None:
        number = len(frames)
        named = replace(pose, name=f"f{number:05d}")
        frames.append(VideoFrame(number / p.frames_a_second, kind, number if shows < 0 else shows, named, blur))

    for k, pose in enumerate(poses):
        if k == hover:
            for _ in range(p.hovering):
                add(HOVERING, pose, -1)
        if k == repeat:
            last = len(frames)
            for number in range(max(0, last - 2 * p.repeated), max(0, last - 2 * p.repeated) + p.repeated):
                again = frames[min(number, last - 1)]
                add(REPEATED, again.image, again.shows, again.blur)
        add(BLURRED if any(blurs[k]) else SHARP, pose, -1, blurs[k])
    return tuple(frames)


def _poses(bounds: Bounds, ground_height: float, p: VideoParameters, seed: int) -> list[OrientedImage]:
    """Of the flown frames."""
    rng = np.random.default_rng([seed, 31])
    first = rng.uniform(0, 2 * math.pi)
    turn = math.radians(p.turn_deg)
    length = p.speed_ms * p.flown / p.frames_a_second
    middle = np.array([(bounds[0] + bounds[2]) / 2, (bounds[1] + bounds[3]) / 2, ground_height + p.altitude_m])
    waves = rng.uniform(0, 2 * math.pi, (2, 3)), rng.uniform(1.0, 4.0, (2, 3))
    head = Head(name="video", direction="forward", tilt_deg=p.tilt_deg)
    poses = []
    for k in range(p.flown):
        share = k / p.flown - 0.5
        heading = first + turn * share
        angles = np.sin(waves[0] + 2 * math.pi * waves[1] * share).mean(axis=0) * math.radians(p.attitude_deg)
        rotation = small_rotation(angles) @ head_rotation(head, heading)
        poses.append(OrientedImage("", p.camera, rotation, middle + _on_arc(first, turn, length, share)))
    return poses


def _on_arc(first: float, turn: float, length: float, share: float) -> FloatArray:
    """(3,) place on an arc about its middle, metres; a line where nothing turns."""
    if turn < 1e-3:
        along = length * share
        return np.array([math.sin(first) * along, math.cos(first) * along, 0.0])
    radius, heading = length / turn, first + turn * share
    return np.array([-math.cos(heading) * radius, math.sin(heading) * radius, 0.0])


def _blurs(p: VideoParameters, seed: int) -> list[tuple[float, float]]:
    """(right, down) of each flown frame, pixels; neither next to the hovering piece nor at the ends."""
    rng = np.random.default_rng([seed, 32])
    blurs = [(0.0, 0.0)] * p.flown
    hover = int(HOVER_AT * p.flown)
    starts = [k for k in range(1, p.flown - BLURRED_TOGETHER) if not hover - BLURRED_TOGETHER <= k <= hover + 1]
    wanted = round(p.blurred_share * p.frames / BLURRED_TOGETHER) if p.blur_px > 0 else 0
    for start in rng.permutation(starts)[:wanted].tolist():
        angle = rng.uniform(0, math.pi)
        for k in range(start, start + BLURRED_TOGETHER):
            blurs[k] = (p.blur_px * math.cos(angle), p.blur_px * math.sin(angle))
    return blurs


def moved_light(light: Float32Array, blur: tuple[float, float]) -> Float32Array:
    """(h, w, bands) light of a camera that turns while the shutter is open, by (right, down) pixels."""
    length = math.hypot(*blur)
    if length < 1e-6:
        return light
    half = math.ceil(length / 2) + 1
    y, x = np.mgrid[-half : half + 1, -half : half + 1].astype(np.float64)
    along = (x * blur[0] + y * blur[1]) / length
    across = (x * -blur[1] + y * blur[0]) / length
    kernel = np.clip(length / 2 - np.abs(along) + 0.5, 0, 1) * np.clip(1 - np.abs(across), 0, 1)
    return np.asarray(cv2.filter2D(light, -1, kernel / kernel.sum(), borderType=cv2.BORDER_REFLECT_101))


def video_reach(frames: Sequence[VideoFrame], bounds: Bounds, ground_height: float) -> float:
    """How far beyond an area the frames see, metres."""
    quads = np.concatenate([ground_quad(f.image, ground_height) for f in frames])
    low, high = quads.min(axis=0), quads.max(axis=0)
    return float(max(bounds[0] - low[0], bounds[1] - low[1], high[0] - bounds[2], high[1] - bounds[3], 0.0))
