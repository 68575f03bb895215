"""Orientations of PATB: for each image its name, focal length, X, Y, Z and nine numbers of a matrix, over as many lines as it takes; -99 ends them."""

from __future__ import annotations

import numpy as np

from cityflow.errors import CatalogError
from cityflow.geometry.rotations import PHOTO_FLIP
from cityflow.io.orientation.camera_table import named_cameras
from cityflow.io.orientation.model_text import MatrixRows, numbers, read_lines
from cityflow.io.orientation.oriented_images import LeftOut, OrientationModel, in_order
from cityflow.io.orientation.readers import OrientationFile, choice

AGAIN = "name PATB's file of orientations with matrices"
NUMBERS = 13
"""Focal length, place and matrix."""
MICROMETRES = 1000.0
"""Focal lengths above are in micrometres: no camera that flies has a metre."""
MOST_FOCAL = 1e-3
"""Share by which two focal lengths of one camera may differ; set by hand."""
END = "-99"


def read(given: OrientationFile) -> OrientationModel:
    """For `readers.READERS`; options ``cameras``, ``matrix``."""
    cameras, path = named_cameras(given.options, given.path), given.path
    rows = choice(MatrixRows, given.options, "matrix", MatrixRows.PHOTO_AXES)
    lines = read_lines(path, AGAIN)
    stop = next((i for i, text in enumerate(lines) if text.strip() == END), len(lines))
    words = [(i, w) for i, text in enumerate(lines[:stop], 1) if not text.startswith(("#", "*")) for w in text.split()]
    images, left_out = [], []
    pixel_mm: dict[str, float] = {}
    notes: list[str] = []
    for start in range(0, len(words), NUMBERS + 1):
        line, name = words[start]
        try:
            values = numbers([w for _, w in words[start + 1 : start + 1 + NUMBERS]], NUMBERS, f"image {name}")
            rotation = PHOTO_FLIP @ rows.photo_from_world(values[4:])
            image, used = cameras.image(name, "", rotation, np.array(values[1:4]))
        except ValueError as error:
            left_out.append(LeftOut(name, f"{path.name}, line {line}: {error}", "fix the file, or name the camera"))
            continue
        images.append(image)
        if used in cameras.pixel_mm:
            pixel_mm[name] = cameras.pixel_mm[used]
            focal, own = (
                abs(values[0]) / (MICROMETRES if abs(values[0]) > MICROMETRES else 1.0),
                image.camera.fx * pixel_mm[name],
            )
            if abs(focal - own) > MOST_FOCAL * own and not notes:
                notes.append(
                    f"{path.name}, line {line}: {name} has a focal length of {focal:g} mm, its camera {own:.3f} mm → check --cameras"
                )
    if not images and not left_out:
        raise CatalogError("no image in the file", where=str(path), remedy=AGAIN)
    kept, twice = in_order(images)
    return OrientationModel(kept, left_out=(*left_out, *twice), notes=tuple(notes), pixel_mm=pixel_mm)
