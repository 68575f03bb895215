"""Results of BINGO (``itera.dat``): a line ``ORIA`` for each image and ``CORD`` for each point.

``ORIA image X Y Z phi omega kappa [camera]``: grads, phi before omega, all right-handed (`geometry.rotations.from_phi_omega_kappa`). BINGO's own
description of cameras (``geoin.dat``) has no pixels, so these are named with ``--cameras``; its focal length is compared with theirs.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cityflow.errors import CatalogError
from cityflow.geometry.rotations import AngleUnit, RotationOrder, from_angles
from cityflow.io.orientation.camera_table import CameraTable, named_cameras
from cityflow.io.orientation.model_text import numbers, read_lines
from cityflow.io.orientation.oriented_images import LeftOut, OrientationModel, in_order
from cityflow.io.orientation.readers import OrientationFile, choice

AGAIN = "name BINGO's file itera.dat"
MOST_FOCAL = 1e-3
"""Share by which two focal lengths of one camera may differ; set by hand."""


def read(given: OrientationFile) -> OrientationModel:
    """For `readers.READERS`; options ``cameras``, ``angle_unit``, ``rotation_order``."""
    cameras = named_cameras(given.options, given.path)
    unit = choice(AngleUnit, given.options, "angle_unit", AngleUnit.GRAD)
    order = choice(RotationOrder, given.options, "rotation_order", RotationOrder.PHI_OMEGA_KAPPA)
    images, left_out, points = [], [], []
    pixel_mm: dict[str, float] = {}
    for line, text in enumerate(read_lines(given.path, AGAIN), 1):
        key, *fields = text.split() or [""]
        try:
            if key == "CORD":
                points.append(numbers(fields[1:], 3, f"point {fields[0] if fields else ''}"))
            elif key == "ORIA":
                values = numbers(fields[1:], 6, "the orientation")
                camera = fields[7] if len(fields) > 7 and fields[7] in cameras.cameras else ""
                first, second, third = (a * unit.radians for a in values[3:])
                rotation = from_angles(first, second, third, order)
                image, used = cameras.image(fields[0], camera, rotation, np.array(values[:3]))
                images.append(image)
                pixel_mm |= {image.name: cameras.pixel_mm[used]} if used in cameras.pixel_mm else {}
        except ValueError as error:
            name = fields[0] if fields else f"line {line}"
            left_out.append(
                LeftOut(name, f"{given.path.name}, line {line}: {error}", "fix the file, or name the camera")
            )
    if not images and not left_out:
        raise CatalogError("no line ORIA in the file", where=str(given.path), remedy=AGAIN)
    kept, twice = in_order(images)
    sparse = np.array(points, np.float64).reshape(-1, 3)
    return OrientationModel(
        kept, sparse, (*left_out, *twice), _other_focal(given.path.with_name("geoin.dat"), cameras), pixel_mm
    )


def _other_focal(path: Path, cameras: CameraTable) -> tuple[str, ...]:
    """A note where the focal length of ``CAPA`` beside is none of the cameras'."""
    known = [cameras.cameras[n].fx * mm for n, mm in cameras.pixel_mm.items() if n in cameras.cameras]
    if not path.is_file() or not known:
        return ()
    for text in read_lines(path, AGAIN):
        fields = text.split()
        if len(fields) > 3 and fields[0] == "CAPA":
            try:
                (focal,) = numbers(fields[3:], 1, "CAPA")
            except ValueError:
                continue
            if all(abs(abs(focal) - f) > MOST_FOCAL * f for f in known):
                listed = ", ".join(f"{f:.3f}" for f in known)
                return (
                    f"{path.name} has a focal length of {abs(focal):g} mm, the cameras {listed} mm → check --cameras",
                )
    return ()
