"""Two straight looks at a level plain whose brightness is a sum of waves: disparities and depths follow from focal length, base and height alone."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import ByteArray, FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.pixels import ArrayPixels
from cityflow.matching.grey import GreyImage, TileStore
from cityflow.matching.lattice import LatticeParameters, PairLattice
from cityflow.matching.rectification import Rectification, rectify
from cityflow.matching.sgm import SgmClock

FOCAL_PX, FLIGHT_M, BASE_M, PLAIN_M = 400.0, 40.0, 8.0, 2.0
"""At the reference height 0 a pixel is 0.1 m."""
CAMERA = Camera(320, 240, FOCAL_PX, FOCAL_PX, 160.0, 120.0)
DISPARITY_PX = FOCAL_PX * BASE_M * (1.0 / (FLIGHT_M - PLAIN_M) - 1.0 / FLIGHT_M)
"""Of the plain against the reference plane at height 0: 4.2 px."""
RAW = np.arange(256).astype(np.uint8)
"""A curve that leaves grey values alone."""


def waves(x: FloatArray, y: FloatArray, shortest: float = 5.0, seed: int = 2) -> FloatArray:
    """Brightness 0 to 255 at places; waves are `shortest` to two and a half times as long."""
    rng = np.random.default_rng(seed)
    out = np.full(np.broadcast(x, y).shape, 128.0)
    for length, turn, phase in zip(
        rng.uniform(1.0, 2.5, 40) * shortest, rng.uniform(0, np.pi, 40), rng.uniform(0, 2 * np.pi, 40), strict=True
    ):
        out += 8.0 * np.sin(2 * np.pi / length * (x * np.cos(turn) + y * np.sin(turn)) + phase)
    return np.asarray(np.clip(out, 0.0, 255.0))


def grey(x: FloatArray, y: FloatArray) -> ByteArray:
    return np.rint(waves(x, y)).astype(np.uint8)


def views() -> tuple[OrientedImage, OrientedImage]:
    upright = np.diag([1.0, -1.0, -1.0])
    base, partner = (
        OrientedImage(name, CAMERA, upright, np.array([x, 0.0, FLIGHT_M])) for name, x in (("base", 0.0), ("partner", BASE_M))
    )  # fmt: skip
    return base, partner


def photograph(view: OrientedImage) -> ArrayPixels:
    """Grey values at the middles of the pixels."""
    u, v = np.meshgrid(np.arange(320) + 0.5, np.arange(240) + 0.5)
    metre = (FLIGHT_M - PLAIN_M) / FOCAL_PX
    seen = grey((view.centre[0] + (u - 160.0) * metre) / 0.1, (view.centre[1] - (v - 120.0) * metre) / 0.1)
    return ArrayPixels(seen[..., None])


def raw_grey(name: str, pixels: ArrayPixels) -> GreyImage:
    return GreyImage(name, pixels, TileStore(1 << 26), RAW)


def lattice_of(
    pair: Rectification | None = None, heights: tuple[float, float] = (-1.0, 5.0), most_disparities: int = 256
) -> PairLattice:
    """Blocks of 128 pixels, levels down to 120 x 160."""
    base, partner = views()
    parameters = LatticeParameters(block_px=128, halo_px=24, coarsest_px=96, most_disparities=most_disparities)
    images = (raw_grey("base", photograph(base)), raw_grey("partner", photograph(partner)))
    return PairLattice(pair or rectify(base, partner, 0.0, 0.0), images, heights, parameters, SgmClock())
