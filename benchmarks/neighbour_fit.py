"""How neighbouring models fit: volume in common, and walls that have not the same vertices."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import shapely

from cityflow.core.building import Polyhedron
from cityflow.geometry.polygon_overlap import overlap_volume
from cityflow.geometry.validity import is_valid
from cityflow.reconstruction.party.party_walls import cut_party_walls, differing_walls

MOST_M3 = 0.01


def fit_of(solids: Mapping[str, Polyhedron], cut: bool = True) -> dict[str, str]:
    """Figures of pairs of units that touch; `cut`: their party walls are still to be cut, as the export does."""
    whole = cut_party_walls(solids) if cut else dict(solids)
    names = sorted(whole)
    boxes = [shapely.box(*whole[n].vertices[:, :2].min(axis=0), *whole[n].vertices[:, :2].max(axis=0)) for n in names]
    first, second = shapely.STRtree(boxes).query(boxes, predicate="intersects")
    pairs = sorted((int(i), int(k)) for i, k in zip(first, second, strict=True) if i < k)
    common = np.array([overlap_volume(whole[names[i]], whole[names[k]]) for i, k in pairs])
    shared = {tuple(sorted((name, f.neighbour))) for name, s in whole.items() for f in s.faces if f.neighbour in whole}
    return {
        "pairs with a common wall": str(len(shared)),
        "of them with other vertices": str(len(differing_walls(whole))),
        "pairs in one another (> 0.01 m³)": str(int(np.count_nonzero(common > MOST_M3))),
        "greatest common volume m³": f"{common.max():.4f}" if len(common) else "0",
        "valid after cutting": f"{sum(is_valid(s) for s in whole.values())} of {len(whole)}",
    }
