"""Images as sources of colour, in the inputs of tasks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cityflow.core.colour_image import ColourImage
from cityflow.flow.store import Store
from cityflow.flow.typed import TaskInputs
from cityflow.handover.cached_reads import open_pixels
from cityflow.handover.field_types import OrientedField


@dataclass(frozen=True, slots=True)
class ShownImage(TaskInputs):
    """Pose and balance of an image; `gain`, `gamma` and `falloff` as in `ColourImage`."""

    image: OrientedField
    gain: tuple[float, ...]
    gamma: tuple[float, ...]
    falloff: float


@dataclass(frozen=True, slots=True)
class ColourInputs(TaskInputs):
    """The images of a task, in its order.

    Attributes
    ----------
    shown : name → pose and balance
    pixels : name → RUN-relative path of the ingested image
    """

    shown: Mapping[str, ShownImage]
    pixels: Mapping[str, str]

    def opened(self, store: Store) -> list[ColourImage]:
        """All of them. Raises CatalogError or OSError where one cannot be read."""
        return [self.open(store, name) for name in self.shown]

    def open(self, store: Store, name: str) -> ColourImage:
        """One of them."""
        shown = self.shown[name]
        return ColourImage(shown.image, open_pixels(store, self.pixels[name]), shown.gain, shown.gamma, shown.falloff)
