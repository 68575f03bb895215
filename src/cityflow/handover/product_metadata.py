"""Metadata of all products of a survey, in the inputs of tasks."""

from __future__ import annotations

from dataclasses import dataclass

from cityflow.flow.typed import TaskInputs


@dataclass(frozen=True, slots=True)
class ProductMetadata(TaskInputs):
    """Code of the CRS, title, date of the newest survey (YYYY-MM-DD, empty where unknown), licence and attribution."""

    crs: str
    title: str
    date: str
    licence: str
    attribution: str
