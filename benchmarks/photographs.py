"""Photographs alone against the model that is given for them: how many are oriented, how well, in what processor time.

``python benchmarks/photographs.py IMAGES MODEL [KEY=VALUE …]``: a folder of photographs without GNSS positions, and a COLMAP model of them. Every task runs
in this process; the mapping in its own, whose time is counted. ``--control FILE`` also writes control and check points: features that many images show,
with the places where the given model has them.
"""

from __future__ import annotations

import argparse
import importlib
import resource
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from cityflow.adjustment.block import Block, residuals
from cityflow.adjustment.tracks import tied
from cityflow.adjustment.triangulation import triangulated
from cityflow.catalog.file_questions import Reading
from cityflow.catalog.photo_folder import PhotoFolder, photo_folder
from cityflow.core.camera import OrientedImage
from cityflow.core.control_points import ControlPoint, ControlPoints, Mark, Role
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task
from cityflow.flow.workspace import Workspace
from cityflow.geometry.similarity import similarity_between
from cityflow.handover.mapped_models import decode_models
from cityflow.handover.source_file import SourceFile
from cityflow.handover.tie_files import decode_features, decode_geometries
from cityflow.io.control_points.point_table_write import point_table_text
from cityflow.io.orientation.colmap import read_colmap
from cityflow.stages.orient import BLOCK, FEATURES
from cityflow.stages.orient.photographs import MAP, MATCHES, PAIRS, Photo, PhotoCamera, PhotoSource
from cityflow.workflow.orient_photographs import photo_parameters

FIRST_VIEWS, MOST_PX = 6, 0.8
"""Control points are made of features that so many images show, with residuals below this in the given model."""
CONTROLS, CHECKS = 8, 5


@dataclass
class Done:
    """Records of all tasks, and processor seconds by stage."""

    store: Store
    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    records: dict[tuple[str, str], Record] = field(default_factory=dict)

    def run(self, task: Task) -> Record:
        begun = _processor_time()
        module, _, name = task.function.partition(":")
        outcome = getattr(importlib.import_module(module), name)(Workspace(self.store, task), task)
        self.seconds[task.stage] += _processor_time() - begun
        record = Record(
            task.stage, task.unit, 1, task.digest, task.version, outcome.status, outcome.reason, outcome.outputs, outcome.result, {}, {}
        )  # fmt: skip
        self.records[task.stage, task.unit] = record
        return record

    def read(self, stage: str, unit: str) -> bytes:
        return self.store.read_bytes(next(iter(self.records[stage, unit].outputs)))


def _processor_time() -> float:
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("images", type=Path)
    parser.add_argument("model", type=Path)
    parser.add_argument("settings", nargs="*")
    parser.add_argument("--control", type=Path, help="write control points here")
    parser.add_argument("--origin", default="0,0,0", help="added to the model's coordinates in that file")
    parser.add_argument("--crs", default="", help="named in that file")
    asked = parser.parse_args()
    given = {Path(i.name).stem: i for i in read_colmap(asked.model).images}
    with tempfile.TemporaryDirectory() as folder:
        found = photo_folder(asked.images, Reading())
        done = _mapped(found, Store.open(folder), asked.settings)
        _told(done, given, read_colmap(asked.model).sparse)
        if asked.control is not None:
            origin = np.array([float(v) for v in asked.origin.split(",")])
            asked.control.write_text(point_table_text(_control(done, given, origin), asked.crs))


def _mapped(found: PhotoFolder, store: Store, settings: list[str]) -> Done:
    photos = tuple(
        Photo(f.name, SourceFile(str(Path(f.path).absolute()), f.size, f.checksum), f.camera, f.looks_at, f.white)
        for f in found.files
    )
    sizes = {f.camera: (f.width, f.height) for f in found.files}
    cameras = tuple(PhotoCamera(*sizes[k], *focal) for k, focal in enumerate(found.focals))
    source = PhotoSource(photos, cameras, photo_parameters(settings), store.read_bytes)
    done, ready = Done(store), list(source.initial())
    while ready:
        task = ready.pop(0)
        ready.extend(source.after(task, done.run(task)))
    return done


def _told(done: Done, given: dict[str, OrientedImage], sparse: Any) -> None:
    models = decode_models(done.read(MAP, BLOCK))
    names = [str(n) for n in done.records[MAP, BLOCK].result["photographs"]]
    model = models[0]
    truth = [given[names[k]] for k in model.numbers]
    ours, theirs = (np.array([i.centre for i in images]) for images in (model.images, truth))
    away = np.linalg.norm(similarity_between(ours, theirs).moved(ours) - theirs, axis=1)
    height = float(np.median(theirs[:, 2]) - np.median(sparse[:, 2]))
    focal = model.images[0].camera.fx / truth[0].camera.fx - 1
    pairs = done.records[PAIRS, BLOCK].result
    used = ", ".join(f"{stage} {done.seconds[stage]:.0f}" for stage in (FEATURES, PAIRS, MATCHES, MAP))
    result = done.records[MAP, BLOCK].result
    print(f"oriented {len(model.images)} of {len(given)} ({len(models)} models, {result['method']} mapping)")
    print(f"pairs tried {pairs['pairs']} of {pairs['possible']}, verified {result['verified_pairs']}")
    print(
        f"tie points {len(model.xyz)} in {model.lengths.mean():.2f} images, mean reprojection error "
        f"{model.reprojection_px:.4f} px over points, {np.average(model.errors_px, weights=model.lengths):.4f} px over observations"
    )
    print(f"focal length {model.images[0].camera.fx:.2f} px, {100 * focal:+.4f} % of the given one")
    print(
        f"centres after a similarity: root mean square {_share(np.sqrt(np.mean(away**2)), height)}, largest {_share(away.max(), height)}"
    )
    print(f"processor time {sum(done.seconds.values()):.0f} s: {used}")


def _share(metres: float, height: float) -> str:
    return f"{metres:.3f} m ({100 * metres / height:.3f} % of {height:.0f} m over the ground)"


def _control(done: Done, given: dict[str, OrientedImage], origin: Any) -> ControlPoints:
    """Points far from each other, in the given model's place, with marks where features were found."""
    names = [str(n) for n in done.records[MAP, BLOCK].result["photographs"]]
    number = {name: k for k, name in enumerate(names)}
    features = [decode_features(done.read(FEATURES, name)) for name in names]
    matches = {
        (number[name], number[other]): pair.matches
        for stage, name in sorted(done.records)
        if stage == MATCHES
        for other, pair in decode_geometries(done.read(MATCHES, name)).items()
    }
    ties = tied(matches, [f.uv for f in features], [f.scale for f in features])
    ties = ties.of_points(ties.lengths >= FIRST_VIEWS)
    block = triangulated(Block.of([given[n] for n in names], np.zeros(3)), ties)
    left = np.linalg.norm(residuals(block, ties)[0], axis=1)
    worst = np.zeros(ties.points)
    np.maximum.at(worst, ties.point, left)
    good = np.flatnonzero(worst < MOST_PX * 2.5)
    chosen = [int(good[np.argmin(block.xyz[good, :2].sum(axis=1))])]
    while len(chosen) < min(CONTROLS + CHECKS, len(good)):
        apart = np.linalg.norm(block.xyz[good, None, :2] - block.xyz[None, chosen, :2], axis=2).min(axis=1)
        chosen.append(int(good[np.argmax(apart)]))
    points = []
    for k, point in enumerate(chosen):
        role = Role.CONTROL if k < CONTROLS else Role.CHECK
        rows = np.flatnonzero(ties.point == point)
        places = np.round(ties.uv[rows], 2).tolist()
        marks = [Mark(f"{names[k]}.jpg", col, row, 0.5) for k, (col, row) in zip(ties.image[rows], places, strict=True)]
        name = f"C{k + 1}" if role is Role.CONTROL else f"K{k + 1 - CONTROLS}"
        xyz = np.round(block.xyz[point] + origin, 2)
        points.append(ControlPoint(name, xyz, (0.05,) * 3, role, tuple(sorted(marks, key=lambda m: m.image))))
    return ControlPoints(tuple(sorted(points, key=lambda p: p.name)))


if __name__ == "__main__":
    main()
