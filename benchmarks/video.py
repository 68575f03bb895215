"""A video that `cityflow synth --video` has rendered, oriented by `cityflow orient`, against its true poses and track.

``python benchmarks/video.py SYNTH CATALOG``: what frames were chosen (none may be blurred, hover twice or come again), how far poses are off as they are placed
and after a similarity, and how far the track is off at the time of every frame of the video.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyogrio.raw
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.evaluation.poses import pose_figures
from cityflow.geometry.similarity import similarity_between
from cityflow.io.catalog.stac import read_catalog
from cityflow.reporting.carrier_track import STEPS, TRACK
from cityflow.reporting.orientation_report import FIGURES
from cityflow.stages.synth.film import TRUTH_PATH, read_truth
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic.video_flight import VideoFrame


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("synth", type=Path)
    parser.add_argument("catalog", type=Path)
    asked = parser.parse_args()
    parameters = SynthParameters.model_validate(json.loads((asked.synth / "synth.json").read_text())["parameters"])
    assert parameters.video is not None
    frames = read_truth((asked.synth / TRUTH_PATH).read_text(), parameters.video)
    report = json.loads((asked.catalog / FIGURES).read_text())
    sequence = report["sequence"]
    number = {name: f["number"] for name, f in sequence["chosen"].items()}
    kinds = Counter(frames[n].kind for n in number.values())
    print(f"{sequence['frames']} frames ({dict(Counter(f.kind for f in frames))}), told apart as {sequence['kinds']}")
    print(
        f"taken: {len(number)} ({dict(kinds)}); a picture twice: {len(number) - len({frames[n].shows for n in number.values()})}"
    )
    found = [
        replace(a.oriented, name=frames[number[a.name]].image.name) for a in read_catalog(str(asked.catalog)).images
    ]
    print(
        f"oriented {len(found)} of {len(number)}, reprojection {report['reprojection_px']:.3f} px, {report['tie_points']} tie points"
    )
    names = {i.name for i in found}
    truth = [f.image for f in frames if f.image.name in names]
    for what, moved in (("as placed", False), ("after a similarity", True)):
        f = pose_figures(found, truth, with_similarity=moved)
        print(
            f"{what}: centres {f.centre_rmse_m:.3f} m (plan {f.plan_rmse_m:.3f}, height {f.height_rmse_m:.3f}), angles {f.angle_rmse_deg:.3f}°, "
            f"scale {f.scale:.5f}, focal length {f.focal_percent:.2f} %"
        )
    knots, times = _track(asked.catalog / TRACK)
    by_name = {t.name: t for t in truth}
    onto = similarity_between(np.array([i.centre for i in found]), np.array([by_name[i.name].centre for i in found]))
    for what, places in (("as placed", knots), ("after a similarity", onto.moved(knots))):
        off = _track_errors(places, times, frames)
        print(
            f"track {what}: {np.sqrt(np.mean(off**2)):.3f} m root mean square, {off.max():.3f} m at most, over {len(off)} frames"
        )


def _track(path: Path) -> tuple[FloatArray, FloatArray]:
    """(K, 3) corners of the track and their (K,) times."""
    meta, _, shapes, columns = pyogrio.raw.read(path, layer=STEPS)
    ends = np.array([shapely.get_coordinates(g, include_z=True) for g in shapely.from_wkb(shapes)])
    rows = dict(zip(meta["fields"], columns, strict=True))
    return np.concatenate([ends[:1, 0], ends[:, 1]]), np.concatenate([rows["start_s"][:1], rows["end_s"]])


def _track_errors(knots: FloatArray, times: FloatArray, frames: Sequence[VideoFrame]) -> FloatArray:
    """Distances of the line, at the time of each frame, from where the carrier was; frames that come again are in no place of theirs."""
    flown = [f for k, f in enumerate(frames) if f.shows == k and times[0] <= f.time_s <= times[-1]]
    when = np.array([f.time_s for f in flown])
    line = np.column_stack([np.interp(when, times, knots[:, k]) for k in range(3)])
    return np.asarray(np.linalg.norm(line - np.array([f.image.centre for f in flown]), axis=1))


if __name__ == "__main__":
    main()
