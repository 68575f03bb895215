"""The sample of pairs that says whether given poses contradict each other, before a city: a task for each of a few images with its partners."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from cityflow.adjustment.relative_error import RelativeError, Systematic
from cityflow.core.building import Status
from cityflow.core.parameters import Parameters
from cityflow.flow.task import Json, Outcome, Record, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.oriented import to_json
from cityflow.handover.tie_sample import CAREFUL_PX, Star, StarImage, StarTies, error_of, star_ties
from cityflow.stages.orient import ONE_IMAGE

SAMPLE = "sample"
SAMPLE_VERSION = 1


class SampleParameters(Parameters):
    """How images are read: up to so many pixels, on a coarser level where an image has more."""

    most_px: int = CAREFUL_PX


@dataclass
class SampleSource:
    """The tasks of a sample, and what they found."""

    stars: Sequence[Star]
    _found: dict[str, Record] = field(default_factory=dict, init=False)

    def initial(self) -> Iterator[Task]:
        """A task for each star."""
        return map(_task, self.stars)

    def after(self, task: Task, record: Record) -> Iterable[Task]:
        """Nothing waits for another."""
        self._found[task.unit] = record
        return []

    @property
    def is_whole(self) -> bool:
        """Whether all images could be read."""
        return all(r.status is Status.DONE for r in self._found.values())

    @property
    def error(self) -> RelativeError:
        """Of the whole sample; a star whose task failed says nothing."""
        records = (self._found[star.images[0].image.name] for star in self.stars)
        return error_of([_ties(r.result) for r in records if r.status is not Status.FAILED])

    @property
    def images(self) -> int:
        """Images that are looked at."""
        return len({i.image.name for star in self.stars for i in star.images})


def run_sample(_workspace: Workspace, task: Task) -> Outcome:
    """Ties of an image with its partners, and what they say of the poses."""
    found = star_ties(task.arguments_as(Star), task.parameters_as(SampleParameters).most_px, checked=True)
    result: dict[str, Json] = {
        "parallax": [_plain(p) for p in found.parallax], "heights": [_plain(h) for h in found.heights],
        "unread": [list(u) for u in found.unread],
    }  # fmt: skip
    if found.unread:
        return Outcome(Status.DEGRADED, f"left out: {found.unread[0][0]}: {found.unread[0][1]}", result=result)
    return Outcome(Status.DONE, result=result)


def _task(star: Star) -> Task:
    return SAMPLE_KIND.task(
        star.images[0].image.name, parameters=as_json(SampleParameters()), inputs={f"image {i.image.name}": _digest(i) for i in star.images},
        given=star, limits=ONE_IMAGE,
    )  # fmt: skip


def _digest(image: StarImage) -> str:
    return digest_of([image.file.checksum, to_json(image.image), list(image.heights), image.white])


def _plain(part: Systematic | None) -> Json:
    return None if part is None else [part.square, part.noise, part.count]


def _ties(result: Any) -> StarTies:
    parallax, heights = (
        tuple(None if p is None else Systematic(float(p[0]), float(p[1]), int(p[2])) for p in result[name])
        for name in ("parallax", "heights")
    )
    return StarTies(parallax, heights, tuple((str(n), str(why)) for n, why in result["unread"]))


SAMPLE_KIND = TaskKind(SAMPLE, SAMPLE_VERSION, run_sample, Star)
