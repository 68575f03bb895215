"""Epipolar rectification that keeps the reference image nearly unchanged, for any tilt and any direction of the base line.

The undistorted reference image is turned in its plane until the x axis (u) points to the partner's epipole, then the fan of epipolar lines is made
parallel by stretching each column: row = v / (1 - u / epipole). Nothing else is done to the reference image, so its scale along the rows is kept.
The partner is drawn through a reference plane into the same geometry (plane and parallax): what lies on the plane has no disparity, what stands
above it has a positive one. Partners of another scale, 45° views and forward-looking heads need no case of their own, and the level ground keeps
nearly the same disparity all over the image.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.kernels import njit
from cityflow.errors import CityflowError

LEAST_FAN = 0.3
"""Least stretch of the fan: the reference image is left out from where its epipole is so near that rows are blown up threefold; set by hand, as are
those below."""
LEAST_SHARE = 0.7
"""Share of the reference image that must be left."""
FURTHEST = 30.0
"""Rays that meet the reference plane further off than this, in units of the camera's distance from the plane, look at the horizon."""


IN_IMAGE = (0.0, 0.0, 1.0)
"""A plane on which the depths of all rays are 1."""

_Plane = tuple[tuple[float, float, float], tuple[float, float, float], float]
"""Correction of rows (constant, per x, per y); n / c of a plane as in `Rectification`; what n · ray / c is at the horizon."""


class UnusablePair(CityflowError):
    """Two images that cannot be rectified or do not fit together."""


@dataclass(frozen=True, slots=True)
class Rectification:
    """Geometry of one rectified pair.

    Rectified coordinates (x, y) count pixels from the corner of the first lattice pixel. The rectified frame is the reference camera's frame, turned
    around its optical axis.

    Attributes
    ----------
    base, partner : the two images
    focal : pixels per unit of normalised coordinates in the rectified reference image
    turn : cosine and sine of the angle from the camera's x axis to the rectified one
    fan : 1 / distance of the epipole from the principal point, per pixel; 0 where the base line is parallel to the image
    origin : rectified position of the principal point is -origin, pixels
    rows, cols : size of the lattice at level 0
    baseline : (3,) from reference image to partner in the rectified frame, metres; the second component is 0
    plane : (3,) n / c in the rectified frame: a ray r meets the reference plane at depth 1 / (plane · r)
    offset : (3,) vertical parallax (constant, per x, per y) that the partner's rows are corrected by, pixels
    """

    reference: OrientedImage
    partner: OrientedImage
    focal: float
    turn: tuple[float, float]
    fan: float
    origin: tuple[float, float]
    rows: int
    cols: int
    baseline: FloatArray = field(repr=False)
    plane: FloatArray = field(repr=False)
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def rays(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Rectified coordinates → (…, 3) rays in the rectified frame whose depth component is 1."""
        u = x + self.origin[0]
        v = (y + self.origin[1]) * (1.0 - u * self.fan)
        return np.stack([u / self.focal, v / self.focal, np.ones_like(u)], axis=-1)

    def rectified(self, normal: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(…, 2) undistorted normalised coordinates of the reference image → rectified x and y."""
        c, s = self.turn
        u = self.focal * (c * normal[..., 0] + s * normal[..., 1])
        v = self.focal * (c * normal[..., 1] - s * normal[..., 0])
        # beyond the lattice anything will do that stays there
        return u - self.origin[0], v / np.maximum(1.0 - u * self.fan, 0.5 * LEAST_FAN) - self.origin[1]

    def reference_pixels(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Rectified coordinates → (…, 2) image coordinates in the reference image; NaN far outside."""
        camera, here = self.reference.camera, (0.0, 0.0, 0.0)
        return self._pixels(camera, x, y, (here, IN_IMAGE, 0.0), (self._back, np.zeros(3)))

    def partner_pixels(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Rectified coordinates → (…, 2) image coordinates in the partner of what the reference plane shows there; NaN where nothing is."""
        plane = float(self.plane[0]), float(self.plane[1]), float(self.plane[2])
        to_partner = self.partner.rotation @ self.reference.rotation.T @ self._back
        apart = self.partner.rotation @ (self.reference.centre - self.partner.centre)
        nearest = float(np.linalg.norm(self.plane)) / FURTHEST
        return self._pixels(self.partner.camera, x, y, (self.offset, plane, nearest), (to_partner, apart))

    def _pixels(
        self, camera: Camera, x: FloatArray, y: FloatArray, plane: _Plane, way: tuple[FloatArray, FloatArray]
    ) -> FloatArray:
        """(…, 2) image coordinates in a camera; `way` leads into its frame."""
        lattice = *self.origin, self.focal, self.fan
        normal = _normals(np.ravel(x), np.ravel(y), lattice, plane, way, _reach(camera) ** 2)
        return camera.distort(normal).reshape(*np.shape(x), 2)

    @property
    def _back(self) -> FloatArray:
        """(3, 3) from the rectified frame into that of the reference camera."""
        c, s = self.turn
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def disparities(self, x: FloatArray, y: FloatArray, depth: FloatArray) -> FloatArray:
        """Disparities of points at a depth in the reference image; NaN where the partner does not look down on the plane through them."""
        to_point = self.rays(x, y) * depth[..., None] - self.baseline
        fall = to_point @ self.plane
        with np.errstate(divide="ignore", invalid="ignore"):
            foot = self.baseline + to_point * ((1.0 - self.plane @ self.baseline) / fall)[..., None]
            disparity = x + self.origin[0] - self.focal * foot[..., 0] / foot[..., 2]
        return np.where((fall > 0) & (foot[..., 2] > 0), disparity, np.nan)

    def depths(self, x: FloatArray, y: FloatArray, disparity: FloatArray) -> FloatArray:
        """Depths along the reference camera's z axis of points with a disparity."""
        ray, other = self.rays(x, y), self.rays(x - disparity, y)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = other / (other @ self.plane)[..., None] - self.baseline
            depth = (self.baseline[0] * s[..., 2] - self.baseline[2] * s[..., 0]) / (
                ray[..., 0] * s[..., 2] - s[..., 0]
            )
        return np.where(depth > 0, depth, np.nan)

    def depths_at_height(self, x: FloatArray, y: FloatArray, height: float) -> FloatArray:
        """Depths at which the rays of the reference image reach a height of the world; NaN where they do not."""
        fall = self._turned_back(self.rays(x, y)) @ self.reference.rotation[:, 2]
        with np.errstate(divide="ignore"):
            depth = (height - self.reference.centre[2]) / fall
        return np.where((depth > 0) & np.isfinite(depth), depth, np.nan)

    def world(self, x: FloatArray, y: FloatArray, depth: FloatArray) -> FloatArray:
        """(…, 3) world points at depths in the reference image."""
        local = self._turned_back(self.rays(x, y) * depth[..., None])
        return local @ self.reference.rotation + self.reference.centre

    def moved(self, offset: tuple[float, float, float]) -> Rectification:
        """The same with another correction of vertical parallax."""
        return replace(self, offset=offset)

    def _turned_back(self, ray: FloatArray) -> FloatArray:
        c, s = self.turn
        return np.stack([c * ray[..., 0] - s * ray[..., 1], s * ray[..., 0] + c * ray[..., 1], ray[..., 2]], axis=-1)


def rectify(reference: OrientedImage, partner: OrientedImage, height: float, lean: float) -> Rectification:
    """Rectification of a pair.

    Parameters
    ----------
    height : world height of the reference plane under the middle of the reference image
    lean : tilt of the reference plane: 0 is level, 1 is parallel to the reference image

    Raises
    ------
    UnusablePair : base line too short, along the viewing direction, or with its epipole in the reference image; views that look apart
    """
    where = f"pair {reference.name} – {partner.name}"
    line = partner.centre - reference.centre
    length = float(np.linalg.norm(line))
    normal, middle = _reference_plane(reference, height, lean, where)
    distance = float(normal @ (middle - reference.centre))
    if length < 1e-3 * abs(distance):
        raise UnusablePair(f"base line of {length:.3g} m is too short", where=where, remedy="leave one of the two out")
    if float(normal @ (middle - partner.centre)) >= 0:
        raise UnusablePair("the partner stands below the ground", where=where, remedy="check poses and heights")
    local = reference.rotation @ line
    across = float(np.hypot(local[0], local[1]))
    if across < 0.05 * length:
        raise UnusablePair(
            "the base line runs along the viewing direction", where=where, remedy="choose another partner"
        )
    turn = (float(local[0]) / across, float(local[1]) / across)
    focal = float(np.sqrt(reference.camera.fx * reference.camera.fy))
    fan = float(local[2]) / (across * focal)
    back = np.array([[turn[0], turn[1], 0.0], [-turn[1], turn[0], 0.0], [0.0, 0.0, 1.0]])
    draft = Rectification(
        reference,
        partner,
        focal,
        turn,
        fan,
        (0.0, 0.0),
        0,
        0,
        back @ local,
        back @ (reference.rotation @ normal) / distance,
    )
    return _on_lattice(draft, where)


def _reference_plane(reference: OrientedImage, height: float, lean: float, where: str) -> tuple[FloatArray, FloatArray]:
    """Normal (towards the cameras) and a point of the reference plane."""
    up = np.array([0.0, 0.0, 1.0])
    normal = (1.0 - lean) * up - lean * reference.axis
    normal /= np.linalg.norm(normal)
    fall = reference.axis[2]
    if fall > -0.05 or reference.centre[2] <= height:
        raise UnusablePair(
            "the reference image does not look down on the ground", where=where, remedy="check rotation and heights"
        )
    return normal, reference.centre + reference.axis * (height - reference.centre[2]) / fall


def _on_lattice(draft: Rectification, where: str) -> Rectification:
    """The same with an origin and a size that take in the reference image as far as the fan allows."""
    camera = draft.reference.camera
    across, down = np.meshgrid(np.linspace(0.0, camera.width, 33), np.linspace(0.0, camera.height, 33))
    inside = camera.undistort(np.stack([across, down], axis=-1)).reshape(-1, 2)
    all_of_it = np.concatenate([_within(draft, camera.undistort(_border(camera))), _within(draft, inside)])
    if len(_within(draft, inside)) < LEAST_SHARE * len(inside):
        raise UnusablePair(
            "the epipole lies in or near the reference image", where=where, remedy="choose another partner"
        )
    x, y = draft.rectified(all_of_it)
    origin = (float(np.floor(x.min())), float(np.floor(y.min())))
    return replace(draft, origin=origin, cols=int(np.ceil(x.max()) - origin[0]), rows=int(np.ceil(y.max()) - origin[1]))


def _within(draft: Rectification, normal: FloatArray) -> FloatArray:
    """Those of (N, 2) normalised coordinates of the reference image where the fan is wide enough."""
    u = draft.focal * (draft.turn[0] * normal[:, 0] + draft.turn[1] * normal[:, 1])
    return normal[1.0 - u * draft.fan >= LEAST_FAN]


def _border(camera: Camera) -> FloatArray:
    along = np.linspace(0.0, 1.0, 65)
    sides = [(along, 0 * along), (along, 0 * along + 1), (0 * along, along), (0 * along + 1, along)]
    return np.concatenate([np.column_stack([a * camera.width, b * camera.height]) for a, b in sides])


@njit(cache=True, nogil=True, error_model="numpy")
def _normals(x, y, lattice, plane, way, reach):  # type: ignore[no-untyped-def]
    """(N, 2) undistorted normalised coordinates in a camera of what a plane shows at rectified coordinates; NaN where that is behind the camera, farther off
    the axis than the root of `reach`, or at the horizon."""
    (x_0, y_0, focal, fan), ((a, b, c), (p, q, r), nearest), (turn, apart) = lattice, plane, way
    out = np.empty((len(x), 2))
    for i in range(len(x)):
        down = y[i] + (a + b * x[i] + c * y[i])
        u = x[i] + x_0
        e, f = u / focal, (down + y_0) * (1.0 - u * fan) / focal
        near = p * e + q * f + r
        right = turn[0, 0] * e + turn[0, 1] * f + turn[0, 2] + apart[0] * near
        below = turn[1, 0] * e + turn[1, 1] * f + turn[1, 2] + apart[1] * near
        ahead = turn[2, 0] * e + turn[2, 1] * f + turn[2, 2] + apart[2] * near
        v, w = right / ahead, below / ahead
        shown = (near > nearest) & (ahead > 0.0) & (v * v + w * w < reach)
        out[i, 0], out[i, 1] = v if shown else np.nan, w if shown else np.nan
    return out


@lru_cache(maxsize=64)
def _reach(camera: Camera) -> float:
    """Greatest tangent of an angle off the axis at which distortion is trusted: a little farther out than the image's corners."""
    return 1.05 * float(np.max(np.hypot(*camera.undistort(_border(camera)).T)))
