"""The photographs that a unit's model is held against: those of a matched surface that have it in their frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

from cityflow.core.colour_image import ColourImage
from cityflow.flow.stage import Nodes
from cityflow.flow.store import Store
from cityflow.flow.typed import TaskInputs
from cityflow.handover.colour_images import ColourRows
from cityflow.survey.city import INGEST, City
from cityflow.survey.surface_source import IMAGES
from cityflow.survey.unit_entry import UnitEntry
from cityflow.survey.unit_images import images_of_units


@dataclass(frozen=True, slots=True)
class PhotographInputs(TaskInputs):
    """The photographs of a unit.

    Attributes
    ----------
    colours : those that could be read
    white : value that is shown as white, 0 if unknown
    """

    colours: ColourRows
    white: float


class Photographs(NamedTuple):
    """What a task is given: name → digest of what it depends on, where it is, and path → text of what tasks have in common."""

    inputs: dict[str, str]
    given: PhotographInputs | None
    shared: Mapping[str, str]


def needed(city: City, unit: UnitEntry) -> Nodes:
    """All images that show a unit of its tile, since these share a table."""
    return Nodes((INGEST, images_of_units(city, unit).shown.names)) if city.survey.source.kind == IMAGES else Nodes()


def photographs_of(city: City, unit: UnitEntry) -> Photographs:
    """Those of a unit, all of which have ended; none where a laser has seen the city."""
    survey = city.survey
    if survey.source.kind != IMAGES:
        return Photographs({}, None, {})
    images = images_of_units(city, unit)
    colours = images.shown.colours(images.names[unit.id])
    inputs = {"images": colours.digest, "views": colours.views_digest}
    # a survey of 8 bits is white at 255, whatever else is in the catalog
    white = {"white": f"{survey.images.white:g}"} if survey.images.dtype != "uint8" else {}
    return Photographs({**inputs, **white}, PhotographInputs(colours.rows, survey.images.white), colours.shared)


def opened(store: Store, given: PhotographInputs | None) -> tuple[ColourImage, ...]:
    """Raises CatalogError or OSError where one cannot be read any more."""
    if given is None:
        return ()
    colours, expecting = given.colours.inputs(store)
    return tuple(replace(image, white=given.white) for image in colours.opened(expecting))
