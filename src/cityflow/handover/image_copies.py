"""Local copies of ingested images for workers with a remote store: fetched once, kept while there is room."""

from __future__ import annotations

import atexit
import shutil
import tempfile
import weakref
from collections import OrderedDict
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from cityflow.flow.store import Store
from cityflow.io.images.tiled_images import TiledImage, open_image

ROOM_BYTES = 16 << 30
"""Of copies in a process; units of one tile need the same hundred images, one after the other."""


@dataclass(slots=True)
class _Copy:
    path: Path
    size: int
    image: weakref.ref[TiledImage]


@dataclass(slots=True)
class ImageCopies:
    """Copies in a folder, those used last at the end; what nobody has open any more goes when there is no room."""

    folder: Path
    room_bytes: int = ROOM_BYTES
    _kept: OrderedDict[tuple[str, str], _Copy] = field(default_factory=OrderedDict)
    _count: int = 0

    def open(self, store: Store, path: str) -> TiledImage:
        """The image, from its copy. Raises as `open_image`, and FileNotFoundError."""
        key = store.root, path
        known = self._kept.pop(key, None)
        image = known.image() if known is not None else None
        if image is None:
            place = known.path if known is not None else self._fetched(store, path)
            image = open_image(place)
            known = _Copy(place, place.stat().st_size, weakref.ref(image))
        assert known is not None
        self._kept[key] = known
        self._make_room()
        return image

    def _fetched(self, store: Store, path: str) -> Path:
        self._count += 1
        place = self.folder / f"{self._count}.tif"
        with store.local_copy(path) as copy:
            shutil.copyfile(copy, place)
        return place

    def _make_room(self) -> None:
        total = sum(c.size for c in self._kept.values())
        for key, copy in list(self._kept.items()):
            if total <= self.room_bytes:
                return
            if copy.image() is None:
                copy.path.unlink(missing_ok=True)
                total -= self._kept.pop(key).size


@lru_cache(maxsize=1)
def image_copies() -> ImageCopies:
    """Those of this process; they go with it."""
    folder = Path(tempfile.mkdtemp(prefix="cityflow-images-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return ImageCopies(folder)
