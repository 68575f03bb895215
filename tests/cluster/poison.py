"""A reconstruction method that takes its process down with it."""

from __future__ import annotations

import ctypes

from cityflow.core.reconstruction import Candidate, Evidence


def segmentation_fault(evidence: Evidence, parameters: object = None) -> Candidate:
    ctypes.string_at(0)
    raise AssertionError("unreachable")
