"""Oriented images in the arguments of tasks: as JSON, exact to the last bit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cityflow.core.camera import Camera, OrientedImage
from cityflow.flow.task import Json


def to_json(image: OrientedImage) -> dict[str, Json]:
    """Name, head, camera and pose; floats survive JSON unchanged."""
    c = image.camera
    head: dict[str, Json] = {"head": image.head} if image.head else {}
    return {
        **head,
        "name": image.name,
        "camera": [c.width, c.height, c.fx, c.fy, c.cx, c.cy, list(c.distortion), c.kind],
        "rotation": np.asarray(image.rotation, np.float64).tolist(),
        "centre": np.asarray(image.centre, np.float64).tolist(),
    }


def of_json(tree: Mapping[str, Any]) -> OrientedImage:
    """What `to_json` wrote."""
    width, height, fx, fy, cx, cy, distortion, kind = tree["camera"]
    camera = Camera(int(width), int(height), fx, fy, cx, cy, tuple(distortion), kind)
    return OrientedImage(
        tree["name"], camera, np.array(tree["rotation"], np.float64), np.array(tree["centre"], np.float64),
        tree.get("head", ""),
    )  # fmt: skip
