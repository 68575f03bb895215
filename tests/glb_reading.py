"""A reader of GLB files that knows nothing of the writer: JSON, accessors as arrays, property tables as lists."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

Json = Any
DTYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
COLUMN_DTYPES = {"INT32": np.int32, "FLOAT64": np.float64, "UINT8": np.uint8, "UINT32": np.uint32}


@dataclass(frozen=True, slots=True)
class Glb:
    document: Json
    binary: bytes

    @classmethod
    def of(cls, data: bytes) -> Glb:
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        at, chunks = 12, {}
        while at < length:
            size, kind = struct.unpack_from("<I4s", data, at)
            assert size % 4 == 0
            chunks[kind] = data[at + 8 : at + 8 + size]
            at += 8 + size
        return cls(json.loads(chunks[b"JSON"]), chunks.get(b"BIN\0", b""))

    @property
    def primitives(self) -> list[Json]:
        return [primitive for mesh in self.document["meshes"] for primitive in mesh["primitives"]]

    def view(self, index: int) -> bytes:
        view = self.document["bufferViews"][index]
        assert view["byteOffset"] % 8 == 0
        assert view["byteLength"] > 0
        return self.binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]

    def array(self, index: int) -> NDArray[Any]:
        accessor = self.document["accessors"][index]
        size = SIZES[accessor["type"]]
        flat = np.frombuffer(self.view(accessor["bufferView"]), DTYPES[accessor["componentType"]])
        assert len(flat) == accessor["count"] * size
        return flat.reshape(-1, size) if size > 1 else flat

    def attributes(self, primitive: Json) -> dict[str, NDArray[Any]]:
        return {name: self.array(index) for name, index in primitive["attributes"].items()}

    def triangles(self, primitive: Json) -> NDArray[Any]:
        return self.array(primitive["indices"]).reshape(-1, 3).astype(np.int64)

    def picture(self, primitive: Json) -> Json:
        """The image of a primitive's material, None where it has none."""
        look = self.document["materials"][primitive["material"]]["pbrMetallicRoughness"]
        if "baseColorTexture" not in look:
            return None
        return self.document["images"][self.document["textures"][look["baseColorTexture"]["index"]]["source"]]

    def table(self, number: int) -> dict[str, list[Any]]:
        """Columns by their names; values that are `noData` are None."""
        metadata = self.document["extensions"]["EXT_structural_metadata"]
        table = metadata["propertyTables"][number]
        properties = metadata["schema"]["classes"][table["class"]]["properties"]
        assert properties.keys() == table["properties"].keys()
        return {
            said["name"]: self._column(said, table["properties"][key], table["count"], metadata["schema"])
            for key, said in properties.items()
        }

    def _column(self, said: Json, column: Json, count: int, schema: Json) -> list[Any]:
        data = self.view(column["values"])
        if said["type"] == "STRING":
            ends = np.frombuffer(self.view(column["stringOffsets"]), np.uint32).tolist()
            assert len(ends) == count + 1
            assert ends[-1] == len(data)
            values: list[Any] = [data[a:b].decode() for a, b in pairwise(ends)]
        elif said["type"] == "BOOLEAN":
            values = [bool(data[i // 8] >> (i % 8) & 1) for i in range(count)]
        elif said["type"] == "ENUM":
            words = {w["value"]: w["name"] for w in schema["enums"][said["enumType"]]["values"]}
            values = [words[v] for v in np.frombuffer(data, np.uint8).tolist()]
        else:
            values = np.frombuffer(data, COLUMN_DTYPES[said["componentType"]]).tolist()
        assert len(values) == count
        return [None if "noData" in said and value == said["noData"] else value for value in values]
