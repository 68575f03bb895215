"""Images as sources of colour, in the inputs of tasks."""

from __future__ import annotations

from collections.abc import Iterable

from cityflow.handover.colour_images import ColourInputs, ShownImage
from cityflow.survey.survey import Survey


def colour_inputs(survey: Survey, names: Iterable[str]) -> ColourInputs:
    """Of those of the images that could be read."""
    views, assets = survey.images.views, survey.images.assets
    pixels = {n: path for n in names if (path := survey.results.tiled_image(n)) is not None}
    shown = {n: ShownImage(views[n].image, assets[n].gain, assets[n].gamma, assets[n].falloff) for n in pixels}
    return ColourInputs(shown, pixels)
