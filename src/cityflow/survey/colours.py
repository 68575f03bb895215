"""Images as sources of colour, in the inputs of tasks."""

from __future__ import annotations

from collections.abc import Iterable

from cityflow.handover.colour_images import ColourInputs
from cityflow.survey.survey import Survey


def colour_inputs(survey: Survey, names: Iterable[str]) -> ColourInputs:
    """Of those of the images that could be read."""
    pixels = {n: path for n in names if (path := survey.results.tiled_image(n)) is not None}
    return ColourInputs({n: survey.images.shown(n) for n in pixels}, pixels)
