"""Aerial images of a town mesh: rays through every pixel, procedural surfaces, one sun, and a sensor behind the lens."""

from __future__ import annotations

import math
import zlib

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.parameters import Parameters
from cityflow.core.pixels import PixelArray
from cityflow.synthetic import noise_tiles
from cityflow.synthetic.ambient import AmbientParameters, sky_of
from cityflow.synthetic.caster import NOTHING, Scene
from cityflow.synthetic.mesh import Material, TownMesh
from cityflow.synthetic.sampling import RayField, simple_pixels, within_pixels
from cityflow.synthetic.sensor import SensorParameters, blurred, exposed
from cityflow.synthetic.shading import Light, Samples, radiances

SAMPLES_AT_ONCE = 150_000
SUN_RADIUS_RAD = 0.00465


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
    adaptive: bool = Field(True, description="further rays only where a pixel shows more than one surface")
    near_infrared: bool = Field(False, description="a fourth band, bright on vegetation")
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
    view = View(mesh if isinstance(mesh, Scene) else Scene(mesh), image, parameters)
    height, width = image.camera.height, image.camera.width
    out = np.empty((height, width, parameters.bands), np.float32)
    for top in range(0, height, view.rows_at_once):
        bottom = min(top + view.rows_at_once, height)
        out[top:bottom] = view.rows(top, bottom) if parameters.adaptive else view.all_samples(top, bottom)
    return blurred(out, parameters.sensor.blur_px)


class View:
    """What one image sees of a scene, some rows at a time."""

    def __init__(self, scene: Scene, image: OrientedImage, parameters: RenderParameters) -> None:
        self.scene, self.image, self.p = scene, image, parameters
        self.field = RayField(image)
        self.centre: FloatArray = image.centre - scene.origin
        self.sky = sky_of(scene, parameters.ambient)
        self.sun_side = scene.surfaces.normal @ parameters.sun
        self.leaf = scene.surfaces.material == int(Material.LEAF)
        self.spots = _sun_spots(parameters.sun)
        self.rows_at_once = max(
            1, SAMPLES_AT_ONCE // (image.camera.width * (1 if parameters.adaptive else parameters.supersampling**2))
        )

    def all_samples(self, top: int, bottom: int) -> Float32Array:
        """(bottom - top, width, bands) light, every pixel sampled n × n times."""
        r, c = np.mgrid[top:bottom, 0 : self.image.camera.width]
        return self._sampled(r.ravel(), c.ravel()).reshape(*r.shape, -1)

    def rows(self, top: int, bottom: int) -> Float32Array:
        """(bottom - top, width, bands) light; n × n samples only in pixels that see more than one thing."""
        width = self.image.camera.width
        shape = bottom - top + 2, width + 2
        directions = self.field.lattice(_middles(top - 1, bottom + 1), _middles(-1, width + 1))
        triangle, depth = self.scene.first_hits(self.centre, directions)
        lit = self._sunlit(directions, triangle, depth, np.zeros(1, np.int64))
        pixel = 1.0 / self.image.camera.fx
        seen = triangle.reshape(shape), depth.reshape(shape), lit.reshape(shape)
        simple: BoolArray = simple_pixels(*seen, self.scene.surfaces, pixel)
        inner = np.zeros(shape, bool)
        inner[1:-1, 1:-1] = simple
        chosen = np.flatnonzero(inner)
        out = np.empty((bottom - top, width, self.p.bands), np.float32)
        out[simple] = self._light(directions[chosen], triangle[chosen], depth[chosen], lit[chosen], pixel)
        row, col = np.nonzero(~simple)
        out[row, col] = self._sampled(row + top, col)
        return out

    def _sampled(self, row: IntArray, col: IntArray) -> Float32Array:
        """(N, bands) light of pixels from n × n samples each: a pixel counts photons over its whole area."""
        n = self.p.supersampling
        directions = self.field.points(*within_pixels(row, col, n))
        triangle, depth = self.scene.first_hits(self.centre, directions)
        # neighbouring samples look for different spots of the sun's disc, so shadows get soft edges
        lit = self._sunlit(directions, triangle, depth, 1 + np.arange(n * n) % 4)
        light = self._light(directions, triangle, depth, lit, 1.0 / self.image.camera.fx / n)
        return np.asarray(light.reshape(len(row), n * n, self.p.bands).mean(axis=1))

    def _light(
        self, directions: FloatArray, triangle: IntArray, depth: FloatArray, lit: BoolArray, pixel: float
    ) -> Float32Array:
        """(N, bands) radiance along rays, averaged over `pixel` times the depth."""
        sky = self.sky.share(self._points(directions, depth), triangle)
        out = np.empty((len(directions), self.p.bands), np.float32)
        samples = Samples(directions, depth, triangle, lit, sky)
        ripple = zlib.crc32(self.image.name.encode())
        patterns = noise_tiles.grain(), noise_tiles.cloud()
        radiances(samples, self.scene.surfaces, self.p.light, self.centre, pixel, ripple, patterns, out)
        return out

    def _points(self, directions: FloatArray, depth: FloatArray) -> FloatArray:
        return np.asarray(self.centre + np.where(np.isfinite(depth), depth, 0.0)[:, None] * directions)

    def _sunlit(self, directions: FloatArray, triangle: IntArray, depth: FloatArray, spot: IntArray) -> BoolArray:
        """(N,) whether the sun reaches each point; `spot` of the sun's disc, repeated over the samples."""
        lit = np.zeros(len(triangle), bool)
        if self.p.sun_strength == 0:
            return lit
        asked = np.flatnonzero((triangle != NOTHING) & (self.leaf | (self.sun_side > 0))[triangle])
        hit = triangle[asked]
        # off the surface by 2 mm on the sunny side, since float32 cannot tell the point from its own triangle
        side = np.where(self.sun_side[hit] > 0, 0.002, -0.002)[:, None] * self.scene.surfaces.normal[hit]
        towards = self.spots[spot[asked % len(spot)]]
        points = self._points(directions[asked], depth[asked])
        lit[asked] = ~self.scene.occluded(points + side, towards)
        return lit


def _middles(start: int, stop: int) -> FloatArray:
    return np.arange(start, stop, dtype=np.float64) + 0.5


def _sun_spots(sun: FloatArray) -> FloatArray:
    """(5, 3) directions to the middle and to four spots of the sun's disc."""
    right = np.cross(sun, [0.3, 0.5, 0.81])
    right /= np.linalg.norm(right)
    up = np.cross(right, sun)
    spots = np.array([[0.0, 0.0], [-0.5, -0.45], [0.5, 0.45], [0.45, -0.5], [-0.45, 0.5]]) * SUN_RADIUS_RAD
    return np.asarray(sun + spots[:, :1] * right + spots[:, 1:] * up)


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
    field, columns = RayField(image), _middles(0, width)
    at_once = max(1, SAMPLES_AT_ONCE // width)
    for top in range(0, height, at_once):
        rows = min(at_once, height - top)
        met, far = scene.first_hits(image.centre - scene.origin, field.lattice(_middles(top, top + rows), columns))
        triangle[top : top + rows] = met.reshape(rows, width)
        depth[top : top + rows] = np.where(np.isfinite(far), far, np.nan).reshape(rows, width)
    return depth, triangle
