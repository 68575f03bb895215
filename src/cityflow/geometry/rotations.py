"""Rotations as photogrammetry, navigation and computer vision write them, all turned into ``camera_from_world``.

The camera frame here is x right, y down, z forward. Photogrammetry's is x right, y up, z backward; `PHOTO_FLIP` leads from one to the other.
World is x east, y north, z up. Elementary rotations are right-handed, for column vectors::

    Rx(a) = [1 0 0; 0 cos −sin; 0 sin cos]   Ry(a) = [cos 0 sin; 0 1 0; −sin 0 cos]   Rz(a) = [cos −sin 0; sin cos 0; 0 0 1]
"""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from cityflow.core.arrays import FloatArray

PHOTO_FLIP = np.diag([1.0, -1.0, -1.0])
"""From x right, y up, z backward to x right, y down, z forward; its own inverse."""
_BODY_TO_CAMERA = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Axes of the aircraft (forward, right, down) to those of the camera (right, down, ahead)."""
_AHEAD_TO_CAMERA = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Axes of a body that looks forward (forward, right, down) to those of its camera (right, down, ahead)."""
_ENU_TO_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Axes east, north, up to north, east, down."""


class RotationOrder(StrEnum):
    """What three angles mean, in the order in which they are given."""

    OMEGA_PHI_KAPPA = "omega-phi-kappa"
    PHI_OMEGA_KAPPA = "phi-omega-kappa"
    YAW_PITCH_ROLL = "yaw-pitch-roll"


class AngleUnit(StrEnum):
    DEGREE = "degree"
    GRAD = "grad"
    RADIAN = "radian"

    @property
    def radians(self) -> float:
        """One of this unit in radians."""
        return {AngleUnit.DEGREE: np.pi / 180.0, AngleUnit.GRAD: np.pi / 200.0, AngleUnit.RADIAN: 1.0}[self]


def rotation_x(angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rotation_z(angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def from_omega_phi_kappa(omega: float, phi: float, kappa: float) -> FloatArray:
    """(3, 3) camera_from_world of ω about x, then φ about the turned y, then κ about the turned z (radians).

    ``world_from_photo = Rx(ω) · Ry(φ) · Rz(κ)``, hence the matrix M = photo_from_world with

    ====================  =====================================  =====================================
    cos φ cos κ           cos ω sin κ + sin ω sin φ cos κ        sin ω sin κ − cos ω sin φ cos κ
    −cos φ sin κ          cos ω cos κ − sin ω sin φ sin κ        sin ω cos κ + cos ω sin φ sin κ
    sin φ                 −sin ω cos φ                           cos ω cos φ
    ====================  =====================================  =====================================

    and the result is ``PHOTO_FLIP · M``. All angles 0: straight down, x of the image to the east, its top to the north.
    """
    return np.asarray(PHOTO_FLIP @ (rotation_x(omega) @ rotation_y(phi) @ rotation_z(kappa)).T)


def from_phi_omega_kappa(phi: float, omega: float, kappa: float) -> FloatArray:
    """(3, 3) camera_from_world of φ about y, then ω about the turned x, then κ about the turned z (radians).

    ``world_from_photo = Ry(φ) · Rx(ω) · Rz(κ)``; φ is right-handed about y, as ω and κ about their axes (programs that count φ the other way
    need its sign changed in the table).
    """
    return np.asarray(PHOTO_FLIP @ (rotation_y(phi) @ rotation_x(omega) @ rotation_z(kappa)).T)


def from_yaw_pitch_roll(yaw: float, pitch: float, roll: float) -> FloatArray:
    """(3, 3) camera_from_world of an aircraft's attitude, for a camera that looks down with its top forward (radians).

    Yaw counts clockwise from grid north, pitch nose up, roll right wing down: ``ned_from_body = Rz(yaw) · Ry(pitch) · Rx(roll)`` with the body's
    x forward, y right, z down.
    """
    ned_from_body = rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll)
    return np.asarray(_BODY_TO_CAMERA @ ned_from_body.T @ _ENU_TO_NED)


def from_gimbal(yaw: float, pitch: float, roll: float) -> FloatArray:
    """(3, 3) camera_from_world of a camera's own angles (radians): yaw clockwise from north, pitch 0 level and -90° straight down, roll about its axis."""
    ned_from_body = rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll)
    return np.asarray(_AHEAD_TO_CAMERA @ ned_from_body.T @ _ENU_TO_NED)


def gimbal_angles(rotation: FloatArray) -> tuple[float, float, float]:
    """Yaw, pitch and roll (radians) of a (3, 3) camera_from_world, as `from_gimbal` takes them; straight down or up, where only their sum counts, roll is 0."""
    ned_from_body = _ENU_TO_NED @ rotation.T @ _AHEAD_TO_CAMERA
    level = float(np.hypot(ned_from_body[0, 0], ned_from_body[1, 0]))
    pitch = float(np.arctan2(-ned_from_body[2, 0], level))
    if level < 1e-9:
        return float(np.arctan2(-ned_from_body[0, 1], ned_from_body[1, 1])), pitch, 0.0
    yaw, roll = (
        np.arctan2(ned_from_body[1, 0], ned_from_body[0, 0]),
        np.arctan2(ned_from_body[2, 1], ned_from_body[2, 2]),
    )
    return float(yaw), pitch, float(roll)


def from_angles(first: float, second: float, third: float, order: RotationOrder) -> FloatArray:
    """(3, 3) camera_from_world of three angles (radians) in the order that `order` names."""
    if order is RotationOrder.OMEGA_PHI_KAPPA:
        return from_omega_phi_kappa(first, second, third)
    if order is RotationOrder.PHI_OMEGA_KAPPA:
        return from_phi_omega_kappa(first, second, third)
    return from_yaw_pitch_roll(first, second, third)


def omega_phi_kappa(rotation: FloatArray) -> tuple[float, float, float]:
    """ω, φ, κ (radians) of a (3, 3) camera_from_world; where cos φ = 0, κ carries both and ω is 0."""
    m = PHOTO_FLIP @ rotation
    phi = float(np.arcsin(np.clip(m[2, 0], -1.0, 1.0)))
    if np.hypot(m[0, 0], m[1, 0]) < 1e-12:
        return 0.0, phi, float(np.arctan2(m[0, 1], m[1, 1]))
    return float(np.arctan2(-m[2, 1], m[2, 2])), phi, float(np.arctan2(-m[1, 0], m[0, 0]))


def from_quaternion(quaternion: FloatArray) -> FloatArray:
    """(3, 3) rotation of a quaternion w, x, y, z of any length but zero.

    Raises
    ------
    ValueError
        Where the quaternion is zero or not finite.
    """
    q = np.asarray(quaternion, np.float64)
    length = float(np.linalg.norm(q))
    if not np.isfinite(length) or length < 1e-12:
        raise ValueError(f"{quaternion} is no rotation")
    w, x, y, z = q / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def to_quaternion(rotation: FloatArray) -> FloatArray:
    """(4,) unit quaternion w, x, y, z with w ≥ 0 of a (3, 3) rotation.

    The largest component is found first, so that nothing small is divided by.
    """
    r = np.asarray(rotation, np.float64)
    squares = np.array([
        1 + r[0, 0] + r[1, 1] + r[2, 2], 1 + r[0, 0] - r[1, 1] - r[2, 2],
        1 - r[0, 0] + r[1, 1] - r[2, 2], 1 - r[0, 0] - r[1, 1] + r[2, 2],
    ])  # fmt: skip
    products = np.array([
        [squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
        [r[2, 1] - r[1, 2], squares[1], r[1, 0] + r[0, 1], r[0, 2] + r[2, 0]],
        [r[0, 2] - r[2, 0], r[1, 0] + r[0, 1], squares[2], r[2, 1] + r[1, 2]],
        [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[2, 1] + r[1, 2], squares[3]],
    ])  # fmt: skip
    q = products[int(np.argmax(squares))]
    q = q / np.linalg.norm(q)
    return np.asarray(-q if q[0] < 0 else q)


def nearest_rotation(matrix: FloatArray) -> FloatArray:
    """The (3, 3) rotation nearest to a matrix that is one but for rounding or scale.

    Raises
    ------
    ValueError
        Where the matrix is not finite, singular, or a reflection.
    """
    m = np.asarray(matrix, np.float64)
    if not np.isfinite(m).all() or np.linalg.det(m) <= 1e-12:
        raise ValueError("the matrix is not a rotation")
    u, _, vt = np.linalg.svd(m)
    return np.asarray(u @ vt)
