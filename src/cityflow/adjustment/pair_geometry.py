"""Which matches of two images without poses agree with one epipolar geometry (RANSAC of pycolmap: essential matrix, fundamental matrix, homography)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.camera import Camera

if TYPE_CHECKING:
    import pycolmap

SEED = 1
"""Of random samples: the same pair gives the same geometry."""
LEAST_INLIERS = 15
"""Fewer agree by chance (COLMAP's limit)."""
MOST_ERROR_PX = 4.0
"""Of a match that agrees, before distortion is known (COLMAP's limit)."""
MODEL = "SIMPLE_RADIAL"


@dataclass(frozen=True, slots=True)
class PairGeometry:
    """Two images that show the same.

    Attributes
    ----------
    matches : (K, 2) numbers of the points that agree
    kind : COLMAP's number of the configuration (calibrated, uncalibrated, planar, …)
    matrices : (3, 3, 3) essential, fundamental matrix and homography; zeros where one was not found
    pose : (3, 4) the second camera from the first, without scale; zeros where it is unknown
    """

    matches: IntArray
    kind: int
    matrices: FloatArray
    pose: FloatArray


def pycolmap_camera(camera: Camera, is_known: bool) -> pycolmap.Camera:
    """A camera of one focal length and one term of distortion, for pycolmap; `is_known`: whether its focal length is more than a guess."""
    import pycolmap

    params = [camera.fx, camera.cx, camera.cy, camera.distortion[0] if camera.distortion else 0.0]
    return pycolmap.Camera(
        model=MODEL, width=camera.width, height=camera.height, params=params, has_prior_focal_length=is_known
    )


def pair_geometry(
    cameras: tuple[pycolmap.Camera, pycolmap.Camera], uv: tuple[FloatArray, FloatArray], matches: IntArray
) -> PairGeometry | None:
    """What agrees; None where too little does.

    Parameters
    ----------
    uv : of each image the (N, 2) image coordinates of all its points, pixels
    matches : (K, 2) numbers of points in both
    """
    import pycolmap

    if len(matches) < LEAST_INLIERS:
        return None
    options = pycolmap.TwoViewGeometryOptions()
    options.min_num_inliers = LEAST_INLIERS
    options.detect_watermark = False
    options.compute_relative_pose = True
    options.ransac.random_seed = SEED
    options.ransac.num_threads = 1
    options.ransac.max_error = MOST_ERROR_PX
    found = pycolmap.estimate_two_view_geometry(
        cameras[0], uv[0], cameras[1], uv[1], matches.astype(np.uint32), options
    )
    inliers = np.asarray(found.inlier_matches, np.int64).reshape(-1, 2)
    if len(inliers) < LEAST_INLIERS:
        return None
    matrices = np.stack([np.zeros((3, 3)) if m is None else np.asarray(m) for m in (found.E, found.F, found.H)])
    pose = np.zeros((3, 4)) if found.cam2_from_cam1 is None else np.asarray(found.cam2_from_cam1.matrix())
    return PairGeometry(
        inliers, int(found.config.value if hasattr(found.config, "value") else found.config), matrices, pose
    )
