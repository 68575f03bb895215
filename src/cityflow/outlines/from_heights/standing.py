"""What stands like a building: on ground that was seen, with a fall at its border, measured, and no vehicle.

Each rule asks for something that every building has by what it is, whatever the scene: walls make its surface fall along
its border, which the inside of a crown does not; it stands out from ground that somebody saw; and it is wider, longer or
higher than what may drive on roads.
"""

from __future__ import annotations

import numpy as np
import shapely
from pydantic import Field
from scipy import ndimage

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.parameters import Parameters

_FAR_M = 1.0
"""The border of a region found in matched points is blurred by so much."""
_LOW_SHARE = 0.5
"""Of its own height a low shed falls by this share, at least."""


class StandingParameters(Parameters):
    """What a region must have to stand for a building."""

    fall_m: float = Field(
        1.5, gt=0, le=10, description="beyond its border the surface lies lower by this (or half the height), m"
    )
    fall_reach_m: float = Field(2.2, gt=1, le=10, description="within this distance, m")
    fall_share: float = Field(
        0.25, ge=0, le=1, description="along this share of its border: walls on one side of four; crowns flow on"
    )
    ground_m: float = Field(0.5, gt=0, le=5, description="ground is what was measured so near to the terrain, m")
    ground_reach_m: float = Field(15.0, gt=1, le=100, description="ground must have been seen this near, m")
    ground_share: float = Field(
        0.05, ge=0, le=1, description="on this share of the area so near: else its height is a guess"
    )
    measured_share: float = Field(
        0.5, ge=0, le=1, description="of its own cells that were measured, where the surface is one of images"
    )
    vehicle_width_m: float = Field(
        2.55, ge=0, le=10, description="what is no wider may be a vehicle (the widest that roads admit), m"
    )
    vehicle_length_m: float = Field(18.75, ge=0, le=100, description="and no longer (articulated), m")
    vehicle_height_m: float = Field(4.0, ge=0, le=20, description="and no higher, m")
    free_share: float = Field(
        0.8, gt=0, le=1, description="of the 3 m around it that are low: a vehicle stands free, sheds have neighbours"
    )

    @property
    def vehicle_area_m2(self) -> float:
        """Of the largest vehicle, m²."""
        return self.vehicle_width_m * self.vehicle_length_m


def standing(
    mask: BoolArray, ndsm: Float32Array, measured: BoolArray, cell: float, parameters: StandingParameters
) -> BoolArray:
    """(rows, cols) the mask without those regions that do not stand like buildings.

    Parameters
    ----------
    mask : (rows, cols) bool, building regions
    ndsm : (rows, cols) float32, metres above terrain, NaN where unknown
    measured : (rows, cols) bool, cells whose height was measured, not filled in
    cell : metres
    """
    labels, _ = ndimage.label(mask)
    margin = int(np.ceil(parameters.ground_reach_m / cell)) + 1
    kept = mask.copy()
    for number, part in enumerate(ndimage.find_objects(labels), 1):
        window = tuple(
            slice(max(s.start - margin, 0), min(s.stop + margin, n)) for s, n in zip(part, mask.shape, strict=True)
        )
        own = labels[window] == number
        if not _stands(own, ndsm[window], measured[window], cell, parameters):
            kept[window][own] = False
    return kept


def _stands(own: BoolArray, ndsm: Float32Array, measured: BoolArray, cell: float, p: StandingParameters) -> bool:
    if (own & measured).sum() < p.measured_share * own.sum():
        return False
    distance = ndimage.distance_transform_edt(~own) * cell
    return (
        _seen_ground_share(own, ndsm, measured, distance, p) >= p.ground_share
        and fall_share(own, ndsm, distance, cell, p) >= p.fall_share
        and not _is_vehicle(own, ndsm, distance, cell, p)
    )


def _seen_ground_share(
    own: BoolArray, ndsm: Float32Array, measured: BoolArray, distance: FloatArray, p: StandingParameters
) -> float:
    """Share of the known surroundings that was measured and is ground; 1 where nothing around is known."""
    around = ~own & (distance <= p.ground_reach_m) & np.isfinite(ndsm)
    if not around.any():
        return 1.0
    return float((measured & (np.abs(ndsm) < p.ground_m))[around].mean())


def fall_share(
    own: BoolArray, ndsm: Float32Array, distance: FloatArray, cell: float, parameters: StandingParameters
) -> float:
    """Share of the cells around a region that lie lower than the region beside them; 1 where nothing around is known."""
    ring = (distance > _FAR_M) & (distance <= parameters.fall_reach_m) & np.isfinite(ndsm)
    if not ring.any():
        return 1.0
    core = ndimage.distance_transform_edt(np.pad(own, 1))[1:-1, 1:-1] * cell > _FAR_M / 2
    core &= np.isfinite(ndsm)
    nearest = ndimage.distance_transform_edt(
        ~(core if core.any() else own), return_distances=False, return_indices=True
    )
    height = np.nan_to_num(ndsm[tuple(nearest)])
    falls = height - ndsm >= np.minimum(parameters.fall_m, _LOW_SHARE * height)
    return float(falls[ring].mean())


def _is_vehicle(own: BoolArray, ndsm: Float32Array, distance: FloatArray, cell: float, p: StandingParameters) -> bool:
    """True for what is as wide, long and high as a vehicle, or less, and stands free. Cells see half of theirs more on either side."""
    height = ndsm[own]
    if np.nanmedian(height) > p.vehicle_height_m or own.sum() * cell**2 > 1.5 * p.vehicle_area_m2:
        return False
    depth = ndimage.distance_transform_edt(np.pad(own, 1))[1:-1, 1:-1]
    if (2 * depth.max() - 1) * cell > p.vehicle_width_m + cell:
        return False
    ends = shapely.oriented_envelope(shapely.MultiPoint(np.argwhere(own) * cell))
    if ends.length / 2 > p.vehicle_length_m + p.vehicle_width_m + 4 * cell:
        return False
    around = (distance > _FAR_M / 2) & (distance <= 3.0) & np.isfinite(ndsm)
    return bool(around.any() and (ndsm[around] < 1.0).mean() >= p.free_share)
