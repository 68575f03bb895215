"""Selects the faces that belong to buildings: minimum sum of area and border costs."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.geometry.min_cut import min_cut
from cityflow.outlines.joined.combine_faces import Faces

_UNITS_PER_M2 = 2000.0
"""The cut counts in whole numbers: 5 cm² each."""
_MOST = 200_000_000
"""What no cut may part."""


def building_faces(faces: Faces, gain: FloatArray, inside_left: FloatArray, inside_right: FloatArray) -> BoolArray:
    """(F,) True for faces of buildings, by a minimum cut.

    Parameters
    ----------
    gain : (F,) m²; what is lost if the face is no building; negative: what is lost if it is one
    inside_left : (E,) m², what a border along the edge costs with the building on its left
    inside_right : (E,) m², with the building on its right
    """
    count = len(gain)
    building, none = np.full(count, count + 1), np.full(count, count)
    both = (faces.left >= 0) & (faces.right >= 0)
    # The source stands for no building, so that of cuts that cost the same the one with the fewest buildings is taken.
    tail = [faces.right[both], faces.left[both], np.arange(count), none]
    head = [faces.left[both], faces.right[both], building, np.arange(count)]
    cost = [inside_left[both], inside_right[both], np.maximum(gain, 0), np.maximum(-gain, 0)]
    room = np.minimum(np.rint(np.concatenate(cost) * _UNITS_PER_M2), _MOST).astype(np.int64)
    return ~min_cut(np.concatenate(tail), np.concatenate(head), room, count + 2)[:count]
