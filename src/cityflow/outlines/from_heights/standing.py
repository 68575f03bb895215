"""What stands like a building: on ground that was seen, with a fall at its border, measured, and no vehicle.

Each rule asks for something that every building has by what it is, whatever the scene: walls make its surface fall along
its border, which the inside of a crown does not; it stands out from ground that somebody saw; and it is wider, longer or
higher than what may drive on roads.
"""

from __future__ import annotations

import numpy as np
import shapely
from scipy import ndimage

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray

_FAR_M = 1.0
"""The border of a region found in matched points is blurred by so much; set by hand on the demo's flight."""
_LOW_SHARE = 0.5
"""Of its own height a low shed falls by this share, at least; set by hand."""

FALL_M = 1.5
"""Beyond its border the surface lies lower by this (or half the height); set by hand on synthetic towns, as are the next two."""
FALL_REACH_M = 2.2
"""Within this distance."""
FALL_SHARE = 0.25
"""Along this share of its border: walls on one side of four; crowns flow on."""
GROUND_M = 0.5
"""Ground is what was measured so near to the terrain; set by hand on synthetic towns, as are the next three."""
GROUND_REACH_M = 15.0
"""Ground must have been seen this near."""
GROUND_SHARE = 0.05
"""On this share of the area so near: else its height is a guess."""
MEASURED_SHARE = 0.5
"""Of its own cells that were measured, where the surface is one of images."""
VEHICLE_WIDTH_M = 2.55
"""What is no wider may be a vehicle: the widest that European roads admit (directive 96/53/EC), as are length and height."""
VEHICLE_LENGTH_M = 18.75
"""And no longer: a road train."""
VEHICLE_HEIGHT_M = 4.0
"""And no higher."""
FREE_SHARE = 0.8
"""Of the 3 m around it that are low: a vehicle stands free, sheds have neighbours; set by hand on synthetic towns."""


VEHICLE_AREA_M2 = VEHICLE_WIDTH_M * VEHICLE_LENGTH_M


def standing(mask: BoolArray, ndsm: Float32Array, measured: BoolArray, cell: float) -> BoolArray:
    """(rows, cols) the mask without those regions that do not stand like buildings.

    Parameters
    ----------
    mask : (rows, cols) bool, building regions
    ndsm : (rows, cols) float32, metres above terrain, NaN where unknown
    measured : (rows, cols) bool, cells whose height was measured, not filled in
    cell : metres
    """
    labels, _ = ndimage.label(mask)
    margin = int(np.ceil(GROUND_REACH_M / cell)) + 1
    kept = mask.copy()
    for number, part in enumerate(ndimage.find_objects(labels), 1):
        window = tuple(
            slice(max(s.start - margin, 0), min(s.stop + margin, n)) for s, n in zip(part, mask.shape, strict=True)
        )
        own = labels[window] == number
        if not _stands(own, ndsm[window], measured[window], cell):
            kept[window][own] = False
    return kept


def _stands(own: BoolArray, ndsm: Float32Array, measured: BoolArray, cell: float) -> bool:
    if (own & measured).sum() < MEASURED_SHARE * own.sum():
        return False
    distance = ndimage.distance_transform_edt(~own) * cell
    return (
        _seen_ground_share(own, ndsm, measured, distance) >= GROUND_SHARE
        and fall_share(own, ndsm, distance, cell) >= FALL_SHARE
        and not _is_vehicle(own, ndsm, distance, cell)
    )


def _seen_ground_share(own: BoolArray, ndsm: Float32Array, measured: BoolArray, distance: FloatArray) -> float:
    """Share of the known surroundings that was measured and is ground; 1 where nothing around is known."""
    around = ~own & (distance <= GROUND_REACH_M) & np.isfinite(ndsm)
    if not around.any():
        return 1.0
    return float((measured & (np.abs(ndsm) < GROUND_M))[around].mean())


def fall_share(own: BoolArray, ndsm: Float32Array, distance: FloatArray, cell: float) -> float:
    """Share of the cells around a region that lie lower than the region beside them; 1 where nothing around is known."""
    ring = (distance > _FAR_M) & (distance <= FALL_REACH_M) & np.isfinite(ndsm)
    if not ring.any():
        return 1.0
    core = ndimage.distance_transform_edt(np.pad(own, 1))[1:-1, 1:-1] * cell > _FAR_M / 2
    core &= np.isfinite(ndsm)
    nearest = ndimage.distance_transform_edt(
        ~(core if core.any() else own), return_distances=False, return_indices=True
    )
    height = np.nan_to_num(ndsm[tuple(nearest)])
    falls = height - ndsm >= np.minimum(FALL_M, _LOW_SHARE * height)
    return float(falls[ring].mean())


def _is_vehicle(own: BoolArray, ndsm: Float32Array, distance: FloatArray, cell: float) -> bool:
    """True for what is as wide, long and high as a vehicle, or less, and stands free. Cells see half of theirs more on either side."""
    height = ndsm[own]
    if np.nanmedian(height) > VEHICLE_HEIGHT_M or own.sum() * cell**2 > 1.5 * VEHICLE_AREA_M2:
        return False
    depth = ndimage.distance_transform_edt(np.pad(own, 1))[1:-1, 1:-1]
    if (2 * depth.max() - 1) * cell > VEHICLE_WIDTH_M + cell:
        return False
    ends = shapely.oriented_envelope(shapely.MultiPoint(np.argwhere(own) * cell))
    if ends.length / 2 > VEHICLE_LENGTH_M + VEHICLE_WIDTH_M + 4 * cell:
        return False
    around = (distance > _FAR_M / 2) & (distance <= 3.0) & np.isfinite(ndsm)
    return bool(around.any() and (ndsm[around] < 1.0).mean() >= FREE_SHARE)
