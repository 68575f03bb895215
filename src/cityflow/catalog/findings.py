"""Findings of a catalog check, as text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum


class Level(StrEnum):
    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing to know about the catalog; errors stop a run, warnings lower its result."""

    level: Level
    where: str
    problem: str
    remedy: str = ""

    def __str__(self) -> str:
        advice = f" → {self.remedy}" if self.remedy else ""
        return f"{self.level.upper():7s} {self.where}: {self.problem}{advice}"


@dataclass(frozen=True, slots=True)
class CheckReport:
    """Findings, the gravest first, and a summary of what is there."""

    title: str
    findings: tuple[Finding, ...]
    summary: Mapping[str, str]

    @property
    def has_errors(self) -> bool:
        return any(f.level is Level.ERROR for f in self.findings)

    def of(self, level: Level) -> tuple[Finding, ...]:
        return tuple(f for f in self.findings if f.level is level)

    def text(self) -> str:
        """The report for a terminal."""
        width = max(len(key) for key in self.summary)
        lines = [self.title, *(f"  {key:<{width}}  {value}" for key, value in self.summary.items())]
        lines += ["", *(str(f) for f in self.findings)] if self.findings else []
        counts = [f"{len(self.of(level))} {level}{'s' if len(self.of(level)) != 1 else ''}" for level in Level]
        return "\n".join([*lines, "", "No problems found." if not self.findings else ", ".join(counts)])
