"""Images as sources of colour, in the inputs of tasks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple
from weakref import WeakKeyDictionary

from cityflow.core.building import Status
from cityflow.flow.shared import SharedText
from cityflow.flow.task import digest_of_members, member_of
from cityflow.handover.colour_images import ColourInputs, ColourRows, ImageFile, files_text, views_text
from cityflow.survey.results import INGEST, Left, Results
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


@dataclass(frozen=True, slots=True)
class Colours:
    """Images that a unit is shown by, all of which have been read or could not be.

    Attributes
    ----------
    pixels : name → RUN-relative path, of those that could be read;  unread : the others
    digest, views_digest : of what was read of all of them, and of poses and balances of those that could be read
    """

    pixels: Mapping[str, str]
    unread: tuple[str, ...]
    digest: str
    views_digest: str


UNREAD = "unread"


class _Source(NamedTuple):
    """An image: where it was ingested to, None if it could not be read; its name with the digest of its contents, and with that of pose and balance."""

    path: str | None
    contents: str
    view: str


@dataclass(slots=True)
class _Sources:
    """Of the images that were asked for since a record of one was learned last."""

    changes: int = -1
    found: dict[str, _Source] = field(default_factory=dict)


_KEPT: WeakKeyDictionary[Survey, _Sources] = WeakKeyDictionary()


def colours_of(survey: Survey, names: Sequence[str]) -> Colours:
    """Of the images with these names, sorted."""
    kept, changes = _KEPT.setdefault(survey, _Sources()), survey.results.changes["ingest"]
    if kept.changes != changes:
        kept.changes, kept.found = changes, {}
    for name in names:
        if name not in kept.found:
            kept.found[name] = _source_of(survey, name)
    found = [kept.found[name] for name in names]
    read = [source for source in found if source.path is not None]
    pixels = {name: source.path for name, source in zip(names, found, strict=True) if source.path is not None}
    unread = tuple(name for name in names if name not in pixels) if len(pixels) < len(found) else ()
    digest = digest_of_members([source.contents for source in found])
    return Colours(pixels, unread, digest, digest_of_members([source.view for source in read]))


class TileImages:
    """The images that show the units of a tile: what tasks of these units share, and the rows of the table that each is given.

    Parameters
    ----------
    shown : those that show any of its units;  names : those that show units of the area: all that tasks are made of. Both sorted

    Attributes
    ----------
    views : poses and balances
    """

    def __init__(self, survey: Survey, shown: Sequence[str], names: Sequence[str]) -> None:
        self.views = views_of(survey, shown)
        self.names = names
        self._lefts, self._rows, self._files, self._changes = list[Left | None](), dict[str, int](), files_text([]), -1

    def inputs(self, results: Results, names: Iterable[str]) -> tuple[ColourRows, dict[str, str]]:
        """Some of them that could be read; and path → text of what is shared. All of `names` have ended."""
        if self._changes != results.changes[INGEST]:
            self._look(results)
        rows = tuple([self._rows[name] for name in names])
        shared = {self.views.path: self.views.text, self._files.path: self._files.text}
        return ColourRows(self.views.path, self._files.path, rows), shared

    def _look(self, results: Results) -> None:
        """Make the table, anew where an image was ingested again."""
        lefts = [results.of(INGEST, name) for name in self.names]
        self._changes = results.changes[INGEST]
        if lefts == self._lefts:
            return
        self._lefts = lefts
        images = [
            ImageFile(name, left.paths[0], left.sizes[0], left.sums[0])
            for name, left in zip(self.names, lefts, strict=True)
            if left is not None and left.paths and left.status is not Status.FAILED
        ]
        self._files, self._rows = files_text(images), {image.name: row for row, image in enumerate(images)}


def _source_of(survey: Survey, name: str) -> _Source:
    path = survey.results.tiled_image(name)
    digest = UNREAD if path is None else survey.results.digest_of("ingest", name)
    return _Source(path, member_of(name, digest), survey.images.shown(name).member)


def views_of(survey: Survey, names: Iterable[str]) -> SharedText:
    """Poses and balances of images."""
    return views_text({n: survey.images.shown(n).text for n in names})


def digest_of_views(survey: Survey, names: Iterable[str]) -> dict[str, str]:
    """Name → digest of pose and balance, for the inputs of a task."""
    return {n: survey.images.shown(n).digest for n in names}
