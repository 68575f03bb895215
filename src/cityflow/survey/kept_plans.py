"""Flight plans that are kept: found once from the poses, which takes 5 ms an image with the tiles under it, and then read."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from typing import Protocol

import numpy as np

from cityflow.core.grid import Tile
from cityflow.errors import CityflowError
from cityflow.flow.store import Store
from cityflow.handover.array_file import decode_arrays, encode_arrays
from cityflow.orientation.flight_plan import PlanFindings, ReferenceImages

FOLDER = "flight_plan"
REMEMBERED = 2
"""Plans that a process keeps: a command asks for its own several times."""
SUM_BYTES = 32


@dataclass(frozen=True, slots=True)
class KeptPlan:
    """What a flight plan has found, and the ground tiles with surveyed ground, south-west first."""

    found: PlanFindings
    tiles: tuple[Tile, ...]


class Plans(Protocol):
    """Where plans are kept, by the digest of all that they follow from."""

    def get(self, digest: str) -> KeptPlan | None: ...

    def put(self, digest: str, plan: KeptPlan) -> None: ...


class NotKept:
    """Nowhere."""

    def get(self, digest: str) -> KeptPlan | None: ...

    def put(self, digest: str, plan: KeptPlan) -> None: ...


_REMEMBERED: OrderedDict[str, KeptPlan] = OrderedDict()


@dataclass(frozen=True, slots=True)
class RunPlans:
    """In a RUN, as far as there is one that can be written; a file that is not what was written counts as missing.

    Attributes
    ----------
    marker : file that tells that the folder is a RUN
    program : digest of the part of the program that a plan follows from; a plan of another one is found again
    """

    store: Store
    marker: str
    program: str

    def get(self, digest: str) -> KeptPlan | None:
        """None where nobody has made it."""
        if (plan := _REMEMBERED.get(digest)) is not None:
            if not self.store.exists(self._path(digest)):
                self._write(digest, plan)
            return plan
        with suppress(OSError, CityflowError, ValueError, KeyError):
            data = self.store.read_bytes(self._path(digest))
            if sha256(data[SUM_BYTES:]).digest() == data[:SUM_BYTES]:
                return _remember(digest, decode_plan(data[SUM_BYTES:]))
        return None

    def put(self, digest: str, plan: KeptPlan) -> None:
        """In place of an earlier one."""
        _remember(digest, plan)
        self._write(digest, plan)

    def _path(self, digest: str) -> str:
        return f"{FOLDER}/{sha256((digest + self.program).encode()).hexdigest()[:32]}.cfa"

    def _write(self, digest: str, plan: KeptPlan) -> None:
        with suppress(OSError):
            if not self.store.exists(self.marker):
                return
            former = [path for path in self.store.find(FOLDER) if path != self._path(digest)]
            data = encode_plan(plan)
            self.store.write_bytes(self._path(digest), sha256(data).digest() + data)
            for path in former:
                self.store.remove(path)


def _remember(digest: str, plan: KeptPlan) -> KeptPlan:
    _REMEMBERED[digest] = plan
    while len(_REMEMBERED) > REMEMBERED:
        _REMEMBERED.popitem(last=False)
    return plan


def encode_plan(plan: KeptPlan) -> bytes:
    """As a file; the same plan gives the same bytes."""
    found, arrays = plan.found, dict[str, np.ndarray]()
    for number, images in enumerate(found.references.values()):
        arrays[f"cell {number}"], arrays[f"view {number}"] = images.cell, images.view
    arrays["image"] = np.array(list(found.partners), np.int64)
    arrays["count"] = np.array([len(chosen) for chosen in found.partners.values()], np.int64)
    arrays["partner"] = np.array([k for chosen in found.partners.values() for k in chosen], np.int64)
    arrays["tile"] = np.array([(t.col, t.row) for t in plan.tiles], np.int64).reshape(-1, 2)
    sizes: Sequence[float] = sorted({t.size for t in plan.tiles})
    return encode_arrays(
        arrays, {"directions": list(found.references), "cell_m": found.cell_m, "tile_m": [*sizes, 0.0][0]}
    )


def decode_plan(data: bytes) -> KeptPlan:
    """Inverse of `encode_plan`. Raises CityflowError, ValueError, KeyError for other bytes."""
    arrays, attributes = decode_arrays(data)
    references = {
        name: ReferenceImages(arrays[f"cell {k}"], arrays[f"view {k}"])
        for k, name in enumerate(attributes["directions"])
    }
    chosen = np.split(arrays["partner"], np.cumsum(arrays["count"])[:-1]) if len(arrays["count"]) else []
    partners = {k: tuple(p.tolist()) for k, p in zip(arrays["image"].tolist(), chosen, strict=True)}
    tiles = tuple(Tile(col, row, float(attributes["tile_m"])) for col, row in arrays["tile"].tolist())
    return KeptPlan(PlanFindings(references, partners, float(attributes["cell_m"])), tiles)
