"""Which images a reference image is matched with.

A partner is good where its rays meet the reference image's at a good angle, at a like scale, and good beside the others where it looks from another side:
what one partner does not see behind a house, the one from the other side does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.parameters import Parameters
from cityflow.orientation.views import View, field_of_view, footprints, sees_each

ANOTHER_SIDE_DEG = 12.0
"""Partners whose parallaxes differ by this many degrees hide different ground to a good part; set by hand, as are the next two."""
MOST_CANDIDATES = 40
"""Images with the best angles that are looked at closely as partners of a base."""
LEAST_GAIN = 0.08
"""A partner that adds less than this share of a perfect one is not worth its matching."""

BEST_ANGLE_DEG = (9.0, 20.0)
"""Best angles between rays that meet, degrees; set by hand on synthetic flights and kite photographs, as are the next two."""
GOOD_ANGLE_DEG = (5.0, 30.0)
"""Angles worth half as much: narrower ones give poor heights, wider ones images that look unlike each other."""
LARGEST_SCALE_RATIO = 2.0
"""Ratio of scales at which a pair is useless: one image has a quarter of the other's pixels."""
LARGEST_TURN_DEG = 45.0
"""Optical axes of a pair differ by no more: neighbouring heads of an oblique camera do by 45 degrees."""
LEAST_OVERLAP = 0.15
"""Share of the reference image's ground that a partner must see; set by hand on synthetic flights and kite photographs."""


class PartnerParameters(Parameters):
    """What makes a good pair."""

    partners: int = Field(5, ge=1, le=32, description="largest number of partners of a reference image")


@dataclass(frozen=True)
class Neighbourhood:
    """All views of a survey, ready to be asked who sees what.

    Attributes
    ----------
    views : sorted by name
    centres, axes : (N, 3) float64, world
    rotations : (N, 3, 3) float64, camera_from_world
    focal_px : (N,) float64
    fields : (N, 2, 2) float64, least and largest x/z, y/z of the rays
    tree : of the footprints on the lowest ground; empty ones are never found
    """

    views: tuple[View, ...]
    centres: FloatArray
    axes: FloatArray
    rotations: FloatArray
    focal_px: FloatArray
    fields: FloatArray
    footprints: tuple[shapely.Polygon, ...]
    tree: shapely.STRtree

    @classmethod
    def of(cls, views: Sequence[View]) -> Neighbourhood:
        ordered = tuple(sorted(views, key=lambda view: view.name))
        ground = tuple(footprints(ordered))
        return cls(
            ordered,
            np.array([v.image.centre for v in ordered]).reshape(-1, 3),
            np.array([v.image.axis for v in ordered]).reshape(-1, 3),
            np.array([v.image.rotation for v in ordered]).reshape(-1, 3, 3),
            np.array([np.sqrt(v.image.camera.fx * v.image.camera.fy) for v in ordered]),
            np.array([field_of_view(v.image.camera) for v in ordered]).reshape(-1, 2, 2),
            ground,
            shapely.STRtree(ground),
        )

    def meeting(self, xyz: FloatArray) -> IntArray:
        """Views whose footprints meet the hull of (n, 3) points, sorted."""
        hull = shapely.MultiPoint(xyz[:, :2]).convex_hull
        return np.sort(np.asarray(self.tree.query(hull, predicate="intersects"), np.int64))


@dataclass(frozen=True, slots=True)
class Pairing:
    """Partners of a reference image, best first, as indices into the neighbourhood; and why there is none."""

    chosen: tuple[int, ...]
    usable: tuple[int, ...]
    reason: str = ""


def find_partners(around: Neighbourhood, reference: int, xyz: FloatArray, parameters: PartnerParameters) -> Pairing:
    """Partners of view `reference` for the (n, 3) world points that it answers for.

    Each next partner is the one that adds most: the sum over the points of its quality there, less what partners from the same side have already.
    """
    if len(xyz) == 0:
        return Pairing((), (), "it sees no ground: it looks at or above the horizon, or its centre is below the ground")
    others = around.meeting(xyz)
    others = others[others != reference]
    if len(others) == 0:
        return Pairing((), (), "no other image sees the ground that it sees")
    others, reason = _comparable(around, reference, others, xyz.mean(axis=0))
    if len(others) == 0:
        return Pairing((), (), reason)
    parallax, quality = _pairs(around, reference, others, xyz)
    enough = np.mean(quality > 0, axis=1) >= LEAST_OVERLAP
    others, parallax, quality = others[enough], parallax[enough], quality[enough]
    if len(others) == 0:
        return Pairing((), (), "no other image sees enough of its ground at a useful angle")
    chosen = _greedy(parallax, quality, parameters.partners)
    if not chosen:
        return Pairing((), (), "its rays meet those of other images at poor angles or scales only")
    return Pairing(tuple(int(others[k]) for k in chosen), tuple(others.tolist()))


def angle_quality(angle_deg: FloatArray) -> FloatArray:
    """1 at the best angles, 0.5 at the ends of the good ones, 0 well beyond."""
    (low, high), (least, most) = BEST_ANGLE_DEG, GOOD_ANGLE_DEG
    return np.interp(angle_deg, [least / 3, least, low, high, most, 1.6 * most], [0.0, 0.5, 1.0, 1.0, 0.5, 0.0])


def _comparable(around: Neighbourhood, reference: int, others: IntArray, point: FloatArray) -> tuple[IntArray, str]:
    """Those of `others` that might do, judged at one point with room to spare; and why the rest do not."""
    turned = np.degrees(np.arccos(np.clip(around.axes[others] @ around.axes[reference], -1, 1)))
    nothing = others[:0]
    alike = turned <= LARGEST_TURN_DEG
    if not alike.any():
        return nothing, f"images that see the same ground look elsewhere: axes differ by {turned.min():.0f}° or more"
    others = others[alike]
    rays, own = around.centres[others] - point, around.centres[reference] - point
    far, near = np.linalg.norm(rays, axis=1), float(np.linalg.norm(own))
    angle = np.degrees(np.arccos(np.clip(rays @ own / np.maximum(far * near, 1e-12), -1, 1)))
    met = (angle <= 2.5 * GOOD_ANGLE_DEG[1]) & (np.linalg.norm(rays - own, axis=1) > 1e-6 * near)
    if not met.any():
        return nothing, f"its rays meet those of others at {angle.min():.0f}° or more, or they come from one place"
    others, octaves = others[met], _octaves(around, reference, others[met], far[met], near)
    scaled = octaves <= 2 * np.log2(LARGEST_SCALE_RATIO)
    if not scaled.any():
        return nothing, f"scales differ by {2 ** octaves.min():.1f} or more from those that see the same ground"
    others = others[scaled]
    apart = ~_epipoles_inside(around, reference, others)
    angle = np.degrees(np.arccos(np.clip(unit_rays(around, others, point) @ (own / near), -1, 1)))
    best = np.lexsort((others, -np.round(angle_quality(angle) * apart, 3)))[:MOST_CANDIDATES]
    others, apart = others[best], apart[best]
    return np.sort(others[apart]), "the images that see the same ground stand along its line of sight"


def unit_rays(around: Neighbourhood, others: IntArray, point: FloatArray) -> FloatArray:
    """(m, 3) unit vectors from a point to projection centres."""
    rays = around.centres[others] - point
    return np.asarray(rays / np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), 1e-12))


def _octaves(
    around: Neighbourhood, reference: int, others: IntArray, far: FloatArray, near: FloatArray | float
) -> FloatArray:
    scale = (far / around.focal_px[others].reshape(-1, *(1,) * (np.ndim(far) - 1))) / (
        near / around.focal_px[reference]
    )
    return np.asarray(np.abs(np.log2(np.maximum(scale, 1e-9))))


def _epipoles_inside(around: Neighbourhood, reference: int, others: IntArray) -> BoolArray:
    """(m,) whether one image sees the other's projection centre or its opposite: then no rectification keeps the image whole."""
    line = around.centres[others] - around.centres[reference]
    inside = np.zeros(len(others), bool)
    for rotations, fields in (
        (around.rotations[[reference]], around.fields[[reference]]),
        (around.rotations[others], around.fields[others]),
    ):
        local = np.einsum("mij,mj->mi", np.broadcast_to(rotations, (len(others), 3, 3)), line)
        depth = np.where(np.abs(local[:, 2]) > 1e-9, local[:, 2], 1e-9)
        normal = local[:, :2] / depth[:, None]
        inside |= np.all((normal >= fields[:, 0]) & (normal <= fields[:, 1]), axis=1)
    return inside


def _pairs(around: Neighbourhood, reference: int, others: IntArray, xyz: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(m, n, 2) parallaxes in degrees across the reference image's rays, and (m, n) qualities, of m others at n points."""
    own = around.centres[reference] - xyz
    near = np.linalg.norm(own, axis=1)
    rays = around.centres[others][:, None, :] - xyz
    far = np.linalg.norm(rays, axis=2)
    own, rays = own / near[:, None], rays / far[..., None]
    # right and down of the reference image, made perpendicular to each ray, span the plane in which a partner may stand
    right, down = (np.asarray(v - (own @ v)[:, None] * own) for v in around.views[reference].image.rotation[:2])
    across = np.stack([np.sum(rays * right, axis=2), np.sum(rays * down, axis=2)], axis=2)
    angle = np.degrees(np.arccos(np.clip(np.sum(rays * own, axis=2), -1, 1)))
    parallax = across / np.maximum(np.linalg.norm(across, axis=2), 1e-12)[..., None] * angle[..., None]
    scale = np.interp(_octaves(around, reference, others, far, near) / np.log2(LARGEST_SCALE_RATIO), [0.25, 1], [1, 0])
    seen = sees_each([around.views[k].image for k in others.tolist()], xyz)
    return parallax, angle_quality(angle) * scale * seen


def _greedy(parallax: FloatArray, quality: FloatArray, most: int) -> list[int]:
    """Indices of the partners that add most, in the order in which they do; ties go to the first."""
    chosen: list[int] = []
    while len(chosen) < min(most, len(quality)):
        gain = np.mean(quality, axis=1)
        gain[chosen] = -1.0
        k = int(np.argmax(np.round(gain, 9)))
        if gain[k] < LEAST_GAIN:
            break
        chosen.append(k)
        apart = np.sum((parallax - parallax[k]) ** 2, axis=2)
        quality = quality * (1 - (quality[k] > 0) * np.exp(-apart / (2 * ANOTHER_SIDE_DEG**2)))
    return chosen


def view_samples(image: OrientedImage, heights: tuple[float, float], per_side: int = 6) -> FloatArray:
    """(n, 3) world points on the lowest ground, and as many at the highest, spread evenly over the image, metres."""
    u, v = (
        (np.arange(per_side) + 0.5) / per_side * image.camera.width,
        (np.arange(per_side) + 0.5) / per_side * image.camera.height,
    )
    rays = image.rays(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))
    down = rays[rays[:, 2] < -0.17 * np.hypot(rays[:, 0], rays[:, 1])]
    return np.concatenate(
        [image.centre + down * ((h - image.centre[2]) / down[:, 2])[:, None] for h in heights if h < image.centre[2]]
        or [np.empty((0, 3))]
    )
