"""Inputs of the textures and windows of a unit, and its atlas cell."""

from __future__ import annotations

from collections.abc import Mapping

from cityflow.core.grid import grown
from cityflow.survey.city import City
from cityflow.survey.survey import Survey
from cityflow.survey.unit_entry import UnitEntry
from cityflow.texture.unit import TextureParameters

STAGE_TEXTURE = "texture"
LONGEST_M = 60.0
"""From where a building is counted to where it ends, mostly."""


def texture_parameters(survey: Survey, unit: UnitEntry) -> TextureParameters:
    """Those of the workflow, with what was asked for this unit alone; a patch is never larger than a page of the atlas."""
    asked = survey.parameters_of(STAGE_TEXTURE, unit.id, survey.fitting_textures)
    return asked if asked is survey.fitting_textures else survey.fitted(asked)


def tiles_around(survey: Survey, unit: UnitEntry) -> tuple[str, ...]:
    """Tiles that may own units whose models stand before this one: how the ground is cut must not tell which."""
    return survey.lattice.tiles_over(grown(unit.bounds, texture_parameters(survey, unit).around_m + LONGEST_M))


def surfaces_around(survey: Survey, unit: UnitEntry) -> tuple[str, ...]:
    """Tiles whose surface may stand between."""
    return survey.lattice.tiles_over(grown(unit.bounds, texture_parameters(survey, unit).halo_m))


def windows_are_wanted(survey: Survey) -> bool:
    """Whether windows are searched: an ortho alone shows no wall."""
    return survey.textures and survey.parameters.windows.when == "auto" and bool(survey.images.assets)


def atlas_cell_of(survey: Survey, unit: UnitEntry) -> str:
    """Name of the atlas cell that a unit belongs to: tile, and column and row in it, south-west first."""
    n, (x, y) = survey.parameters.atlas.atlas_cells(survey.parameters.tiles.tile_m), unit.point
    x_0, y_0, x_1, y_1 = survey.lattice.tiles[unit.tile].bounds
    col, row = int((x - x_0) / (x_1 - x_0) * n), int((y - y_0) / (y_1 - y_0) * n)
    return f"{unit.tile}.{min(max(col, 0), n - 1)}_{min(max(row, 0), n - 1)}"


def atlas_cells_of(city: City, tile: str) -> Mapping[str, list[str]]:
    """Atlas cell → the units of the area on it, of one tile whose units are known."""
    if tile not in city.atlas_cells_of:
        found: dict[str, list[str]] = {}
        for unit in city.chosen[tile]:
            found.setdefault(atlas_cell_of(city.survey, city.units[unit]), []).append(unit)
        city.atlas_cells_of[tile] = dict(sorted(found.items()))
    return city.atlas_cells_of[tile]
