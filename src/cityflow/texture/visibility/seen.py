"""Visibility of a face in images, cell by cell."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
import shapely

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.run_lengths import RunLengthMask
from cityflow.core.texture import FaceGrid, FacePlane, FaceView, SeenFace
from cityflow.texture.ranking.face_views import WHOLE
from cityflow.texture.ranking.field_of_view import in_frame
from cityflow.texture.visibility.scene import Scene

GROWTH = 1.05
"""Cells grow by this share until they are few enough; set by hand."""


def coarse_grid(face: FacePlane, finest_m: float, most_cells: int) -> FaceGrid:
    """Cells to try all images on: `finest_m`, or as coarse as needed for no more than `most_cells` over the face's box."""
    s_0, t_0, s_1, t_1 = face.polygon.bounds
    grid = FaceGrid.over(face.polygon, max(finest_m, float(np.sqrt((s_1 - s_0) * (t_1 - t_0) / most_cells))))
    # rows and columns are whole, so that slim faces have more cells than their area says
    while grid.rows * grid.cols > most_cells:
        grid = FaceGrid.over(face.polygon, grid.cell * GROWTH)
    return grid


def seen_faces(
    face: FacePlane, views: Sequence[FaceView], images: Sequence[OrientedImage], scene: Scene, grid: FaceGrid
) -> tuple[SeenFace, ...]:
    """What each view sees: cells inside the face's polygon and in the frame, with nothing between; in the order of the views.

    What is hidden is widened by the margin of the scene's parameters, because edges of what hides are known no better.
    """
    inside, st = face_cells(face, grid)
    xyz = face.world(st)
    return tuple(_seen(face, view, images[view.image], scene, grid, inside, xyz) for view in views)


def face_cells(face: FacePlane, grid: FaceGrid) -> tuple[BoolArray, FloatArray]:
    """(rows, cols) which cells are the face's, and (N, 2) s, t of a point of the face in each of these.

    These are the cells whose middle is inside; where that is none, because the face is slimmer than a cell, all that it touches.
    """
    centres = grid.centres().reshape(-1, 2)
    inside = shapely.contains_xy(face.polygon, centres[:, 0], centres[:, 1])
    if np.any(inside):
        return inside.reshape(grid.rows, grid.cols), centres[inside]
    half = grid.cell / 2
    boxes = shapely.box(*(centres - half).T, *(centres + half).T)
    touched = shapely.intersects(face.polygon, boxes)
    middles = shapely.point_on_surface(shapely.intersection(face.polygon, boxes[touched]))
    return touched.reshape(grid.rows, grid.cols), shapely.get_coordinates(middles)


def _seen(
    face: FacePlane,
    view: FaceView,
    image: OrientedImage,
    scene: Scene,
    grid: FaceGrid,
    inside: BoolArray,
    xyz: FloatArray,
) -> SeenFace:
    framed = np.ones(len(xyz), bool)
    if view.inside < WHOLE:
        framed = in_frame(image, xyz)
    free = framed.copy()
    free[framed] = scene.visible(xyz[framed], face.normal, image.centre)
    seen, hidden = np.zeros(inside.shape, bool), np.zeros(inside.shape, bool)
    seen[inside], hidden[inside] = free, framed & ~free
    return SeenFace(view, RunLengthMask.of(seen & ~_widened(hidden, scene.parameters.margin_m / grid.cell)))


def _widened(hidden: BoolArray, by_cells: float) -> BoolArray:
    """Cells whose middle is within so many cells of a hidden one's."""
    if by_cells < 1.0 or not np.any(hidden):
        return hidden
    away = cv2.distanceTransform((~hidden).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(away <= by_cells)
