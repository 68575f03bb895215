"""Where a view of a wall shows the ground before it or the roof above, since the wall stands behind or before its model.

A wall that stands `e` metres behind its model leaves the ground in sight up to `e · tan(incidence)` metres above the model's foot; one that stands before it
leaves the roof in sight as far below the model's eaves. Colours tell how far: those of the ground before the wall or of the roof behind it, and those of the
wall's middle, in the same image. Of all heights up to which a column of cells may show something else, the likeliest is taken, where `e` is normally
distributed as the outline's standard deviation says.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.run_lengths import RunLengthMask
from cityflow.core.texture import FaceGrid, FacePlane, SeenFace
from cityflow.errors import CityflowError
from cityflow.texture.ranking.field_of_view import in_frame
from cityflow.texture.source_image import Source
from cityflow.texture.visibility.scene import Scene

APART_M = (0.4, 0.8, 1.2, 1.6, 2.0)
"""Distances from the wall at which the colours of its ground and of its roof are taken; set by hand, as are those below."""
LEAST_SIGMA_M = 0.01
"""No wall is known better."""
SURE_SIGMAS = 2.0
"""Cells that would only show ground if the wall stood further back than this tell its own colours."""
FEWEST = 12
"""Fewer cells or places tell no colours."""
OTHER = 0.05
"""Share of cells whose colour is neither like the ground nor like the wall: windows, people."""
NOISE = 6.0
"""Standard deviation of colours that look the same, values of 0 to 255."""
ALONG_M = 1.0
"""Columns within so much of a wall end at about the same height."""
MIXED = 1
"""Cells beyond the last one that shows something else, of which the image shows both."""
MOST_TOLD = 2.0
"""A cell speaks for the ground or the wall by no more than this (nats): its neighbours show much the same."""
ALIKE = 11.3
"""Square of Mahalanobis' distance within which are 99 of 100 colours of the ground."""
OWN_SHARE = 0.25
"""What looks like the ground is no wall, unless so little is left then."""


@dataclass(frozen=True, slots=True, eq=False)
class Wall:
    """A wall, and what may be seen in place of its ends.

    Attributes
    ----------
    face, grid : its plane, and the cells that views of it are on
    ground, roof : (N, 3) places before its foot and behind its eaves, world metres; none where other things stand there
    sigma_m : how exactly it is known across, standard deviation
    """

    face: FacePlane
    grid: FaceGrid
    ground: FloatArray
    roof: FloatArray
    sigma_m: float

    @classmethod
    def of(cls, face: FacePlane, grid: FaceGrid, heights: FloatArray, of_heights: Grid, sigma_m: float) -> Wall:
        """With the surface around it.

        Parameters
        ----------
        heights : (rows, cols) on `of_heights`, world metres; NaN where it is not known
        """
        s_0, t_0, s_1, t_1 = face.polygon.bounds
        along = np.linspace(s_0, s_1, 2 + int((s_1 - s_0) / APART_M[0]))
        foot = face.world(np.column_stack([along, np.full(len(along), t_0)]))
        away = np.array(APART_M)[:, None, None] * face.normal
        ground, roof = (_on_surface((foot + way * away).reshape(-1, 3), heights, of_heights) for way in (1.0, -1.0))
        half = foot[0, 2] + 0.5 * (t_1 - t_0)
        return cls(face, grid, ground[ground[:, 2] < half], roof[roof[:, 2] > half], max(sigma_m, LEAST_SIGMA_M))


def _on_surface(places: FloatArray, heights: FloatArray, grid: Grid) -> FloatArray:
    """(N, 3) those places whose height the surface knows, on it."""
    row, col = grid.indices(places[:, 0], places[:, 1])
    inside = (row >= 0) & (row < grid.rows) & (col >= 0) & (col < grid.cols)
    z = heights[row[inside], col[inside]]
    return np.column_stack([places[inside, :2], z])[~np.isnan(z)]


def without_beside(
    wall: Wall, seen: Sequence[SeenFace], sources: Sequence[Source], scene: Scene, keep: Callable[[Sequence[SeenFace]], Sequence[int]]
) -> tuple[SeenFace, ...]:  # fmt: skip
    """What images see of a wall, less the cells at its ends at which they show the ground or the roof; only of images that would be kept.

    Parameters
    ----------
    keep : which of such views are kept, as positions
    """
    looked = dict[int, SeenFace]()
    while True:
        now = tuple(looked.get(one.view.image, one) for one in seen)
        new = [one for one in (now[k] for k in keep(now)) if one.view.image not in looked]
        if not new:
            return tuple(one for one in now if one.mask.count)
        looked.update({one.view.image: _without(wall, one, sources[one.view.image], scene) for one in new})


def _without(wall: Wall, one: SeenFace, source: Source, scene: Scene) -> SeenFace:
    mask = one.mask.mask()
    shown = np.full((*mask.shape, 3), np.nan)
    shown[mask] = _colours(source, wall.face.world(wall.grid.centres()[mask]), one.view.gsd_m, wall.grid.cell)
    lower, upper = (_away(wall, mask, source, of_upper) for of_upper in (False, True))
    sure = mask & ~np.isnan(shown[..., 0]) & (np.minimum(lower, upper) > SURE_SIGMAS)
    left = mask.copy()
    for places, away, way in ((wall.ground, lower, -1), (wall.roof, upper, 1)):
        beside = _colours(source, places[_sees(source, places, scene)], one.view.gsd_m, wall.grid.cell)
        beside = beside[~np.isnan(beside[:, 0])]
        if len(beside) >= FEWEST:
            speaks = _for_beside(shown, beside, shown[sure])
            left &= ~_up_to(speaks[::way], away[::way], mask[::way], wall.grid.cell)[::way]
    return one if np.array_equal(left, mask) else replace(one, mask=RunLengthMask.of(left))


def _sees(source: Source, places: FloatArray, scene: Scene) -> BoolArray:
    """(N,) which places on level ground an image shows."""
    sees = in_frame(source.image, places)
    sees[sees] = scene.visible(places[sees], np.array([0.0, 0.0, 1.0]), source.image.centre)
    return sees


def _colours(source: Source, xyz: FloatArray, gsd_m: float, cell_m: float) -> FloatArray:
    """(N, 3) at places in the world, of pixels about as large as cells; NaN where the image shows nothing or cannot be read."""
    found = np.full((len(xyz), 3), np.nan)
    uv, depth = source.image.project(xyz)
    inside = (depth > 0) & source.image.holds(uv)
    if inside.any():
        with suppress(CityflowError):
            found[inside] = source.colours(uv[inside], source.level_of(cell_m / max(gsd_m, 1e-6)))
    return found


def _away(wall: Wall, mask: BoolArray, source: Source, upper: bool) -> FloatArray:
    """(rows, cols) standard deviations that the wall must stand behind its model, or before it, for its cells to show what is beyond its lower or upper end."""
    centres = wall.grid.centres()
    rays = wall.face.world(centres[mask]) - source.image.centre
    down = np.maximum((rays @ wall.face.up) / (rays @ wall.face.normal), 1e-6)
    t = centres[..., 1]
    to_end = np.where(mask, t, -np.inf).max(axis=0) - t if upper else t - np.where(mask, t, np.inf).min(axis=0)
    away = np.full(mask.shape, np.inf)
    away[mask] = (to_end[mask] + wall.grid.cell / 2) / (down * wall.sigma_m)
    return away


def _for_beside(shown: FloatArray, beside: FloatArray, own: FloatArray) -> FloatArray:
    """(rows, cols) how much likelier each colour is beside the wall than on it, nats; 0 where nothing is known.

    Parameters
    ----------
    beside : (N, 3) colours of the ground or the roof;  own : (N, 3) of the middle of the wall
    """
    known = ~np.isnan(shown[..., 0])
    colours = shown[known]
    ground = _Look.of(beside)
    other = own[ground.squared(own) > ALIKE]
    if len(other) >= max(FEWEST, OWN_SHARE * len(own)):
        own = other
    none = -3.0 * np.log(256.0)
    on_wall = _Look.of(own).density(colours) if len(own) >= FEWEST else np.full(len(colours), none)
    either = np.log(OTHER) + none
    tells = np.logaddexp(np.log1p(-OTHER) + ground.density(colours), either)
    tells -= np.logaddexp(np.log1p(-OTHER) + on_wall, either)
    out = np.zeros(known.shape)
    out[known] = np.clip(tells, -MOST_TOLD, MOST_TOLD)
    return out


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """Normally distributed colours: (3,) mean, (3, 3) covariance."""

    mean: FloatArray
    covariance: FloatArray

    @classmethod
    def of(cls, colours: FloatArray) -> _Look:
        return cls(colours.mean(axis=0), np.cov(colours.T) + NOISE**2 * np.eye(3))

    def squared(self, colours: FloatArray) -> FloatArray:
        """(N,) squares of Mahalanobis' distance."""
        away = colours - self.mean
        return np.asarray(np.einsum("ni,ij,nj->n", away, np.linalg.inv(self.covariance), away))

    def density(self, colours: FloatArray) -> FloatArray:
        """(N,) its logarithm."""
        scale = np.linalg.slogdet(2.0 * np.pi * self.covariance)[1]
        return np.asarray(-0.5 * (self.squared(colours) + scale))


def _up_to(speaks: FloatArray, away: FloatArray, mask: BoolArray, cell: float) -> BoolArray:
    """(rows, cols) cells that show what is beside the wall: in each column those from its first row to the likeliest one, and the mixed ones beyond it.

    Parameters
    ----------
    speaks : (rows, cols) for what is beside, nats;  away : (rows, cols) how far the wall must stand away, standard deviations
    """
    wide = round(ALONG_M / cell)
    smooth = cv2.blur(np.where(mask, speaks, 0.0), (2 * wide + 1, 1), borderType=cv2.BORDER_CONSTANT)
    likely = np.where(mask, np.cumsum(smooth, axis=0) - 0.5 * away**2, -np.inf)
    last = np.where(likely.max(axis=0) > 0.0, likely.argmax(axis=0) + MIXED, -1)
    return np.asarray(mask & (np.arange(len(mask))[:, None] <= last))
