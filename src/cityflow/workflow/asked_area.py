"""What a survey from images was meant to show, and how much of it is surveyed."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cityflow.core.grid import tiles_over
from cityflow.stages.area import Area
from cityflow.stages.catalog_check_images import wanted_area
from cityflow.stages.survey import Survey


def asked_area(survey: Survey, area: Area) -> BaseGeometry:
    """The area of interest where one was given; else where outlines are, or what the images' axes look at."""
    return area.shape or wanted_area(survey.catalog, list(survey.images.flown.values()))


def surveyed_share(survey: Survey, asked: BaseGeometry) -> float | None:
    """How much of an area enough images see, 0 to 1, on a lattice that is finer than the cells of base images; None for an area of nothing."""
    inside = surveyed = 0
    for tile in tiles_over(asked.bounds, survey.parameters.tiles.tile_m) if asked.area else ():
        places = survey.images.places_in(tile.bounds)
        x, y = np.meshgrid(places.x_centres(), places.y_centres())
        x_min, y_min, x_max, y_max = tile.bounds
        chosen = shapely.contains_xy(asked, x, y) & (x >= x_min) & (x < x_max) & (y >= y_min) & (y < y_max)
        inside += int(chosen.sum())
        if tile.name in survey.images.tiles:
            surveyed += int((chosen & survey.images.is_surveyed(places, [tile])).sum())
    return surveyed / inside if inside else None
