"""Colours of points in each image of a survey: images decoded at a coarse level, each in a task of its own."""

from __future__ import annotations

import hashlib
import io
from dataclasses import dataclass

import numpy as np

from cityflow.catalog.file_questions import Question
from cityflow.catalog.kept_answers import state_of
from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.imagery.colour_samples import PointColours, SampleParameters, point_colours
from cityflow.io.images.coarse_image import coarse_image

VERSION = 1
"""Raise it when other colours are found: what was kept before is then looked up again."""

ARRAYS = ("point", "log_colour", "radius2", "burnt")
"""Fields of `PointColours`, in their order."""


@dataclass(frozen=True, slots=True)
class ColourJob:
    """An image, (N, 3) points that it may show, world metres, and how their colours are taken; `white` as in `point_colours`."""

    href: str
    image: OrientedImage
    xyz: FloatArray
    parameters: SampleParameters
    white: float = 0.0


def colours_in(job: ColourJob) -> PointColours:
    """Raises CatalogError where the image is damaged."""
    return point_colours(job.image, coarse_image(job.href, job.parameters.level), job.xyz, job.parameters, job.white)


def _key(job: ColourJob) -> str:
    state = state_of(job.href)
    arrays = hashlib.sha256(b"".join(a.tobytes() for a in (job.xyz, job.image.rotation, job.image.centre))).hexdigest()
    how = f"{job.image.camera} {job.parameters.model_dump_json()} {job.white}"
    return f"colours {VERSION} {job.href} {state} {arrays} {how}" if state else ""


def _pack(colours: PointColours) -> bytes:
    out = io.BytesIO()
    np.savez(out, **{name: getattr(colours, name) for name in ARRAYS})
    return out.getvalue()


def _unpack(data: bytes) -> PointColours:
    with np.load(io.BytesIO(data)) as found:
        return PointColours(*(found[name] for name in ARRAYS))


COLOURS = Question("images, for their colours", colours_in, _key, _pack, _unpack)
