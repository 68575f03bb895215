"""Before a city is made of images: poses that contradict each other are adjusted once, others are taken as they are."""

# mypy: disable-error-code="no-untyped-call"

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from distributed import Client
from rich.console import Console

from cityflow.errors import RunError
from cityflow.flow.heartbeat import Heartbeat
from cityflow.flow.talk import Talk
from cityflow.io.catalog.stac import read_catalog
from cityflow.reporting.pose_words import lines_of_pose
from cityflow.reporting.poses_words import lines_before
from cityflow.runs.first_look import is_orientation
from cityflow.runs.poses_note import NOTE, read_note
from cityflow.runs.prepare import Prepared, prepared
from cityflow.runs.run_folder import describe_run, open_run
from cityflow.workflow.chosen_part import Selection
from cityflow.workflow.orientation_run import rerun_orientation
from cityflow.workflow.orientation_standing import explain_image, print_orientation
from cityflow.workflow.settle_poses import CATALOG, WORK, Driver, with_settled_poses
from cityflow.workflow.status import print_status
from flow.processes import Cluster
from ground_flight import ground_catalog, ground_flight, off_px, turned

pytestmark = pytest.mark.cluster


@pytest.fixture(scope="module")
def client(two_workers: Cluster) -> Iterator[Client]:
    with Client(two_workers.address, set_as_default=False) as client:
        yield client


def _asked(folder: Path, run: str = "run", *settings: str) -> Prepared:
    (folder / "workflow.yaml").write_text("name: ground\npoints: {source: images}\n")
    return prepared(folder / "workflow.yaml", str(folder / "catalog"), str(folder / run), settings, "")


def _settled(wanted: Prepared, client: Any) -> Prepared:
    with Heartbeat(wanted.store) as beat:

        def begin() -> None:
            beat.begin()
            describe_run(wanted)

        return with_settled_poses(wanted, Driver(client, beat, begin, Talk.QUIET))


def _records(run: Path) -> dict[str, int]:
    """Relative path and time of every record."""
    return {str(p.relative_to(run)): p.stat().st_mtime_ns for p in (run / WORK / "records").rglob("*.json")}


@pytest.fixture(scope="module")
def spoiled(client: Client, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A flight whose poses are off by 1.5 pixels, settled in a RUN."""
    folder = tmp_path_factory.mktemp("spoiled")
    images = ground_flight()
    ground_catalog(folder, images, turned(images, 1.5))
    wanted = _asked(folder)
    assert wanted.poses_are_unknown
    assert "looked at by a sample first" in next(lines_before(None, unknown=True, how="auto"))
    assert not wanted.store.exists(NOTE), "who only asks writes nothing"
    _settled(wanted, client)
    return folder


def test_the_tasks_of_its_poses_say_how_they_stand(spoiled: Path) -> None:
    work, told = str(spoiled / "run" / WORK), io.StringIO()
    assert is_orientation(work)
    print_orientation(work, Console(file=told, width=200))
    name = read_catalog(str(spoiled / "catalog")).images[0].name
    explain_image(work, name, Console(file=told, width=200))
    text = told.getvalue()
    assert f"refinement of poses of the run in {spoiled / 'run'}" in text
    assert "Given poses were refined" in text
    assert f"cityflow status {spoiled / 'run'}" in text
    assert "It has a pose" in text
    assert "not complete" not in text
    with pytest.raises(RunError, match="belong to a run"):
        rerun_orientation(work, Selection(failed=True), "", 1, Console(quiet=True))


def test_spoiled_poses_are_adjusted_once_and_every_command_has_them(spoiled: Path) -> None:
    given, images, records = read_catalog(str(spoiled / "catalog")), ground_flight(), _records(spoiled / "run")
    for wanted in (_asked(spoiled), open_run(str(spoiled / "run"))):
        assert not wanted.poses_are_unknown
        assert wanted.poses is not None
        assert wanted.poses.refined
        assert off_px(wanted.catalog, images) < 0.3 * off_px(given, images)
        assert wanted.source().survey.images.assets == {a.name: a for a in wanted.catalog.images}
        assert _settled(wanted, None) is wanted, "nothing is computed again"
    assert _records(spoiled / "run") == records
    assert len({p.split("/")[2] for p in records}) == 4, "sample, features, ties, block"
    frozen = read_catalog(str(spoiled / "run" / CATALOG))
    assert frozen.images == wanted.catalog.images
    assert wanted.poses is not None
    pose = list(lines_of_pose(wanted.poses, wanted.catalog.images[4].name, given))
    assert len(pose) == 1
    assert "moved by" in pose[0]


def test_what_was_found_is_said(spoiled: Path, capsys: pytest.CaptureFixture[str]) -> None:
    print_status(str(spoiled / "run"), Console())
    told = capsys.readouterr().out
    assert "Given poses contradict each other by" in told
    assert "Poses refined:" in told


def test_another_image_pose_or_parameter_makes_it_again_and_never_takes_the_given_ones(
    spoiled: Path, client: Client
) -> None:
    given = read_catalog(str(spoiled / "catalog"))
    assert _asked(spoiled, "run", "orient.bound_px=10").poses_are_unknown
    assert _asked(spoiled, "run", "match.memory_mb=900").poses is not None
    never = _asked(spoiled, "run", "orient.refine=never")
    assert not never.poses_are_unknown
    assert never.catalog.images == given.images
    note = (spoiled / "run" / NOTE).read_bytes()
    assert _settled(never, None).catalog.images == given.images
    assert read_note(never.store) is None, "nothing says that poses are others than those that are used"
    again = _settled(_asked(spoiled), client)
    assert (spoiled / "run" / NOTE).read_bytes() == note
    assert again.poses is not None


def test_a_run_that_was_killed_goes_on(spoiled: Path, client: Client) -> None:
    note, run = (spoiled / "run" / NOTE).read_bytes(), spoiled / "run"
    (run / NOTE).unlink()
    gone = sorted((run / WORK / "records").glob("*/*/*.json"))
    gone = [p for p in gone if p.parts[-3] == "adjust" or (p.parts[-3] == "ties" and "i3" in p.parts[-2])]
    assert len(gone) == 2
    for path in gone:
        path.unlink()
    before = _records(run)
    _settled(_asked(spoiled), client)
    assert (run / NOTE).read_bytes() == note
    after = _records(run)
    assert {p: t for p, t in after.items() if p in before} == before
    assert len(after) == len(before) + 2


def test_an_image_that_cannot_be_read_keeps_its_pose_until_it_can(spoiled: Path, client: Client) -> None:
    """Then all is as if it had never been away."""
    given = read_catalog(str(spoiled / "catalog"))
    away = Path(given.images[8].href)
    picture = away.read_bytes()
    away.write_bytes(b"no image")
    try:
        found = _settled(_asked(spoiled, "late"), client)
    finally:
        away.write_bytes(picture)
    assert found.poses is not None
    assert found.poses.refined
    assert not found.poses.is_final
    assert list(found.poses.left_out) == [given.images[8].name]
    assert found.catalog.images[8] == given.images[8]
    assert "the file could not be read" in " ".join(lines_before(found.poses, unknown=False, how="auto"))
    _settled(_asked(spoiled, "late"), client)
    assert (spoiled / "late" / NOTE).read_bytes() == (spoiled / "run" / NOTE).read_bytes()


def test_exact_poses_stay_and_nothing_but_the_sample_is_computed(client: Client, tmp_path: Path) -> None:
    images = ground_flight()
    given = ground_catalog(tmp_path, images, images)
    found = _settled(_asked(tmp_path), client)
    assert found.poses is not None
    assert not found.poses.refined
    assert found.poses.is_final
    assert found.catalog.images == given.images
    assert {p.split("/")[2] for p in _records(tmp_path / "run")} == {"sample"}
    assert not (tmp_path / "run" / CATALOG).exists()
    assert json.loads((tmp_path / "run" / NOTE).read_text())["sample"]["parallax_px"] < 0.15
