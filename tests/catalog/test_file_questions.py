"""Files of a catalog are read each on its own: once, on any number of workers, and one that is bad does not keep the others from being read."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
from cityflow.catalog.file_questions import Reading
from cityflow.catalog.height_ranges import within
from cityflow.catalog.kept_answers import KeptAnswers
from cityflow.catalog.orientation import ImageSource
from cityflow.catalog.plan_index import PlanIndex
from cityflow.errors import CatalogError
from cityflow.flow.spread import Spread
from cityflow.io.catalog.stac import sha256_of
from cityflow.io.images.coarse_image import coarse_image
from cityflow.workflow.catalog_reading import kept_place, reading_files
from cluster.small_flight import CRS_CODE, DATA, ORIGIN
from survey_files import points, write_las

FLIGHT = ImageSource(DATA / "images", {"colmap": DATA / "sparse"}, origin=ORIGIN)
NAMES = ("a", "b", "c")


@pytest.fixture
def laz(tmp_path: Path) -> Path:
    (tmp_path / "laz").mkdir()
    for seed, name in enumerate(NAMES):
        write_las(tmp_path / "laz" / f"{name}.laz", points(500, seed))
    return tmp_path / "laz"


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the files that are read from now on: whole ones, and decoded ones."""
    names: list[str] = []

    def noted(path: str) -> tuple[str, int]:
        names.append(Path(path).name)
        return sha256_of(path)

    def decoded(path: str, level: int) -> object:
        names.append(f"{Path(path).name} decoded")
        return coarse_image(path, level)

    monkeypatch.setattr("cityflow.catalog.file_reading.sha256_of", noted)
    monkeypatch.setattr("cityflow.catalog.colour_reading.coarse_image", decoded)
    return names


def contents(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def made(out: Path, laz: Path, reading: Reading, images: bool = True) -> dict[str, bytes]:
    create_catalog(
        out,
        SurveyFiles(lidar=[str(laz)], images=FLIGHT if images else None),
        crs=CRS_CODE,
        reading=reading,
        text=SurveyText(title="one"),
    )
    return contents(out)


def test_what_was_read_is_not_read_again(tmp_path: Path, laz: Path, read: list[str]) -> None:
    def again() -> dict[str, bytes]:
        read.clear()
        with KeptAnswers(tmp_path / "kept") as kept:
            return made(tmp_path / "c", laz, Reading(kept=kept))

    first = again()
    images = len(list((DATA / "images").iterdir()))
    assert len(read) == len(NAMES) + 2 * images
    assert (again(), read) == (first, [])
    os.utime(laz / "b.laz", ns=(1, 1))
    assert (again(), read) == (first, ["b.laz"])
    write_las(laz / "c.laz", points(600, 9))
    changed = again()
    assert read == ["c.laz"]
    assert {name for name in first if first[name] != changed[name]} == {
        "items/c.json",
        "items/items.parquet",
        "collection.json",
    }
    assert changed == made(tmp_path / "c", laz, Reading())


def test_bad_files_are_all_named_and_the_others_need_not_be_read_again(
    tmp_path: Path, laz: Path, read: list[str]
) -> None:
    good = (laz / "b.laz").read_bytes()
    (laz / "b.laz").write_bytes(good[:-100])
    with KeptAnswers(tmp_path / "kept") as kept, pytest.raises(CatalogError, match=r"b\.laz: the file is truncated"):
        made(tmp_path / "c", laz, Reading(kept=kept), images=False)
    (laz / "a.laz").write_bytes(b"text")
    with (
        KeptAnswers(tmp_path / "kept") as kept,
        pytest.raises(
            CatalogError, match=r"a\.laz: this is no readable.*; .*b\.laz: the file is truncated.*2 of 3 files"
        ),
    ):
        made(tmp_path / "c", laz, Reading(kept=kept), images=False)
    assert not (tmp_path / "c").exists()
    assert read == ["a.laz", "c.laz"]
    (laz / "a.laz").unlink()
    (laz / "b.laz").write_bytes(good)
    with KeptAnswers(tmp_path / "kept") as kept:
        made(tmp_path / "c", laz, Reading(kept=kept), images=False)
    assert read == ["a.laz", "c.laz", "b.laz"]


def test_two_commands_do_not_make_one_catalog(tmp_path: Path) -> None:
    with KeptAnswers(tmp_path / "kept") as kept, KeptAnswers(tmp_path / "kept") as other:
        assert kept.get("x") is None
        with pytest.raises(CatalogError, match=r"kept: .*locked.* end the other command"):
            other.get("x")


@pytest.mark.cluster
def test_the_catalog_is_the_same_whoever_reads(tmp_path: Path, laz: Path) -> None:
    here = made(tmp_path / "c", laz, Reading())
    shutil.rmtree(tmp_path / "c")
    told: dict[str, int] = {}
    with Spread(workers=2) as spread:
        reading = Reading(spread, told=lambda what, done, _: told.update({what: done}))
        there = made(tmp_path / "c", laz, reading)
        write_las(laz / "b.laz", points(500, 1))
        (laz / "b.laz").write_bytes((laz / "b.laz").read_bytes()[:-100])
        with pytest.raises(CatalogError, match=r"b\.laz: the file is truncated"):
            made(tmp_path / "c", laz, reading)
    assert there == here
    images = len(list((DATA / "images").iterdir()))
    assert told == {"LiDAR files": len(NAMES), "images": images, "images, for their colours": images}


def test_nothing_is_made_beside_a_catalog_before_a_file_is_read(tmp_path: Path) -> None:
    from rich.console import Console

    with reading_files("", 1, Console(), kept_beside=tmp_path / "c") as reading:
        assert list(tmp_path.iterdir()) == []
        reading.kept.get("x")
    assert list(tmp_path.iterdir()) == [kept_place(tmp_path / "c")]


def test_points_in_boxes_are_those_of_a_search_through_all() -> None:
    rng = np.random.default_rng(4)
    xyz = rng.normal(0, (300, 40, 5), (3000, 3)).round(1)
    xyz = xyz[np.lexsort((xyz[:, 2], xyz[:, 1], xyz[:, 0]))]
    index = PlanIndex(xyz)
    corners = rng.normal(0, (300, 40), (200, 2, 2)).round(1)
    for low, high in zip(corners.min(axis=1).tolist(), corners.max(axis=1).tolist(), strict=True):
        x, y = xyz[:, 0], xyz[:, 1]
        inside = np.flatnonzero((x >= low[0]) & (x < high[0]) & (y >= low[1]) & (y <= high[1]))
        assert index.inside((*low, *high)).tolist() == inside.tolist()
    assert PlanIndex(np.empty((0, 3))).inside((0, 0, 1, 1)).tolist() == []
    assert index.inside((np.nan,) * 4).tolist() == []
    assert index.inside((9e3, 9e3, 1e4, 1e4)).tolist() == index.inside((-1e4, -1e4, -9e3, -9e3)).tolist() == []


def test_images_look_at_the_same_points_as_before(tmp_path: Path) -> None:
    from cityflow.catalog.gains import _boxes

    images = create_catalog(tmp_path / "c", SurveyFiles(images=FLIGHT), crs=CRS_CODE).catalog.images
    low, high = (
        np.array([i.bounds for i in images])[:, :2].min(axis=0),
        np.array([i.bounds for i in images])[:, 2:].max(axis=0),
    )
    xyz = np.column_stack([np.random.default_rng(1).uniform(low, high, (4000, 2)), np.zeros(4000)])
    xyz = xyz[np.argsort(xyz[:, 0])]
    index = PlanIndex(xyz)
    for image, box in zip(images, _boxes(images), strict=True):
        assert index.inside(box).tolist() == within(xyz, image.oriented, image.heights).tolist()
