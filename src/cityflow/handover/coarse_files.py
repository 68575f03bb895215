"""What a tile or a district looks like from far away, for the merge above it: a file of bounded size."""

from __future__ import annotations

import json
from io import BytesIO

import numpy as np
import shapely

from cityflow.core.coarse import Blocks, Coarse

COARSE = "coarse.npz"


def encode_coarse(coarse: Coarse) -> bytes:
    """As arrays of numpy, compressed; floats are exact."""
    blocks, picture = coarse.blocks, coarse.picture
    texts = json.dumps([blocks.ids, blocks.status, blocks.verdict], ensure_ascii=False).encode("utf-8", "surrogatepass")
    plans = shapely.to_wkb(list(blocks.plans))
    file = BytesIO()
    np.savez_compressed(
        file, bounds=np.array([coarse.bounds, coarse.extent]), error=np.array([coarse.error]), vertices=coarse.vertices, triangles=coarse.triangles,
        picture=np.empty((0, 0, 3), np.uint8) if picture is None else picture, texts=np.frombuffer(texts, np.uint8),
        figures=blocks.figures, heights=blocks.heights, colours=blocks.colours,
        plans=np.frombuffer(b"".join(plans), np.uint8), plan_sizes=np.array([len(p) for p in plans], np.int64),
    )  # fmt: skip
    return file.getvalue()


def decode_coarse(data: bytes) -> Coarse:
    with np.load(BytesIO(data), allow_pickle=False) as found:
        ids, status, verdict = map(tuple, json.loads(found["texts"].tobytes().decode("utf-8", "surrogatepass")))
        ends = np.cumsum(found["plan_sizes"]).tolist()
        wkb = found["plans"].tobytes()
        plans = shapely.from_wkb([wkb[a:b] for a, b in zip([0, *ends], ends, strict=False)])
        blocks = Blocks(ids, status, verdict, found["figures"], tuple(plans), found["heights"], found["colours"])
        bounds, extent = ((float(x_0), float(y_0), float(x_1), float(y_1)) for x_0, y_0, x_1, y_1 in found["bounds"])
        picture = found["picture"] if found["picture"].size else None
        return Coarse(bounds, found["vertices"], found["triangles"], picture, extent, blocks, float(found["error"][0]))
