"""What the nodes of the tree of 3D Tiles show from far away: merged from what the parts have left, each node from its children."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from cityflow.core.coarse import Coarse
from cityflow.io.city_models.coarse_glb import places_of, write_coarse_glb
from cityflow.io.city_models.coarse_merge import for_above, merged
from cityflow.io.city_models.tiles3d import FOLDER, stated
from cityflow.io.city_models.tiles3d_tree import Members, NodeContent
from cityflow.io.globe import Globe
from cityflow.io.globe_frame import frame_at

FAR = "coarse"
"""Folder of the contents of nodes, among the tilesets."""


class FarContents:
    """Contents of the nodes over some parts; those of both sets of textures are the same files.

    Parameters
    ----------
    unit : name of the merge, with which the files' names begin
    parts : part → what it has left (`for_above`)
    globe : of the city;  publish : writes a file of RUN
    """

    def __init__(
        self, unit: str, parts: Mapping[str, Coarse], globe: Globe | None, attribution: str, publish: Callable[[str, bytes], str]
    ) -> None:  # fmt: skip
        self._unit, self._globe, self._attribution, self._publish = unit, globe, attribution, publish
        self._known: dict[frozenset[str], Coarse] = {frozenset([name]): part for name, part in parts.items()}
        self._contents: dict[frozenset[str], NodeContent] = {}
        self._uris: set[str] = set()

    def over(self, part_of: Mapping[str, str]) -> Callable[[str, Sequence[Members]], NodeContent | None]:
        """For `tree_over`; `part_of` is URI of a tileset → part."""
        return lambda path, children: self._content(path, [frozenset(part_of[u] for u in c) for c in children])

    def whole(self, names: Iterable[str]) -> Coarse | None:
        """What the merge itself leaves, of all these parts."""
        return self._known.get(frozenset(names))

    def _content(self, path: str, children: Sequence[frozenset[str]]) -> NodeContent | None:
        key = frozenset[str]().union(*children)
        if key not in self._contents and all(child in self._known for child in children):
            coarse = merged([self._known[child] for child in children])
            self._known[key] = for_above(coarse)
            self._contents[key] = self._written(path, coarse)
        return self._contents.get(key)

    def _written(self, path: str, coarse: Coarse) -> NodeContent:
        stem = f"{FAR}/{self._unit}{'_' if path else ''}{path}"
        uri = f"{stem}.glb" if f"{stem}.glb" not in self._uris else f"{stem}_raw.glb"
        self._uris.add(uri)
        x_0, y_0, x_1, y_1 = coarse.bounds
        frame = frame_at(self._globe, ((x_0 + x_1) / 2, (y_0 + y_1) / 2, 0.0))
        self._publish(f"{FOLDER}/{uri}", write_coarse_glb(self._unit, coarse, frame, self._attribution, is_whole=True))
        return NodeContent(
            uri, stated(coarse.error), np.asarray(frame.local(places_of(coarse)) @ frame.axes + frame.origin)
        )
