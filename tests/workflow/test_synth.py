"""Options of ``cityflow synth``, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from cityflow.catalog.height_ranges import heights_of_points
from cityflow.errors import CityflowError, RunError
from cityflow.synthetic.pose_noise import PoseErrors
from cityflow.synthetic.town import make_town
from cityflow.workflow.synth import make_survey, synth_parameters
from cityflow.workflow.synth_files import LEAST_TIES, TIE_STEPS_M, tie_points


def test_options_become_parameters() -> None:
    p = synth_parameters(3, "120x80", "nadir", 8.0, ["flight.gsd_m=0.2", "raw=true", "town.relief=1"])
    assert p.size == (120.0, 80.0)
    assert p.flight is not None
    assert p.flight.gsd_m == 0.2
    assert p.lidar is not None
    assert p.lidar.density_m2 == 8.0
    assert p.raw is not None
    assert p.whole_town.relief == 1


@pytest.mark.parametrize(
    ("size", "flight", "lidar", "setting", "said"),
    [
        ("wide", "nadir", 0.0, "seed=1", "'wide' is no size"),
        ("100", "zeppelin", 0.0, "seed=1", "no flight 'zeppelin' → one of five_cameras"),
        ("100", "nadir", 0.0, "flight.gsd=1", "nearest known one is 'flight.gsd_m'"),
        ("100", "none", 4.0, "flight.gsd_m=1", "no flight is flown"),
        ("100", "nadir", 99.0, "seed=1", "lidar.density_m2 = 99.0"),
        ("100", "none", 0.0, "seed=1", "nothing to survey with"),
        ("100", "nadir", 0.0, "crs=EPSG:99999", "EPSG:99999"),
    ],
)
def test_wrong_options_are_explained(size: str, flight: str, lidar: float, setting: str, said: str) -> None:
    with pytest.raises(CityflowError) as caught:
        synth_parameters(1, size, flight, lidar, [setting])
    assert said in str(caught.value)


def test_a_condition_changes_pictures_and_poses_and_settings_go_before_it() -> None:
    clean = synth_parameters(3, "120x80", "nadir", 0.0, [])
    spoiled = synth_parameters(3, "120x80", "nadir", 0.0, ["given.position_m=0.5"], suffers="spoiled")
    assert clean.given == PoseErrors()
    assert (spoiled.given.position_m, spoiled.given.angle_px, spoiled.jpeg_quality) == (0.5, 0.4, 60)
    assert spoiled.render.sensor.blur_px > clean.render.sensor.blur_px
    assert spoiled.render.sensor.vignetting == clean.render.sensor.vignetting
    assert [i.name for i in spoiled.images] == [i.name for i in clean.images]
    with pytest.raises(CityflowError, match="no condition is called 'awful' → one of clean, spoiled"):
        synth_parameters(3, "120x80", "nadir", 0.0, [], suffers="awful")


@pytest.mark.parametrize("flight", ["five_cameras", "crossing"])
def test_the_standard_scene_has_discontinuities_a_lens_and_errors_with_every_flight(flight: str) -> None:
    standard, spoiled = (
        synth_parameters(3, "80x80", flight, 0.0, [], suffers=name) for name in ("standard", "spoiled")
    )
    assert standard.whole_town.level == 2
    assert standard.images[0].camera.distortion == standard.given_images[0].camera.distortion != ()
    assert (standard.given, standard.jpeg_quality) == (spoiled.given, spoiled.jpeg_quality)
    assert standard.render.sensor == spoiled.render.sensor
    assert synth_parameters(3, "80x80", flight, 0.0, ["town.level=3"], suffers="standard").town.level == 3


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("all of it")
    with pytest.raises(RunError, match="not empty"):
        make_survey(tmp_path, synth_parameters(1, "100", "none", 2.0, []), "", 1, Console(quiet=True))
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.txt"]


def test_a_small_area_has_enough_tie_points_to_tell_heights_by() -> None:
    """A larger one has those of the usual distance."""
    usual = {}
    for size in ("28x28", "80x80"):
        p = synth_parameters(9335, size, "five_cameras", 0.0, ["surroundings_m=50"])
        xyz = tie_points(make_town(p.seed, p.whole_town), p)
        (x_min, y_min, x_max, y_max), (x, y) = p.area, xyz[:, :2].T
        assert np.all((x >= x_min) & (x < x_max) & (y >= y_min) & (y < y_max))
        assert len(xyz) >= LEAST_TIES
        assert heights_of_points(xyz).whole[0] < xyz[:, 2].min()
        usual[size] = int(np.isclose((x - x_min) % TIE_STEPS_M[0], TIE_STEPS_M[0] / 2).sum())
    assert usual["28x28"] < 10
    assert usual["80x80"] > 50
