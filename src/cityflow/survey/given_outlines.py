"""Outlines of the catalog, as read and assigned to tiles."""

from __future__ import annotations

from cityflow.flow.task import Record
from cityflow.survey.point_files import stem

ACCURACY = "outline_accuracy"
"""Unit of the stage ``ingest`` that says how exact given outlines are."""
OUTLINES = "outlines"
"""Unit of the stage ``ingest`` that reads given outlines."""


class GivenOutlines:
    """Files of given outlines.

    Attributes
    ----------
    sigma_m : how exact they are by the survey's own buildings (standard deviation); None if unknown
    """

    def __init__(self) -> None:
        self.sigma_m: float | None = None
        self._files: dict[str, dict[str, str]] = {}
        self._beside: dict[str, list[str]] = {}
        self._sampled_from = ""

    def learn(self, record: Record) -> None:
        """Keep what the tasks that read them have left."""
        if record.stage != "ingest":
            return
        if record.unit == OUTLINES:
            self._files = {stem(path): {path: digest} for path, digest in record.outputs.items()}
            self._sampled_from = str(record.result.get("sampled_from", ""))
            self._beside = {str(t): list(map(str, near)) for t, near in record.result.get("beside", {}).items()}
        elif record.unit == ACCURACY:
            self.sigma_m = record.result.get("sigma_m")

    def of(self, tile: str) -> dict[str, str]:
        """Path → digest of those that a tile owns; empty where there are none."""
        return self._files.get(tile, {})

    def beside(self, tile: str) -> dict[str, str]:
        """Path → digest of the files of those tiles whose outlines touch ones of this tile."""
        return {p: d for t in self._beside.get(tile, []) for p, d in self.of(t).items()}

    @property
    def sample(self) -> tuple[str, dict[str, str]]:
        """The LiDAR file that tells how exact they are, and path → digest of outlines that stand in it."""
        return self._sampled_from, self._files.get("sample", {})
