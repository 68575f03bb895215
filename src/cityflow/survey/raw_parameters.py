"""Parameters of raw images: sensor format, calibration frames, processing."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from cityflow.core.camera import OrientedImage
from cityflow.core.parameters import Parameters
from cityflow.imagery.raw_calibration import CalibrationParameters
from cityflow.imagery.raw_frames import Pattern
from cityflow.imagery.resampling import pinhole_within
from cityflow.io.catalog.stac_assets import ImageAsset

Homography = tuple[float, float, float, float, float, float, float, float, float]

MOST_SATURATED = 0.01
"""Flat frames with a greater share of saturated pixels are refused; set by hand."""


class CalibrationFrames(Parameters):
    """Frames of each camera with closed shutter, and of an evenly lit surface."""

    folder: str = Field(".", description="folder or URL; relative to the catalog's folder")
    camera: str = Field(
        r"([^_]+)$", description="regular expression whose first group is, in an image's name, that of its camera"
    )
    dark: str = Field(
        "{camera}_dark*.tif", description="names of a camera's dark frames in the folder; * stands for anything"
    )
    flat: str = Field("{camera}_flat*.tif", description="names of a camera's flat frames in the folder")
    sensor: CalibrationParameters = CalibrationParameters()

    @model_validator(mode="after")
    def _names_work(self) -> CalibrationFrames:
        try:
            groups = re.compile(self.camera).groups
        except re.error as error:
            raise ValueError(f"camera is no regular expression: {error}") from error
        if groups < 1:
            raise ValueError("camera has no group; put parentheses around what names the camera")
        if any("{camera}" not in pattern for pattern in (self.dark, self.flat)):
            raise ValueError("dark and flat must hold {camera}, or all cameras would share their frames")
        return self

    def camera_of(self, image: str) -> str:
        """Name of the camera that took an image; empty where the image's name does not tell."""
        found = re.search(self.camera, image)
        return found.group(1) or "" if found else ""


class InfraredFrames(Parameters):
    """Pictures of a near-infrared head that looks where the colour head looks."""

    folder: str = Field(".", description="folder or URL; relative to the catalog's folder")
    file: str = Field("{image}_nir.tif", description="name of an image's near-infrared picture in the folder")
    infrared_from_colour: Homography = Field(
        (1, 0, 0, 0, 1, 0, 0, 0, 1),
        description="homography, row by row, from the colour image as it was taken to the infrared one; pixels from the corner of the first",
    )

    @model_validator(mode="after")
    def _names_work(self) -> InfraredFrames:
        if "{image}" not in self.file:
            raise ValueError("file must hold {image}, or all images would share one near-infrared picture")
        return self


class RawInput(Parameters):
    """What is done to images before anything else; by default they are pictures already."""

    pattern: Pattern | None = Field(
        None, description="colours of the first 2 x 2 pixels of raw frames; null: images are pictures"
    )
    bits: Literal[8, 10, 12, 14, 16] | None = Field(
        None, description="bits of a value in its container of 8 or 16; null: all, and values stay as they are"
    )
    left_aligned: bool = Field(False, description="the container's highest bits hold the value, not its lowest")
    calibration: CalibrationFrames | None = Field(None, description="dark and flat frames of the cameras; null: none")
    undistort: bool = Field(
        False,
        description="make pinhole images; false: matching and orthos remove distortion in their own resampling",
    )
    near_infrared: InfraredFrames | None = Field(
        None, description="pictures of a near-infrared head, to be the fourth band; null: none"
    )

    @model_validator(mode="after")
    def _alignment_is_known(self) -> RawInput:
        if self.left_aligned and self.bits is None:
            raise ValueError("left_aligned says nothing without bits")
        return self

    @property
    def is_nothing(self) -> bool:
        """Images are taken as they are."""
        return self == RawInput()

    @property
    def makes_16_bits(self) -> bool:
        """Values are linear numbers of full range afterwards."""
        return self.pattern is not None or self.bits is not None or self.calibration is not None

    def bands_of(self, stored: int) -> int:
        """Bands of an image that is stored with so many."""
        return (3 if self.pattern else stored) + (self.near_infrared is not None)

    def developed(self, image: OrientedImage) -> OrientedImage:
        """How the image that later stages read was taken."""
        return replace(image, camera=pinhole_within(image.camera)) if self.undistort else image

    def balance_of(self, asset: ImageAsset) -> ImageAsset:
        """The asset with the gains that its developed image takes: those of a catalog were found on the numbers in its file."""
        gain, gamma, shoulder = asset.gain, asset.gamma, asset.shoulder
        if self.bits is not None and not self.left_aligned:
            wider = 2.0 ** (8 * np.dtype(asset.dtype).itemsize - self.bits)
            shoulder /= wider
            gain = _each(gain, len(gamma)) if gamma else gain
            gain = tuple(float(g * wider ** (1.0 - c)) for g, c in zip(gain, gamma or (1.0,) * len(gain), strict=True))
        if self.near_infrared is not None:
            # nothing is known of the other head's exposures
            gain, gamma = (*_each(gain, 3), 1.0), (*_each(gamma, 3), 1.0) if gamma else ()
        return replace(asset, gain=gain, gamma=gamma, shoulder=shoulder)

    def dtype_of(self, stored: str) -> str:
        return "uint16" if self.makes_16_bits else stored


def _each(values: tuple[float, ...], bands: int) -> tuple[float, ...]:
    """One number for each band: a single one is for all, none is 1."""
    return values if len(values) == bands else (values or (1.0,))[:1] * bands
