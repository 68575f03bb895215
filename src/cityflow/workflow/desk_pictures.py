"""Photographs of a building for the desk: which ones show it, and a part of each with its camera."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.errors import RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.records import quoted
from cityflow.handover.cached_reads import open_pixels
from cityflow.reporting.desk_photograph import Part
from cityflow.reporting.view import CITY
from cityflow.reporting.view_tiles import UNITS
from cityflow.runs.prepare import Prepared
from cityflow.stages import ingest
from cityflow.survey.survey import Survey
from cityflow.viewer.view_page import DATA

MOST, STOREY_M = 12, 3.0

Json = Any


@dataclass(frozen=True, slots=True, eq=False)
class Pictures:
    """Photographs of one building; `polygon`: its outline, world metres."""

    run: Prepared
    survey: Survey
    unit: str
    tile: str
    polygon: Polygon

    def names(self) -> list[tuple[str, float | None]]:
        """Photographs that show all of it, with the share of its texture that each gave: those with the largest first, then the nearest."""
        shares = dict(self._of_texture())
        more = (
            self.survey.images.showing(self.polygon.bounds, self._heights(), 4 * MOST)
            if self.survey.images.views
            else []
        )
        names = [*shares, *(n for n in more if n not in shares)]
        found = [(n, shares.get(n)) for n in names if n in self.survey.images.views and self._part(n) is not None]
        return found[:MOST]

    def about(self, image: str) -> Json:
        """Size and camera of the part."""
        city = json.loads(self.run.store.read_bytes(CITY))
        return self._known(image).as_json(np.array(city["world"], np.float64), self._solid().mean(axis=0))

    def jpeg(self, image: str) -> bytes:
        part = self._known(image)
        with Ledger.open(self.run.store) as ledger:
            record = ledger.latest(ingest.NAME, image)
        if record is None or not record.outputs:
            raise RunError(f"{image} was not read", where=self.run.store.root, remedy="see `cityflow status`")
        return part.jpeg(open_pixels(self.run.store, next(iter(record.outputs))))

    def _known(self, image: str) -> Part:
        found = self._part(image) if image in self.survey.images.views else None
        if found is None:
            raise RunError(
                f"{image!r} does not show {self.unit}", where=self.run.store.root, remedy="choose another one"
            )
        return found

    def _part(self, image: str) -> Part | None:
        return Part.around(self.survey.images.views[image].image, self._solid())

    def _solid(self) -> FloatArray:
        """(N, 3) corners of the outline at the heights of floor and ridge."""
        ring = shapely.get_coordinates(self.polygon.exterior)
        return np.concatenate([np.column_stack([ring, np.full(len(ring), z)]) for z in self._heights()])

    def _heights(self) -> tuple[float, float]:
        known = self._json(f"{UNITS}/{quoted(self.tile)}.json").get(self.unit, {}).get("attributes", {})
        low, high = (known.get(key) for key in ("ground_height_m", "ridge_height_m"))
        floor = float(low) if isinstance(low, int | float) else self.survey.images.heights_over(self.polygon.bounds)[0]
        return floor, float(high) if isinstance(high, int | float) else floor + STOREY_M

    def _of_texture(self) -> list[tuple[str, float]]:
        cell = self._json(f"{UNITS}/{quoted(self.tile)}.json").get(self.unit, {}).get("atlas_cell")
        found = self._json(f"{DATA}/images/{quoted(cell)}.json").get(self.unit, []) if cell else []
        return [(str(name), float(share)) for name, share in found]

    def _json(self, path: str) -> dict[str, Json]:
        try:
            return dict(json.loads(self.run.store.read_bytes(path)))
        except (OSError, ValueError):
            return {}
