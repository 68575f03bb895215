"""Found outlines with walls moved in where only the roof edge was known and façades are seen inside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Outline
from cityflow.outlines.from_heights.regions import RegionSurface
from cityflow.outlines.noded.adjacency import party_edges
from cityflow.outlines.under_eaves.facades_inside import SeenHouses, facade_inside
from cityflow.outlines.under_eaves.walls_in import WallsInParameters, walls_moved_in

ROOF_EDGE_M = 0.25
"""Standard deviation of a roof's edge of which nothing is known: half a cell of the surface that outlines are found in; set by hand."""


def found_walls_in(
    outlines: Sequence[Outline], seen: SeenHouses | None, parameters: WallsInParameters
) -> list[Outline]:
    """The same outlines without a search for façades.

    Parameters
    ----------
    outlines : noded, with what is known of their edges
    seen : all that is seen of them and of their façades
    """
    if seen is None:
        return list(outlines)
    party = party_edges(outlines)
    return walls_moved_in(
        [replace(o, party=party[o.id]) for o in outlines],
        lambda outline, edge: facade_inside(outline, edge, seen, ROOF_EDGE_M),
        parameters,
    )


def seen_in(surface: RegionSurface) -> SeenHouses | None:
    """What a surface and the points on façades in it show; None without façades."""
    if surface.walls is None or surface.dtm is None or not len(surface.walls):
        return None
    return SeenHouses.of(tops_of(surface), surface.walls)


def tops_of(surface: RegionSurface) -> FloatArray:
    """(N, 3) middles of the cells, at the height of what stands there."""
    assert surface.dtm is not None
    return surface.grid.points(surface.dtm.astype(np.float64) + surface.ndsm)
