"""A synthetic flight with five heads, and what its projections are, for the tests of formats that contractors deliver."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.io.orientation.oriented_images import OrientationModel
from cityflow.synthetic.flight import FlightParameters, Head, plan_flight

ORIGIN = np.array([458_000.0, 5_428_000.0, 0.0])
HEADS = (
    Head(name="nadir"), Head(name="left", direction="left", tilt_deg=45, focal_factor=1.3),
    Head(name="right", direction="right", tilt_deg=45, focal_factor=1.3),
    Head(name="forward", direction="forward", tilt_deg=45, focal_factor=1.3), Head(name="back", direction="back", tilt_deg=40),
)  # fmt: skip
PIXEL_MM = 0.004


def flight(heads: tuple[Head, ...] = HEADS, distortion: tuple[float, ...] = ()) -> tuple[OrientedImage, ...]:
    """Images over a square of 240 m in UTM coordinates, heights around 115 m, with a principal point off the middle and angles off by 2°."""
    x, y = ORIGIN[:2]
    how = FlightParameters(
        gsd_m=0.2, width_px=900, height_px=600, heads=heads, forward_overlap=0.6, side_overlap=0.4, heading_deg=33.0,
        attitude_sigma_deg=2.0, jitter_seed=5, distortion=distortion, principal_px=(3.7, -2.2),
    )  # fmt: skip
    return plan_flight((x, y, x + 240.0, y + 240.0), 115.0, how)


def ground(seed: int = 3) -> FloatArray:
    """(500, 3) places on and above the ground."""
    rng = np.random.default_rng(seed)
    return np.asarray(ORIGIN + np.column_stack([rng.uniform(-300, 540, (500, 2)), rng.uniform(110, 140, 500)]))


def largest_difference_px(model: OrientationModel, images: tuple[OrientedImage, ...]) -> float:
    """Of projections of `ground`, in images that hold them; names are compared without their endings."""
    found = {image.name.split(".")[0]: image for image in model.images}
    assert set(found) == {image.name.split(".")[0] for image in images}
    assert not model.left_out
    largest, compared = 0.0, 0
    for image in images:
        uv, depth = image.project(ground())
        seen = image.holds(uv) & (depth > 0)
        compared += int(seen.sum())
        other, _ = found[image.name.split(".")[0]].project(ground())
        largest = max(largest, float(np.abs(other - uv)[seen].max(initial=0.0)))
    assert compared > 10 * len(images)
    return largest
