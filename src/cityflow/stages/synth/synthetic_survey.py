"""The synthetic survey: parameters, size of the town, flight plan."""

from __future__ import annotations

import math
from functools import cached_property, lru_cache

import numpy as np
from pydantic import Field, model_validator

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds
from cityflow.core.parameters import Parameters
from cityflow.geometry.similarity import Similarity
from cityflow.synthetic.control_marks import ControlParameters
from cityflow.synthetic.flight import FlightParameters, head_rotation, plan_flight
from cityflow.synthetic.flight_presets import PRESETS
from cityflow.synthetic.footprints import ground_quad
from cityflow.synthetic.pose_noise import PoseErrors, whole_move, with_pose_noise
from cityflow.synthetic.render import RenderParameters
from cityflow.synthetic.sensor_readout import RawParameters
from cityflow.synthetic.town import Town, TownParameters, make_town, town_terrain
from cityflow.synthetic.town_lidar import HALO_M, TownLidarParameters
from cityflow.synthetic.video_flight import VideoFrame, VideoParameters, plan_video, video_reach

BELOW_M = 15.0
"""The ground may lie this much below the plane that a flight is planned on."""
ROUNDED_M = 10.0
LARGEST_TOWN_M = 5000.0


class RawOutput(RawParameters):
    """Frames as the sensor reads them out, beside the pictures."""

    calibration_frames: int = Field(8, ge=2, le=100, description="dark frames, and as many flat frames, of each head")


class SynthParameters(Parameters):
    """A synthetic survey."""

    seed: int = Field(1, ge=0, description="seed of the town and of all noise")
    crs: str = Field("EPSG:7415", description="EPSG:n with heights, or local")
    origin: tuple[float, float] = Field(
        (85000.0, 447000.0), description="south-west corner of the surveyed area, metres"
    )
    size: tuple[float, float] = Field(
        (250.0, 250.0), description="extent of the surveyed area eastwards and northwards, metres"
    )
    surroundings_m: float | None = Field(
        None, ge=0, le=2000,
        description="the town extends so far beyond the surveyed area, metres; null: as far as an image that shows part of the area can see",
    )  # fmt: skip
    town: TownParameters = TownParameters()
    flight: FlightParameters | None = Field(PRESETS["five_cameras"], description="how pictures are taken; null: none")
    render: RenderParameters = RenderParameters()
    raw: RawOutput | None = Field(None, description="raw frames and calibration frames as well; null: none")
    given: PoseErrors = Field(PoseErrors(), description="how far the catalog's orientation is off the true one")
    exif: bool = Field(False, description="JPEG pictures carry place, time and focal length of the given orientation")
    control: ControlParameters | None = Field(
        None, description="control and check points with their marks in the pictures; null: none"
    )
    jpeg_quality: int = Field(95, ge=0, le=100, description="JPEG quality of pictures of 8 bits; 0: lossless TIFF")
    lidar: TownLidarParameters | None = Field(None, description="how the town is scanned; null: not at all")
    video: VideoParameters | None = Field(None, description="a video of a flight over the area; null: none")
    truth_cell_m: float = Field(0.08, ge=0.02, le=1, description="cell of the truth rasters, metres")

    @model_validator(mode="after")
    def _fits(self) -> SynthParameters:
        if min(self.size) < 20:
            raise ValueError(f"an area of {self.size[0]:g} x {self.size[1]:g} m is too small; at least 20 x 20 m")
        if self.flight is None and self.lidar is None and self.video is None:
            raise ValueError("neither a flight, LiDAR nor a video: there is nothing to survey with")
        if self.raw is not None and self.flight is None:
            raise ValueError("raw frames need a flight")
        if self.control is not None and self.flight is None:
            raise ValueError("control points are marked in pictures: they need a flight")
        if self.exif and not self._writes_jpeg:
            raise ValueError(
                "EXIF is written into JPEG pictures only: 8 bits, no near infrared, a jpeg_quality above 0"
            )
        if self.exif and self.crs == "local":
            raise ValueError("a local frame has no latitudes for EXIF: give a crs")
        if self.video is not None and (self.render.sensor.bits != 8 or self.render.near_infrared):
            raise ValueError("a video has three colours of 8 bits")
        if self.video is not None and self.video.subtitles and self.crs == "local":
            raise ValueError("a local frame has no latitudes for subtitles: give a crs, or video.subtitles=false")
        if max(self.size) + 2 * self.around_m > LARGEST_TOWN_M:
            raise ValueError(
                f"the town would be {max(self.size) + 2 * self.around_m:.0f} m wide with the {self.around_m:.0f} m around it that "
                f"images see; at most {LARGEST_TOWN_M:.0f} m: a smaller size, smaller images, or surroundings_m"
            )
        return self

    @property
    def _writes_jpeg(self) -> bool:
        return self.jpeg_quality > 0 and self.render.sensor.bits == 8 and not self.render.near_infrared

    @property
    def area(self) -> Bounds:
        """The surveyed area."""
        (x, y), (width, height) = self.origin, self.size
        return x, y, x + width, y + height

    @cached_property
    def around_m(self) -> float:
        """How far the town goes on beyond the area; with overlaps and seeds it does not change, nor does the town therefore."""
        if self.surroundings_m is not None:
            return max(self.surroundings_m, self._least_m)
        seen = HALO_M if self.flight is None else _reach(self.flight)
        if self.video is not None:
            frames = plan_video(self.area, 0.0, self.video, self.seed)
            seen = max(seen, video_reach(frames, self.area, -BELOW_M))
        return max(math.ceil(seen / ROUNDED_M) * ROUNDED_M, self._least_m)

    @property
    def _least_m(self) -> float:
        """A town has a least extent of its own, so that there is a block in it."""
        return max(0.0, (100.0 - min(self.size)) / 2)

    @property
    def whole_town(self) -> TownParameters:
        """The town with its surroundings."""
        (x, y), (width, height), more = self.origin, self.size, self.around_m
        extent = {
            "origin_x": x - more,
            "origin_y": y - more,
            "width_m": width + 2 * more,
            "height_m": height + 2 * more,
        }
        return self.town.model_copy(update=extent)

    @cached_property
    def images(self) -> tuple[OrientedImage, ...]:
        """What is flown, with true poses."""
        if self.flight is None:
            return ()
        return plan_flight(self.area, round(float(self._middle[2]), 1), self.flight)

    @cached_property
    def video_frames(self) -> tuple[VideoFrame, ...]:
        """What is filmed, with true poses."""
        if self.video is None:
            return ()
        return plan_video(self.area, self.video_ground_m, self.video, self.seed)

    @property
    def video_ground_m(self) -> float:
        """The ground that the video's altitude counts from, metres."""
        return round(float(self._middle[2]), 1)

    @cached_property
    def _middle(self) -> FloatArray:
        """(3,) the ground in the middle of the area, metres."""
        x, y = (self.area[0] + self.area[2]) / 2, (self.area[1] + self.area[3]) / 2
        return np.array([x, y, float(town_terrain(self.seed, self.whole_town).z(np.array([x]), np.array([y]))[0])])

    @property
    def given_images(self) -> tuple[OrientedImage, ...]:
        """What is flown, with the orientation that is handed over."""
        images, move = with_pose_noise(self.images, self.given, self.seed), self.given_move
        return images if move is None else tuple(map(move.moved_image, images))

    @property
    def given_move(self) -> Similarity | None:
        """What the block that is handed over is off by as a whole: from true points to where it has them; None where it is not."""
        errors = self.given
        if not (errors.shift_m or errors.turn_deg or errors.scale_share):
            return None
        return whole_move(errors, self._middle, self.seed)


def _reach(flight: FlightParameters) -> float:
    """The longest side of the box about a footprint: what an image that only just meets the area sees beyond it."""
    slack = math.radians(3 * flight.attitude_sigma_deg)
    longest = 0.0
    for head in flight.heads:
        tilted = head.model_copy(update={"tilt_deg": head.tilt_deg + math.degrees(slack) if head.tilt_deg else 0.0})
        for turn in (0.0, 90.0) if flight.crossing else (0.0,):
            rotation = head_rotation(tilted, math.radians(flight.heading_deg + turn))
            image = OrientedImage("", flight.camera(head), rotation, np.array([0.0, 0.0, flight.flying_height_m]))
            longest = max(longest, float(np.ptp(ground_quad(image, -BELOW_M), axis=0).max()))
    return longest


@lru_cache(maxsize=2)
def town_of(seed: int, parameters: TownParameters) -> Town:
    """The town; kept, as many things are asked of it in one process."""
    return make_town(seed, parameters)
