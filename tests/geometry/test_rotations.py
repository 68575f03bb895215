from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cityflow.geometry.rotations import (
    PHOTO_FLIP,
    AngleUnit,
    RotationOrder,
    from_angles,
    from_omega_phi_kappa,
    from_phi_omega_kappa,
    from_quaternion,
    from_yaw_pitch_roll,
    nearest_rotation,
    omega_phi_kappa,
    to_quaternion,
)

NADIR = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
ANGLE = st.floats(-3.1, 3.1)


def _deg(*angles: float) -> tuple[float, ...]:
    return tuple(float(a) for a in np.radians(angles))


def test_all_zero_looks_down_with_the_top_to_the_north() -> None:
    for rotation in (from_omega_phi_kappa(0, 0, 0), from_phi_omega_kappa(0, 0, 0), from_yaw_pitch_roll(0, 0, 0)):
        assert rotation == pytest.approx(NADIR)


@pytest.mark.parametrize(
    ("angles", "axis"),
    [
        ((90, 0, 0), (0, 1, 0)),  # omega lifts the view to the north: z of the photo, backward, turns from up to south
        ((-90, 0, 0), (0, -1, 0)),
        ((0, 90, 0), (-1, 0, 0)),  # phi turns backward from up to east
        ((0, 0, 77), (0, 0, -1)),
    ],
)
def test_where_omega_and_phi_look(angles: tuple[float, float, float], axis: tuple[float, float, float]) -> None:
    assert from_omega_phi_kappa(*_deg(*angles))[2] == pytest.approx(np.array(axis), abs=1e-12)


def test_kappa_turns_the_image_counter_clockwise() -> None:
    """At κ = 90° the image's x points north."""
    assert from_omega_phi_kappa(*_deg(0, 0, 90))[0] == pytest.approx((0, 1, 0), abs=1e-12)


def test_omega_phi_kappa_of_a_published_record() -> None:
    """An oblique image of a national survey that states angles and matrix both."""
    published = [
        [0.00981716190118791, 0.999908851350567, 0.00926889006272609],
        [-0.710926523207453, 0.000460826228438361, 0.703266141826372],
        [0.703197768719703, -0.0134935773602192, 0.710866247220709],
    ]
    made = PHOTO_FLIP @ from_omega_phi_kappa(*_deg(1.08745, 44.6841, 89.2089))
    assert made == pytest.approx(np.array(published), abs=1e-6)


def test_the_order_matters_by_hand() -> None:
    """ω = φ = 90°: first ω leads the photo's z (up) to the south, where φ about the turned y (now up) leads it to ... the east."""
    backward = -from_omega_phi_kappa(*_deg(90, 90, 0))[2]
    assert backward == pytest.approx((1, 0, 0), abs=1e-12)
    # φ first leads z to the east, and ω about the turned x (now down) leads it to the south
    backward = -from_phi_omega_kappa(*_deg(90, 90, 0))[2]
    assert backward == pytest.approx((0, -1, 0), abs=1e-12)


def test_yaw_pitch_and_roll_by_hand() -> None:
    east = from_yaw_pitch_roll(*_deg(90, 0, 0))
    assert -east[1] == pytest.approx((1, 0, 0), abs=1e-12)  # top of the image to the east
    nose_up = from_yaw_pitch_roll(*_deg(0, 30, 0))
    assert nose_up[2] == pytest.approx((0, 0.5, -np.sqrt(0.75)), abs=1e-12)  # the view swings forward
    right_down = from_yaw_pitch_roll(*_deg(0, 0, 30))
    assert right_down[2] == pytest.approx((-0.5, 0, -np.sqrt(0.75)), abs=1e-12)  # and to the left


@given(ANGLE, st.floats(-1.5, 1.5), ANGLE)
def test_angles_come_back(omega: float, phi: float, kappa: float) -> None:
    rotation = from_omega_phi_kappa(omega, phi, kappa)
    assert from_omega_phi_kappa(*omega_phi_kappa(rotation)) == pytest.approx(rotation, abs=1e-9)


def test_angles_where_phi_is_a_right_angle() -> None:
    rotation = from_omega_phi_kappa(*_deg(20, 90, 30))
    assert from_omega_phi_kappa(*omega_phi_kappa(rotation)) == pytest.approx(rotation, abs=1e-9)


@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_quaternions_come_back(q: tuple[float, ...]) -> None:
    rotation = from_quaternion(np.array(q))
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1)
    assert from_quaternion(to_quaternion(rotation)) == pytest.approx(rotation, abs=1e-12)


def test_quaternion_by_hand() -> None:
    """A quarter turn about z."""
    rotation = from_quaternion(np.array([np.sqrt(0.5), 0, 0, np.sqrt(0.5)]))
    assert rotation == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]), abs=1e-15)


def test_what_is_no_rotation_is_refused() -> None:
    with pytest.raises(ValueError, match="no rotation"):
        from_quaternion(np.zeros(4))
    with pytest.raises(ValueError, match="not a rotation"):
        nearest_rotation(np.diag([1.0, 1.0, -1.0]))


def test_units() -> None:
    assert 100 * AngleUnit.GRAD.radians == pytest.approx(90 * AngleUnit.DEGREE.radians) == pytest.approx(np.pi / 2)
    assert from_angles(0.1, 0.2, 0.3, RotationOrder.PHI_OMEGA_KAPPA) == pytest.approx(
        from_phi_omega_kappa(0.1, 0.2, 0.3)
    )
