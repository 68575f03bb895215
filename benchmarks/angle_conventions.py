"""Angles of a real flight, written in several conventions and off by some noise: which reading `catalog create` takes, and in what processor time.

``python benchmarks/angle_conventions.py CATALOG [--noise DEG …] [--seeds N]``: a catalog of oriented images of one camera, whose poses count as true. Noise:
standard deviation of the rotations about each axis.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from cityflow.adjustment.block import rotation_of
from cityflow.catalog.file_questions import Reading
from cityflow.catalog.height_ranges import given_heights
from cityflow.catalog.image_files import ImageFiles, sizes_of
from cityflow.catalog.orientation import ImageSource, read_model
from cityflow.catalog.tried_angles import AngleTable, TriedAngles, with_tried_angles
from cityflow.core.arrays import FloatArray
from cityflow.geometry.rotations import PHOTO_FLIP, omega_phi_kappa
from cityflow.io.catalog.stac import Catalog, read_catalog


def phi_first(rotation: FloatArray) -> FloatArray:
    """Omega, phi, kappa in degrees of a table whose first rotation is phi."""
    m = (PHOTO_FLIP @ rotation).T
    return np.asarray(np.degrees([np.arcsin(-m[1, 2]), np.arctan2(m[0, 2], m[2, 2]), np.arctan2(m[1, 0], m[1, 1])]))


CONVENTIONS: Mapping[str, Callable[[FloatArray], FloatArray]] = {
    "omega-phi-kappa, degrees": lambda r: np.degrees(omega_phi_kappa(r)),
    "omega-phi-kappa, grads": lambda r: np.degrees(omega_phi_kappa(r)) / 0.9,
    "omega-phi-kappa, radians": lambda r: np.array(omega_phi_kappa(r)),
    "phi-omega-kappa, degrees": phi_first,
    "signs turned": lambda r: -np.degrees(omega_phi_kappa(r)),
    "transposed": lambda r: np.degrees(omega_phi_kappa(r.T)),
}


def main() -> None:
    """A line for each convention and noise."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("catalog")
    parser.add_argument("--noise", type=float, nargs="*", default=[0.0, 0.1, 0.3], help="degrees")
    parser.add_argument("--seeds", type=int, default=1)
    asked = parser.parse_args()
    catalog = read_catalog(asked.catalog, allow_outside=True)
    for noise in asked.noise:
        for name, write in CONVENTIONS.items():
            right, seconds, notes = 0, 0.0, []
            for seed in range(asked.seeds):
                with tempfile.TemporaryDirectory() as folder:
                    begun = time.process_time()
                    found, given = tried(Path(folder), catalog, write, noise, seed)
                    seconds += time.process_time() - begun
                right += off_deg(found, given) < 1e-4
                notes += list(found.notes)
            print(
                f"{noise:g}° {name}: {right} of {asked.seeds} right, {seconds / asked.seeds:.1f} s; {notes[0]}",
                flush=True,
            )


def tried(
    folder: Path, catalog: Catalog, write: Callable[[FloatArray], FloatArray], noise: float, seed: int
) -> tuple[TriedAngles, dict[str, FloatArray]]:
    """What is found, and the rotations that the table means."""
    rng, camera = np.random.default_rng(seed), catalog.images[0].oriented.camera
    given, lines = {}, ["name,x,y,z,omega,phi,kappa"]
    for asset in catalog.images:
        turn = rotation_of(np.radians(rng.normal(0, noise, (1, 3))))[0]
        given[Path(asset.href).name] = turn @ asset.oriented.rotation
        values = [*asset.oriented.centre, *write(given[Path(asset.href).name])]
        lines.append(",".join([Path(asset.href).name, *(f"{v:.9f}" for v in values)]))
    (folder / "angles.csv").write_text("\n".join(lines) + "\n")
    first = camera.distortion[0] if camera.distortion else 0.0
    (folder / "cameras.csv").write_text(
        f"id,width,height,focal_px,k1\nc,{camera.width},{camera.height},{camera.fx},{first}\n"
    )
    heights = min(a.heights[0] for a in catalog.images), max(a.heights[1] for a in catalog.images)
    options = {"cameras": str(folder / "cameras.csv")}
    source = ImageSource(Path(catalog.images[0].href).parent, {"opk": folder / "angles.csv"}, options, heights=heights)
    files = ImageFiles.of(source.folder)
    model = read_model(source, catalog.reference, sizes_of(files))
    table = AngleTable(source, catalog.reference, files)
    return with_tried_angles(table, model, given_heights(*heights), Reading()), given


def off_deg(found: TriedAngles, given: Mapping[str, FloatArray]) -> float:
    """The largest angle between rotations as they are taken and as they are meant."""
    cosines = [(np.trace(i.rotation @ given[i.name].T) - 1) / 2 for i in found.model.images]
    return float(np.degrees(np.arccos(np.clip(min(cosines), -1, 1))))


if __name__ == "__main__":
    main()
