"""The binary part of a glTF file: arrays laid into one buffer, and the GLB container around JSON and buffer (glTF 2.0, sections 3.6 and 4)."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Json = Any
MAGIC, VERSION, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
COMPONENT_TYPES = {"uint8": 5121, "uint16": 5123, "uint32": 5125, "float32": 5126}
ELEMENT_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
METADATA_ALIGNMENT = 8
"""Property tables ask for eight bytes; vertex data for four: eight serves both."""


@dataclass(slots=True)
class GltfBuffer:
    """Buffer views and accessors as they are added; `data` is the buffer."""

    data: bytearray = field(default_factory=bytearray)
    views: list[Json] = field(default_factory=list)
    accessors: list[Json] = field(default_factory=list)

    def view(self, data: bytes, target: int | None = None) -> int:
        """Index of a new buffer view over `data`."""
        self.data += bytes(-len(self.data) % METADATA_ALIGNMENT)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.views.append(view if target is None else {**view, "target": target})
        self.data += data
        return len(self.views) - 1

    def attribute(self, values: NDArray[Any], normalized: bool = False, bounds: bool = False) -> int:
        """Index of a new accessor over (N,) or (N, 2 to 4) vertex values; an element's bytes are a multiple of four."""
        rows = values.reshape(len(values), -1)
        accessor = {
            "bufferView": self.view(np.ascontiguousarray(rows).tobytes(), ARRAY_BUFFER),
            "componentType": COMPONENT_TYPES[rows.dtype.name], "count": len(rows), "type": ELEMENT_TYPES[rows.shape[1]],
        }  # fmt: skip
        if normalized:
            accessor["normalized"] = True
        if bounds:
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def indices(self, triangles: NDArray[Any], vertices: int) -> int:
        """Index of a new accessor over the corners of triangles, in the smallest type that counts `vertices`."""
        # The largest value of a type is reserved, so it is no index.
        flat = triangles.reshape(-1).astype(np.uint16 if vertices <= np.iinfo(np.uint16).max else np.uint32)
        self.accessors.append({
            "bufferView": self.view(flat.tobytes(), ELEMENT_ARRAY_BUFFER),
            "componentType": COMPONENT_TYPES[flat.dtype.name], "count": len(flat), "type": "SCALAR",
        })  # fmt: skip
        return len(self.accessors) - 1

    def glb(self, document: dict[str, Json]) -> bytes:
        """The file: `document` with this buffer's views and accessors, empty lists left out."""
        whole = {**document, "accessors": self.accessors, "bufferViews": self.views}
        if self.data:
            whole["buffers"] = [{"byteLength": len(self.data)}]
        text = compact_json({name: value for name, value in whole.items() if value not in ([], {})})
        chunks = _chunk(JSON_CHUNK, text, b" ") + (_chunk(BINARY_CHUNK, bytes(self.data), b"\0") if self.data else b"")
        return struct.pack("<III", MAGIC, VERSION, 12 + len(chunks)) + chunks


def compact_json(value: Json) -> bytes:
    """UTF-8, no spaces, no NaN."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode("utf-8", "replace")


def _chunk(kind: int, data: bytes, filler: bytes) -> bytes:
    padded = data + filler * (-len(data) % 4)
    return struct.pack("<II", len(padded), kind) + padded
