"""``cityflow orient`` for photographs: the placed model is adjusted with GNSS positions and control points, as a task with a record."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Status
from cityflow.core.control_points import ControlPoints
from cityflow.core.json_values import rounded
from cityflow.errors import RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.flow.task import Record, digest_of
from cityflow.handover.known_points import known_points
from cityflow.handover.refined_block import RefinedPose, decode_points, decode_poses
from cityflow.io.catalog.stac_assets import ImageAsset
from cityflow.io.tables.feature_ids import listing
from cityflow.orientation.stations import stations
from cityflow.reporting.adjustment_words import OF_AN_IMAGE
from cityflow.reporting.orientation_words import control_lines
from cityflow.stages.orient import ADJUST, BLOCK, BLOCK_FILE, FEATURES, POINTS_FILE
from cityflow.stages.orient.georeference import GeoreferenceInputs, GeoreferenceSource, PlacedImage
from cityflow.workflow.gnss_places import GNSS, GnssPlaces
from cityflow.workflow.orient import run_stages
from cityflow.workflow.photo_placing import Placed


@dataclass(frozen=True, slots=True)
class Known:
    """What is known beside the images.

    Attributes
    ----------
    gnss : positions;  control : points whose marks name the images
    arm : the antenna's place in the frame of the camera
    taken : by the images' names, time of exposure as files have it
    """

    gnss: GnssPlaces | None
    control: ControlPoints | None
    arm: tuple[float, float, float] | None
    taken: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Adjustment:
    """What the adjustment found: the record's figures, poses by the images' names, the block as its task wrote it, and the table of its tie points."""

    summary: Mapping[str, Any]
    poses: Mapping[str, RefinedPose]
    block: Mapping[str, Any]
    points: FloatArray

    @property
    def is_taken(self) -> bool:
        """Whether the adjusted poses are used: they do not contradict tie points that were kept out."""
        return bool(self.summary["taken"])


def adjusted_model(
    put: Placed,
    cameras: Mapping[str, int],
    known: Known,
    mapping: Record,
    store: Store,
    scheduler: str,
    workers: int,
) -> tuple[Placed, Adjustment | None]:
    """The placed model after its adjustment, and that; as it was and None where neither positions nor control points are known.

    Parameters
    ----------
    cameras : number of each image's camera
    mapping : its record

    Raises
    ------
    RunError
        The block could not be adjusted.
    """
    gnss, control, arm = known.gnss, known.control, known.arm
    names = [i.name for i in put.images]
    place = {} if gnss is None else {n: k for k, n in enumerate(gnss.names) if n in set(names) - put.unused}
    points = () if control is None else known_points(control.points)
    if not place and not points:
        return put, None
    with Ledger.open(store) as ledger:
        features = {n: r for n in names if (r := ledger.latest(FEATURES, n)) is not None}
        together = stations(names, [cameras[n] for n in names], [known.taken.get(n, "") for n in names])
        images = tuple(
            PlacedImage(
                replace(i, head=str(cameras[i.name])), next(iter(features[i.name].outputs)),
                _row(gnss.xyz[place[i.name]]) if gnss is not None and i.name in place else None,
                _row(gnss.sigmas_m[place[i.name]]) if gnss is not None and i.name in place else None, station,
            )
            for i, station in zip(put.images, together, strict=True)
        )  # fmt: skip
        models, digest = next(iter(mapping.outputs.items()))
        digests = (str(digest), *(digest_of(list(features[n].outputs.values())) for n in names))
        asked = GeoreferenceInputs(images, models, arm, put.on_line, points, dict(put.wrong))
        run_stages(GeoreferenceSource(asked, digests), {ADJUST: 1}, store, ledger, scheduler, workers)
        record = ledger.latest(ADJUST, BLOCK)
    if record is None or record.status is Status.FAILED:
        reason = record.reason if record is not None else "it did not run"
        raise RunError(f"the block could not be adjusted: {reason}", where=ADJUST, remedy="see docs/orient.md")
    outputs = {Path(path).name: path for path in record.outputs}
    block = json.loads(store.read_bytes(outputs[BLOCK_FILE]))
    poses = {n: replace(p, image=replace(p.image, head="")) for n, p in decode_poses(block).items()}
    table = decode_points(store.read_bytes(outputs[POINTS_FILE]))
    found = Adjustment(dict(record.result), poses, block, table)
    if not found.is_taken:
        return put, found
    return replace(put, images=tuple(poses[n].image for n in names), xyz=table[:, :3]), found


def _row(values: Any) -> tuple[float, float, float] | None:
    one, two, three = (float(v) for v in values)
    return (one, two, three) if np.isfinite([one, two, three]).all() else None


def with_covariances(assets: Sequence[ImageAsset], found: Adjustment) -> tuple[ImageAsset, ...]:
    """Images of a catalog with the covariances of their poses."""
    return tuple(
        replace(a, pose_covariance=found.poses[a.name].covariance) if a.name in found.poses else a for a in assets
    )


def add_adjustment(report: dict[str, Any], found: Adjustment) -> None:
    """Into orientation.json: figures of the whole and of each image, cameras with their standard deviations."""
    if not found.is_taken:
        report["refused_adjustment"] = dict(found.summary)
        return
    report["summary"] = dict(found.summary)
    report["adjusted_cameras"] = found.block["cameras"]
    report["images"] = {i["name"]: {key: i[key] for key in OF_AN_IMAGE} for i in found.block["images"]}
    report["weak"] = sorted({*report["weak"], *found.summary["weak"]})
    sigmas = {c["head"]: c["focal_sigma_percent"] / 100 for c in found.block["cameras"]}
    for camera in report["cameras"]:
        head = str(camera["number"])
        is_held = head in found.summary["held_focals"]
        camera["focal_sigma_px"] = None if is_held else rounded(sigmas[head] * camera["focal_px"], 3)


def adjustment_lines(found: Adjustment) -> Iterator[str]:
    """What the adjustment found, in lines for people."""
    s = found.summary
    if not s["taken"]:
        yield (
            f"{GNSS} and control points contradict the images: tie points that were kept out fit worse ({s['check_before_px']:.2f} → "
            f"{s['check_after_px']:.2f} px) → poses stay as the similarity has them; check positions, marks and their CRS"
        )
        return
    by = [f"{s['positions']} {GNSS}"] if s["positions"] else []
    points = [p for p in s["control"]["points"] if p["role"] == "control" and p["used"]] if "control" in s else []
    by += [f"{len(points)} control points"] if points else []
    yield (
        f"Adjusted with {' and '.join(by)}: tie points that were kept out {s['check_before_px']:.2f} → {s['check_after_px']:.2f} px, "
        f"centres move by {s['median_move_m'] * 100:.1f} cm in the median"
    )
    if s["positions"]:
        yield f"{GNSS} are exact to {s['position_sigma_m']:.2f} m per axis in plan (estimated; 1.5 times that in height where files state nothing)"
    if s["positions_far"]:
        yield f"{GNSS} far off where the images have them, with less weight: {listing(s['positions_far'])}"
    for arm in s["arms"]:
        exact = f" ± {_metres(arm['sigmas_m'])}" if any(arm["sigmas_m"]) else ""
        yield f"Antenna of camera {int(arm['head']) + 1}: {_metres(arm['arm_m'])}{exact} m from the projection centre (right, down, ahead in the picture)"
    if s["mounts"] is not None:
        yield (
            f"{s['mounts']['heads']} heads that fire together are held by their mount, which gives way by {s['mounts']['angle_sigma_deg']:.4f}° and "
            f"{s['mounts']['offset_sigma_m'] * 100:.1f} cm (estimated)"
        )
    if "control" in s:
        lines = list(control_lines(s["control"]))
        # a shift of positions is told only where there are some
        yield from lines if s["positions"] else lines[:-1]


def _metres(values: Sequence[float]) -> str:
    return ", ".join(f"{v:.3f}" for v in values)
