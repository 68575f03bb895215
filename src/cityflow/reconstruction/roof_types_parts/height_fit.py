"""Heights of several parts at once, by robust least squares."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.roof_type_names import RoofType
from cityflow.reconstruction.roof_types_parts.roof_model import PlacedSkeleton, roof_model
from cityflow.reconstruction.roof_types_parts.shape_fit import ROBUST, Clues, cell_means
from cityflow.reconstruction.roof_types_parts.skeletons import shape_heights

RIDGED = (RoofType.GABLE, RoofType.HIP, RoofType.HALF_HIP, RoofType.MANSARD)


SHARING = (*RIDGED, RoofType.PYRAMID)
"""Types whose parts often have one eave and one slope."""


def linear_fit(
    clues: Clues, parts: list[PlacedSkeleton], share_eave: bool, share_slope: bool
) -> tuple[list[PlacedSkeleton], int]:
    """Parts after one robust fit of all heights, and how many numbers were free; level parts and sheds share nothing."""
    cells = clues.cells
    owner = roof_model(parts).owners(cells.xy)
    pure = np.array(
        [cell_means((owner == k).astype(np.float64), cells.cell, len(cells)) > 0.999 for k in range(len(parts))]
    )
    ties = [p.skeleton.type in SHARING for p in parts]
    eave = _columns(ties, share_eave)
    rise = _columns(ties, share_slope)
    rows, shares = np.zeros((len(cells), max(eave) + max(rise) + 2)), np.ones(len(parts))
    for k, part in enumerate(parts):
        if ties[k] and share_slope:
            shares[k] = part.skeleton.quad.width / 2
        t = cell_means(shape_heights(part.skeleton, cells.xy), cells.cell, len(cells))
        rows[pure[k], eave[k]] = 1.0
        rows[pure[k], max(eave) + 1 + rise[k]] = shares[k] * t[pure[k]]
    known = pure.any(axis=0)
    if np.any(pure.sum(axis=1) < 3):
        return parts, 2 * len(parts)
    x = _robust(rows[known], cells.z[known], cells.weight[known], clues.sigma)
    fitted = []
    for k, part in enumerate(parts):
        e, r = float(x[eave[k]]), float(x[max(eave) + 1 + rise[k]] * shares[k])
        turned = part.skeleton.rise * r <= 0 and part.skeleton.type is not RoofType.FLAT
        fitted.append(part if turned else replace(part, skeleton=part.skeleton.with_heights(e, r)))
    return fitted, max(eave) + max(rise) + 2


def _columns(ties: list[bool], share: bool) -> list[int]:
    """Number of the unknown of each part."""
    columns, common = list[int](), -1
    for tied in ties:
        if tied and share and common >= 0:
            columns.append(common)
            continue
        columns.append(max(columns, default=-1) + 1)
        common = columns[-1] if tied and share else common
    return columns


def _robust(rows: FloatArray, z: FloatArray, weight: FloatArray, sigma: float) -> FloatArray:
    w = weight.copy()
    x: FloatArray = np.zeros(rows.shape[1])
    for turn in range(5):
        normal = rows.T @ (w[:, None] * rows) + 1e-9 * np.eye(len(x))
        x = np.asarray(np.linalg.solve(normal, rows.T @ (w * z)), np.float64)
        wide = ROBUST * sigma * (3 if turn == 0 else 1)
        w = weight / (1 + ((z - rows @ x) / wide) ** 2)
    return x
