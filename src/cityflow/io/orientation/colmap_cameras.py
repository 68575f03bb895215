"""COLMAP's camera models as cameras whose distortion OpenCV knows."""

from __future__ import annotations

from cityflow.core.camera import FISHEYE, Camera

MODELS: dict[str, tuple[int, int]] = {
    "SIMPLE_PINHOLE": (0, 3), "PINHOLE": (1, 4), "SIMPLE_RADIAL": (2, 4), "RADIAL": (3, 5), "OPENCV": (4, 8),
    "OPENCV_FISHEYE": (5, 8), "FULL_OPENCV": (6, 12), "FOV": (7, 5), "SIMPLE_RADIAL_FISHEYE": (8, 4),
    "RADIAL_FISHEYE": (9, 5), "THIN_PRISM_FISHEYE": (10, 12), "RAD_TAN_THIN_PRISM_FISHEYE": (11, 16),
}  # fmt: skip
"""Name → number in binary files, and number of parameters."""
BY_NUMBER = {number: (name, count) for name, (number, count) in MODELS.items()}
ONE_FOCAL = ("SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE")
TWO_FOCAL = ("PINHOLE", "OPENCV", "FULL_OPENCV", "OPENCV_FISHEYE")
REMEDY = "undistort the images with COLMAP's image_undistorter and use its model, or calibrate as OPENCV"


def camera_of(model: str, width: int, height: int, params: tuple[float, ...]) -> Camera:
    """The camera of a COLMAP model.

    Raises
    ------
    ValueError
        Where the model has no counterpart, or the numbers cannot be a camera.
    """
    if model not in ONE_FOCAL + TWO_FOCAL:
        raise ValueError(f"the camera model {model} cannot be undistorted here")
    if len(params) != MODELS[model][1]:
        raise ValueError(f"the camera model {model} has {MODELS[model][1]} parameters, the file gives {len(params)}")
    if model in ONE_FOCAL:
        fx = fy = params[0]
        cx, cy, *distortion = params[1:]
    else:
        fx, fy, cx, cy, *distortion = params
    if not (width > 0 and height > 0 and 0 < fx < 1e7 and 0 < fy < 1e7):
        raise ValueError(f"impossible camera: {width} × {height} pixels, focal lengths {fx:g} and {fy:g}")
    return _with_distortion(model, Camera(width, height, fx, fy, cx, cy), tuple(distortion))


def _with_distortion(model: str, plain: Camera, distortion: tuple[float, ...]) -> Camera:
    fisheye = model.endswith("FISHEYE")
    if not fisheye and not any(distortion):
        return plain
    if not fisheye and len(distortion) < 4:
        distortion += (0.0,) * (4 - len(distortion))
    kind = FISHEYE if fisheye else plain.kind
    return Camera(plain.width, plain.height, plain.fx, plain.fy, plain.cx, plain.cy, distortion, kind)


def model_of(camera: Camera) -> tuple[str, tuple[float, ...]]:
    """Name and parameters of the least COLMAP model that holds a camera."""
    start = (camera.fx, camera.fy, camera.cx, camera.cy)
    if camera.kind == FISHEYE:
        return "OPENCV_FISHEYE", start + _padded(camera.distortion, 4)
    if camera.is_pinhole:
        return "PINHOLE", start
    if len(camera.distortion) <= 4:
        return "OPENCV", start + _padded(camera.distortion, 4)
    return "FULL_OPENCV", start + _padded(camera.distortion, 8)


def _padded(values: tuple[float, ...], length: int) -> tuple[float, ...]:
    return values + (0.0,) * (length - len(values))
