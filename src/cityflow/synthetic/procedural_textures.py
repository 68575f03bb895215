"""Procedural textures, a function each: factors on the base colour at a point of a face, averaged over a pixel's footprint.

Texture coordinates s, t and footprints are metres, t upwards on walls and up the slope on roofs. What is finer than the footprint fades
into its mean instead of flickering from image to image.
"""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import Float32Array
from cityflow.core.kernels import njit
from cityflow.synthetic.mesh import Material
from cityflow.synthetic.noise_tiles import pattern

GRASS, ASPHALT, PAVING, SOIL = int(Material.GRASS), int(Material.ASPHALT), int(Material.PAVING), int(Material.SOIL)
ROOF_TILE, SLATE, BITUMEN = int(Material.ROOF_TILE), int(Material.SLATE), int(Material.BITUMEN)
GRAVEL, BRICK, PLASTER = int(Material.GRAVEL), int(Material.BRICK), int(Material.PLASTER)
WOOD, LEAF, BARK = int(Material.WOOD), int(Material.LEAF), int(Material.BARK)
METAL, CONCRETE, WATER = int(Material.METAL), int(Material.CONCRETE), int(Material.WATER)

GRAIN_TEXEL_M = 0.02
CLOUD_TEXEL_M = 0.08

Factors = tuple[float, float, float]
"""On red, green, blue."""


@njit(cache=True, nogil=True)
def hashed(a: int, b: int, c: int) -> float:
    """A number in [-1, 1) that looks random, the same for the same integers."""
    h = np.uint64(a) * np.uint64(0x9E3779B97F4A7C15)
    h ^= (np.uint64(b) + np.uint64(0x7F4A7C15)) * np.uint64(0xC2B2AE3D27D4EB4F)
    h ^= (np.uint64(c) + np.uint64(0x165667B1)) * np.uint64(0xD6E8FEB86659FD93)
    h ^= h >> np.uint64(32)
    h *= np.uint64(0xD6E8FEB86659FD93)
    h ^= h >> np.uint64(29)
    h *= np.uint64(0x9E3779B97F4A7C15)
    return float(h >> np.uint64(11)) * (2.0 / 9007199254740992.0) - 1.0


@njit(cache=True, nogil=True)
def fade(size: float, footprint: float) -> float:
    """Share of a pattern's contrast that is left when its elements have `size`: all at two footprints, nothing at 0.7."""
    return min(max((size / footprint - 0.7) / 1.3, 0.0), 1.0)


@njit(cache=True, nogil=True)
def stripe(t: float, period: float, width: float, footprint: float) -> float:
    """Share of [t ± footprint / 2] that lies in stripes of `width`, one at the start of each `period`."""
    half = 0.5 * footprint
    a, b = t - half, t + half
    upto_a = np.floor(a / period) * width + min(a - np.floor(a / period) * period, width)
    upto_b = np.floor(b / period) * width + min(b - np.floor(b / period) * period, width)
    return (upto_b - upto_a) / footprint


@njit(cache=True, nogil=True)
def _grain(table: Float32Array, s: float, t: float, footprint: float) -> float:
    return pattern(table, s / GRAIN_TEXEL_M, t / GRAIN_TEXEL_M, footprint / GRAIN_TEXEL_M)


@njit(cache=True, nogil=True)
def _cloud(table: Float32Array, s: float, t: float, footprint: float) -> float:
    return pattern(table, s / CLOUD_TEXEL_M, t / CLOUD_TEXEL_M, footprint / CLOUD_TEXEL_M)


@njit(cache=True, nogil=True)
def _vegetation(s: float, t: float, fp: float, grain: Float32Array, cloud: Float32Array) -> Factors:
    fine, patch = _grain(grain, s, t, fp), _cloud(cloud, s, t, fp)
    dry = _cloud(cloud, 0.37 * t + 31.0, 0.37 * s, 0.37 * fp)
    light = 1.0 + 0.15 * fine + 0.09 * patch
    return light * (1.0 + 0.11 * dry), light, light * (1.0 - 0.06 * dry)


@njit(cache=True, nogil=True)
def _slabs(s: float, t: float, fp: float, size: float, joint: float, seed: int) -> float:
    """Rectangular slabs: each a little different, dark joints between."""
    each = hashed(int(np.floor(s / size)), int(np.floor(t / size)), seed)
    joints = max(stripe(s, size, joint, fp), stripe(t, size, joint, fp))
    return 1.0 + 0.07 * each * fade(size, fp) - 0.35 * joints


@njit(cache=True, nogil=True)
def _tiles(s: float, t: float, fp: float, seed: int) -> float:
    """Pan tiles of 22 × 34 cm: rounded across, a shadow under the lower edge of each course."""
    course, column = int(np.floor(t / 0.34)), int(np.floor(s / 0.22))
    each = hashed(column, course, seed) * fade(0.22, fp)
    bow = np.sin(2.0 * np.pi * s / 0.22) * fade(0.14, fp)
    edge = stripe(t, 0.34, 0.05, fp) - 0.05 / 0.34
    return (1.0 + 0.13 * each) * (1.0 + 0.09 * bow) * (1.0 - 0.5 * edge)


@njit(cache=True, nogil=True)
def _slates(s: float, t: float, fp: float, seed: int) -> float:
    """Slates of 25 × 20 cm, every second course shifted by half."""
    course = int(np.floor(t / 0.2))
    column = int(np.floor(s / 0.25 + 0.5 * (course & 1)))
    edge = stripe(t, 0.2, 0.015, fp) - 0.015 / 0.2
    return (1.0 + 0.12 * hashed(column, course, seed) * fade(0.2, fp)) * (1.0 - 0.45 * edge)


@njit(cache=True, nogil=True)
def _bricks(s: float, t: float, fp: float, seed: int) -> float:
    """Bricks of 25 × 7.5 cm with their joints, and batches of four courses that differ."""
    course = int(np.floor(t / 0.075))
    shifted = s + 0.125 * (course & 1)
    each = hashed(int(np.floor(shifted / 0.25)), course, seed) * fade(0.075, fp)
    batch = hashed(int(np.floor(s / 0.5)), int(np.floor(t / 0.3)), seed + 1) * fade(0.3, fp)
    joints = stripe(t, 0.075, 0.012, fp) + 0.84 * stripe(shifted, 0.25, 0.012, fp)
    return (1.0 + 0.15 * each + 0.05 * batch) * (1.0 + 0.5 * (joints - 0.2))


@njit(cache=True, nogil=True)
def _planks(s: float, t: float, fp: float, grain: Float32Array, seed: int) -> float:
    """Upright boards of 14 cm with their grain lengthwise."""
    board = hashed(int(np.floor(s / 0.14)), 3, seed) * fade(0.14, fp)
    along = pattern(grain, s / 0.02, 0.08 * t / 0.02, fp / 0.02)
    return 1.0 + 0.1 * board + 0.05 * along - 0.5 * stripe(s, 0.14, 0.01, fp)


@njit(cache=True, nogil=True)
def texture(
    material: int, s: float, t: float, fp: float, seed: int, grain: Float32Array, cloud: Float32Array
) -> Factors:
    """Factors on a face's base colour; mean about 1."""
    # every face starts elsewhere in the patterns, or all would be alike
    u, v = s + (seed & 1023) * 0.173, t + ((seed >> 10) & 1023) * 0.211
    if material in (GRASS, LEAF):
        return _vegetation(u, v, fp, grain, cloud)
    fine, patch = _grain(grain, u, v, fp), _cloud(cloud, u, v, fp)
    if material == ASPHALT:
        f = 1.0 + 0.035 * fine + 0.045 * patch
    elif material == PAVING:
        f = _slabs(s, t, fp, 0.3, 0.008, seed) * (1.0 + 0.03 * fine + 0.04 * patch)
    elif material == SOIL:
        f = 1.0 + 0.12 * fine + 0.08 * patch
    elif material == ROOF_TILE:
        f = _tiles(s, t, fp, seed) * (1.0 + 0.05 * fine + 0.05 * patch)
        return f, f * (1.0 + 0.02 * patch), f * (1.0 + 0.03 * patch)
    elif material == SLATE:
        f = _slates(s, t, fp, seed) * (1.0 + 0.04 * fine + 0.04 * patch)
    elif material == BITUMEN:
        f = 1.0 + 0.012 * fine + 0.03 * patch - 0.12 * stripe(s, 1.0, 0.03, fp)
    elif material == GRAVEL:
        f = 1.0 + 0.1 * fine + 0.03 * patch
    elif material == BRICK:
        f = _bricks(s, t, fp, seed) * (1.0 + 0.03 * fine + 0.04 * patch)
    elif material == PLASTER:
        f = 1.0 + 0.007 * fine + 0.018 * patch
    elif material == WOOD:
        f = _planks(s, t, fp, grain, seed)
    elif material == METAL:
        f = 1.0 + 0.01 * fine + 0.02 * patch - 0.15 * stripe(s, 0.5, 0.03, fp)
    elif material == CONCRETE:
        f = _slabs(s, t, fp, 2.5, 0.015, seed) * (1.0 + 0.02 * fine + 0.03 * patch)
    elif material == BARK:
        f = 1.0 + 0.15 * fine
    else:
        f = 1.0 + 0.004 * fine
    return f, f, f
