from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.geometry.rotations import PHOTO_FLIP, from_omega_phi_kappa, omega_phi_kappa
from cityflow.orientation.plausibility import SURVEY, datum_doubt, implausible
from orientation.regular_flight import flight, images_of, reread


def in_grad(rotation: FloatArray) -> FloatArray:
    """Angles in grad from 0 to 400, read as degrees."""
    grads = [np.degrees(a) / 0.9 % 400 for a in omega_phi_kappa(rotation)]
    return from_omega_phi_kappa(*np.radians(grads))


def phi_first(rotation: FloatArray) -> FloatArray:
    """Angles of Ry(φ) Rx(ω) Rz(κ), read as ω, φ, κ."""
    world_from_photo = (PHOTO_FLIP @ rotation).T
    omega = -np.arcsin(np.clip(world_from_photo[1, 2], -1, 1))
    phi = np.arctan2(world_from_photo[0, 2], world_from_photo[2, 2])
    kappa = np.arctan2(world_from_photo[1, 0], world_from_photo[1, 1])
    return from_omega_phi_kappa(float(omega), float(phi), float(kappa))


MISREAD: dict[str, tuple[Callable[[FloatArray], FloatArray], str]] = {
    "grad": (in_grad, "grad"),
    "transposed": (lambda r: r.T, "transpose"),
    "photo": (lambda r: PHOTO_FLIP @ r, "y up, z backward"),
    "order": (phi_first, "phi-omega-kappa"),
}


@pytest.mark.parametrize("turn_deg", [0.0, 20.0, 63.0])
@pytest.mark.parametrize("heads", ["N", "NLR", "NFBLR"])
def test_a_plain_flight_is_not_doubted(turn_deg: float, heads: str) -> None:
    images = images_of(flight(4, 6, heads=heads, turn_deg=turn_deg, jitter_deg=2.0))
    assert implausible(images, 0.0) == []


@pytest.mark.parametrize("name", MISREAD)
@pytest.mark.parametrize("seed", [0, 1])
def test_a_wrong_reading_is_named(name: str, seed: int) -> None:
    misread, word = MISREAD[name]
    images = images_of(flight(4, 6, heads="NFBLR", turn_deg=25.0, seed=seed))
    doubts = implausible(reread(images, [misread(i.rotation) for i in images]))
    assert doubts[0][0] == SURVEY
    assert word in doubts[0][2]


def test_a_vertical_flight_in_grad_is_named() -> None:
    images = images_of(flight(4, 6, turn_deg=25.0))
    (doubt,) = implausible(reread(images, [in_grad(i.rotation) for i in images]))
    assert "grad" in doubt[2]


def test_single_images_are_named() -> None:
    images = images_of(flight(4, 6))
    images[2] = replace(images[2], centre=np.add(images[2].centre, (1e6, 0, 0)))
    images[3] = replace(images[3], rotation=PHOTO_FLIP @ images[3].rotation)
    images[4] = replace(images[4], rotation=np.diag([-1.0, 1, 1]) @ images[4].rotation)
    images[5] = replace(images[5], centre=images[5].centre * (1, 1, -1))
    doubts = {name: reason for name, reason, _ in implausible(images, 0.0)}
    assert set(doubts) == {images[k].name for k in (2, 3, 4, 5)}
    assert "middle of the survey" in doubts[images[2].name]
    assert "horizon" in doubts[images[3].name]
    assert "reflection" in doubts[images[4].name]
    assert "below the ground" in doubts[images[5].name]


def test_a_survey_below_the_ground_or_in_one_place() -> None:
    images = images_of(flight(3, 4))
    assert any("below the ground" in reason for _, reason, _ in implausible(images, 2000.0))
    still = [replace(i, centre=images[0].centre) for i in images]
    assert any("one place" in reason for _, reason, _ in implausible(still))


def test_footprints_that_never_meet_are_told() -> None:
    images = images_of(flight(3, 4))
    narrow = [replace(i, camera=replace(i.camera, fx=60_000.0, fy=60_000.0)) for i in images]
    (doubt,) = implausible(narrow, 0.0)
    assert "meet none" in doubt[1]
    assert "focal length" in doubt[2]


@pytest.mark.parametrize(
    ("shift", "factor", "word"), [(43.2, 1.0, "geoid"), (0.0, 1 / 0.3048, "feet"), (900.0, 1.0, "origin")]
)
def test_heights_in_another_datum(shift: float, factor: float, word: str) -> None:
    rng = np.random.default_rng(0)
    reference = np.column_stack([rng.uniform(0, 500, (200, 2)), rng.normal(60, 2, 200)])
    points = reference * (1, 1, factor) + rng.normal(0, 0.5, (200, 3)) + [0, 0, shift]
    doubt = datum_doubt(points, reference)
    assert doubt is not None
    assert word in doubt[2]
    assert datum_doubt(reference + rng.normal(0, 1.5, (200, 3)), reference) is None
    far = datum_doubt(np.add(points, (1e5, 0, 0)), reference)
    assert far is not None
    assert "nowhere near" in far[1]
