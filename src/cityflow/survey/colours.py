"""Images as sources of colour, in the inputs of tasks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from cityflow.flow.shared import SharedText
from cityflow.handover.colour_images import ColourInputs, views_text
from cityflow.survey.results import Results
from cityflow.survey.survey import Survey


@dataclass(frozen=True, slots=True)
class ColourSources:
    """Images that a task may show, before it is known which could be read.

    Attributes
    ----------
    views : RUN-relative path of poses and balances of all of them
    digests : name → digest of pose and balance, in the order of the task
    """

    views: str
    digests: Mapping[str, str]

    def inputs(self, results: Results, names: Iterable[str]) -> ColourInputs:
        """Those of some images that could be read."""
        return ColourInputs(self.views, {n: path for n in names if (path := results.tiled_image(n)) is not None})

    def digests_of(self, names: Iterable[str]) -> dict[str, str]:
        """Name → digest of pose and balance, for the inputs of a task."""
        return {n: self.digests[n] for n in names}


def colour_sources(survey: Survey, names: Sequence[str]) -> tuple[ColourSources, SharedText]:
    """What is known of images before they are read, and the text of their poses and balances."""
    views = views_of(survey, names)
    return ColourSources(views.path, digest_of_views(survey, names)), views


def colour_inputs(survey: Survey, names: Iterable[str], views: SharedText) -> ColourInputs:
    """Of those of the images that could be read; `views` holds their poses."""
    return ColourInputs(views.path, {n: path for n in names if (path := survey.results.tiled_image(n)) is not None})


def views_of(survey: Survey, names: Iterable[str]) -> SharedText:
    """Poses and balances of images."""
    return views_text({n: survey.images.shown(n)[0] for n in names})


def digest_of_views(survey: Survey, names: Iterable[str]) -> dict[str, str]:
    """Name → digest of pose and balance, for the inputs of a task."""
    return {n: survey.images.shown(n)[1] for n in names}
