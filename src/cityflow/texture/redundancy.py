"""Removes redundant images of a face by a graph of common pixels (Frommholz 2017, section 5).

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
"""Bounds memory; no result depends on it."""

LEAST_NEW = 0.002
"""What is new in an image is at least this share of all that is seen of the face; set by hand on textures of synthetic towns."""


class RedundancyParameters(Parameters):
    """Which images of a face go because others show the same."""

    least_gain: float = Field(
        0.05, ge=0, le=1, description="an image is kept if at least this share of its view of a face is new"
    )
    least_covered: float = Field(
        0.995,
        ge=0,
        le=1,
        description="dropped images return until this share of the pixels that all images see is covered",
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
    masks : (n, cells) bool, what it sees
    common : (n, n) int64, cells that both see; the diagonal is `visible`
    density : (n,) float64, pixels of the image per square metre of the face
    """

    images: tuple[int, ...]
    masks: BoolArray
    common: IntArray
    density: FloatArray

    @property
    def visible(self) -> IntArray:
        """(n,) cells of the face that each image sees."""
        return np.asarray(np.diag(self.common))

    @property
    def pixels(self) -> FloatArray:
        """(n,) pixels of each image on what it sees, up to a factor common to all: cells times density."""
        return self.visible * self.density

    @property
    def overlaps(self) -> FloatArray:
        """(n, n) the edges: pixels of image i on what j sees, too, up to the same factor."""
        return self.common * self.density[:, None]

    @property
    def share(self) -> FloatArray:
        """(n, n) of what image i sees, the part that j sees, too; 0 for images that see nothing."""
        return np.asarray(self.overlaps / np.maximum(self.pixels, self.density)[:, None])

    def seen_by(self, nodes: Sequence[int]) -> BoolArray:
        """(cells,) what some of these images see."""
        return np.asarray(self.masks[list(nodes)].any(axis=0))


def overlap_graph(seen: Sequence[SeenFace]) -> OverlapGraph:
    """The graph of a face; masks are all on the face's one grid."""
    masks = np.stack([s.mask.mask().ravel() for s in seen]) if seen else np.zeros((0, 0), bool)
    common = np.zeros((len(seen), len(seen)), np.int64)
    for start in range(0, masks.shape[1], CELLS_AT_ONCE):
        part: Float32Array = masks[:, start : start + CELLS_AT_ONCE].astype(np.float32)
        # counts below 2**24 are exact in single precision
        common += (part @ part.T).astype(np.int64)
    gsd = np.array([max(s.view.gsd_m, 1e-6) for s in seen])
    return OverlapGraph(tuple(s.view.image for s in seen), masks, common, 1.0 / gsd**2)


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
    graph = overlap_graph(seen)
    useful = [i for i in order if graph.visible[i] > 0]
    if not useful:
        return ()
    root = _root(graph, useful, asked.tie)
    candidates = [i for i in useful if i != root]
    others = _adding(graph, root, candidates, asked)
    chosen = _widest(graph, (root,), others, asked.most_images - 1)
    enough = asked.least_covered * int(graph.seen_by(useful).sum())
    rest = [i for i in candidates if i not in chosen]
    chosen |= _widest(graph, (root, *chosen), rest, asked.most_images - 1 - len(chosen), enough)
    return (root, *(i for i in candidates if i in chosen))


def _root(graph: OverlapGraph, useful: Sequence[int], tie: float) -> int:
    enough = (1.0 - tie) * float(graph.pixels[list(useful)].max())
    return next(i for i in useful if graph.pixels[i] >= enough)


def _adding(graph: OverlapGraph, root: int, others: Sequence[int], asked: RedundancyParameters) -> list[int]:
    """Those that see enough that the root and better ones do not.

    An edge to one of them that carries nearly all pixels of an image already says that it goes; else what they see together tells.
    """
    visible, common = graph.visible, graph.common
    least = max(LEAST_NEW * int(graph.seen_by([root, *others]).sum()), 1.0)
    covered, found = graph.masks[root].copy(), list[int]()
    for i in others:
        if int(visible[i] - common[i, [root, *found]].max()) < asked.least_gain * int(visible[i]):
            continue
        new = int((graph.masks[i] & ~covered).sum())
        if new >= least and new >= asked.least_gain * int(visible[i]):
            found.append(i)
            covered |= graph.masks[i]
    return found


def _widest(
    graph: OverlapGraph, given: Sequence[int], others: Sequence[int], most: int, enough: float = np.inf
) -> set[int]:
    """Those, at most so many, that together with the given ones see most; no more of them than it takes to see enough cells."""
    covered, left, found = graph.seen_by(given), list(others), set[int]()
    while left and len(found) < most and int(covered.sum()) < enough:
        new = [int((graph.masks[i] & ~covered).sum()) for i in left]
        if not any(new):
            break
        best = left.pop(int(np.argmax(new)))
        found.add(best)
        covered |= graph.masks[best]
    return found
