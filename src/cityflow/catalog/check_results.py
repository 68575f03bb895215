"""Intermediate results of a catalog check."""

from __future__ import annotations

from dataclasses import dataclass, field

from cityflow.catalog.findings import Finding, Level
from cityflow.core.building import Outline
from cityflow.errors import CatalogError
from cityflow.io.points.las import Sample
from cityflow.io.points.las_header import LasHeader


@dataclass(slots=True)
class Seen:
    """What reading the files brought to light."""

    findings: list[Finding] = field(default_factory=list)
    headers: dict[str, LasHeader] = field(default_factory=dict)
    samples: dict[str, Sample] = field(default_factory=dict)
    outlines: list[Outline] = field(default_factory=list)
    outside: int = 0
    bad_images: list[str] = field(default_factory=list)

    def say(self, level: Level, where: str, problem: str, remedy: str = "") -> None:
        self.findings.append(Finding(level, where, problem, remedy))

    def fail(self, error: CatalogError, where: str) -> None:
        self.say(Level.ERROR, error.where or where, error.problem, error.remedy)
