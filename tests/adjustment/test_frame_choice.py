"""Frames of a sequence: each step asked for once, the sharpest near it, never a blurred, still or repeated one."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import cv2
import numpy as np
import pytest

from adjustment.film import RATE, filmed, pictures
from cityflow.adjustment.frame_choice import BLURRED, DOUBLE, STILL, FrameChoice, FrameParameters, choose_frames
from cityflow.adjustment.frame_tracking import overlap, parallax_px, sharpness
from cityflow.synthetic.video_flight import BLURRED as FILMED_BLURRED
from cityflow.synthetic.video_flight import HOVERING, REPEATED, SHARP, VideoFrame, VideoParameters


@lru_cache(maxsize=1)
def _flight() -> tuple[tuple[VideoFrame, ...], FrameChoice]:
    frames = filmed(VideoParameters(**SMALL, seconds=5.5, hover_s=0.6, repeated_s=0.6, blurred_share=0.1, blur_px=7.0))
    return frames, _chosen(frames)


SMALL = {
    "width_px": 320, "height_px": 240, "frames_a_second": RATE, "altitude_m": 50.0, "tilt_deg": 20.0, "speed_ms": 9.0, "turn_deg": 200.0,
}  # fmt: skip


def _chosen(frames: tuple[VideoFrame, ...]) -> FrameChoice:
    return choose_frames(
        zip([f.time_s for f in frames], pictures(frames), strict=True), RATE, FrameParameters(overlap=0.8)
    )


def _true_overlap(one: VideoFrame, other: VideoFrame) -> float:
    """By the level ground that both see."""
    u, v = np.meshgrid([20.0, 160.0, 300.0], [20.0, 120.0, 220.0])
    uv = np.column_stack([u.ravel(), v.ravel()])
    rays = one.image.rays(uv)
    ground = one.image.centre + rays * (-one.image.centre[2] / rays[:, 2])[:, None]
    homography, _ = cv2.findHomography(uv, other.image.project(ground)[0])
    return overlap(np.asarray(homography), (240, 320))


def test_frames_are_a_step_apart_and_none_is_blurred_still_or_repeated() -> None:
    frames, choice = _flight()
    taken = [frames[c.number] for c in choice.chosen]
    assert {f.kind for f in taken} == {SHARP}
    steps = [_true_overlap(a, b) for a, b in pairwise(taken)]
    assert min(steps) > 0.7
    assert max(steps) < 0.87
    assert len(taken) >= 6
    # what the choice reckons from tracked points is what the poses say
    assert [c.overlap for c in choice.chosen[1:]] == pytest.approx(steps, abs=0.02)
    assert all(c.parallax_px is not None and c.parallax_px > 1 for c in choice.chosen[1:])
    assert choice.pieces == 1


def test_every_frame_is_known_for_what_it_is() -> None:
    frames, choice = _flight()
    by_kind = {
        k: [choice.kinds[n] for n, f in enumerate(frames) if f.kind == k]
        for k in (FILMED_BLURRED, HOVERING, REPEATED, SHARP)
    }
    assert set(by_kind[FILMED_BLURRED]) == {BLURRED}
    assert by_kind[HOVERING].count(STILL) >= len(by_kind[HOVERING]) - 1
    assert set(by_kind[REPEATED]) == {DOUBLE}
    assert by_kind[SHARP].count("sharp") >= len(by_kind[SHARP]) - 1


def test_the_same_frames_are_chosen_again() -> None:
    frames = _flight()[0][:20]
    assert _chosen(frames) == _chosen(frames)


def test_a_camera_that_stands_or_only_turns_has_no_parallax() -> None:
    still = _chosen(
        filmed(
            VideoParameters(
                **{**SMALL, "speed_ms": 0.0, "turn_deg": 0.0}, seconds=2.0, attitude_deg=0.0, blurred_share=0.0
            )
        )
    )
    assert still.widest_px < 5
    assert not still.moves
    turning = _chosen(
        filmed(
            VideoParameters(**{**SMALL, "speed_ms": 0.0}, seconds=3.0, hover_s=0.0, repeated_s=0.0, blurred_share=0.0)
        )
    )
    assert turning.widest_px > 100
    assert not turning.moves


def test_overlap_and_parallax_of_known_homographies() -> None:
    shift = np.array([[1.0, 0, 64], [0, 1, 0], [0, 0, 1]])
    assert overlap(shift, (240, 320)) == pytest.approx(0.8)
    assert overlap(np.diag([0.5, 0.5, 1.0]), (240, 320)) == pytest.approx(0.25)
    # a level camera that moves sideways over level ground shifts its picture; one that turns bends it
    assert parallax_px(shift, (240, 320)) > 1
    focal, angle = 300.0, np.radians(9.0)
    interior = np.array([[focal, 0, 160], [0, focal, 120], [0, 0, 1]])
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    assert parallax_px(interior @ turn @ np.linalg.inv(interior), (240, 320)) < 0.5


def test_blur_in_any_direction_lowers_sharpness() -> None:
    rng = np.random.default_rng(1)
    picture = cv2.GaussianBlur(rng.integers(0, 255, (240, 320)).astype(np.float32), (0, 0), 1.0)
    for kernel in (np.ones((1, 7)), np.ones((7, 1)), np.eye(7), np.eye(7)[::-1]):
        blurred = cv2.filter2D(picture, -1, kernel / kernel.sum())
        assert sharpness(blurred.astype(np.uint8)) < 0.8 * sharpness(picture.astype(np.uint8))
