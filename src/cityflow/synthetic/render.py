"""Aerial images of a town mesh: rays through every pixel, procedural surfaces, one sun, and a sensor behind the lens."""

from __future__ import annotations

import math
import zlib

import numpy as np
from pydantic import Field
from scipy.interpolate import RectBivariateSpline

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.parameters import Parameters
from cityflow.core.pixels import PixelArray
from cityflow.synthetic import noise_tiles
from cityflow.synthetic.ambient import AmbientParameters, SkyLattice
from cityflow.synthetic.caster import NOTHING, Scene
from cityflow.synthetic.mesh import Material, TownMesh
from cityflow.synthetic.sensor import SensorParameters, blurred, exposed
from cityflow.synthetic.shading import Light, Samples, radiances

SAMPLES_AT_ONCE = 400_000
SUN_RADIUS_RAD = 0.00465
SPLINE_STEP_PX = 32


class RenderParameters(Parameters):
    """Light and sampling of made images."""

    sun_azimuth_deg: float = Field(
        215.0, ge=0, lt=360, description="where the sun stands, degrees clockwise from north"
    )
    sun_elevation_deg: float = Field(42.0, gt=5, le=90, description="degrees above the horizon")
    sun_strength: float = Field(1.0, ge=0, le=5, description="irradiance on a surface facing the sun; 0: overcast")
    sky_strength: float = Field(0.22, ge=0, le=5, description="irradiance of a level surface by the open sky")
    haze_m: float = Field(15000.0, ge=500, description="distance over which 63 % of the contrast is lost, metres")
    supersampling: int = Field(2, ge=1, le=6, description="rays per pixel and axis; cost goes with the square")
    near_infrared: bool = Field(False, description="a fourth band, bright where things grow")
    ambient: AmbientParameters = Field(AmbientParameters(), description="how much of the sky a point sees")
    sensor: SensorParameters = Field(SensorParameters(), description="blur, noise, vignetting, exposure, bits")

    @property
    def bands(self) -> int:
        return 4 if self.near_infrared else 3

    @property
    def sun(self) -> FloatArray:
        """(3,) unit vector towards the sun."""
        azimuth, elevation = math.radians(self.sun_azimuth_deg), math.radians(self.sun_elevation_deg)
        level = math.cos(elevation)
        return np.array([level * math.sin(azimuth), level * math.cos(azimuth), math.sin(elevation)])

    @property
    def light(self) -> Light:
        return Light(self.sun, self.sun_strength, self.sky_strength, self.haze_m)


def render(mesh: TownMesh | Scene, image: OrientedImage, parameters: RenderParameters, seed: int) -> PixelArray:
    """(height, width, bands) uint8 or uint16: what the camera delivers.

    The bytes depend on mesh, image, parameters and seed alone: noise and exposure follow from the seed and the image's name.

    Parameters
    ----------
    mesh : of everything that the image sees or that shadows it; a `Scene` where several images are made of it
    image : its camera may have distortion
    """
    return exposed(irradiance(mesh, image, parameters), image, parameters.sensor, seed)


def irradiance(mesh: TownMesh | Scene, image: OrientedImage, parameters: RenderParameters) -> Float32Array:
    """(height, width, bands) float32, light that falls on each pixel through a perfect, blurred lens: white in the sun is about 1."""
    scene = mesh if isinstance(mesh, Scene) else Scene(mesh)
    height, width = image.camera.height, image.camera.width
    n = parameters.supersampling
    sky = SkyLattice(scene, parameters.ambient)
    out = np.empty((height, width, parameters.bands), np.float32)
    rows_at_once = max(1, SAMPLES_AT_ONCE // (width * n * n))
    directions = RayField(image)
    for top in range(0, height, rows_at_once):
        rows = min(rows_at_once, height - top)
        samples = directions.block(top, rows, n)
        light = _radiance_of(scene, sky, image, samples, parameters)
        # a pixel counts photons over its whole area, so light is averaged before anything else
        out[top : top + rows] = light.reshape(rows, n, width, n, -1).mean(axis=(1, 3))
    return blurred(out, parameters.sensor.blur_px)


def _radiance_of(
    scene: Scene, sky: SkyLattice, image: OrientedImage, directions: FloatArray, p: RenderParameters
) -> Float32Array:
    """(N, bands) radiance along rays in row-major order of samples."""
    centre = image.centre - scene.origin
    triangle, depth = scene.first_hits(centre, directions)
    points = centre + np.where(np.isfinite(depth), depth, 0.0)[:, None] * directions
    lit = _sunlit(scene, points, triangle, p)
    seen = Samples(directions, depth, triangle, lit, sky.share(points, directions, triangle))
    out = np.empty((len(directions), p.bands), np.float32)
    ripple = zlib.crc32(image.name.encode())
    patterns = noise_tiles.grain(), noise_tiles.cloud()
    radiances(seen, scene.surfaces, p.light, centre, 1.0 / image.camera.fx / p.supersampling, ripple, patterns, out)
    return out


def _sunlit(scene: Scene, points: FloatArray, triangle: IntArray, p: RenderParameters) -> BoolArray:
    """(N,) whether the sun reaches each point; a different spot of the sun's disc for neighbouring samples, so shadows get soft edges."""
    lit = np.zeros(len(points), bool)
    if p.sun_strength == 0:
        return lit
    facing = scene.surfaces.normal @ p.sun
    leaf = scene.surfaces.material == int(Material.LEAF)
    asked = np.flatnonzero((triangle != NOTHING) & (leaf | (facing > 0))[triangle])
    towards = _sun_spots(p.sun)[asked % 4]
    hit = triangle[asked]
    # off the surface by 2 mm on the sunny side, since float32 cannot tell the point from its own triangle
    side = np.where(facing[hit] > 0, 0.002, -0.002)[:, None] * scene.surfaces.normal[hit]
    lit[asked] = ~scene.occluded(points[asked] + side, towards)
    return lit


def _sun_spots(sun: FloatArray) -> FloatArray:
    """(4, 3) directions to four spots of the sun's disc."""
    right = np.cross(sun, [0.3, 0.5, 0.81])
    right /= np.linalg.norm(right)
    up = np.cross(right, sun)
    spots = np.array([[-0.5, -0.45], [0.5, 0.45], [0.45, -0.5], [-0.45, 0.5]]) * SUN_RADIUS_RAD
    return np.asarray(sun + spots[:, :1] * right + spots[:, 1:] * up)


class RayField:
    """Directions through an image; a lens's distortion is solved on a lattice and splined between, far below 1e-4 pixels off."""

    def __init__(self, image: OrientedImage) -> None:
        camera = image.camera
        self.image, self.splines = image, None
        if not camera.is_pinhole:
            u = np.linspace(0.0, camera.width, max(camera.width // SPLINE_STEP_PX, 8))
            v = np.linspace(0.0, camera.height, max(camera.height // SPLINE_STEP_PX, 8))
            grid = np.stack(np.meshgrid(u, v), axis=-1)
            normal = camera.undistort(grid.reshape(-1, 2)).reshape(grid.shape)
            self.splines = [RectBivariateSpline(v, u, normal[..., i]) for i in range(2)]

    def block(self, top: int, rows: int, n: int) -> FloatArray:
        """(rows · n · width · n, 3) world directions, depth component 1, of n × n samples per pixel from row `top` on."""
        camera = self.image.camera
        v = top + (np.arange(rows * n) + 0.5) / n
        u = (np.arange(camera.width * n) + 0.5) / n
        if self.splines is not None:
            x, y = (spline(v, u) for spline in self.splines)
        else:
            x, y = np.meshgrid((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy)
        r = self.image.rotation
        out = np.empty((*x.shape, 3))
        for j in range(3):
            out[..., j] = x * r[0, j] + y * r[1, j] + r[2, j]
        return out.reshape(-1, 3)


def truth_depth(mesh: TownMesh | Scene, image: OrientedImage) -> tuple[Float32Array, IntArray]:
    """Depth along the camera's z axis at pixel centres, and the triangle seen there.

    Returns
    -------
    depth : (height, width) float32, metres; NaN where nothing is hit
    triangle : (height, width) int64, -1 where nothing is hit
    """
    scene = mesh if isinstance(mesh, Scene) else Scene(mesh)
    height, width = image.camera.height, image.camera.width
    depth, triangle = np.empty((height, width), np.float32), np.empty((height, width), np.int64)
    field = RayField(image)
    at_once = max(1, SAMPLES_AT_ONCE // width)
    for top in range(0, height, at_once):
        rows = min(at_once, height - top)
        met, far = scene.first_hits(image.centre - scene.origin, field.block(top, rows, 1))
        triangle[top : top + rows] = met.reshape(rows, width)
        depth[top : top + rows] = np.where(np.isfinite(far), far, np.nan).reshape(rows, width)
    return depth, triangle
