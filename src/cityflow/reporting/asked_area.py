"""The requested area of a survey from images, and its surveyed share."""

from __future__ import annotations

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


def tile_entries(records: CurrentRecords) -> dict[str, list[dict[str, Any]]]:
    """Tile → what it owns: id, point inside and file of each unit, or of each outline where those have not been split yet."""
    owners = {**{r.unit: r for r in records.of(outline.NAME)}, **{r.unit: r for r in records.of(units.NAME)}}
    return {tile: record.result.get("units", []) for tile, record in sorted(owners.items())}


def units_beyond(records: CurrentRecords, area: Area) -> list[str]:
    """Units that were not asked for: they are modelled for what they share with those of the area of interest, or hide of them."""
    entries = [] if area.is_everywhere else [e for owned in tile_entries(records).values() for e in owned]
    return sorted({e["id"] for e in entries if not area.holds(tuple(e["point"]))})
