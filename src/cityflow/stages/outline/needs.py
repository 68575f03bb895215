"""What the task of a tile's outlines waits for."""

from __future__ import annotations

from collections.abc import Iterable

from cityflow.flow.stage import Node
from cityflow.stages.outline import given_walls as outline_walls
from cityflow.survey.city import DETECT, INGEST, City
from cityflow.survey.city import OUTLINES as OUTLINES_GIVEN
from cityflow.survey.given_outlines import ACCURACY, noding_unit
from cityflow.survey.surface_source import LIDAR
from cityflow.survey.survey import Survey


def sources(city: City, name: str) -> Iterable[Node]:
    """Given outlines and what may show their walls, or what was found."""
    survey = city.survey
    if survey.outlines_given:
        return [(INGEST, OUTLINES_GIVEN), *_walls_of_given(survey, name)]
    return [(DETECT, name)]


def noding(city: City, name: str) -> Iterable[Node]:
    """Who nodes the chains of given outlines that reach into the tile: known when they are dealt out."""
    given = city.survey.given
    return [(INGEST, noding_unit(t)) for t in given.sources(name)] if city.survey.outlines_given else []


def _walls_of_given(survey: Survey, name: str) -> list[Node]:
    """Where façades may tell that given outlines are rims of roofs: the points and façades around them."""
    if not outline_walls.are_looked_for(survey):
        return []
    if survey.source.kind == LIDAR:
        around = survey.lattice.tiles[name].buffered(outline_walls.REACH_M)
        return [(INGEST, ACCURACY), *((INGEST, f.name) for f in survey.lidar.assets_over(around))]
    near = survey.lattice.near(name, outline_walls.REACH_M)
    return [*(("surface", t) for t in near), *(("walls", t) for t in near)]
