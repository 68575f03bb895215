"""Marks of control points by the names that a catalog gives its images."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import PurePosixPath

from cityflow.core.control_points import ControlPoint, ControlPoints
from cityflow.io.tables.feature_ids import listing


def with_catalog_names(points: ControlPoints, files: Mapping[str, str]) -> ControlPoints:
    """The points, whose marks name images of the catalog; others are left out, with a note.

    An image is known by its name in the catalog, by the end of its path, or by its file's name with or without its ending; capitals do not count.

    Parameters
    ----------
    files : image's name in the catalog → path or URL of its file
    """
    known: dict[str, set[str]] = {}
    for name, href in files.items():
        for form in _forms(name, href):
            known.setdefault(form, set()).add(name)
    unknown: Counter[str] = Counter()
    several: Counter[str] = Counter()

    def named(point: ControlPoint) -> ControlPoint:
        marks = []
        for mark in point.marks:
            found = _found(mark.image, known)
            if len(found) == 1:
                marks.append(replace(mark, image=next(iter(found))))
            else:
                (several if found else unknown)[mark.image] += 1
        return replace(point, marks=tuple(sorted(marks, key=lambda m: m.image)))

    made = tuple(map(named, points.points))
    notes = [
        f"{sum(count.values())} marks of control points are not used, {why}: {listing(sorted(count))}"
        for count, why in (
            (unknown, "as the catalog has no such image"), (several, "as several images of the catalog have this name"),
        )
        if count
    ]  # fmt: skip
    return replace(points, points=made, notes=(*points.notes, *notes))


def _forms(name: str, href: str) -> set[str]:
    path = PurePosixPath(href.replace("\\", "/").lower())
    ends = {"/".join(path.parts[-k:]) for k in range(1, len(path.parts) + 1)}
    return ends | {path.stem, name.lower()}


def _found(image: str, known: Mapping[str, set[str]]) -> set[str]:
    """Names of the images that are meant; a folder that the catalog's files do not lie in says nothing."""
    plain = image.strip().replace("\\", "/").lower()
    last = PurePosixPath(plain).name
    return next((known[form] for form in (plain, last, PurePosixPath(last).stem) if form in known), set())
