"""Compile once what numba compiles, by reconstructing houses of a made town; otherwise the first buildings of the first run wait for it."""

from __future__ import annotations

import numpy as np

from cityflow.core.building import Evidence
from cityflow.reconstruction.choose import ReconstructParameters, choose
from cityflow.reconstruction.measures import measure
from cityflow.synthetic.lidar_scene import LidarSceneParameters, lidar_scene

HOUSES = 8

scene = lidar_scene(1, LidarSceneParameters(width_m=100, height_m=100))
for number, building in enumerate(scene.buildings[:HOUSES]):
    points = scene.points.take(np.flatnonzero(scene.truth_building == number))
    evidence = Evidence(building.id, building.outline, points, float(points.xyz[:, 2].min()))
    measure(choose(evidence, ReconstructParameters()), evidence)
