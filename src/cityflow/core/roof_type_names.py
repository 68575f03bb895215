"""Roof types by the code list that CityGML's examples use (SIG 3D, ``_AbstractBuilding_roofType``)."""

from __future__ import annotations

from enum import StrEnum


class RoofType(StrEnum):
    """A roof type; its value is the name used in attributes, edits and evaluations."""

    FLAT = "flat"
    SHED = "shed"
    GABLE = "gable"
    HIP = "hip"
    HALF_HIP = "half-hip"
    MANSARD = "mansard"
    PYRAMID = "pyramid"
    CONE = "cone"
    DOME = "dome"
    SAWTOOTH = "sawtooth"
    BUTTERFLY = "butterfly"
    STEPPED_FLAT = "stepped flat"
    COMPLEX = "complex"
    UNKNOWN = "unknown"


CODES = {
    RoofType.FLAT: "1000", RoofType.SHED: "1010", RoofType.GABLE: "1030", RoofType.HIP: "1040", RoofType.HALF_HIP: "1050",
    RoofType.MANSARD: "1060", RoofType.PYRAMID: "1070", RoofType.CONE: "1080", RoofType.DOME: "1090", RoofType.SAWTOOTH: "1100",
}  # fmt: skip
"""Codes of CityGML's ``roofType``; types without one here are written as 1130 (combination) or 9999 (unknown)."""
