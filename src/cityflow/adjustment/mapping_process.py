"""The process that maps a database of COLMAP: ``python -m cityflow.adjustment.mapping_process DATABASE OUT METHOD CALIBRATION``.

One thread and fixed seeds, as sums over several threads differ from run to run; a process of its own, as COLMAP ends its process where it finds a
contradiction. Each model is adjusted once more, with more terms of distortion than the mapping has, and written beside the standard deviations of its
focal lengths.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pycolmap

SEED = 1
"""Of random samples: the same photographs give the same models."""
GLOBAL, INCREMENTAL = "global", "incremental"
RADIAL, FULL = "radial", "full"
"""Calibration: focal length and two radial terms, or also principal point and decentring."""
LEAST_IMAGES = 3
"""Of a model: fewer agree by chance, and two have no check; set by hand."""
CALIBRATED = "calibration.json"
MOST_ERROR_PX, LEAST_ANGLE_DEG = 4.0, 1.5
"""Observations further off, and points on flatter rays, are left out before the last adjustment (COLMAP's limits)."""
OPEN_FOCAL = 0.01
"""Share: a focal length that is less certain is left open by the scene, and held; set by hand."""


def main(database: Path, out: Path, method: str, calibration: str) -> None:
    """Map, adjust, and write each model to a folder of its own."""
    # libraries count the cores that they may use
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    import pycolmap

    pycolmap.logging.minloglevel = pycolmap.logging.ERROR.value
    pycolmap.set_random_seed(SEED)
    (_global if method == GLOBAL else _incremental)(database, out)
    start = pycolmap.Database.open(database)
    given = {c.camera_id: (c.mean_focal_length(), c.has_prior_focal_length) for c in start.read_all_cameras()}
    start.close()
    if _is_lost(_finish(out, calibration, given)):
        # a scene that leaves the focal length open let it run away; poses for such a one do not come back
        for place in _models(out):
            shutil.rmtree(place)
        _incremental(database, out, hold=True)
        _finish(out, calibration, given, hold=True)


def _models(out: Path) -> list[Path]:
    return sorted(p for p in out.iterdir() if (p / "images.bin").exists())


def _finish(
    out: Path, calibration: str, given: dict[int, tuple[float, bool]], hold: bool = False
) -> list[tuple[bool, float]]:
    """Adjust each model and write it; whether a focal length is held, and the mean reprojection error in pixels, of each."""
    import pycolmap

    told = []
    for place in _models(out):
        model = pycolmap.Reconstruction(place)
        if model.num_reg_images() >= LEAST_IMAGES:
            stated = calibrated(model, calibration, given, hold)
            model.write_binary(place)
            (place / CALIBRATED).write_text(json.dumps(stated))
            told.append((any(s["held"] for s in stated.values()), float(model.compute_mean_reprojection_error())))
    return told


def _is_lost(told: list[tuple[bool, float]]) -> bool:
    """Whether a model does not fit its own tie points with the focal length that it is held at."""
    return any(held and not error < MOST_ERROR_PX for held, error in told)


def _global(database: Path, out: Path) -> None:
    import pycolmap

    view = pycolmap.ViewGraphCalibrationOptions()
    view.random_seed = SEED
    pycolmap.calibrate_view_graph(database, view)
    options = pycolmap.GlobalPipelineOptions()
    options.num_threads = options.mapper.num_threads = 1
    options.random_seed = options.mapper.random_seed = SEED
    options.min_model_size = LEAST_IMAGES
    options.mapper.global_positioning.use_gpu = False
    options.mapper.bundle_adjustment.ceres.use_gpu = False
    options.mapper.bundle_adjustment.ceres.solver_options.num_threads = 1
    pycolmap.global_mapping(database, out, out, options)


def _incremental(database: Path, out: Path, hold: bool = False) -> None:
    """`hold`: all cameras are as given."""
    import pycolmap

    options = pycolmap.IncrementalPipelineOptions()
    options.ba_refine_focal_length = options.ba_refine_extra_params = not hold
    options.num_threads = options.mapper.num_threads = 1
    options.random_seed = SEED
    options.min_model_size = LEAST_IMAGES
    options.extract_colors = False
    pycolmap.incremental_mapping(database, out, out, options)


def calibrated(
    model: pycolmap.Reconstruction, calibration: str, given: dict[int, tuple[float, bool]], hold: bool = False
) -> dict[str, dict[str, Any]]:
    """Adjust poses, points and cameras; of each camera the standard deviation of its focal length (pixels) and whether it was held.

    Parameters
    ----------
    given : of each camera its focal length as given, and whether that is more than a guess; held there where the scene leaves it open
    hold : all cameras are as given, and stay
    """
    import pycolmap

    for camera in model.cameras.values():
        f, cx, cy, k = camera.params
        lens = [f, f, cx, cy, k, 0.0, 0.0, 0.0] if calibration == FULL else [f, cx, cy, k, 0.0]
        camera.model = pycolmap.CameraModelId.OPENCV if calibration == FULL else pycolmap.CameraModelId.RADIAL
        camera.params = lens
    used = sorted({model.images[i].camera_id for i in model.reg_image_ids()})
    fixed = used if hold else ()
    _adjusted(model, calibration == FULL, fixed)
    pycolmap.ObservationManager(model).filter_all_points3D(MOST_ERROR_PX, LEAST_ANGLE_DEG)
    sigmas = _adjusted(model, calibration == FULL, fixed)
    if hold:
        return {str(n): {"sigma_px": None, "held": True} for n in used}
    held = [n for n in used if (sigmas[n] or math.inf) > OPEN_FOCAL * model.cameras[n].mean_focal_length()]
    if held:
        for number in held:
            focal, is_known = given[number]
            params = list(model.cameras[number].params)
            if is_known:
                for k in model.cameras[number].focal_length_idxs():
                    params[k] = focal
            model.cameras[number].params = params
        _adjusted(model, False, held)
    model.update_point_3d_errors()
    return {str(n): {"sigma_px": sigmas[n], "held": n in held} for n in used}


def _adjusted(model: pycolmap.Reconstruction, principal: bool, held: Any) -> dict[int, float | None]:
    """Adjust all; standard deviations of the focal lengths by camera, pixels."""
    import pycolmap

    options = pycolmap.BundleAdjustmentOptions()
    options.print_summary = False
    options.refine_principal_point = principal
    options.ceres.loss_function_type = pycolmap.LossFunctionType.SOFT_L1
    options.ceres.solver_options.num_threads = 1
    config = pycolmap.BundleAdjustmentConfig()
    for number in sorted(model.reg_image_ids()):
        config.add_image(number)
    for number in held:
        config.set_constant_cam_intrinsics(number)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    adjuster = pycolmap.create_default_ceres_bundle_adjuster(options, config, model)
    adjuster.solve()
    wanted = pycolmap.BACovarianceOptions()
    wanted.params = pycolmap.BACovarianceOptionsParams.ALL
    covariance = pycolmap.estimate_ba_covariance(wanted, model, adjuster)
    # covariances hold for coordinates that are exact to a pixel; errors in a plane have a mean of 1.25 standard deviations (Rayleigh)
    model.update_point_3d_errors()
    unit = model.compute_mean_reprojection_error() / (math.pi / 2) ** 0.5
    sigmas: dict[int, float | None] = {}
    for number, camera in sorted(model.cameras.items()):
        own = covariance.get_other_params_cov(camera.params) if covariance is not None else None
        sigmas[number] = unit * float(own[0, 0]) ** 0.5 if own is not None and own[0, 0] >= 0 else None
    return sigmas


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], sys.argv[4])
