"""Rows of the page of an orientation: cameras, images, known points."""

from __future__ import annotations

from dataclasses import dataclass

from cityflow.core.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class CameraRow:
    """A value of a camera.

    Attributes
    ----------
    camera : its name, with the number of its images;  value : what it is, with its unit
    given, adjusted : None where it is not known, or not stated;  sigma : standard deviation, None where it was held
    """

    camera: str
    value: str
    given: float | None
    adjusted: float | None
    sigma: float | None


@dataclass(frozen=True, slots=True)
class ImageRow:
    """An image with a pose; None is unknown.

    Attributes
    ----------
    name : in the catalog;  observations : tie points in it
    reprojection_px : root mean square per axis
    position_sigmas_m, angle_sigmas_deg : of the pose, along x, y, z of the world and of the camera
    move_m, turn_deg : from the given pose;  weak : why little holds it, empty where enough does
    """

    name: str
    observations: int | None = None
    reprojection_px: float | None = None
    position_sigmas_m: tuple[float, ...] = ()
    angle_sigmas_deg: tuple[float, ...] = ()
    move_m: float | None = None
    turn_deg: float | None = None
    weak: str = ""


@dataclass(frozen=True, slots=True)
class PointRow:
    """A control or check point.

    Attributes
    ----------
    role : ``control`` or ``check``;  used : not left out;  marks : images that show it, None unknown
    off_m : (3) where the images have it less where it is known to be; None in height where that is unknown
    mark_px : residual of its marks, None unknown;  problem : what is wrong with it
    """

    name: str
    role: str
    used: bool
    marks: int | None
    off_m: tuple[float | None, ...]
    mark_px: float | None
    problem: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Station:
    """Where an image was taken and looks: (3,) world metres, (3,) of unit length; whether little holds its pose."""

    name: str
    centre: FloatArray
    axis: FloatArray
    weak: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class TiePoints:
    """Tie points of an orientation.

    Attributes
    ----------
    xyz : (M, 3) those that a map shows, world metres
    lengths : (P,) images that show each;  errors_px : (P,) reprojection error of each, NaN where unknown
    """

    xyz: FloatArray
    lengths: FloatArray
    errors_px: FloatArray
