"""The quadtree over the tilesets of all ground tiles, in several files where they are many."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.io.city_models.tiles3d import BOX_MARGIN_M, FOLDER, PORTABLE, About, box_of, error_of, tileset_json

Json = Any
TILES_PER_FILE = 256
"""Of the tree: a file of 256 tiles is 100 kB, and none is fetched before a viewer looks at its quarter."""

_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
_DEPTH = 24
_Square = tuple[float, float, float]
"""x and y of the lower corner, side."""


@dataclass(frozen=True, slots=True)
class TileRoot:
    """The root of a tileset as the tree over it sees it.

    Attributes
    ----------
    uri : from the tree's folder
    box : its 12 numbers in the frame of the whole: centre and three half axes
    axes : 9 numbers, the axes of the tileset's own frame in that of the whole, one after the other
    error : metres
    """

    uri: str
    box: tuple[float, ...]
    axes: tuple[float, ...]
    error: float

    @classmethod
    def of(cls, uri: str, tileset: bytes) -> TileRoot:
        """From a file that `tiles3d.tile_files` wrote."""
        root = json.loads(tileset)["root"]
        matrix = np.array(root["transform"], np.float64).reshape(4, 4).T
        box = np.array(root["boundingVolume"]["box"], np.float64)
        centre, sides = matrix[:3, :3] @ box[:3] + matrix[:3, 3], box[3:].reshape(3, 3) @ matrix[:3, :3].T
        axes = matrix[:3, :3].T.reshape(-1)
        return cls(uri, (*map(float, (*centre, *sides.reshape(-1))),), tuple(map(float, axes)), root["geometricError"])

    @property
    def corners(self) -> FloatArray:
        """(8, 3) of its box, in the frame of the whole."""
        box = np.array(self.box)
        return np.asarray(box[:3] + _CORNERS @ box[3:].reshape(3, 3))


@dataclass(frozen=True, slots=True, eq=False)
class NodeContent:
    """What is shown in place of all below a node where they are far away.

    Attributes
    ----------
    uri : from the tree's folder
    error : metres
    places : (N, 3) of what is in it, in the frame of the whole
    """

    uri: str
    error: float
    places: FloatArray


Members = tuple[str, ...]
"""URIs of the tilesets below a node."""

NodeContents = Callable[[str, Sequence[Members]], NodeContent | None]
"""What a node shows: from the way to it, a digit per level, and the members of each of its children; asked for from below upwards."""


@dataclass(frozen=True, slots=True)
class Tree:
    """A tileset over others: its files by their path in RUN, and its root as a tree above it sees it."""

    files: Mapping[str, bytes]
    root: TileRoot


def tree_over(
    roots: Iterable[TileRoot], about: About, name: str = PORTABLE, root_transform: Sequence[float] | None = None,
    contents: NodeContents = lambda *_: None,
) -> Tree | None:  # fmt: skip
    """The tileset `name` over others; for more than 256 of them with quarters in files of their own, ``NAME_0_12.json``.

    Parameters
    ----------
    roots : of the tilesets below, in any order
    name : of the file; of the set over the whole city `tiles3d.PORTABLE` or `tiles3d.RAW`
    root_transform : 16 numbers, column after column, that place a local frame; none by default
    contents : what nodes show; by default nothing

    Returns
    -------
    None where there is no tileset below
    """
    ordered = sorted(roots, key=lambda root: root.uri)
    if not ordered:
        return None
    tree = _Tree(ordered, about, name.removesuffix(".json"), contents)
    node = tree.node(np.arange(len(ordered)), tree.square(), "")
    top = node if root_transform is None else {"transform": [float(v) for v in root_transform], **node}
    tree.files[f"{FOLDER}/{name}"] = tileset_json({"refine": "ADD", **top}, about)
    return Tree(tree.files, TileRoot(name, tuple(node["boundingVolume"]["box"]), tree.axes, node["geometricError"]))


def city_tilesets(
    tiles: Mapping[str, bytes], about: About, name: str = PORTABLE, root_transform: Sequence[float] | None = None
) -> dict[str, bytes]:
    """The files of `tree_over` the tilesets of ground tiles: path in RUN → contents; nothing where there is no tile."""
    roots = [TileRoot.of(path.removeprefix(f"{FOLDER}/"), tiles[path]) for path in sorted(tiles)]
    tree = tree_over(roots, about, name, root_transform)
    return {} if tree is None else dict(tree.files)


class _Tree:
    """Builds nodes over tiles in the plane of the middle tile; `files` gathers the quarters that are files of their own."""

    def __init__(self, roots: Sequence[TileRoot], about: About, stem: str, contents: NodeContents) -> None:
        self.files: dict[str, bytes] = {}
        self._roots, self._about, self._stem, self._contents = roots, about, stem, contents
        centres = np.array([root.box[:3] for root in roots])
        middle = int(np.argmin(((centres - centres.mean(axis=0)) ** 2).sum(axis=1)))
        self.axes = roots[middle].axes
        self._axes = np.array(self.axes).reshape(3, 3)
        self._plan = (centres - centres[middle]) @ self._axes.T[:, :2]

    def square(self) -> _Square:
        """x, y of the lower corner, and side, of the square over all tiles' middles."""
        lower, upper = self._plan.min(axis=0), self._plan.max(axis=0)
        return float(lower[0]), float(lower[1]), float((upper - lower).max()) + 1e-3

    def node(self, members: IntArray, square: _Square, path: str) -> dict[str, Json]:
        """The tile over some ground tiles; `path` is the way to it, a digit per level."""
        if len(members) == 1:
            return self._leaf(self._roots[members[0]])
        quarters = self._quarters(members, square, len(path))
        children = [self._child(*quarter, f"{path}{i}", len(members)) for i, quarter in quarters]
        if len(children) == 1 and "children" in children[0]:
            return children[0]
        corners = np.concatenate([self._roots[i].corners for i in members])
        content = self._contents(path, [tuple(self._roots[i].uri for i in found) for _, (found, _) in quarters])
        shown: dict[str, Json] = {}
        if content is not None:
            corners = np.concatenate([corners, content.places])
            shown = {"refine": "REPLACE", "content": {"uri": content.uri}}
        local = corners @ self._axes.T
        box = box_of(local.min(axis=0) - BOX_MARGIN_M, local.max(axis=0) + BOX_MARGIN_M, self._axes)
        below = max(child["geometricError"] for child in children)
        error = max(error_of(box) if content is None else content.error, below)
        return {"boundingVolume": {"box": box}, "geometricError": error, **shown, "children": children}

    def _child(self, members: IntArray, square: _Square, path: str, siblings: int) -> dict[str, Json]:
        """A quarter, in a file of its own where it fits in one and all `siblings` together do not."""
        node = self.node(members, square, path)
        if not 1 < len(members) <= TILES_PER_FILE < siblings:
            return node
        file = f"{self._stem}_{path}.json"
        self.files[f"{FOLDER}/{file}"] = tileset_json({"refine": "ADD", **node}, self._about)
        return {**{key: node[key] for key in ("boundingVolume", "geometricError")}, "content": {"uri": file}}

    def _quarters(self, members: IntArray, square: _Square, depth: int) -> list[tuple[int, tuple[IntArray, _Square]]]:
        """Number, members and square of each quarter with tiles; all members as they are where they cannot be told apart."""
        x, y, side = square
        if depth >= _DEPTH:
            return [(i, (members[i : i + 1], square)) for i in range(len(members))]
        half = side / 2
        right, upper = self._plan[members, 0] >= x + half, self._plan[members, 1] >= y + half
        quarter = right + 2 * upper
        return [
            (i, (members[quarter == i], (x + half * (i % 2), y + half * (i // 2), half))) for i in np.unique(quarter)
        ]

    @staticmethod
    def _leaf(root: TileRoot) -> dict[str, Json]:
        return {
            "boundingVolume": {"box": list(root.box)}, "geometricError": root.error, "content": {"uri": root.uri},
        }  # fmt: skip
