"""What the driver knows of a small flight, and images that do not fit the others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pydantic import ValidationError

from cityflow.io.catalog.stac import read_catalog
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.survey.image_survey import ImageSurvey
from cityflow.survey.survey import Survey
from cluster.small_flight import GSD_M, WORKFLOW, make_flight


def parameters(**tiles: float) -> CityParameters:
    tree = {k: v for k, v in WORKFLOW.items() if k != "name"}
    return CityParameters.model_validate({**tree, "tiles": {"tile_m": 50, **tiles}})


def test_a_grey_image_among_coloured_ones_is_left_out_by_name(tmp_path: Path) -> None:
    flight = make_flight(tmp_path / "flight", described=False)
    Image.open(flight.image("n1")).convert("L").save(flight.image("n1"))
    notes = " ".join(flight.describe(gains=False).notes)
    assert "n1.jpg" in notes or "n1:" in notes
    assert "1 band of 8 bits" in notes
    assert {a.bands for a in read_catalog(flight.catalog).images} == {3}


def surveyed_places(survey: ImageSurvey) -> set[tuple[float, float]]:
    """Places of the driver's lattice in the tiles that the survey works on where it has been."""
    found = set[tuple[float, float]]()
    for tile in survey.tiles.values():
        places = survey.places_in(tile.bounds)
        rows, cols = np.nonzero(survey.is_surveyed(places, [tile]))
        x, y = places.x_centres()[cols], places.y_centres()[rows]
        found.update(zip(x.tolist(), y.tolist(), strict=True))
    return found


def test_surveyed_ground_does_not_depend_on_the_tiles(tmp_path: Path) -> None:
    flight = make_flight(tmp_path / "flight", described=False)
    flight.describe(gains=False)
    catalog = read_catalog(flight.catalog)
    small, middle, large = (ImageSurvey(catalog, parameters(tile_m=m)) for m in (50, 100, 250))
    assert len(small.tiles) > len(large.tiles) == 1
    ground = surveyed_places(large)
    assert len(ground) > 300
    assert surveyed_places(small) == ground == surveyed_places(middle)


def test_tiles_frames_and_cells_follow_from_the_flight(tmp_path: Path) -> None:
    flight = make_flight(tmp_path / "flight", described=False)
    flight.describe(gains=False)
    survey = ImageSurvey(read_catalog(flight.catalog), parameters())
    assert list(survey.tiles) == ["1700_8940", "1701_8940", "1700_8941"], "the last for a strip of two metres"
    assert [f.name for f in survey.frames] == ["nadir", "north_45"]
    assert survey.cell_m == GSD_M
    assert all(survey.flight_tiles(t) and survey.ortho_images(t) for t in survey.tiles.values())
    asked = {n for t in survey.tiles.values() for n in survey.ortho_images(t)}
    assert {survey.is_slanting(n) for n in asked} == {False, True}, "slanting images colour what the others do not see"


@pytest.mark.parametrize("cell_m", [0.06, 0.13, 0.3])
def test_a_cell_that_fits_no_tile_is_refused_with_those_that_do(cell_m: float) -> None:
    with pytest.raises(ValidationError, match=r"images\.cell_m .* these do: .*0\.125"):
        CityParameters.model_validate({"images": {"cell_m": cell_m}, "tiles": {"tile_m": 50}})


def test_a_workflow_read_back_from_a_run_asks_for_the_same(tmp_path: Path) -> None:
    flight = make_flight(tmp_path / "flight", described=False)
    flight.describe(gains=False)
    catalog = read_catalog(flight.catalog)
    asked = parameters()
    again = CityParameters.model_validate(asked.model_dump(mode="json"))
    first, second = Survey(catalog, asked, {}), Survey(catalog, again, {})
    assert first.wall_parameters == second.wall_parameters
    assert first.outline_parameters == second.outline_parameters
    assert first.wall_parameters.gsd_m == first.images.cell_m != asked.walls.gsd_m
    assert first.outline_parameters.found.walls.gsd_m == first.images.cell_m
    stated = asked.model_copy(update={"walls": asked.walls.model_copy(update={"gsd_m": 0.11})})
    assert Survey(catalog, stated, {}).wall_parameters.gsd_m == 0.11


def test_the_same_catalog_and_parameters_have_one_image_survey(tmp_path: Path) -> None:
    """A command makes several surveys, with and without overrides: what follows from the images alone is found once."""
    flight = make_flight(tmp_path / "flight", described=False)
    flight.describe(gains=False)
    catalog, asked = read_catalog(flight.catalog), parameters()
    first = Survey(catalog, asked, {}).images
    assert Survey(catalog, asked, {("split", "a"): {"x": 1}}).images is first
    assert Survey(catalog, parameters(tile_m=100), {}).images is not first
    assert Survey(read_catalog(flight.catalog), asked, {}).images is not first
