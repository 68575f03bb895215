"""Tie points of a block are led onto LiDAR files and a DSM by a task, and images and survey come into one catalog."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from adjustment.survey_scenes import EXTENT, PLACE, houses, measured, moved_away, surface
from cityflow.adjustment.coarse_registration import OF_A_BLOCK, RegistrationParameters, Search
from cityflow.core.building import Status
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.grid import Grid
from cityflow.core.points import PointCloud
from cityflow.errors import CatalogError
from cityflow.evaluation.poses import angle_deg
from cityflow.flow.store import Store
from cityflow.geometry.similarity import Similarity
from cityflow.handover.registration_file import (
    RegistrationResult,
    covariance_matrix,
    decode_registration,
    upper_of,
)
from cityflow.io.catalog.stac import Catalog, read_catalog
from cityflow.io.catalog.stac_assets import ImageAsset
from cityflow.io.crs import crs_of, resolve
from cityflow.io.points.las_write import write_points
from cityflow.io.rasters.raster import write_cog
from cityflow.runs.catalog_fits import Holding
from cityflow.stages.orient.register import encode_tie_points, register_task
from cityflow.workflow.onto import Onto, joined, refuse_other_crs, surveyed
from in_process import outcome_of

CRS = "EPSG:7415"
HIGH = np.array([EXTENT[0] / 2, EXTENT[1] / 2, 80.0]) + PLACE


@lru_cache(maxsize=1)
def _ties() -> tuple[np.ndarray, np.ndarray, Similarity]:
    """Tie points where they are, where the block has them, and what leads from the former to the latter."""
    true = measured(houses(1), 3, 2_000, 0.06, 0.15, 0.03)
    return (true, *moved_away(true, (3.0, -3.0, 2.6), (2.0, -1.5, 1.7), 1.003))


def _scan(folder: Path) -> Catalog:
    """Two LiDAR files that meet in the middle."""
    xyz = measured(houses(1), 2, 50_000, 0.03, 0.03)
    west = xyz[:, 0] < PLACE[0] + EXTENT[0] / 2
    folder.mkdir()
    for name, part in (("west", west), ("east", ~west)):
        (folder / f"{name}.laz").write_bytes(write_points(PointCloud.of(xyz[part]), crs=crs_of(resolve(CRS))))
    return surveyed(Onto((str(folder),)), folder / "work", "", 1, Console(quiet=True))


def _registered(store: Store, xyz: np.ndarray, survey: Catalog, search: Search = OF_A_BLOCK) -> RegistrationResult:
    store.write_bytes("shared/ties.npy", encode_tie_points(xyz))
    outcome = outcome_of(store, register_task("shared/ties.npy", "0" * 64, survey, search))
    assert outcome.status is Status.DONE
    return decode_registration(json.loads(store.read_bytes(next(iter(outcome.outputs)))))


def test_a_block_comes_onto_lidar_files_and_both_stand_in_one_catalog(tmp_path: Path) -> None:
    true, given, by = _ties()
    survey = _scan(tmp_path / "lidar")
    assert [a.name for a in survey.lidar] == ["east", "west"]
    found = _registered(Store.open(str(tmp_path / "run")), given, survey)
    assert np.linalg.norm(found.similarity.moved(given) - true, axis=1).max() < 0.08
    assert found.figures["overlap"] > 0.95
    assert abs(found.figures["scale"] - 1 / 1.003) < 5e-4
    assert found.figures["turn_deg"] == pytest.approx(
        float(np.degrees(np.linalg.norm(np.radians([2.0, -1.5, 1.7])))), abs=0.05
    )
    camera = Camera(800, 600, 900.0, 900.0, 400.0, 300.0)
    up = OrientedImage("west", camera, np.diag([1.0, -1.0, -1.0]), HIGH)
    own = upper_of(np.diag([1e-8] * 3 + [1e-4] * 3))
    off = by.moved_image(up)
    asset = ImageAsset("west", "west.jpg", "0" * 64, 1, (0, 0, 1, 1), off, (0.0, 1.0), pose_covariance=own)
    catalog = replace(survey, lidar=(), images=(asset,))
    both, made = joined(catalog, survey, found, given, {})
    image = both.images[0]
    assert np.linalg.norm(image.oriented.centre - HIGH) < 0.1
    assert angle_deg(image.oriented.rotation, up.rotation) < 0.05
    assert [a.name for a in both.lidar] == ["east", "west-lidar"], "an image is called west already"
    assert image.heights[0] < true[:, 2].min() + 1 < image.heights[1]
    assert image.bounds[0] < HIGH[0] < image.bounds[2]
    assert both.sparse is not None
    assert list(made) == [both.sparse.name]
    assert Holding.of(both).workflow == "workflows/lidar_photos_city.yaml"
    more = covariance_matrix(image.pose_covariance)
    sigmas = np.sqrt(np.diag(more))
    # its own centimetre, and what the registration adds at the height of the flight
    assert (sigmas[3:] > 0.0099).all()
    assert sigmas[5] < 0.06
    assert sigmas[3:5].max() < 0.1
    assert np.linalg.eigvalsh(more).min() > 0


def test_a_block_comes_onto_a_dsm(tmp_path: Path) -> None:
    true, given, _ = _ties()
    grid = Grid(PLACE[0], PLACE[1] + EXTENT[1], 0.5, int(EXTENT[1] * 2), int(EXTENT[0] * 2))
    x, y = grid.centres()
    z = surface(houses(1), np.column_stack([x.ravel(), y.ravel()]) - PLACE[:2]).reshape(grid.shape) + PLACE[2]
    (tmp_path / "dsm.tif").write_bytes(write_cog(z.astype(np.float32), grid, resolve(CRS)))
    survey = surveyed(Onto((str(tmp_path / "dsm.tif"),), CRS), tmp_path / "work", "", 1, Console(quiet=True))
    found = _registered(Store.open(str(tmp_path / "run")), given, survey)
    assert np.linalg.norm(found.similarity.moved(given) - true, axis=1).max() < 0.12


def test_what_is_no_survey_is_refused(tmp_path: Path) -> None:
    console = Console(quiet=True)
    (tmp_path / "notes.txt").write_text("nothing")
    with pytest.raises(CatalogError, match="neither LAS, LAZ, a raster nor outlines"):
        surveyed(Onto((str(tmp_path / "notes.txt"),)), tmp_path / "work", "", 1, console)
    with pytest.raises(CatalogError, match="more than one survey"):
        surveyed(Onto(("a.tif", "b.laz")), tmp_path / "work", "", 1, console)
    delft = Path(__file__).parents[2] / "catalogs" / "delft"
    assert surveyed(Onto((str(delft),)), tmp_path / "work", "", 1, console).lidar == read_catalog(delft).lidar
    with pytest.raises(CatalogError, match="EPSG:25832"):
        refuse_other_crs(resolve("EPSG:25832"), read_catalog(delft))
    far = _ties()[1] + 5_000.0
    store = Store.open(str(tmp_path / "run"))
    store.write_bytes("shared/ties.npy", encode_tie_points(far))
    with pytest.raises(CatalogError, match="no point of the survey lies within 30 m"):
        outcome_of(store, register_task("shared/ties.npy", "0" * 64, _scan(tmp_path / "lidar"), OF_A_BLOCK))


def test_what_is_stated_of_the_search_counts() -> None:
    asked = RegistrationParameters(shift_m=80.0).search(OF_A_BLOCK)
    assert asked == Search(OF_A_BLOCK.yaw_deg, OF_A_BLOCK.scale, 80.0)
    assert RegistrationParameters().search(OF_A_BLOCK) == OF_A_BLOCK
