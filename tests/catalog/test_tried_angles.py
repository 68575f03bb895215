"""``catalog create --opk`` finds by the pictures what the angles of a table mean, takes it, and says so."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import cv2
import numpy as np
import pytest

from cityflow.catalog.create import CreatedCatalog, SurveyFiles, SurveyText, create_catalog
from cityflow.catalog.orientation import ImageSource
from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.geometry.rotations import PHOTO_FLIP, from_omega_phi_kappa, omega_phi_kappa
from ground_flight import CAMERA, ORIGIN, ground_pictures

GRAD = np.degrees(1.0) / 0.9


def tilted() -> list[OrientedImage]:
    """Nine images 50 m over the ground that look aside by up to 15°, in two strips of opposite ways."""
    rng = np.random.default_rng(6)
    images = []
    for k in range(9):
        omega, phi = rng.uniform(-0.25, 0.25, 2).tolist()
        kappa = 0.5 + np.pi * (k // 3 % 2) + float(rng.normal(0, 0.03))
        centre = np.array([9.0 * (k % 3) - 9, 9.0 * (k // 3) - 9, 50.0 + rng.normal(0, 1.5)])
        images.append(OrientedImage(f"i{k}.png", CAMERA, from_omega_phi_kappa(omega, phi, kappa), centre))
    return images


def as_omega_phi_kappa(rotation: FloatArray) -> FloatArray:
    return np.asarray(np.degrees(omega_phi_kappa(rotation)))


def as_grad(rotation: FloatArray) -> FloatArray:
    return np.asarray(np.array(omega_phi_kappa(rotation)) * GRAD)


def as_phi_omega_kappa(rotation: FloatArray) -> FloatArray:
    """In the columns omega, phi, kappa, as such tables have them."""
    m = (PHOTO_FLIP @ rotation).T
    return np.asarray(np.degrees([np.arcsin(-m[1, 2]), np.arctan2(m[0, 2], m[2, 2]), np.arctan2(m[1, 0], m[1, 1])]))


def with_turned_signs(rotation: FloatArray) -> FloatArray:
    return np.asarray(-np.degrees(omega_phi_kappa(rotation)))


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return ground_pictures(tmp_path_factory.mktemp("tilted") / "images", tilted())


def created(
    folder: Path, pictures: Path, write: Callable[[FloatArray], FloatArray], options: Mapping[str, str] | None = None
) -> CreatedCatalog:
    lines = ["name,x,y,z,omega,phi,kappa"]
    for image in tilted():
        values = [*(image.centre + ORIGIN), *write(image.rotation)]
        lines.append(",".join([image.name, *(f"{v:.8f}" for v in values)]))
    (folder / "angles.csv").write_text("\n".join(lines) + "\n")
    (folder / "cameras.csv").write_text(f"id,width,height,focal_px\nc,{CAMERA.width},{CAMERA.height},{CAMERA.fx}\n")
    source = ImageSource(
        pictures, {"opk": folder / "angles.csv"}, {"cameras": str(folder / "cameras.csv"), **(options or {})}, heights=(-2.0, 2.0), gains=False
    )  # fmt: skip
    return create_catalog(
        folder / "catalog",
        SurveyFiles(images=source),
        crs="EPSG:7415",
        text=SurveyText(title="tilted", date="2026-06-21"),
    )


def off_deg(made: CreatedCatalog) -> float:
    """The largest angle between the rotations of the catalog and the true ones."""
    truth = {Path(i.name).stem: i.rotation for i in tilted()}
    cosines = [(np.trace(a.oriented.rotation @ truth[a.name].T) - 1) / 2 for a in made.catalog.images]
    return float(np.degrees(np.arccos(np.clip(min(cosines), -1, 1))))


@pytest.mark.parametrize(
    ("write", "told"),
    [
        (as_omega_phi_kappa, "omega-phi-kappa in degrees"), (as_grad, "omega-phi-kappa in grads"),
        (as_phi_omega_kappa, "phi-omega-kappa in degrees"), (with_turned_signs, "signs turned"),
    ],
    ids=["degrees", "grads", "phi first", "signs"],
)  # fmt: skip
def test_each_convention_is_found_and_said(
    tmp_path: Path, pictures: Path, write: Callable[[FloatArray], FloatArray], told: str
) -> None:
    made = created(tmp_path, pictures, write)
    said = [n for n in made.notes if "angles are read as" in n]
    assert len(said) == 1
    assert told in said[0].partition(": ")[0]
    assert len(made.catalog.images) == len(tilted())
    assert off_deg(made) < 1e-4
    assert not [n for n in made.notes if "doubtful" in n]


def test_what_was_stated_stays_and_a_contradiction_is_said(tmp_path: Path, pictures: Path) -> None:
    made = created(tmp_path, pictures, as_omega_phi_kappa, {"rotation_order": "phi-omega-kappa"})
    assert off_deg(made) > 1.0
    said = [n for n in made.notes if "they stay as stated" in n]
    assert len(said) == 1
    assert said[0].endswith("--rotation-order omega-phi-kappa")


def test_pictures_that_show_nothing_leave_the_angles_as_they_are(tmp_path: Path) -> None:
    folder = tmp_path / "images"
    folder.mkdir()
    for image in tilted():
        cv2.imwrite(str(folder / image.name), np.full((CAMERA.height, CAMERA.width, 3), 90, np.uint8))
    made = created(tmp_path, folder, as_omega_phi_kappa)
    assert off_deg(made) < 1e-4
    assert [n for n in made.notes if "angles stay as they were read" in n and "no pair of pictures" in n]
