"""Photographs without poses, led onto a survey: from where GNSS positions, a stated height or nothing has put them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cityflow.adjustment.coarse_registration import BY_GNSS, BY_NOTHING, BY_SCALE, Search
from cityflow.adjustment.placing import placed
from cityflow.catalog.create import SurveyFiles
from cityflow.core.photo_metadata import PhotoMetadata
from cityflow.handover.registration_file import RegistrationResult, covariance_matrix, upper_of
from cityflow.io.catalog.stac import Catalog
from cityflow.reporting.orientation_words import registration_words
from cityflow.workflow.gnss_places import FEWEST
from cityflow.workflow.photo_adjusting import Adjustment
from cityflow.workflow.photo_placing import Placed, Placing


def placing_before(placing: Placing, survey: Catalog, photos: Sequence[PhotoMetadata]) -> Placing:
    """Where the search begins: GNSS positions in the survey's CRS where there are enough, else a frame of the photographs' own.

    Parameters
    ----------
    photos : those whose GNSS positions can be true
    """
    if placing.scale_m is not None or placing.local:
        return placing
    heights = [p for p in photos if p.position is not None and p.position.height_m is not None]
    if survey.reference.is_local or len(heights) < FEWEST:
        return replace(placing, local=True)
    return replace(placing, crs=survey.reference.code)


def usual_search(placing: Placing) -> Search:
    """How far photographs may be off after that."""
    if placing.scale_m is not None:
        return BY_SCALE
    return BY_NOTHING if placing.local else BY_GNSS


def moved_onto(put: Placed, by: RegistrationResult, survey: Catalog) -> Placed:
    """The model in the CRS of the survey."""
    lines = (*(put.lines if put.crs == survey.reference.code else ()), *registration_words(by.figures))
    before = put.figures if put.figures["by"] not in ("local", "scale") else {}
    figures = {**before, "by": "registration", "registration": dict(by.figures)}
    images, xyz = placed(put.images, by.similarity), by.similarity.moved(put.xyz)
    return replace(put, images=images, xyz=xyz, crs=survey.reference.code, figures=figures, lines=lines)


def moved_adjustment(found: Adjustment | None, by: RegistrationResult) -> Adjustment | None:
    """Poses, their covariances and tie points of an adjustment, moved alike."""
    if found is None:
        return None
    poses = {}
    for name, pose in found.poses.items():
        image = by.similarity.moved_image(pose.image)
        covariance = upper_of(by.covariance_of(image, covariance_matrix(pose.covariance)))
        poses[name] = replace(pose, image=image, covariance=covariance)
    points = found.points.copy()
    points[:, :3] = by.similarity.moved(points[:, :3])
    return replace(found, poses=poses, points=points)


def files_of(survey: Catalog | None) -> SurveyFiles:
    """Files of a survey, for a catalog that has them and the photographs."""
    if survey is None:
        return SurveyFiles()
    given, dsm, dtm = survey.outlines, survey.rasters.get("dsm"), survey.rasters.get("dtm")
    return SurveyFiles(
        lidar=[a.href for a in survey.lidar],
        outlines=given.href if given else None,
        dsm=dsm.href if dsm else None,
        dtm=dtm.href if dtm else None,
        orthos=[r.href for r in survey.rasters.values() if r.kind == "ortho"],
        id_column=given.id_column if given else None,
        id_format=given.id_format if given else None,
        layer=given.layer if given else None,
    )
