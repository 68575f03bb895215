"""Where a survey aircraft takes its pictures: strips over an area, several heads firing at each station."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.grid import Bounds
from cityflow.core.parameters import Parameters
from cityflow.errors import CityflowError
from cityflow.synthetic.footprints import ground_quad, meets

Direction = Literal["nadir", "forward", "back", "left", "right"]
AZIMUTH: dict[str, float] = {"nadir": 0.0, "forward": 0.0, "right": 90.0, "back": 180.0, "left": 270.0}
"""Degrees clockwise from the direction of flight."""


class Head(Parameters):
    """One camera of the system."""

    name: str = Field("nadir", pattern=r"^[a-z0-9]+$", description="part of the image names")
    direction: Direction = Field("nadir", description="viewing direction, as seen from the pilot")
    tilt_deg: float = Field(0.0, ge=0, le=70, description="angle from the nadir, degrees")
    focal_factor: float = Field(1.0, gt=0.1, le=10, description="focal length over that of the first head")
    size_factor: float = Field(1.0, gt=0.05, le=4, description="pixels per edge over those of the first head")


class FlightParameters(Parameters):
    """What is flown; the first head is the one that GSD and overlaps are stated for."""

    gsd_m: float = Field(
        0.08, gt=0.005, le=1, description="ground sampling distance of the first head in its image centre, metres"
    )
    altitude_m: float | None = Field(None, gt=10, le=10000, description="above ground, metres; none: from the GSD")
    width_px: int = Field(6000, ge=64, le=40000, description="of the first head's images, pixels")
    height_px: int = Field(4000, ge=64, le=40000, description="of the first head's images, pixels")
    focal_widths: float = Field(1.4, ge=0.5, le=6, description="focal length over image width; unused with an altitude")
    heads: tuple[Head, ...] = Field((Head(),), min_length=1, description="cameras that fire together")
    forward_overlap: float = Field(0.8, ge=0, le=0.98, description="share of the first head's footprint")
    side_overlap: float = Field(0.6, ge=0, le=0.98, description="share of the first head's footprint")
    heading_deg: float = Field(0.0, ge=0, lt=360, description="heading of the strips, degrees clockwise from north")
    crossing: bool = Field(False, description="a second set of strips at a right angle")
    serpentine: bool = Field(True, description="every second strip is flown the other way")
    margin_m: float = Field(
        0.0, ge=0, le=5000, description="margin of stations beyond those that cover the area, metres"
    )
    all_stations: bool = Field(False, description="keep images whose footprint misses the area")
    attitude_sigma_deg: float = Field(
        0.4, ge=0, le=5, description="deviation of roll, pitch and yaw from the plan, degrees (standard deviation)"
    )
    position_sigma: float = Field(
        0.004, ge=0, le=0.1, description="deviation of stations from the plan, share of the altitude"
    )
    jitter_seed: int = Field(0, ge=0, description="seed of the errors of attitude and position")
    distortion: tuple[float, ...] = Field((), description="OpenCV's perspective coefficients, of all heads")
    principal_px: tuple[float, float] = Field((0.0, 0.0), description="principal point off the image centre, pixels")

    @model_validator(mode="after")
    def _names_differ(self) -> FlightParameters:
        names = [h.name for h in self.heads]
        if len(set(names)) < len(names):
            raise ValueError(f"two heads have the same name: {names}")
        return self

    @property
    def focal_px(self) -> float:
        """Focal length of the first head, pixels."""
        if self.altitude_m is None:
            return self.focal_widths * self.width_px
        return self.altitude_m / math.cos(math.radians(self.heads[0].tilt_deg)) / self.gsd_m

    @property
    def flying_height_m(self) -> float:
        """Above the ground."""
        return self.gsd_m * self.focal_px * math.cos(math.radians(self.heads[0].tilt_deg))

    def camera(self, head: Head) -> Camera:
        width, height = round(self.width_px * head.size_factor), round(self.height_px * head.size_factor)
        focal = self.focal_px * head.focal_factor
        cx, cy = width / 2 + self.principal_px[0], height / 2 + self.principal_px[1]
        return Camera(width, height, focal, focal, cx, cy, self.distortion)


def plan_flight(bounds: Bounds, ground_height: float, parameters: FlightParameters) -> tuple[OrientedImage, ...]:
    """Images over `bounds`, strip after strip, named ``s<strip>_<station>_<head>``.

    Stations go so far that every head has image centres all the way to the edge of the area; images that see none of it are left out
    unless the parameters ask for all.

    Parameters
    ----------
    bounds : world metres
    ground_height : world metres, of the plane that GSD and overlaps are reckoned on

    Raises
    ------
    CityflowError
        A head sees the horizon, or would make more than a million images.
    """
    p = parameters
    rng = np.random.default_rng([p.jitter_seed, 5])
    images: list[OrientedImage] = []
    strip = 0
    for turn in (0.0, 90.0) if p.crossing else (0.0,):
        heading = math.radians(p.heading_deg + turn)
        for across, alongs in _strips(bounds, heading, p):
            reverse = p.serpentine and strip % 2 == 1
            for station, along in enumerate(reversed(alongs) if reverse else alongs):
                centre = _to_world(bounds, heading, along, across, ground_height + p.flying_height_m)
                flown = heading + (math.pi if reverse else 0.0)
                images += _fired(f"s{strip:02d}_{station:03d}", centre, flown, p, rng)
            strip += 1
    if p.all_stations:
        return tuple(images)
    return tuple(i for i in images if meets(ground_quad(i, ground_height), bounds))


def _strips(bounds: Bounds, heading: float, p: FlightParameters) -> list[tuple[float, list[float]]]:
    """Offset across the direction of flight, and stations along it, of each strip; metres from the centre of `bounds`."""
    boxes = [_box(p, head) for head in p.heads]
    first = boxes[0]
    base = (1 - p.forward_overlap) * (first[1] - first[0])
    spacing = (1 - p.side_overlap) * (first[3] - first[2])
    half_along, half_across = _half_extent(bounds, heading)
    centres = [((b[0] + b[1]) / 2, (b[2] + b[3]) / 2) for b in boxes]
    sides = (1.0, -1.0) if p.serpentine else (1.0,)
    along = _steps(half_along + p.margin_m, [s * c[0] for c in centres for s in sides], base)
    across = _steps(half_across + p.margin_m, [s * c[1] for c in centres for s in sides], spacing)
    if len(along) * len(across) * len(p.heads) > 1_000_000:
        raise CityflowError(
            f"{len(across)} strips of {len(along)} stations are too many", remedy="less overlap, or a smaller area"
        )
    return [(a, along) for a in across]


def _steps(half: float, centres: list[float], step: float) -> list[float]:
    """Positions every `step`, symmetrical, from which a footprint centred `centre` ahead can stand anywhere in ± half."""
    reach = half + max(abs(c) for c in centres)
    count = math.ceil(2 * reach / step - 1e-9)
    return [(i - count / 2) * step for i in range(count + 1)]


def _half_extent(bounds: Bounds, heading: float) -> tuple[float, float]:
    """Half the extent of an area along and across a heading, metres."""
    dx, dy = (bounds[2] - bounds[0]) / 2, (bounds[3] - bounds[1]) / 2
    s, c = abs(math.sin(heading)), abs(math.cos(heading))
    return s * dx + c * dy, c * dx + s * dy


def _box(p: FlightParameters, head: Head) -> tuple[float, float, float, float]:
    """Least and greatest distance along and across the flight that all rows and columns of a head reach, metres."""
    image = OrientedImage("plan", p.camera(head), head_rotation(head, 0.0), np.array([0.0, 0.0, p.flying_height_m]))
    quad = ground_quad(image, 0.0)
    x, y = np.sort(quad[:, 0]), np.sort(quad[:, 1])
    # a trapezium's inner extent: what is between its two middle corners is in every row, or in every column
    return float(y[1]), float(y[2]), float(x[1]), float(x[2])


def _to_world(bounds: Bounds, heading: float, along: float, across: float, z: float) -> FloatArray:
    s, c = math.sin(heading), math.cos(heading)
    x, y = (bounds[0] + bounds[2]) / 2, (bounds[1] + bounds[3]) / 2
    return np.array([x + s * along + c * across, y + c * along - s * across, z])


def _fired(
    name: str, centre: FloatArray, heading: float, p: FlightParameters, rng: np.random.Generator
) -> list[OrientedImage]:
    """The images of one station: the heads are fixed to one another and move with the aircraft."""
    centre = centre + rng.normal(0.0, 1.0, 3) * p.position_sigma * p.flying_height_m
    body = small_rotation(rng.normal(0.0, 1.0, 3) * math.radians(p.attitude_sigma_deg))
    return [
        OrientedImage(f"{name}_{h.name}", p.camera(h), head_rotation(h, heading) @ body, centre, h.name)
        for h in p.heads
    ]


def head_rotation(head: Head, heading: float) -> FloatArray:
    """(3, 3) camera_from_world of a head in level flight; `heading` radians clockwise from north.

    A nadir image has its top in the direction of flight; an oblique one has the horizon upwards.
    """
    azimuth, tilt = heading + math.radians(AZIMUTH[head.direction]), math.radians(head.tilt_deg)
    outwards = np.array([math.sin(azimuth), math.cos(azimuth), 0.0])
    right = np.array([math.cos(azimuth), -math.sin(azimuth), 0.0])
    forward = math.sin(tilt) * outwards - math.cos(tilt) * np.array([0.0, 0.0, 1.0])
    return np.array([right, np.cross(forward, right), forward])


def small_rotation(angles: FloatArray) -> FloatArray:
    """(3, 3) rotation about the axis `angles` by its length, radians."""
    angle = float(np.linalg.norm(angles))
    if angle < 1e-15:
        return np.eye(3)
    x, y, z = angles / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross)
