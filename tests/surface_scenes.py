"""Scenes that several test modules share."""

from __future__ import annotations

from functools import cache

from cityflow.synthetic.lidar_scene import LidarScene, LidarSceneParameters, lidar_scene


@cache
def small_scene(seed: int = 11, classes: str = "none", with_returns: bool = True) -> LidarScene:
    """160 x 160 m at 5 pulses per m²."""
    p = LidarSceneParameters(width_m=160, height_m=160, density_m2=5, with_returns=with_returns)
    return lidar_scene(seed, p.model_copy(update={"classes": classes}))
