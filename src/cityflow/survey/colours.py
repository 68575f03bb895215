"""Images as sources of colour, in the inputs of tasks."""

from __future__ import annotations

from collections.abc import Iterable

from cityflow.flow.shared import SharedText
from cityflow.handover.colour_images import ColourInputs, views_text
from cityflow.survey.survey import Survey


def colour_inputs(
    survey: Survey, names: Iterable[str], views: SharedText | None = None
) -> tuple[ColourInputs, SharedText]:
    """Of those of the images that could be read; their poses stand in `views` where these are known already, else in a text of their own."""
    pixels = {n: path for n in names if (path := survey.results.tiled_image(n)) is not None}
    found = views or views_of(survey, pixels)
    return ColourInputs(found.path, pixels), found


def views_of(survey: Survey, names: Iterable[str]) -> SharedText:
    """Poses and balances of images."""
    return views_text({n: survey.images.shown(n)[0] for n in names})


def digest_of_views(survey: Survey, names: Iterable[str]) -> dict[str, str]:
    """Name → digest of pose and balance, for the inputs of a task."""
    return {n: survey.images.shown(n)[1] for n in names}
