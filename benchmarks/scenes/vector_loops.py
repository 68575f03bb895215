"""What this processor can do at most: loops of semi-global matching with nothing around them, and OpenCV's plain matcher."""

from __future__ import annotations

import time
from collections.abc import Sequence

import cv2
import numpy as np

from cityflow.core.arrays import ByteArray
from cityflow.core.kernels import njit

DISPARITIES = 128
CACHE_BYTES = 96 << 10
"""Costs of a loop: they stay in the second level of any processor's cache."""
LOOP_S = 0.3


def plain_sgbm_seconds(pairs: Sequence[tuple[ByteArray, ByteArray]], repeats: int) -> float:
    """Processor seconds of OpenCV's StereoSGBM for one image: five paths, 128 disparities, one way, one thread; the median of all.

    Parameters
    ----------
    pairs : (rows, cols) uint8 grey each; what they show does not matter
    """
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    area = 9
    matcher = cv2.StereoSGBM.create(
        minDisparity=0, numDisparities=DISPARITIES, blockSize=3, P1=8 * area, P2=32 * area, preFilterCap=63,
        mode=cv2.STEREO_SGBM_MODE_SGBM,
    )  # fmt: skip
    taken = []
    for left, right in list(pairs) * repeats:
        begun = time.process_time()
        matcher.compute(left, right)
        taken.append(time.process_time() - begun)
    cv2.setNumThreads(threads)
    return float(np.median(taken))


def path_rate(disparities: int) -> float:
    """Pixel-disparities a second of one path of semi-global matching, 16-bit costs that stay in the cache."""
    cost = np.random.default_rng(1).integers(0, 100, (CACHE_BYTES // disparities, disparities)).astype(np.uint8)
    total, before, now = np.zeros(cost.shape, np.uint16), *np.zeros((2, disparities + 2), np.uint16)
    return _rate(lambda: _path(cost, total, before, now, np.uint16(8), np.uint16(64)), cost.size)


def bare_rate() -> float:
    """The same of a loop that takes the lesser of two 16-bit values and adds it up."""
    a, b, c = np.random.default_rng(1).integers(0, 9999, (3, CACHE_BYTES // 12)).astype(np.uint16)
    return _rate(lambda: _bare(a, b, c), a.size)


def _rate(call, work: int) -> float:  # type: ignore[no-untyped-def]
    call()
    calls, begun = 0, time.process_time()
    while (taken := time.process_time() - begun) < LOOP_S:
        for _ in range(10):
            call()
        calls += 10
    return calls * work / taken


@njit(cache=True)
def _path(cost, total, before, now, small, large):  # type: ignore[no-untyped-def]
    least, edge = np.uint16(0), np.uint16(50000)
    before[:] = 0
    before[0] = before[-1] = now[0] = now[-1] = edge
    for i in range(cost.shape[0]):
        bound, lowest = np.uint16(least + large), np.uint16(65535)
        for d in range(cost.shape[1]):
            near = np.uint16(min(before[d], before[d + 2]) + small)
            value = np.uint16(np.uint16(min(near, min(before[d + 1], bound)) - least) + cost[i, d])
            now[d + 1] = value
            total[i, d] = np.uint16(total[i, d] + value)
            lowest = min(lowest, value)
        least = lowest
        before, now = now, before


@njit(cache=True)
def _bare(a, b, c):  # type: ignore[no-untyped-def]
    for i in range(a.size):
        c[i] = np.uint16(c[i] + min(a[i], b[i]))
