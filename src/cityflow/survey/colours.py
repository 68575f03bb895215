"""Images as sources of colour, in the inputs of tasks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

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
    rows : those that could be read;  unread : the others
    digest, views_digest : of what was read of all of them, and of poses and balances of those that could be read
    shared : path → text of what tasks over the tile have in common
    """

    rows: ColourRows
    unread: tuple[str, ...]
    digest: str
    views_digest: str
    shared: Mapping[str, str]


UNREAD = "unread"


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
        self._survey = survey
        self.views = views_of(survey, shown)
        self.names = names
        # by name: the row of each that could be read; its name with the digest of its contents, and with that of pose and balance
        self._rows, self._contents, self._views = dict[str, int](), dict[str, str](), dict[str, str]()
        self._lefts, self._files, self._changes = list[Left | None](), files_text([]), -1
        self._shared: dict[str, str] = {}

    def colours(self, names: Sequence[str]) -> Colours:
        """Some of them, sorted, all of which have ended."""
        if self._changes != self._survey.results.changes[INGEST]:
            self._look()
        read: Sequence[str] = names
        unread: tuple[str, ...] = ()
        if len(self._rows) < len(self.names):
            read = [name for name in names if name in self._rows]
            unread = tuple(name for name in names if name not in self._rows)
        rows = tuple(map(self._rows.__getitem__, read))
        return Colours(
            ColourRows(self.views.path, self._files.path, rows), unread,
            digest_of_members(map(self._contents.__getitem__, names)), digest_of_members(map(self._views.__getitem__, read)), self._shared,
        )  # fmt: skip

    def _look(self) -> None:
        """Make the table, anew where an image was ingested again."""
        results = self._survey.results
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
        digests = {name: results.digest_of(INGEST, name) if name in self._rows else UNREAD for name in self.names}
        self._contents = {name: member_of(name, digest) for name, digest in digests.items()}
        self._views = {name: self._survey.images.shown(name).member for name in self.names}
        self._shared = {self.views.path: self.views.text, self._files.path: self._files.text}


def views_of(survey: Survey, names: Iterable[str]) -> SharedText:
    """Poses and balances of images."""
    return views_text({n: survey.images.shown(n).text for n in names})


def digest_of_views(survey: Survey, names: Iterable[str]) -> dict[str, str]:
    """Name → digest of pose and balance, for the inputs of a task."""
    return {n: survey.images.shown(n).digest for n in names}
