"""Which images of a face add something: a graph of what they see in common (Frommholz 2017, section 5).

Nodes are images with the number of pixels by which they really see the face, edges what two of them see in common. The paper counts pixels of the
image that an edge starts from, so counts are not commutative: of two images that see the same part, the finer one has more pixels of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.core.texture import SeenFace

CELLS_AT_ONCE = 1 << 16


class RedundancyParameters(Parameters):
    """Which images of a face go because others show the same."""

    least_gain: float = Field(
        0.05, ge=0, le=1, description="an image stays if at least this share of what it sees of a face is new"
    )
    least_new: float = Field(
        0.002, ge=0, le=1, description="and if that is at least this share of all that is seen of the face"
    )
    least_covered: float = Field(
        0.995, ge=0, le=1, description="images that went come back until this share of what all see together is seen"
    )
    most_images: int = Field(12, ge=1, le=100, description="images per face that remain at most")
    tie: float = Field(
        0.03, ge=0, le=1, description="images whose visible pixels differ by no more than this share may both be root"
    )


@dataclass(frozen=True, slots=True, eq=False)
class OverlapGraph:
    """What the images of a face see, alone and in common.

    Attributes
    ----------
    images : index of the image at each node
    visible : (n,) int64, cells of the face that it sees
    common : (n, n) int64, cells that both see; the diagonal is `visible`
    density : (n,) float64, pixels of the image per square metre of the face
    """

    images: tuple[int, ...]
    visible: IntArray
    common: IntArray
    density: FloatArray

    @property
    def pixels(self) -> FloatArray:
        """(n,) pixels of each image on what it sees, up to a factor common to all: cells times density."""
        return self.visible * self.density

    @property
    def share(self) -> FloatArray:
        """(n, n) of what image i sees, the part that j sees, too; 0 for images that see nothing."""
        return np.asarray(self.common / np.maximum(self.visible, 1)[:, None])


def overlap_graph(seen: Sequence[SeenFace]) -> OverlapGraph:
    """The graph of a face; masks are all on the face's one grid."""
    masks = _flat(seen)
    common = np.zeros((len(seen), len(seen)), np.int64)
    for start in range(0, masks.shape[1], CELLS_AT_ONCE):
        part: Float32Array = masks[:, start : start + CELLS_AT_ONCE].astype(np.float32)
        # counts below 2**24 are exact in single precision
        common += (part @ part.T).astype(np.int64)
    gsd = np.array([max(s.view.gsd_m, 1e-6) for s in seen])
    return OverlapGraph(tuple(s.view.image for s in seen), np.diag(common).copy(), common, 1.0 / gsd**2)


def kept(
    seen: Sequence[SeenFace], order: Sequence[int], parameters: RedundancyParameters | None = None
) -> tuple[int, ...]:
    """Which images remain, as positions in `seen`: the root first, then by ranking; none where no image sees anything.

    The root is the image with most visible pixels: cells times pixels per cell, so that an image of twice the resolution may see a quarter of the
    face and be root. Among images that differ by less than `tie` the ranking decides.

    Parameters
    ----------
    seen : what every candidate sees
    order : positions in `seen`, best first
    """
    asked = parameters or RedundancyParameters()
    masks = _flat(seen)
    visible = masks.sum(axis=1)
    useful = [i for i in order if visible[i] > 0]
    if not useful:
        return ()
    root = _root(seen, useful, visible, asked.tie)
    candidates = [i for i in useful if i != root]
    others = _adding(masks, root, candidates, asked)
    chosen = _widest(masks, (root,), others, asked.most_images - 1)
    enough = asked.least_covered * int(masks.any(axis=0).sum())
    rest = [i for i in candidates if i not in chosen]
    chosen |= _widest(masks, (root, *chosen), rest, asked.most_images - 1 - len(chosen), enough)
    return (root, *(i for i in candidates if i in chosen))


def _flat(seen: Sequence[SeenFace]) -> BoolArray:
    """(n, cells) masks side by side."""
    return np.stack([s.mask.mask().ravel() for s in seen]) if seen else np.zeros((0, 0), bool)


def _root(seen: Sequence[SeenFace], useful: Sequence[int], visible: IntArray, tie: float) -> int:
    pixels = [float(visible[i]) / max(seen[i].view.gsd_m, 1e-6) ** 2 for i in useful]
    enough = (1.0 - tie) * max(pixels)
    return next(i for i, count in zip(useful, pixels, strict=True) if count >= enough)


def _adding(masks: BoolArray, root: int, others: Sequence[int], asked: RedundancyParameters) -> list[int]:
    """Those that see enough that the root and better ones do not."""
    least = max(asked.least_new * int(masks[[root, *others]].any(axis=0).sum()), 1.0)
    covered, found = masks[root].copy(), []
    for i in others:
        new = int((masks[i] & ~covered).sum())
        if new >= least and new >= asked.least_gain * int(masks[i].sum()):
            found.append(i)
            covered |= masks[i]
    return found


def _widest(
    masks: BoolArray, given: Sequence[int], others: Sequence[int], most: int, enough: float = np.inf
) -> set[int]:
    """Those, at most so many, that together with the given ones see most; no more of them than it takes to see enough cells."""
    covered, left, found = masks[list(given)].any(axis=0), list(others), set[int]()
    while left and len(found) < most and int(covered.sum()) < enough:
        new = [int((masks[i] & ~covered).sum()) for i in left]
        if not any(new):
            break
        best = left.pop(int(np.argmax(new)))
        found.add(best)
        covered |= masks[best]
    return found
