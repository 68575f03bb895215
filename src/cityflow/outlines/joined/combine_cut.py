"""Which faces are building: the least sum of disagreement with what is known of areas and with what is known of borders."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.outlines.joined.combine_faces import Faces

_UNITS_PER_M2 = 2000.0
_MOST = 200_000_000


def building_faces(faces: Faces, gain: FloatArray, inside_left: FloatArray, inside_right: FloatArray) -> BoolArray:
    """(F,) True for faces of buildings, by a minimum cut.

    Parameters
    ----------
    gain : (F,) m²; what is lost if the face is no building; negative: what is lost if it is one
    inside_left : (E,) m², what a border along the edge costs with the building on its left
    inside_right : (E,) m², with the building on its right
    """
    count = len(gain)
    source, sink = count, count + 1
    both = (faces.left >= 0) & (faces.right >= 0)
    rows = [faces.left[both], faces.right[both], np.full(count, source), np.arange(count)]
    cols = [faces.right[both], faces.left[both], np.arange(count), np.full(count, sink)]
    data = [inside_left[both], inside_right[both], np.maximum(gain, 0), np.maximum(-gain, 0)]
    capacity = np.minimum(np.rint(np.concatenate(data) * _UNITS_PER_M2), _MOST).astype(np.int32)
    graph = coo_array((capacity, (np.concatenate(rows), np.concatenate(cols))), shape=(count + 2, count + 2)).tocsr()
    graph.sum_duplicates()
    flow = maximum_flow(csr_array(graph), source, sink).flow
    left = (graph - flow).tocsr()
    left.data[left.data < 0] = 0
    left.eliminate_zeros()
    reached = breadth_first_order(left, source, directed=True, return_predecessors=False)
    result = np.zeros(count + 2, bool)
    result[reached] = True
    return result[:count]
