"""The parameters of a whole workflow: those of the algorithms, and the limits of every stage of the pipeline."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from pydantic import create_model

from cityflow.evaluation.changes import ChangeParameters
from cityflow.pipeline.pipeline import PIPELINE
from cityflow.survey.survey_parameters import ExecutionParameters, StageLimits, SurveyParameters

if TYPE_CHECKING:
    Execution = ExecutionParameters
else:
    Execution = create_model(
        "ExecutionParameters",
        __base__=ExecutionParameters,
        **{stage.name: (StageLimits, StageLimits(**asdict(stage.limits))) for stage in PIPELINE},
    )


class CityParameters(SurveyParameters):
    """All parameters of a run, by stage."""

    changes: ChangeParameters = ChangeParameters()
    execution: Execution = Execution()
