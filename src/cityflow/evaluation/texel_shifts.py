"""Error of texture interpolation in a renderer, against the perspective of the face."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.texture import FacePlane, Patch
from cityflow.evaluation.texture_accuracy import on_face
from cityflow.geometry.polygon_triangulation import triangulate_polygon
from cityflow.geometry.textured_view import TexturedTriangles, draw_textured


def texel_shifts(face: FacePlane, patch: Patch, view: OrientedImage, *, divide: bool = True) -> FloatArray:
    """(N,) how far each texel that a view shows is drawn from where it belongs, pixels of the view.

    The face is drawn with a page whose values are its own columns and rows, so that what comes out is where the renderer looked.

    Parameters
    ----------
    view : a camera without distortion
    divide : False as a renderer does that interpolates u and v as they are
    """
    rows, cols = patch.index.shape
    col, row = np.meshgrid(np.arange(cols) + 0.5, np.arange(rows) + 0.5)
    page = np.stack([col, row, np.zeros_like(col)], axis=-1).astype(np.float32)
    corners = np.concatenate(patch.corners)
    uvd = np.column_stack([corners[:, 0] / cols, 1.0 - corners[:, 1] / rows, corners[:, 2]])
    triangles = np.asarray(triangulate_polygon([face.on_plane(r) for r in face.rings]), np.int64)
    many = len(triangles)
    # values that are not 0 to 255 are as good as colours to the renderer
    drawn = TexturedTriangles(np.concatenate(face.rings), uvd, triangles, np.zeros(many, np.int64), np.zeros((many, 3), np.int64), [page])  # type: ignore[list-item]  # fmt: skip
    seen = draw_textured(view, drawn, divide=divide)
    at_row, at_col = np.nonzero(seen.triangle >= 0)
    where = on_face(face, patch, seen.colour[at_row, at_col, :2].astype(np.float64))
    uv, _ = view.project(face.world(where))
    return np.asarray(np.hypot(uv[:, 0] - at_col - 0.5, uv[:, 1] - at_row - 0.5))
