"""Textures on the command line: a LiDAR city with photographs, its requests, its failures, its area of interest."""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml

from cluster.small_city import Commands, contents, newest, redone, report
from stages.painted_houses import PLANS, WORKFLOW, Painted, X, Y, pictures, survey_in

pytestmark = pytest.mark.cluster


@dataclass(frozen=True)
class PaintedTown:
    """Stands in for `SmallCity` where commands are run."""

    painted: Painted

    @property
    def catalog(self) -> Path:
        return self.painted.catalog

    @property
    def workflow(self) -> Path:
        return self.painted.folder / "workflow.yaml"


@pytest.fixture(scope="module")
def town(cityflow: Commands, tmp_path_factory: pytest.TempPathFactory) -> PaintedTown:
    painted = survey_in(tmp_path_factory.mktemp("painted"))
    painted.write_images(pictures())
    folder = painted.folder
    done = cityflow(
        "catalog", "create", painted.catalog, "--lidar", folder / "town.laz", "--images", folder / "images", "--colmap", folder / "sparse",
        "--origin", f"{X:.0f},{Y:.0f},0", "--heights", "2,14", "--outlines", folder / "outlines.gpkg", "--crs", "EPSG:7415", "--id-column", "id",
    )  # fmt: skip
    assert done.code == 0, done.text
    town = PaintedTown(painted)
    town.workflow.write_text(yaml.safe_dump(WORKFLOW))
    return town


@pytest.fixture(scope="module")
def town_run(cityflow: Commands, town: PaintedTown, tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = tmp_path_factory.mktemp("painted_run") / "run"
    cityflow.run(town, run)
    return run


def test_every_command_knows_textures(cityflow: Commands, town: PaintedTown, town_run: Path) -> None:
    assert {r["status"] for r in newest(town_run, "texture").values()} == {"done"}
    status = cityflow("status", town_run)
    assert "texture" in status.out
    assert "atlas" in status.out
    explained = cityflow("explain", town_run, "c")
    assert explained.code == 0, explained.text
    assert "Faces with a photograph" in explained.out
    assert {r["status"] for r in newest(town_run, "windows").values()} == {"done"}
    assert "windows-c: done" in explained.out
    told = cityflow(
        "plan", town.workflow, "--catalog", town.catalog, "--out", town_run, "--set", "texture.patches.padding_px=4"
    ).out
    assert "padding_px 3 → 4" in told
    names = {s["stage"] for s in report(town_run)["stages"]}
    assert {"texture", "windows", "atlas"} <= names
    assert redone(town_run, lambda: cityflow.run(town, town_run)) == set()


def test_other_leaves_and_formats_leave_nothing_stale(
    cityflow: Commands, town: PaintedTown, town_run: Path, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    shutil.copytree(town_run, run)
    more = ("--set", "export.formats=[obj,tiles3d]", "--set", "atlas.cell_m=20", "--set", "atlas.form=png")
    again = redone(run, lambda: cityflow.run(town, run, *more))
    assert {s for s, _ in again} == {"atlas", "export"}
    cityflow.run(town, tmp_path / "fresh", *more)
    assert contents(run) == contents(tmp_path / "fresh")
    cityflow.run(town, run)
    assert contents(run) == contents(town_run)


def test_an_area_keeps_the_pages_of_the_rest(
    cityflow: Commands, town: PaintedTown, town_run: Path, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    shutil.copytree(town_run, run)
    x_0, y_0, x_1, y_1 = PLANS["b"]
    cityflow.run(town, run, "--aoi", f"{x_0 + 5},{y_0},{x_1},{y_1}")
    pages = {p: d for p, d in contents(town_run).items() if p.startswith("products/textures/")}
    assert {p: d for p, d in contents(run).items() if p.startswith("products/textures/")} == pages
    told = {u["id"] for u in report(run)["units"]}
    assert told == {"b"}, "what stands around is modelled, since it hides walls, and is nobody's request"
    assert len(newest(run, "reconstruct")) > len(told)
    status = json.loads(cityflow("status", run, "--json").out)
    assert sum(status["verdicts"].values()) == 1, "and counts in no verdict"
    assert status["beyond"] == len(newest(run, "reconstruct")) - 1


def test_one_unit_again_with_wishes_of_its_own(
    cityflow: Commands, town: PaintedTown, town_run: Path, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    shutil.copytree(town_run, run)
    request = ("--stage", "texture", "--unit", "c", "--set", "texture.most_images=2")
    again = redone(run, lambda: cityflow("rerun", run, *request))
    assert {u for s, u in again if s == "texture"} == {"c"}
    assert len([u for s, u in again if s == "atlas"]) == 1
    told = cityflow("explain", run, "c").out
    assert "for this unit alone: most_images = 2" in told
    refused = cityflow("rerun", run, "--stage", "texture", "--unit", "c", "--set", "texture.when=never")
    assert refused.code == 1, "whether there are textures is a matter of the whole city"
    never = cityflow("rerun", run, "--stage", "windows", "--unit", "c", "--set", "windows.when=never")
    assert never.code == 1, never.text
    assert "one value for the whole run" in never.text
    alone = redone(run, lambda: cityflow("rerun", run, "--stage", "windows", "--unit", "c"))
    assert set(alone) == {("windows", "c")}, "with the same result, so that nothing behind it is stale"
    cityflow("rerun", run, "--stage", "texture", "--unit", "c", "--clear-overrides")
    assert contents(run) == contents(town_run)


def test_a_lost_picture_fails_and_heals(cityflow: Commands, town: PaintedTown, town_run: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    picture = town.painted.picture("west")
    hidden = picture.with_suffix(".gone")
    picture.rename(hidden)
    try:
        done = cityflow.run(town, run, ok=False)
        assert "ingest-west" in done.text
        assert {r["status"] for r in newest(run, "texture").values()} == {"degraded"}
        assert all("west" in r["reason"] for r in newest(run, "texture").values())
    finally:
        hidden.rename(picture)
    again = redone(run, lambda: cityflow("rerun", run, "--failed"))
    assert {s for s, _ in again} == {"ingest", "texture", "windows", "atlas", "export"}
    assert {r["status"] for r in newest(run, "texture").values()} == {"done"}
    assert contents(run) == contents(town_run)


def test_pages_are_in_the_catalog_of_products(town_run: Path) -> None:
    items = [json.loads(p.read_text()) for p in sorted((town_run / "products/items").rglob("*.json"))]
    named = {Path(a["href"]).name for i in items for a in i["assets"].values()}
    assert {p.name for p in (town_run / "products/textures").iterdir()} <= named
