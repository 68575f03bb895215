"""A second `run` of a finished city follows no graph, says the same, and still notices what is gone, cut short or changed."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import geopandas
import pytest
import shapely

from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.pipeline.city_source import CitySource
from cluster.small_city import Commands, SmallCity, contents, newest, scene
from cluster.test_damaged_files import cut, flip

pytestmark = pytest.mark.cluster

SAID = "Nothing to run: all of it is done."


def joined(run: Path) -> None:
    """Records stand in segments, as in a large city."""
    with Ledger.open(Store.open(run), segment=8) as ledger, ledger.driven():
        while ledger.join():
            pass


def told(text: str) -> list[str]:
    """What a run says in the end."""
    lines = text.splitlines()
    return lines[next(i for i, line in enumerate(lines) if line.startswith("Buildings by verdict")) :]


def test_nothing_is_followed_and_the_same_is_said(
    cityflow: Commands, small_city: SmallCity, small_run: Path, copied_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    followed = cityflow.run(small_city, copied_run, "--verify")
    joined(copied_run)
    (copied_run / "report.html").unlink()

    def initial(_: object) -> None:
        raise AssertionError("the graph is followed")

    monkeypatch.setattr(CitySource, "initial", initial)
    done = cityflow.run(small_city, copied_run)
    assert SAID in done.out
    assert told(done.out) == told(followed.out)
    assert contents(copied_run) == contents(small_run)
    assert (copied_run / "report.html").exists()
    monkeypatch.setattr("cityflow.workflow.run.REPORTED", 0)
    (copied_run / "report.html").write_text("as before")
    assert told(cityflow.run(small_city, copied_run).out) == told(followed.out)
    assert (copied_run / "report.html").read_text() == "as before", "of a large city"
    assert '"ended"' in (copied_run / "driver.json").read_text(), "whoever has submitted it is told"


def removed(run: Path) -> None:
    next((run / "products/citygml").iterdir()).unlink()


def hull_removed(run: Path) -> None:
    shutil.rmtree(next((run / "work/reconstruct").iterdir()))


def cut_chunk(run: Path) -> None:
    cut(next(p for p in sorted((run / "surface.zarr/dsm/c").rglob("*")) if p.is_file()))


def described_no_more(run: Path) -> None:
    (run / "surface.zarr/zarr.json").unlink()


def changed_segment(run: Path) -> None:
    flip(max((run / "segments").glob("*.zst"), key=lambda p: p.stat().st_size))


def table_removed(run: Path) -> None:
    next((run / "segments").glob("*.parquet")).unlink()


HARM = [removed, hull_removed, cut_chunk, described_no_more, changed_segment, table_removed]


@pytest.mark.parametrize("harm", HARM, ids=lambda harm: harm.__name__)
def test_harm_is_noticed_and_mended(
    harm: Callable[[Path], None], cityflow: Commands, small_city: SmallCity, small_run: Path, copied_run: Path
) -> None:
    joined(copied_run)
    files = {p.relative_to(copied_run) for p in copied_run.rglob("*") if p.is_file() and "records" not in p.parts}
    harm(copied_run)
    done = cityflow.run(small_city, copied_run)
    assert (SAID in done.out) == (harm is table_removed), "a table says nothing that records do not"
    assert contents(copied_run) == contents(small_run)
    kept = {f for f in files if f.parts[0] in ("work", "products", "surface.zarr")}
    assert all((copied_run / f).exists() for f in kept)
    assert len([*(copied_run / "segments").glob("*.zst")]) == len([*(copied_run / "segments").glob("*.parquet")])
    assert SAID in cityflow.run(small_city, copied_run).out


def test_edits_are_held_against_those_of_before(
    cityflow: Commands, small_city: SmallCity, small_run: Path, copied_run: Path
) -> None:
    """Also where a building was made again under other ones meanwhile."""
    first, second = (scene().outlines[name].representative_point() for name in sorted(scene().outlines)[:2])
    write_edits(copied_run, first)
    assert SAID not in cityflow.run(small_city, copied_run).out
    assert contents(copied_run) != contents(small_run)
    assert SAID in cityflow.run(small_city, copied_run).out, "the same edits"
    former = (copied_run / "edits.gpkg").read_bytes()
    write_edits(copied_run, first, second)
    unit = max(newest(copied_run, "reconstruct"))
    assert cityflow("rerun", copied_run, "--unit", unit).code == 0
    (copied_run / "edits.gpkg").write_bytes(former)
    assert SAID not in cityflow.run(small_city, copied_run).out, "a building was made again under other edits"


def write_edits(run: Path, *rejected: shapely.Point) -> None:
    (run / "edits.gpkg").unlink(missing_ok=True)
    frame = geopandas.GeoDataFrame(geometry=list(rejected), crs="EPSG:28992")
    frame.to_file(run / "edits.gpkg", layer="rejected")
