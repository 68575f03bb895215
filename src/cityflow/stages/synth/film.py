"""The task of a synthetic video: frames, subtitles with positions, and the true poses of all frames."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from pyproj import CRS

from cityflow.core.grid import Bounds
from cityflow.core.photo_metadata import GnssPosition
from cityflow.core.pixels import PixelArray
from cityflow.flow.task import Outcome, Task
from cityflow.flow.workspace import Workspace
from cityflow.io.crs import horizontal_transform, resolve, transformed
from cityflow.io.images.subtitles import CarrierPosition, subtitles_text
from cityflow.io.images.video import write_video
from cityflow.stages.synth import FilmParameters, scene_bounds, scene_over
from cityflow.stages.synth.synthetic_survey import town_of
from cityflow.synthetic.render import irradiance
from cityflow.synthetic.sensor import exposed
from cityflow.synthetic.town import Town
from cityflow.synthetic.video_flight import VideoFrame, VideoParameters, moved_light, plan_video

VIDEO_PATH, SUBTITLES_PATH, TRUTH_PATH = "video/flight.mp4", "video/flight.srt", "truth/video/frames.csv"
COLUMNS = ("frame", "time_s", "kind", "shows", "x", "y", "z", *(f"r{i}{k}" for i in (1, 2, 3) for k in (1, 2, 3)))
"""Of the truth: number and time of each frame, what befalls it, the frame whose picture it shows, and its pose: centre and camera_from_world."""


def run_video(workspace: Workspace, task: Task) -> Outcome:
    """Render all frames, one after another, and encode them."""
    p = task.parameters_as(FilmParameters)
    frames = plan_video(p.area, p.ground_m, p.video, p.seed)
    size = p.video.width_px, p.video.height_px
    with tempfile.TemporaryDirectory(prefix="cityflow-") as folder:
        path = Path(folder) / Path(VIDEO_PATH).name
        write_video(path, _pictures(p, frames), size, p.video.frames_a_second)
        workspace.publish_file(VIDEO_PATH, path)
    if p.video.subtitles:
        workspace.publish(SUBTITLES_PATH, _subtitles(p, frames).encode())
    workspace.publish(TRUTH_PATH, truth_table(frames).encode())
    return workspace.outcome(result={"frames": len(frames)})


def _pictures(p: FilmParameters, frames: tuple[VideoFrame, ...]) -> Iterator[PixelArray]:
    town = town_of(p.seed, p.town)
    scene = scene_over(p.seed, town.parameters, _bounds(town, frames))
    # a video's exposure does not jump from frame to frame
    sensor = p.render.sensor.model_copy(update={"exposure_sigma": 0.0})
    again = {f.shows for k, f in enumerate(frames) if f.shows != k}
    kept: dict[int, PixelArray] = {}
    light, of = None, None
    for number, frame in enumerate(frames):
        if frame.shows in kept:
            yield kept[frame.shows]
            continue
        if light is None or of is None or not np.array_equal(of.centre, frame.image.centre) or any(frame.blur):
            light, of = moved_light(irradiance(scene, frame.image, p.render), frame.blur), frame.image
        pixels = exposed(light, frame.image, sensor, p.seed)
        if number in again:
            kept[number] = pixels
        yield pixels


def _bounds(town: Town, frames: tuple[VideoFrame, ...]) -> Bounds:
    """What of the town all frames are rendered from."""
    each = np.array([scene_bounds(town, f.image) for f in frames])
    (x_0, y_0), (x_1, y_1) = each[:, :2].min(axis=0).tolist(), each[:, 2:].max(axis=0).tolist()
    return x_0, y_0, x_1, y_1


def _subtitles(p: FilmParameters, frames: tuple[VideoFrame, ...]) -> str:
    """The carrier's positions as its receiver has them."""
    rng = np.random.default_rng([p.seed, 33])
    centres = np.array([f.image.centre for f in frames])
    centres = centres + rng.normal(0.0, 1.0, centres.shape) * p.video.position_m
    places = transformed(horizontal_transform(resolve(p.crs), CRS.from_epsg(4326)), centres[:, :2])
    known = [
        CarrierPosition(f.time_s, GnssPosition(latitude, longitude, float(z)), float(z - p.ground_m))
        for f, (longitude, latitude), z in zip(frames, places.tolist(), centres[:, 2], strict=True)
    ]
    return subtitles_text(known, p.video.frames_a_second)


def truth_table(frames: tuple[VideoFrame, ...]) -> str:
    """CSV with `COLUMNS`."""
    lines = [",".join(COLUMNS)]
    for number, f in enumerate(frames):
        pose = [*f.image.centre.tolist(), *f.image.rotation.ravel().tolist()]
        lines.append(",".join([str(number), f"{f.time_s:.6f}", f.kind, str(f.shows), *(f"{v:.9f}" for v in pose)]))
    return "\n".join(lines) + "\n"


def read_truth(text: str, video: VideoParameters) -> tuple[VideoFrame, ...]:
    """What `truth_table` has written; blurs are not in it."""
    from cityflow.core.camera import OrientedImage

    frames = []
    for line in text.splitlines()[1:]:
        number, time, kind, shows, *pose = line.split(",")
        values = np.array(pose, np.float64)
        image = OrientedImage(f"f{int(number):05d}", video.camera, values[3:].reshape(3, 3), values[:3])
        frames.append(VideoFrame(float(time), kind, int(shows), image))
    return tuple(frames)
