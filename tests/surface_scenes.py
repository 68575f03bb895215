"""Scenes that several test modules share."""

from __future__ import annotations

from functools import cache

from cityflow.synthetic.lidar_scene import LidarScene, LidarSceneParameters, lidar_scene


def small_scene(seed: int = 11, classes: str = "none", with_returns: bool = True) -> LidarScene:
    """160 x 160 m at 5 pulses per m²."""
    return _made(seed, classes, with_returns)


@cache
def _made(seed: int, classes: str, with_returns: bool) -> LidarScene:
    # a cache tells arguments that are left out from the same ones given
    p = LidarSceneParameters(width_m=160, height_m=160, density_m2=5, with_returns=with_returns)
    return lidar_scene(seed, p.model_copy(update={"classes": classes}))
