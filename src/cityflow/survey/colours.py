"""Images as sources of colour, in the inputs of tasks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

from cityflow.flow.shared import SharedText
from cityflow.flow.task import digest_of_members, member_of
from cityflow.handover.colour_images import ColourInputs, views_text
from cityflow.survey.results import Left, Results
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
_KEPT: WeakKeyDictionary[Survey, dict[str, tuple[Left | None, str | None, str]]] = WeakKeyDictionary()


def colours_of(survey: Survey, names: Iterable[str]) -> Colours:
    """Of the images with these names, sorted."""
    kept, results, images = _KEPT.setdefault(survey, {}), survey.results, survey.images
    pixels, unread, members, views = dict[str, str](), list[str](), list[str](), list[str]()
    for name in names:
        left, found = results.of("ingest", name), kept.get(name)
        if found is None or found[0] is not left:
            path = results.tiled_image(name)
            digest = UNREAD if path is None else results.digest_of("ingest", name)
            found = kept[name] = left, path, member_of(name, digest)
        members.append(found[2])
        if found[1] is None:
            unread.append(name)
        else:
            pixels[name] = found[1]
            views.append(images.shown(name).member)
    return Colours(pixels, tuple(unread), digest_of_members(members), digest_of_members(views))


def views_of(survey: Survey, names: Iterable[str]) -> SharedText:
    """Poses and balances of images."""
    return views_text({n: survey.images.shown(n).text for n in names})


def digest_of_views(survey: Survey, names: Iterable[str]) -> dict[str, str]:
    """Name → digest of pose and balance, for the inputs of a task."""
    return {n: survey.images.shown(n).digest for n in names}
