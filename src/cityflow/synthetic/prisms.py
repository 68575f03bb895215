"""Solids under roof faces as triangles; the bridge over a river."""

from __future__ import annotations

import numpy as np
import shapely

from cityflow.core.building import RoofPlane
from cityflow.core.grid import Bounds
from cityflow.geometry.polygon_triangulation import triangulate_polygon
from cityflow.synthetic.known_terrain import Terrain
from cityflow.synthetic.mesh import Material, Part
from cityflow.synthetic.roofs import MAIN, TruthFace
from cityflow.synthetic.town_soup import FaceSoup, Look, TextureFrame, plane_frame

DECK_M, DECK_WIDTH_M = 1.0, 9.0
BRIDGE = Look(Part.BRIDGE, Material.CONCRETE, (150, 148, 142))


def add_prism(soup: FaceSoup, face: TruthFace, floor_m: float, top: Look, side: Look) -> None:
    """A solid between a level floor and a roof face."""
    xy = shapely.get_coordinates(face.polygon.exterior)[:-1]
    high, low = (np.column_stack([xy, z]) for z in (face.plane.z(*xy.T), np.full(len(xy), floor_m)))
    tips = triangulate_polygon([xy])
    frame = plane_frame(high[0], np.array([-face.plane.slope_x, -face.plane.slope_y, 1.0]))
    soup.add(high[tips], top, frame)
    soup.add(low[tips[:, ::-1]], side, TextureFrame(low[0], np.array([1.0, 0, 0]), np.array([0, -1.0, 0])))
    quads = np.stack([low, np.roll(low, -1, axis=0), np.roll(high, -1, axis=0), high], axis=1)
    along = quads[:, 1] - quads[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    soup.add(quads, side, TextureFrame(quads[:, 0], along, np.array([0, 0, 1.0])))


def bridge_over(terrain: Terrain, bounds: Bounds) -> TruthFace:
    """A deck over the river in the middle of the bounds, from bank to bank."""
    line, half_width, bank, _ = terrain.river
    y = (bounds[1] + bounds[3]) / 2 + 13.0
    middle, reach, half = float(line.x_at(np.asarray(y))), half_width + 0.7 * bank, DECK_WIDTH_M / 2
    west, east = (float(terrain.z(np.asarray(middle + d), np.asarray(y))) for d in (-reach, reach))
    plane = RoofPlane((east - west) / (2 * reach), 0.0, (east + west) / 2 + 0.3, (middle, y))
    return TruthFace(plane, shapely.box(middle - reach, y - half, middle + reach, y + half), MAIN)


def add_bridge(soup: FaceSoup, deck: TruthFace) -> None:
    add_prism(soup, deck, float(deck.plane.z(*np.array(deck.plane.origin))) - DECK_M, BRIDGE, BRIDGE)
