"""All pictures of the report of a run, as far as the run has come."""

from __future__ import annotations

from collections.abc import Sequence

from cityflow.flow.store import Store
from cityflow.stages.survey import Survey
from cityflow.viewer.picture import Picture
from cityflow.viewer.rows import UnitRow
from cityflow.workflow.current import CurrentRecords
from cityflow.workflow.model_pictures import model_pictures
from cityflow.workflow.outline_pictures import outline_pictures
from cityflow.workflow.raster_pictures import city_rasters, frame_pictures


def run_pictures(
    store: Store, survey: Survey, units: Sequence[UnitRow], records: CurrentRecords
) -> tuple[Picture, ...]:
    """Models, outlines, surface, ortho, classes, terrain and oblique orthos; none where no tile has a surface yet."""
    rasters = city_rasters(store, survey, records)
    if rasters is None:
        return ()
    models = model_pictures(store, units, records, rasters)
    plans = outline_pictures(store, survey, units, records)
    return (*models, *plans, *rasters.pictures(), *frame_pictures(store, survey, records))
