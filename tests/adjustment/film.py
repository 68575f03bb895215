"""A film of level ground with a texture: frames with true poses, and their pictures."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from adjustment.scenes import rendered_ground
from cityflow.synthetic.video_flight import VideoFrame, VideoParameters, moved_light, plan_video

RATE = 12.5


def filmed(parameters: VideoParameters, seed: int = 5) -> tuple[VideoFrame, ...]:
    """On an arc about the origin."""
    return plan_video((-1.0, -1.0, 1.0, 1.0), 0.0, parameters, seed)


def pictures(frames: tuple[VideoFrame, ...]) -> Iterator[np.ndarray]:
    """(h, w, 3) uint8 of each frame, with noise of its own; repeated ones are the same but for that."""
    rng = np.random.default_rng(2)
    for frame in frames:
        light = moved_light(rendered_ground(frame.image).astype(np.float32), frame.blur)
        grey = light.reshape(light.shape[:2]) + rng.normal(0, 2.0, light.shape[:2])
        yield np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
