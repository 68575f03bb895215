"""The camera that the page gets draws places of the model where the photograph shows them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import FISHEYE, PERSPECTIVE, Camera, OrientedImage
from cityflow.io.crs import resolve
from cityflow.reporting.desk_photograph import MOST_PX, Part
from cityflow.reporting.view_frame import PageFrame

X, Y = 90000.0, 460000.0
FRAME = PageFrame.over(resolve("EPSG:7415"), (X - 2000, Y - 2000, X + 2000, Y + 2000))
SOLID = np.array([[X + 1500 + a, Y + 900 + b, c] for a in (0, 12) for b in (0, 9) for c in (2.0, 11.0)])


class Painted:
    """Pixels whose colours tell their places: red grows with the column, green with the row."""

    def __init__(self, camera: Camera) -> None:
        self.height, self.width, self.bands = camera.height, camera.width, 3

    def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int = 0) -> np.ndarray:
        step = 1 << level
        r, c = np.meshgrid((np.arange(*rows) + 0.5) * step, (np.arange(*cols) + 0.5) * step, indexing="ij")
        return np.stack([c, r, np.zeros_like(r)], axis=-1)


def seen_from(camera: Camera, tilt_deg: float) -> OrientedImage:
    """From the south, 300 m away from the building."""
    t = np.radians(tilt_deg)
    axis = np.array([0.0, np.sin(t), -np.cos(t)])
    right = np.array([1.0, 0.0, 0.0])
    middle = SOLID.mean(axis=0)
    return OrientedImage(
        "a", camera, np.array([right, np.cross(axis, right), axis]), middle - 300 * axis + np.array([20.0, 5.0, 0.0])
    )


CAMERAS = [
    Camera(4000, 3000, 3500.0, 3510.0, 2010.0, 1490.0),
    Camera(4000, 3000, 3500.0, 3510.0, 2010.0, 1490.0, (-0.1, 0.05, 0.001, -0.0005, 0.01), PERSPECTIVE),
    Camera(4000, 3000, 1500.0, 1500.0, 2000.0, 1500.0, (0.01, -0.002, 0.0, 0.0), FISHEYE),
    Camera(14000, 10000, 70000.0, 70000.0, 7000.0, 5000.0),
]


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("tilt_deg", [0.0, 45.0])
def test_places_are_drawn_where_the_photograph_shows_them(camera: Camera, tilt_deg: float) -> None:
    image = seen_from(camera, tilt_deg)
    part = Part.around(image, SOLID)
    assert part is not None
    assert max(part.camera.width, part.camera.height) <= MOST_PX
    told = part.as_json(FRAME.to_world, SOLID.mean(axis=0))
    drawn = on_part(told, FRAME.local(SOLID))
    assert (drawn > 0).all()
    assert (drawn < [told["width"], told["height"]]).all()
    # where the part shows that place of the photograph, by its colours
    uv, _ = image.project(SOLID)
    shown = part.image.camera.distort(part.camera.undistort(drawn))
    assert np.abs(shown - uv).max() < 0.05 * part.step


def test_the_part_is_the_photograph_without_distortion(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "cityflow.reporting.desk_photograph.ortho_pixels",
        lambda bands: np.moveaxis(np.asarray(bands, np.float32), 0, -1),
    )
    for camera in CAMERAS[:3]:
        part = Part.around(seen_from(camera, 30.0), SOLID)
        assert part is not None
        pixels = part.pixels(Painted(camera))  # type: ignore[arg-type]  # what a window is made from
        assert pixels.shape == (part.camera.height, part.camera.width, 3)
        rows, cols = (
            np.array([5, part.camera.height // 2, part.camera.height - 6]),
            np.array([7, part.camera.width // 2, 9]),
        )
        expected = part.image.camera.distort(part.camera.undistort(np.column_stack([cols + 0.5, rows + 0.5])))
        assert np.abs(pixels[rows, cols, :2] - expected).max() < 0.1


def test_a_photograph_that_cuts_the_building_off_is_not_taken() -> None:
    image = seen_from(CAMERAS[0], 0.0)
    assert Part.around(image, SOLID + np.array([185.0, 0.0, 0.0])) is None
    assert Part.around(image, SOLID + np.array([0.0, 0.0, 400.0])) is None


def on_part(told: dict[str, Any], places: FloatArray) -> FloatArray:
    """(N, 2) pixels of the part, as the page draws them."""
    view = np.array(told["view"])
    x, y, z = (places @ view[:, :3].T + view[:, 3]).T
    return np.column_stack([told["fx"] * x / z + told["cx"], told["fy"] * y / z + told["cy"]])
