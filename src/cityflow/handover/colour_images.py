"""Images as sources of colour, in the inputs of tasks."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

from cityflow.core.colour_image import ColourImage
from cityflow.flow.shared import KEPT, SharedText, read_shared
from cityflow.flow.store import Store
from cityflow.flow.task import digest_of, member_of
from cityflow.flow.typed import TaskInputs, as_json, from_json
from cityflow.handover.cached_reads import open_pixels
from cityflow.handover.field_types import OrientedField


@dataclass(frozen=True, slots=True)
class ShownImage(TaskInputs):
    """Pose and balance of an image; all but the pose as in `ColourImage`."""

    image: OrientedField
    gain: tuple[float, ...]
    gamma: tuple[float, ...]
    falloff: float
    shoulder: float

    @property
    def text(self) -> str:
        """All of it as JSON text, the same for the same values."""
        return json.dumps(as_json(self), separators=(",", ":"))


class ImageText(NamedTuple):
    """`ShownImage.text`, its digest, and that digest under the name of the image (`flow.task.member_of`)."""

    text: str
    digest: str
    member: str

    @classmethod
    def of(cls, name: str, shown: ShownImage) -> ImageText:
        text = shown.text
        digest = digest_of(text)
        return cls(text, digest, member_of(name, digest))


@dataclass(frozen=True, slots=True)
class ColourInputs(TaskInputs):
    """The images of a task.

    Attributes
    ----------
    views : RUN-relative path of poses and balances, of these images and maybe of others (`views_text`)
    pixels : name → RUN-relative path of the ingested image, in the order of the task
    """

    views: str
    pixels: Mapping[str, str]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.pixels)

    def opened(self, store: Store) -> list[ColourImage]:
        """All of them. Raises CatalogError or OSError where one cannot be read."""
        return [self.open(store, name) for name in self.pixels]

    def open(self, store: Store, name: str) -> ColourImage:
        """One of them."""
        shown = from_json(ShownImage, _views(store, self.views)[name], name)
        pixels = open_pixels(store, self.pixels[name])
        return ColourImage(shown.image, pixels, shown.gain, shown.gamma, shown.falloff, shown.shoulder)


class ImageFile(NamedTuple):
    """An ingested image in a table: its name, its RUN-relative path, bytes and SHA-256 of its file; 0 bytes where that is not known."""

    name: str
    path: str
    size: int
    digest: str


@dataclass(frozen=True, slots=True)
class ColourRows(TaskInputs):
    """The images of a task among those of a table that many tasks share.

    Attributes
    ----------
    views : as in `ColourInputs`, of all in the table;  files : RUN-relative path of the table (`files_text`)
    rows : their places in it, in the order of the task
    """

    views: str
    files: str
    rows: tuple[int, ...]

    def inputs(self, store: Store) -> tuple[ColourInputs, Store]:
        """The images, and the store that expects of their files what was written."""
        table = _files(store, self.files) if self.rows else []
        images = [table[row] for row in self.rows]
        written = {image.path: (image.size, image.digest) for image in images if image.size}
        return ColourInputs(self.views, {image.name: image.path for image in images}), store.also_expecting(written)


def files_text(images: Iterable[ImageFile]) -> SharedText:
    """A table for `ColourRows.files`."""
    return SharedText.of(json.dumps(list(images), separators=(",", ":"), ensure_ascii=False))


@lru_cache(maxsize=KEPT)
def _files(store: Store, path: str) -> list[ImageFile]:
    return [ImageFile(*values) for values in json.loads(read_shared(store, path))]


def views_text(shown: Mapping[str, str]) -> SharedText:
    """Poses and balances of images for `ColourInputs.views`: name → `ShownImage.text`."""
    return SharedText.of("{" + ",".join(f"{json.dumps(name)}:{text}" for name, text in shown.items()) + "}")


@lru_cache(maxsize=KEPT)
def _views(store: Store, path: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(read_shared(store, path))
    return found
