"""How bright a point of the town looks from somewhere: sun, sky, what it is made of, and what shines on it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.synthetic.caster import Surfaces
from cityflow.synthetic.mesh import Material
from cityflow.synthetic.procedural_textures import GRASS, LEAF, METAL, SOIL, WATER, hashed, texture

GLASS, PAINT = int(Material.GLASS), int(Material.PAINT)
RED, GREEN, BLUE, NIR = 0, 1, 2, 3
SUN_COLOUR = np.array([1.0, 0.95, 0.87, 0.95])
SKY_COLOUR = np.array([0.75, 0.95, 1.35, 0.45])
GROUND_COLOUR = np.array([0.20, 0.20, 0.17, 0.30])
"""Of what the ground throws back upwards, as share of sun and sky."""
NIR_OF_LEAF, NIR_OF_SOIL = 0.5, 0.3


class Light(NamedTuple):
    """Where light comes from.

    Attributes
    ----------
    sun : (3,) unit vector towards the sun
    sun_strength, sky_strength : irradiance on a surface that faces the sun, and on a level one from the open sky
    haze_m : distance over which 63 % of the contrast is lost
    """

    sun: FloatArray
    sun_strength: float
    sky_strength: float
    haze_m: float


class Samples(NamedTuple):
    """Rays of an image with what they met, (N, …).

    Attributes
    ----------
    directions : (N, 3) float64, depth component 1;  depth : (N,) float64, metres
    triangle : (N,) int64, -1 for nothing;  sunlit : (N,) bool;  sky : (N,) float32, share of its half of the sky that a point sees
    """

    directions: FloatArray
    depth: FloatArray
    triangle: IntArray
    sunlit: BoolArray
    sky: Float32Array


@njit(cache=True, nogil=True)
def _sky_radiance(up: float, band: int) -> float:
    """Of a clear sky in a direction whose z component is `up`; below the horizon that of the ground."""
    if up < 0.0:
        return 0.8 * GROUND_COLOUR[band]
    pale = (1.0 - up) ** 3
    return 0.3 * (SKY_COLOUR[band] * (1.0 - pale) + 1.3 * pale)


@njit(cache=True, nogil=True)
def _mirror_share(material: int, cosine: float) -> float:
    """Share of light mirrored (Schlick's approximation of Fresnel's law); 0 for rough materials."""
    if material == GLASS:
        base = 0.10
    elif material == WATER:
        base = 0.03
    elif material == METAL:
        base = 0.12
    elif material == PAINT:
        base = 0.03
    else:
        return 0.0
    return base + (1.0 - base) * (1.0 - cosine) ** 5


@njit(cache=True, nogil=True)
def _near_infrared(material: int, red: float, green: float, blue: float, factor: float) -> float:
    """Reflectance in the near infrared: high where things grow, low on water, elsewhere a little above red."""
    if material in (LEAF, GRASS):
        return NIR_OF_LEAF * factor
    if material == WATER:
        return 0.01
    if material == SOIL:
        return NIR_OF_SOIL * factor
    return min(1.0, 0.04 + 0.6 * red + 0.3 * green + 0.2 * blue)


@njit(cache=True, nogil=True)
def radiances(
    samples: Samples,
    surfaces: Surfaces,
    light: Light,
    centre: FloatArray,
    pixel: float,
    ripple_seed: int,
    patterns: tuple[Float32Array, Float32Array],
    out: Float32Array,
) -> None:
    """Writes (N, bands) radiances, 1 for a white surface facing the sun and the open sky.

    Parameters
    ----------
    samples, surfaces, light : the rays, the mesh and the sun
    centre : (3,) projection centre, metres from the scene's origin
    pixel : width of a sample at depth 1 (metres per metre)
    ripple_seed : water looks different in every image
    patterns : `noise_tiles.grain()` and `noise_tiles.cloud()`
    """
    grain, cloud = patterns
    bands = out.shape[1]
    point, colour = np.empty(3), np.empty(4)
    for i in range(len(samples.triangle)):
        k = samples.triangle[i]
        d = samples.directions[i]
        if k < 0:
            for b in range(bands):
                out[i, b] = _sky_radiance(0.05, b)
            continue
        depth = samples.depth[i]
        length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        nx, ny, nz = surfaces.normal[k, 0], surfaces.normal[k, 1], surfaces.normal[k, 2]
        along = (nx * d[0] + ny * d[1] + nz * d[2]) / length
        if along > 0.0:
            nx, ny, nz, along = -nx, -ny, -nz, -along
        cosine = max(-along, 0.02)
        for j in range(3):
            point[j] = centre[j] + depth * d[j]
        frame = surfaces.texture[k]
        s, t = 0.0, 0.0
        for j in range(3):
            s += (point[j] - frame[0, j]) * frame[1, j]
            t += (point[j] - frame[0, j]) * frame[2, j]
        material, seed = int(surfaces.material[k]), surfaces.seed[k]
        # a slanting pixel covers a long and narrow patch; a disc of the same area stands for it
        footprint = depth * pixel / np.sqrt(cosine)
        fr, fg, fb = texture(material, s, t, footprint, seed, grain, cloud)
        colour[RED], colour[GREEN] = surfaces.tint[k, RED] * fr, surfaces.tint[k, GREEN] * fg
        colour[BLUE] = surfaces.tint[k, BLUE] * fb
        colour[NIR] = _near_infrared(material, colour[RED], colour[GREEN], colour[BLUE], fg)
        if material == GLASS:
            _behind_glass(colour, seed)
        facing = nx * light.sun[0] + ny * light.sun[1] + nz * light.sun[2]
        if material == LEAF:
            # leaves point everywhere and let light through
            facing = 0.35 + 0.5 * abs(facing)
        sun = light.sun_strength * max(facing, 0.0) if samples.sunlit[i] else 0.0
        upper = 0.5 + 0.5 * nz
        mirrored = _mirror_share(material, cosine)
        if mirrored > 0.0:
            if material == WATER:
                wave = hashed(int(np.floor(s * 3.0)), int(np.floor(t * 3.0)), ripple_seed) * 0.04
                nx += wave
                ny -= wave
            up = d[2] / length + 2.0 * cosine * nz
        clear = np.exp(-depth * length / light.haze_m)
        level = max(light.sun[2], 0.1) * light.sun_strength + light.sky_strength
        for b in range(bands):
            # walls of narrow yards are lit by one another: a third of what the sky does not give comes from there
            ambient = light.sky_strength * SKY_COLOUR[b] * upper * samples.sky[i]
            ambient += level * GROUND_COLOUR[b] * (1.0 - upper) * (0.3 + 0.7 * samples.sky[i])
            value = colour[b] * (sun * SUN_COLOUR[b] + ambient)
            if mirrored > 0.0:
                value += mirrored * (_sky_radiance(up, b) * (0.3 + 0.7 * samples.sky[i]) - value)
            out[i, b] = value * clear + (1.0 - clear) * 0.5 * light.sky_strength * SKY_COLOUR[b]


@njit(cache=True, nogil=True)
def _behind_glass(colour: FloatArray, seed: int) -> None:
    """A dark room, or a curtain."""
    curtain = hashed(seed, 17, 5)
    share = 0.55 if curtain > 0.5 else 0.12 + 0.08 * curtain
    for b in range(4):
        colour[b] *= share
