"""Outlines as short lines of text that many of them are written and read by; coordinates survive bit for bit."""

from __future__ import annotations

import json
import tempfile
from array import array
from collections.abc import Iterable, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from cityflow.core.arrays import IntArray
from cityflow.core.building import Outline


def encode_plain(outlines: Sequence[Outline]) -> list[bytes]:
    """A line for each: polygon, id, attributes and remark; of walls and roofs nothing is known yet."""
    shapes = shapely.to_wkb([o.polygon for o in outlines], hex=True, include_srid=False) if outlines else []
    return [
        (json.dumps([wkb, o.id, dict(o.attributes), o.remark], ensure_ascii=False, separators=(",", ":")) + "\n").encode()
        for wkb, o in zip(shapes, outlines, strict=True)
    ]  # fmt: skip


def decode_plain(lines: Iterable[bytes]) -> list[Outline]:
    """The outlines of such lines."""
    trees = [json.loads(line) for line in lines]
    shapes = shapely.from_wkb([tree[0] for tree in trees])
    return [Outline(name, p, about, remark) for p, (_, name, about, remark) in zip(shapes, trees, strict=True)]


class OutlineSpool:
    """Outlines in a file of this process, read again in any order: more than fit into memory.

    They are numbered as they come; each takes eight bytes of memory.
    """

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile()  # noqa: SIM115
        self._ends = array("q", [0])

    def __enter__(self) -> OutlineSpool:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def __len__(self) -> int:
        return len(self._ends) - 1

    def append(self, outlines: Sequence[Outline]) -> None:
        self._file.seek(self._ends[-1])
        for line in encode_plain(outlines):
            self._file.write(line)
            self._ends.append(self._ends[-1] + len(line))

    def lines(self, numbers: Iterable[int]) -> list[bytes]:
        return [self._line(n) for n in numbers]

    def outlines(self, numbers: Iterable[int]) -> list[Outline]:
        return decode_plain(self.lines(numbers))

    def polygons(self, numbers: IntArray) -> NDArray[np.object_]:
        """(N,) their polygons alone."""
        texts = [line[2 : line.index(b'"', 2)].decode() for line in self.lines(numbers.tolist())]
        return np.asarray(shapely.from_wkb(np.array(texts, dtype=object)))

    def _line(self, number: int) -> bytes:
        start, end = self._ends[number], self._ends[number + 1]
        self._file.seek(start)
        return self._file.read(end - start)
