"""Which image is the reference image of which ground, one look direction at a time (Nex et al. 2013 §2.1).

The ground is cut into cells of a lattice that knows neither tiles nor the extent of the survey. A cell's reference image is the image that sees all of it,
from the ground to the highest object, along the ray nearest to the direction: the vertical for nadir views, the frame's mean direction else.
The ray and not the perspective centre decides, because it is the ray that passes over or behind a house. A coarser scale counts as a worse ray.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.orientation.views import View, footprint, sees

OCTAVE_DEG = 8.0
"""A view at half the scale is as bad as a ray that much farther from the best direction; set by hand, as are the next three."""
UNSEEN_DEG = 30.0
"""Each eighth of a cell that an image does not see counts as much: only at the rim of a survey such an image is reference image."""
GRAZING_DEG = 75.0
"""Ground is not matched along rays farther from the vertical than this."""


CELLS_M = (2.0, 4.0, 8.0, 16.0, 24.0)
CELL_SHARE = 0.25
"""Cells that are given to reference images: the largest of these whose edge is at most this share of a footprint's."""

DETOUR_DEG = 6.0
"""How much worse a view may be for the sake of fewer reference images; set by hand on synthetic flights and kite photographs."""
MOST_GSD_RATIO = 3.0
"""Ground that an image resolves worse than this many median GSDs has no reference image in it; set by hand on synthetic flights and kite photographs."""


class ReferenceImageParameters(Parameters):
    """Which ground an image answers for."""

    cell_m: float | None = Field(
        None,
        ge=1,
        le=1000,
        description="edge of the ground cells that are assigned to reference images, metres; null: from the footprints",
    )
    images_per_cell: int = Field(1, ge=1, le=16, description="reference images of a cell in each look direction")
    max_overlap: float = Field(
        0.2,
        ge=0,
        le=1,
        description="largest share of the matched ground of a reference image that belongs to other reference images",
    )
    halo_px: int = Field(
        64, ge=0, le=1024, description="margin that matching adds around the ground of a reference image, pixels"
    )


def cell_for(footprints: Sequence[shapely.Polygon]) -> float:
    """Edge of the cells for a flight, metres: small images cannot see large cells whole."""
    areas = [f.area for f in footprints if not f.is_empty]
    edge = CELL_SHARE * float(np.sqrt(np.median(areas))) if areas else CELLS_M[-1]
    return max((c for c in CELLS_M if c <= edge), default=CELLS_M[0])


@dataclass(frozen=True, slots=True)
class Candidates:
    """Cells and the images that see them in one direction: sorted by cell, and in a cell by how good the view is.

    Attributes
    ----------
    cell : (P, 2) int64 col, row;  view : (P,) int64;  cost_deg : (P,) float64
    first : (C + 1,) int64, where each cell's views begin
    """

    cell: IntArray
    view: IntArray
    cost_deg: FloatArray
    first: IntArray

    def __len__(self) -> int:
        return len(self.first) - 1

    @property
    def number(self) -> IntArray:
        """(P,) running number of the cell of each pair."""
        return np.repeat(np.arange(len(self)), np.diff(self.first))

    def take(self, kept: BoolArray) -> Candidates:
        """The pairs that `kept` (P,) marks."""
        return _grouped(self.cell[kept], self.view[kept], self.cost_deg[kept])


def candidates(
    views: Sequence[View], members: Sequence[int], look: FloatArray, cell_m: float, coarsest_m: float = np.inf
) -> Candidates:
    """All pairs of a cell and a view of it.

    Parameters
    ----------
    views : of the survey
    members : indices of the direction's views; of two views as good the first is better
    look : (3,) unit vector, the best direction of a ray
    coarsest_m : cells that a view resolves worse than this are none of its own, metres per pixel
    """
    parts = [_cells_of(views[k], look, cell_m, coarsest_m) for k in members]
    counts = [len(cost) for _, cost in parts]
    if sum(counts) == 0:
        return _grouped(np.empty((0, 2), np.int64), np.empty(0, np.int64), np.empty(0))
    cell = np.concatenate([cells for cells, _ in parts])
    cost = np.concatenate([costs for _, costs in parts])
    view = np.repeat(np.asarray(members, np.int64), counts)
    order = np.lexsort((view, cost, cell[:, 0], cell[:, 1]))
    return _grouped(cell[order], view[order], cost[order])


def _grouped(cell: IntArray, view: IntArray, cost: FloatArray) -> Candidates:
    new = np.any(np.diff(cell, axis=0, prepend=cell[:1] - 1) != 0, axis=1)
    return Candidates(cell, view, cost, np.append(np.flatnonzero(new), len(cell)))


def _cells_of(view: View, look: FloatArray, cell_m: float, coarsest_m: float) -> tuple[IntArray, FloatArray]:
    """(n, 2) cells that a view sees at least half of, and (n,) how good it is for them, degrees; less is better."""
    ground = footprint(view)
    if ground.is_empty:
        return np.empty((0, 2), np.int64), np.empty(0)
    x_min, y_min, x_max, y_max = np.floor(np.array(ground.bounds) / cell_m).astype(np.int64)
    cols, rows = np.meshgrid(np.arange(x_min, x_max + 2), np.arange(y_min, y_max + 2))
    corners = np.stack([cols, rows], axis=-1) * cell_m
    levels = [np.concatenate([corners, np.full((*cols.shape, 1), h)], axis=-1) for h in view.heights]
    seen: IntArray = np.asarray([sees(view.image, level) for level in levels]).sum(axis=0, dtype=np.int64)
    share = (seen[:-1, :-1] + seen[1:, :-1] + seen[:-1, 1:] + seen[1:, 1:])  # fmt: skip
    chosen = share >= 4
    cells = np.column_stack([cols[:-1, :-1][chosen], rows[:-1, :-1][chosen]])
    rays = np.column_stack([(cells + 0.5) * cell_m, np.full(len(cells), view.heights[0])]) - view.image.centre
    far = np.linalg.norm(rays, axis=1)
    angle = np.degrees(np.arccos(np.clip(rays @ look / far, -1, 1)))
    resolved = far / np.sqrt(view.image.camera.fx * view.image.camera.fy)
    octaves = np.log2(resolved)
    usable = (resolved <= coarsest_m) & (-rays[:, 2] >= far * np.cos(np.radians(GRAZING_DEG)))
    # rounded, so that views that are as good as each other are told apart by name and not by the last bit
    cost = np.round(angle + OCTAVE_DEG * octaves + UNSEEN_DEG * (8 - share[chosen]), 6)
    return cells[usable], cost[usable]


def choose_reference_images(found: Candidates, surplus: Collection[int], images_per_cell: int) -> IntArray:
    """Positions in `found` of the pairs that are reference image and cell: the best views of each cell that are not `surplus`."""
    allowed = ~np.isin(found.view, np.array(sorted(surplus), np.int64))
    before: IntArray = np.cumsum(allowed) - allowed
    rank: IntArray = before - before[found.first[:-1]][found.number] if len(found) else before
    return np.flatnonzero(allowed & (rank < images_per_cell))
