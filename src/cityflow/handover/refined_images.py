"""A catalog with the poses of an adjusted block."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from cityflow.handover.refined_block import RefinedPose
from cityflow.io.catalog.stac_assets import Catalog, ImageAsset
from cityflow.orientation.views import View, footprint


def with_poses(given: Catalog, poses: Mapping[str, RefinedPose]) -> Catalog:
    """The catalog; images that are named have these poses, with covariances and the bounds that follow; all else stays.

    Parameters
    ----------
    poses : by names of images
    """
    return replace(given, images=tuple(_with_pose(a, poses[a.name]) if a.name in poses else a for a in given.images))


def _with_pose(asset: ImageAsset, pose: RefinedPose) -> ImageAsset:
    seen = footprint(View(pose.image, asset.heights))
    bounds = asset.bounds
    if not seen.is_empty:
        x_min, y_min, x_max, y_max = (round(float(v), 3) for v in seen.bounds)
        bounds = x_min, y_min, x_max, y_max
    return replace(asset, oriented=pose.image, bounds=bounds, pose_covariance=pose.covariance)
