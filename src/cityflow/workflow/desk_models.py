"""Models that a rerun has just made: the page shows them before their textures and the files of the tiles are there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import Ended
from cityflow.flow.records import newest_file
from cityflow.flow.task import Record
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
            self._tell_model(task.unit)
        elif task.stage == self.run().source().city.unit_stage:
            self._units(task.unit)

    def _tell_model(self, unit: str) -> None:
        run = self.run()
        record = newest_file(run.store, reconstruct.NAME, unit)
        if record is not None:
            self.tell({"models": self._triangles(run, [record]), "without": [unit]})

    def _triangles(self, run: Prepared, records: Sequence[Record]) -> Json:
        hulls = [p for record in records for p in record.outputs if p.endswith(HULL)]
        frame = PageFrame.over(run.catalog.reference, self.survey().lattice.bounds)
        return triangles_of((read_feature(run.store.read_bytes(p)) for p in hulls), frame)

    def _units(self, tile: str) -> None:
        """Buildings of a ground tile that another outline, or none, has taken the place of; and those that are there again, whose models stand already."""
        run = self.run()
        record = newest_file(run.store, run.source().city.unit_stage, tile)
        if record is None:
            return
        now = {str(entry["id"]): str(entry["digest"]) for entry in record.result.get("units", [])}
        before = {row["id"] for row in self.list.rows() if row["tile"] == tile}
        with Ledger.open(run.store) as ledger:
            again = [ledger.latest(reconstruct.NAME, unit) for unit in sorted(now.keys() - before)]
        standing = [r for r in again if r is not None and r.inputs.get("outline") == now[r.unit]]
        gone = [*sorted(before - now.keys()), *(r.unit for r in standing)]
        if gone:
            self.tell({"models": self._triangles(run, standing), "without": gone})
