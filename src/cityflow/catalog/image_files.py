"""Finds the image file of each oriented image, checks that it is complete, and gives it a name in the run."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cityflow.core.camera import OrientedImage
from cityflow.errors import CatalogError
from cityflow.io.images.image_header import image_header
from cityflow.io.orientation.oriented_images import LeftOut
from cityflow.io.orientation.readers import SizeOf

IMAGE_SUFFIXES = (".jpg", ".jpeg", ".tif", ".tiff", ".png", ".jp2")
_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")


def sizes_of(files: ImageFiles) -> SizeOf:
    """Size of an image by its name in a model, None where there is none or it cannot be read."""

    def size_of(name: str) -> tuple[int, int] | None:
        path = files.of_name(name)
        try:
            header = image_header(path) if path is not None else None
        except CatalogError:
            return None
        return (header.width, header.height) if header is not None else None

    return size_of


@dataclass(frozen=True, slots=True)
class ImageFiles:
    """The image files of a folder and how a model may call them."""

    all: tuple[Path, ...]
    by_path: dict[str, Path]
    by_name: dict[str, Path]
    by_stem: dict[str, Path]

    @classmethod
    def of(cls, folder: Path) -> ImageFiles:
        files = sorted(p for p in folder.rglob("*") if p.is_file() and p.suffix.lower() in IMAGE_SUFFIXES)
        by_path = {p.relative_to(folder).as_posix(): p for p in files}
        return cls(
            tuple(files), by_path, _only({p: p.name.lower() for p in files}), _only({p: p.stem.lower() for p in files})
        )

    def of_name(self, name: str) -> Path | None:
        """By relative path, else by file name, else by stem, where only one fits."""
        plain = Path(name.replace("\\", "/"))
        by_file = self.by_path.get(plain.as_posix()) or self.by_name.get(plain.name.lower())
        return by_file or self.by_stem.get(plain.name.lower()) or self.by_stem.get(plain.stem.lower())


def matched(
    images: Sequence[OrientedImage], files: ImageFiles, folder: Path
) -> tuple[list[tuple[str, Path]], list[LeftOut]]:
    """Model's names with their files, and those that have none or another image's."""
    found: dict[Path, str] = {}
    missing = []
    for image in images:
        path = files.of_name(image.name)
        if path is None:
            problem = f"the image is in the model, but not in {folder.name}/"
            missing.append(LeftOut(image.name, problem, "put the file there and make the catalog again"))
        elif path in found:
            problem = f"its file would be {path.name}, which is {found[path]}'s"
            missing.append(LeftOut(image.name, problem, "give each image a file of its own"))
        else:
            found[path] = image.name
    return [(name, path) for path, name in found.items()], missing


def _only(keys: dict[Path, str]) -> dict[str, Path]:
    count = Counter(keys.values())
    return {key: path for path, key in keys.items() if count[key] == 1}


def unit_names(names: Sequence[str], taken: Iterable[str] = ()) -> list[str]:
    """Names for images that are fit for files and tasks, each once.

    The extension goes, unless two images differ by nothing else; folders become part of the name where file names repeat.

    >>> unit_names(["a/1.jpg", "b/1.jpg", "b/2.jpg"])
    ['a-1', 'b-1', '2']
    """
    plain = [n.replace("\\", "/") for n in names]
    shapes = [
        [Path(n).stem for n in plain],
        [str(Path(n).with_suffix("")) if Path(n).suffix else n for n in plain],
        plain,
    ]
    safe = [[_UNSAFE.sub("-", n).strip("-.") or "image" for n in shape] for shape in shapes]
    used, result = set(taken), []
    counts = [Counter(shape) for shape in safe]
    for i in range(len(plain)):
        choices = [s[i] for s, c in zip(safe, counts, strict=True) if c[s[i]] == 1]
        name = next((c for c in choices if c not in used), "")
        number = 1
        while not name or name in used:
            number += 1
            name = f"{safe[2][i]}-{number}"
        used.add(name)
        result.append(name)
    return result
