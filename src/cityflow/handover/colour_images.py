"""Images as sources of colour, in the inputs of tasks."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass

from cityflow.core.colour_image import ColourImage
from cityflow.flow.store import Store
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


@dataclass(frozen=True, slots=True)
class ColourInputs(TaskInputs):
    """The images of a task, in its order.

    Attributes
    ----------
    shown : name → pose and balance, a `ShownImage` as JSON text: many units show the same image
    pixels : name → RUN-relative path of the ingested image
    """

    shown: Mapping[str, str]
    pixels: Mapping[str, str]

    @property
    def digest(self) -> str:
        """SHA-256 of names, poses and balances, in their order; 64 hexadecimal digits."""
        return hashlib.sha256("\n".join(part for item in self.shown.items() for part in item).encode()).hexdigest()

    def opened(self, store: Store) -> list[ColourImage]:
        """All of them. Raises CatalogError or OSError where one cannot be read."""
        return [self.open(store, name) for name in self.shown]

    def open(self, store: Store, name: str) -> ColourImage:
        """One of them."""
        shown = from_json(ShownImage, json.loads(self.shown[name]), name)
        pixels = open_pixels(store, self.pixels[name])
        return ColourImage(shown.image, pixels, shown.gain, shown.gamma, shown.falloff, shown.shoulder)
