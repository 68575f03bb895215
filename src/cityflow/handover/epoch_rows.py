"""Buildings of a RUN as they stood before an update: outline, model, and what tells whether it is still the same. Lines of JSON, a file for each tile."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass

import shapely
from shapely import Polygon

from cityflow.core.building import Building
from cityflow.io.city_models.cityjson import read_feature


@dataclass(frozen=True, slots=True)
class EpochRow:
    """A building.

    Attributes
    ----------
    outline : well-known binary, hexadecimal;  digest : of its model, empty where it has none
    feature : the model as `feature_line` wrote it, empty where it has none
    outline_sigma_m : standard deviation of its outline
    """

    id: str
    tile: str
    outline: str
    digest: str
    feature: str
    outline_sigma_m: float

    @property
    def footprint(self) -> Polygon:
        """In plan, world metres."""
        found = shapely.from_wkb(bytes.fromhex(self.outline))
        assert isinstance(found, Polygon)
        return found

    @property
    def building(self) -> Building | None:
        """The model, where it has one."""
        return read_feature(self.feature) if self.feature else None


def encode_epoch(rows: Iterable[EpochRow]) -> bytes:
    """A line for each."""
    return b"".join(json.dumps(asdict(row), ensure_ascii=False).encode() + b"\n" for row in rows)


def decode_epoch(data: bytes) -> Iterator[EpochRow]:
    """What `encode_epoch` wrote."""
    return (EpochRow(**json.loads(line)) for line in data.splitlines() if line)
