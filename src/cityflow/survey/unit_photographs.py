"""The photographs that an outline's borders and a unit's model are held against: those of a matched surface that have it in their frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from cityflow.flow.stage import Nodes
from cityflow.handover.photograph_inputs import PhotographInputs
from cityflow.survey.city import INGEST, City
from cityflow.survey.surface_source import IMAGES
from cityflow.survey.unit_entry import UnitEntry
from cityflow.survey.unit_images import UnitImages, images_of_units

ImagesOf = Callable[[City, UnitEntry], UnitImages]
"""`images_of_units`, or the same of outlines."""


class Photographs(NamedTuple):
    """What a task is given: name → digest of what it depends on, where it is, and path → text of what tasks have in common."""

    inputs: dict[str, str]
    given: PhotographInputs | None
    shared: Mapping[str, str]


def needed(city: City, unit: UnitEntry, images_of: ImagesOf = images_of_units) -> Nodes:
    """All images that show a unit or an outline of its tile, since these share a table."""
    return Nodes((INGEST, images_of(city, unit).shown.names)) if city.survey.source.kind == IMAGES else Nodes()


def photographs_of(city: City, unit: UnitEntry, images_of: ImagesOf = images_of_units) -> Photographs:
    """Those of a unit or an outline, all of which have ended; none where a laser has seen the city."""
    survey = city.survey
    if survey.source.kind != IMAGES:
        return Photographs({}, None, {})
    images = images_of(city, unit)
    colours = images.shown.colours(images.names[unit.id])
    inputs = {"images": colours.digest, "views": colours.views_digest}
    # a survey of 8 bits is white at 255, whatever else is in the catalog
    white = {"white": f"{survey.images.white:g}"} if survey.images.dtype != "uint8" else {}
    return Photographs({**inputs, **white}, PhotographInputs(colours.rows, survey.images.white), colours.shared)
