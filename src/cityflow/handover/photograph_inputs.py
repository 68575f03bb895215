"""The photographs of a matched surface that a task looks at."""

from __future__ import annotations

from dataclasses import dataclass, replace

from cityflow.core.colour_image import ColourImage
from cityflow.flow.store import Store
from cityflow.flow.typed import TaskInputs
from cityflow.handover.colour_images import ColourRows


@dataclass(frozen=True, slots=True)
class PhotographInputs(TaskInputs):
    """The photographs of a unit or an outline.

    Attributes
    ----------
    colours : those that could be read
    white : value that is shown as white, 0 if unknown
    """

    colours: ColourRows
    white: float


def opened(store: Store, given: PhotographInputs | None) -> tuple[ColourImage, ...]:
    """Raises CatalogError or OSError where one cannot be read any more."""
    if given is None:
        return ()
    colours, expecting = given.colours.inputs(store)
    return tuple(replace(image, white=given.white) for image in colours.opened(expecting))
