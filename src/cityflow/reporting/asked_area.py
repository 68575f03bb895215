"""The requested area of a survey from images, and its surveyed share."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import shapely
from shapely.geometry.base import BaseGeometry

from cityflow.catalog.check_images import wanted_area
from cityflow.core.grid import tiles_over
from cityflow.runs.current import CurrentRecords
from cityflow.stages import outline, units
from cityflow.survey.area import Area
from cityflow.survey.survey import Survey


def asked_area(survey: Survey, area: Area) -> BaseGeometry:
    """The area of interest where one was given; else where outlines are, or what the images' axes look at."""
    return area.shape or wanted_area(survey.catalog, list(survey.images.flown.values()))


def surveyed_share(survey: Survey, asked: BaseGeometry) -> float | None:
    """How much of an area enough images see, 0 to 1, on a lattice that is finer than the cells of reference images; None for an area of nothing."""
    inside = surveyed = 0
    for tile in tiles_over(asked.bounds, survey.parameters.tiles.tile_m) if asked.area else ():
        places = survey.images.places_in(tile.bounds)
        x, y = places.centres()
        x_min, y_min, x_max, y_max = tile.bounds
        chosen = shapely.contains_xy(asked, x, y) & (x >= x_min) & (x < x_max) & (y >= y_min) & (y < y_max)
        inside += int(chosen.sum())
        if tile.name in survey.images.tiles:
            surveyed += int((chosen & survey.images.is_surveyed(places, [tile])).sum())
    return surveyed / inside if inside else None


def tile_entries(records: CurrentRecords) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Tile → what it owns: id, point inside and file of each unit, or of each outline where those have not been split yet; sorted.

    One tile after the other: of a million buildings, all together are gigabytes.
    """
    split = frozenset(records.units(units.NAME))
    for tile in sorted({*split, *records.units(outline.NAME)}):
        for record in records.some(units.NAME if tile in split else outline.NAME, [tile]):
            yield tile, record.result.get("units", [])


def units_beyond(records: CurrentRecords, area: Area) -> list[str]:
    """Units that were not asked for: they are modelled for what they share with those of the area of interest, or hide of them."""
    if area.is_everywhere:
        return []
    return sorted({e["id"] for _, owned in tile_entries(records) for e in owned if not area.holds(tuple(e["point"]))})
