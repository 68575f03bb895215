"""Models that a rerun has just made: the page shows them before their textures and the files of the tiles are there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cityflow.flow.progress import Ended
from cityflow.flow.records import newest_file
from cityflow.io.city_models.cityjson import read_feature
from cityflow.reporting.compared import triangles_of
from cityflow.reporting.desk_list import DeskList
from cityflow.reporting.view_frame import PageFrame
from cityflow.runs.prepare import Prepared
from cityflow.stages import reconstruct
from cityflow.survey.results import HULL
from cityflow.survey.survey import Survey

Json = Any


@dataclass
class NewModels:
    """Tells pages what each task of a rerun changes in the scene.

    Attributes
    ----------
    run, survey : the RUN as it is now
    list : buildings of which the tiles know
    tell : hears of `models`: triangles as `reporting.compared.triangles_of` gives them, by building; `without`: buildings whose models of before are no more
    """

    run: Callable[[], Prepared]
    survey: Callable[[], Survey]
    list: DeskList
    tell: Callable[[Json], None]

    def ended(self, task: Ended) -> None:
        """Hear of a task that has ended; its record is read from its file, since the index of the ledger is the driver's."""
        if task.stage == reconstruct.NAME:
            self._model(task.unit)
        elif task.stage == self.run().source().city.unit_stage:
            self._units(task.unit)

    def _model(self, unit: str) -> None:
        run = self.run()
        record = newest_file(run.store, reconstruct.NAME, unit)
        if record is None:
            return
        hulls = [p for p in record.outputs if p.endswith(HULL)]
        frame = PageFrame.over(run.catalog.reference, self.survey().lattice.bounds)
        models = triangles_of((read_feature(run.store.read_bytes(p)) for p in hulls[:1]), frame)
        self.tell({"models": models, "without": [unit]})

    def _units(self, tile: str) -> None:
        """Buildings of a ground tile that another outline, or none, has taken the place of."""
        run = self.run()
        record = newest_file(run.store, run.source().city.unit_stage, tile)
        if record is None:
            return
        now = {str(entry["id"]) for entry in record.result.get("units", [])}
        gone = [row["id"] for row in self.list.rows() if row["tile"] == tile and row["id"] not in now]
        if gone:
            self.tell({"models": [], "without": gone})
