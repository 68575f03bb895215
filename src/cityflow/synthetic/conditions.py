"""What a survey suffers from, by name: changes of the parameters of a synthetic survey."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cityflow.errors import CityflowError

CLEAN = "clean"
_PICTURES: dict[str, Any] = {
    # at the limit of resolution 9 % of the contrast are left: between a sharp lens and a weak one;
    # a full well of 5,000 electrons: a small sensor, or a large one at ISO 800
    "render": {"sensor": {"blur_px": 0.7, "full_well_e": 5000.0, "read_noise_e": 15.0, "exposure_sigma": 0.2}},
    "jpeg_quality": 60,
}
CONDITIONS: dict[str, Mapping[str, Any]] = {
    CLEAN: {},
    # an adjustment left its errors in each pose by itself
    "spoiled": {**_PICTURES, "given": {"position_m": 0.02, "angle_px": 0.4}},
    # the standard scene: discontinuities, through a lens that is known, with the errors of "spoiled"
    "standard": {
        **_PICTURES,
        "town": {"level": 2, "eaves": 0.5},
        "flight": {"distortion": [-0.06, 0.05, 2e-4, -3e-4], "principal_px": [6.0, -4.0]},
        "given": {"position_m": 0.02, "angle_px": 0.4},
    },
    # GNSS of a good receiver, an IMU, and the data sheet's focal length; 1 % of distortion in the corners, as lenses have it that nobody corrected
    "uncalibrated": {
        **_PICTURES,
        "flight": {"distortion": [-0.06, 0.05, 2e-4, -3e-4], "principal_px": [6.0, -4.0]},
        "given": {
            "position_m": 0.1,
            "angle_deg": 0.1,
            "together": True,
            "interior": "nominal",
            "focal_share": 0.01,
        },
        "exif": True,
        "control": {},
    },
}


def condition(name: str) -> Mapping[str, Any]:
    """The changes to `SynthParameters`, as a tree of keys.

    >>> condition("spoiled")["jpeg_quality"]
    60

    Raises
    ------
    CityflowError
        No condition has this name.
    """
    if name not in CONDITIONS:
        raise CityflowError(f"no condition is called {name!r}", remedy=f"one of {', '.join(CONDITIONS)}")
    return CONDITIONS[name]
