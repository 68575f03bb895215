"""JSON forms of the project's values in the inputs of tasks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import PlainSerializer, PlainValidator

from cityflow.core.camera import OrientedImage
from cityflow.core.edits import Edits
from cityflow.core.local_frame import LocalFrame
from cityflow.flow.task import Json
from cityflow.handover.oriented import of_json, to_json

V = TypeVar("V")


def frame_to_json(frame: LocalFrame) -> dict[str, Json]:
    """Name, rotation and origin; who needs the images of its cluster has them from elsewhere."""
    return {"name": frame.name, "rotation": frame.frame_from_world.tolist(), "origin": frame.origin.tolist()}


def frame_of_json(tree: Mapping[str, Any]) -> LocalFrame:
    """What `frame_to_json` wrote."""
    return LocalFrame(tree["name"], np.array(tree["rotation"], np.float64), np.array(tree["origin"], np.float64))


def _reader(read: Callable[[Any], V]) -> PlainValidator:
    """One whose complaints name the field."""

    def checked(tree: object) -> V:
        try:
            return read(tree)
        except (KeyError, TypeError, IndexError) as error:
            raise ValueError(f"{type(error).__name__}: {error}") from error

    return PlainValidator(checked)


OrientedField = Annotated[OrientedImage, _reader(of_json), PlainSerializer(to_json)]
"""An image with its camera and pose."""

FrameField = Annotated[LocalFrame, _reader(frame_of_json), PlainSerializer(frame_to_json)]
"""A local reference frame without its images."""

EditsField = Annotated[Edits, _reader(Edits.from_lines), PlainSerializer(Edits.lines)]
"""What a person has drawn, a line of text for each edit."""
