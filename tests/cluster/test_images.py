"""The door of images, from the catalog to models: what a run leaves against the truth, and what must not depend on who did it when."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import geopandas
import laspy
import numpy as np
import pytest
import rasterio

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Status
from cityflow.flow.ledger import Ledger
from cityflow.flow.task import Outcome, Record, Task
from cityflow.io.rasters.surface_dataset import chunked_surface
from cityflow.runs.prepare import prepared
from cityflow.stages import frame
from cityflow.surface.ortho_reach import hiding_reach
from cityflow.surface.true_ortho import OrthoParameters
from cityflow.survey import frame_tiles
from cluster.small_city import Commands, Done, contents, copy_of, newest, redone, report
from cluster.small_flight import AREA, GSD_M, HOUSES, SmallFlight, make_flight, truth
from flow.processes import Cluster
from in_process import run_all

pytestmark = pytest.mark.cluster

EAST, RIM = "1701_8940", "1700_8941"
"""The eastern tile with houses, and one of which the survey shows a strip."""
FEW = ("--set", "images.frames=false", "--set", "export.formats=[obj]", "--set", "texture.when=never")
"""What the comparison of runs does without; textures would ask for the models around an area, too."""


@pytest.fixture(scope="module")
def area_run(
    cityflow: Commands, two_workers: Cluster, small_flight: SmallFlight, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """A finished run of the eastern half, one of whose workers was killed while it matched; read only."""
    run = tmp_path_factory.mktemp("area") / "run"
    with two_workers.one_more() as victim, ThreadPoolExecutor(1) as driver:
        done = driver.submit(cityflow.run, small_flight, run, "--aoi", AREA, *FEW)
        wait_for_a_match(run)
        victim.kill()
        done.result(timeout=500)
    return run


def read(run: Path, layer: str) -> tuple[FloatArray, FloatArray, np.ndarray]:
    """x, y and values of a layer of the surface, south up as stored."""
    city = chunked_surface(str(run / "surface.zarr"))
    return city["x"].to_numpy(), city["y"].to_numpy(), city[layer].to_numpy()


def at_truth(run: Path, layer: str) -> np.ndarray:
    """A layer at the places of the truth."""
    x, y, values = read(run, layer)
    grid = truth().grid
    cols = np.abs(x[None, :] - grid.x_centres()[:, None]).argmin(axis=1)
    rows = np.abs(y[None, :] - grid.y_centres()[:, None]).argmin(axis=1)
    return np.asarray(values[np.ix_(rows, cols)])


def nmad(errors: FloatArray) -> float:
    return float(1.4826 * np.median(np.abs(errors - np.median(errors))))


def test_heights_are_the_true_ones(flight_run: Path) -> None:
    known = truth()
    found = at_truth(flight_run, "dsm")
    judged = known.open_cells & np.isfinite(found)
    errors = (found - known.dsm)[judged]
    assert judged.sum() / known.open_cells.sum() > 0.95
    assert abs(np.median(errors)) < 0.5 * GSD_M
    assert nmad(errors) < 1.0 * GSD_M
    assert (np.abs(errors) < 3 * GSD_M).mean() > 0.95


def test_no_block_of_a_pair_was_matched_twice(flight_run: Path, area_run: Path) -> None:
    """By the records; an image is one task, also of a part of its ground, and leaves a file for each ground tile."""
    whole, part = (newest(run, "match") for run in (flight_run, area_run))
    for matched in (whole, part):
        assert set(matched) <= {f"{kind}{k}" for kind in "no" for k in range(9)}
        for record in matched.values():
            counts = record["result"]["blocks"]
            assert counts
            assert all(count == different > 0 for count, different in counts.values())
    assert max(len(r["outputs"]) for r in whole.values()) > 1
    for unit, record in part.items():
        own, every = ({p.split("/")[-1]: d for p, d in r["outputs"].items()} for r in (record, whole[unit]))
        assert own.items() <= every.items(), "a tile has the same bytes whatever is asked for beside it"


def test_terrain_passes_under_the_houses(flight_run: Path) -> None:
    errors = at_truth(flight_run, "dtm") - truth().dtm
    assert np.isfinite(errors).mean() > 0.95
    assert np.nanquantile(np.abs(errors), 0.9) < 0.6


def test_every_house_leaves_a_valid_model_with_its_roof(flight_run: Path) -> None:
    units = newest(flight_run, "reconstruct")
    assert len(units) == HOUSES
    assert {r["status"] for r in units.values()} == {"done"}
    assert all(r["result"]["method"].startswith("orientation_histogram") for r in units.values())


def test_points_have_colours_and_classes(flight_run: Path) -> None:
    files = sorted((flight_run / "products" / "points").glob("*.laz"))
    assert [f.stem for f in files] == ["1700_8940", RIM, EAST]
    for file in (f for f in files if f.stem != RIM):
        points = laspy.read(file)
        assert points.header.parse_crs() is not None
        assert {2, 6} <= set(np.unique(points.classification).tolist()) <= {1, 2, 3, 4, 5, 6, 7, 9, 18}
        assert np.ptp(np.asarray(points.red)) > 10_000
        # roofs are red here, and they are the highest
        roofs, ground = np.asarray(points.classification) == 6, np.asarray(points.classification) == 2
        assert np.median(np.asarray(points.z)[roofs]) > np.median(np.asarray(points.z)[ground]) + 4
        assert (np.asarray(points.sigma) > 0).all()


def test_the_ortho_lies_where_the_surface_does(flight_run: Path) -> None:
    with rasterio.open(flight_run / "products" / "ortho" / f"{EAST}.tif") as file:
        assert file.crs is not None
        assert file.res == (GSD_M, GSD_M)
        colour, alpha = file.read()[:3], file.read(4)
    assert set(np.unique(alpha)) == {0, 255}
    assert (colour[:, alpha == 0] == 0).all()
    seen, red, green = at_truth(flight_run, "ortho_seen"), *(at_band(flight_run, b) for b in (0, 1))
    assert seen.mean() > 0.95
    roof = truth().open_cells & (truth().dsm - truth().dtm > 4) & seen
    lawn = truth().open_cells & (truth().dsm - truth().dtm < 0.2) & seen
    assert np.median(red[roof] - green[roof]) > np.median(red[lawn] - green[lawn]) + 20


def at_band(run: Path, band: int) -> np.ndarray:
    x, y, values = read(run, "ortho")
    grid = truth().grid
    cols = np.abs(x[None, :] - grid.x_centres()[:, None]).argmin(axis=1)
    rows = np.abs(y[None, :] - grid.y_centres()[:, None]).argmin(axis=1)
    return np.asarray(values[band][np.ix_(rows, cols)]).astype(int)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_surface_and_frames_open_with_xarray(flight_run: Path) -> None:
    city = chunked_surface(str(flight_run / "surface.zarr"))
    assert {"dsm", "dtm", "ndsm", "class", "count", "sigma", "holes", "ortho"} <= set(city.data_vars)
    assert city.attrs["vertical_datum"] == "NAP height"
    frame = chunked_surface(str(flight_run / "surface.zarr" / "frames" / "north_45"))
    assert {"dsm", "ortho", "ortho_seen"} <= set(frame.data_vars)
    assert np.isfinite(frame["dsm"].values).sum() > 10_000
    assert frame["ortho_seen"].values.sum() > 10_000


def test_what_can_hide_a_tile_of_a_frame_is_all_that_counts(
    flight_run: Path, small_flight: SmallFlight, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Fused with all within the limit, not only with what rays and heights say can hide it, a tile has the same surface and colours."""
    run = copy_of(flight_run, tmp_path / "copy")
    wanted = prepared(small_flight.workflow, str(small_flight.catalog), str(run), [], "")
    with Ledger.open(wanted.store) as ledger:
        known = {(r.stage, r.unit): r for r in ledger.records()}
    for stage, unit in list(known):
        if stage == "frame":
            del known[stage, unit]
    # tiles as narrow as ground tiles, of which the flight has several
    monkeypatch.setattr(frame_tiles, "TILE_M", 0.0)
    reaches = list[float]()

    def unlimited(*given: Any) -> float:
        reaches.append(hiding_reach(*given))
        return np.inf

    def frames() -> dict[str, Record]:
        found = run_all(wanted.source(), wanted.store, known=known, fate=left_out)
        return {unit: record for (stage, unit), record in found.items() if stage == "frame"}

    def left_out(task: Task) -> Outcome | None:
        return None if task.stage == "frame" else Outcome(Status.FAILED, "not asked for")

    as_made = frames()
    monkeypatch.setattr(frame, "hiding_reach", unlimited)
    made = frames()
    assert len(made) == len(as_made) > 2
    assert [r.result["digest"] for r in made.values()] == [r.result["digest"] for r in as_made.values()]
    assert all(made[u].result["points"] >= r.result["points"] for u, r in as_made.items())
    assert any(made[u].result["points"] > r.result["points"] for u, r in as_made.items()), "nothing was left out"
    assert max(reaches) < OrthoParameters().halo_m / 2


def test_the_report_says_that_the_poses_were_looked_at_first(flight_run: Path) -> None:
    """They are exact, so a sample of pairs is all that is made; the runs that others are compared with take them as they are."""
    found = report(flight_run)["poses"]
    assert not found["refined"]
    assert found["sample"]["tied"] > 0
    assert "Poses are taken as given" in (flight_run / "report.html").read_text()
    assert [p.name for p in (flight_run / "orient" / "records").iterdir()] == ["sample"]


def test_the_report_names_every_stage(flight_run: Path) -> None:
    stages = {s["stage"]: s["units"] for s in report(flight_run)["stages"]}
    assert stages["ingest"] == 17, "fifteen images, the outlines, and those of one tile noded"
    assert {"match", "fuse", "surface", "ortho", "frame", "outline", "reconstruct", "export"} <= stages.keys()


def test_totals_are_known_before_anything_ran(
    cityflow: Commands, small_flight: SmallFlight, flight_run: Path, tmp_path: Path
) -> None:
    """Pages are known when the units are, noding when the outlines are; the rest is as the run did it, but for what no photograph shows."""
    where = ("--catalog", small_flight.catalog)
    before = json.loads(cityflow("plan", small_flight.workflow, *where, "--out", tmp_path / "new", "--json").out)
    after = json.loads(cityflow("plan", small_flight.workflow, *where, "--out", flight_run, "--json").out)
    done = {s["stage"]: s["total"] for s in after["stages"]}
    told = {s["stage"]: s["total"] for s in before["stages"]}
    assert [s for s, n in told.items() if n is None] == ["atlas"]
    assert all(told[s] >= done.get(s, 0) for s in ("walls", "texture", "windows"))
    assert told["ingest"] + 1 == done["ingest"], "who nodes outlines is known when they are dealt out: one tile here"
    rest = told.keys() - {"ingest", "walls", "atlas", "texture", "windows"}
    assert {s: told[s] for s in rest} == {s: done[s] for s in rest}
    status = json.loads(cityflow("status", flight_run, "--json").out)
    assert status["is_complete"]
    assert {s["stage"]: s["tasks"] for s in status["stages"]} == done
    assert [s["stage"] for s in status["stages"]] == [s["stage"] for s in after["stages"]]


def test_a_second_run_does_nothing(cityflow: Commands, small_flight: SmallFlight, flight_run: Path) -> None:
    assert redone(flight_run, lambda: cityflow("run", small_flight.workflow, "--catalog", small_flight.catalog,
                                               "--out", flight_run)) == set()  # fmt: skip


def wait_for_a_match(run: Path) -> None:
    deadline = time.monotonic() + 300
    while not (run / "records" / "match").is_dir():
        assert time.monotonic() < deadline, "nothing was ever matched"
        time.sleep(0.05)


def surveyed_m2(run: Path) -> float:
    return float(sum(r["result"]["surveyed_m2"] for r in newest(run, "surface").values()))


def test_other_tiles_give_the_same_heights(
    cityflow: Commands, small_flight: SmallFlight, flight_run: Path, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    one = ("--set", "tiles.tile_m=100", *FEW)
    cityflow.run(small_flight, run, *one)
    for layer in ("dsm", "dtm"):
        mine, other = (at_truth(r, layer) for r in (run, flight_run))
        alike = (np.abs(mine - other) <= 0.001) | (np.isnan(mine) & np.isnan(other))
        assert alike.mean() >= 0.999, layer
    # the ground is the same, but its last places where the terrain under them is not quite
    assert surveyed_m2(run) == pytest.approx(surveyed_m2(flight_run), rel=0.005)
    assert newest(run, "reconstruct").keys() == newest(flight_run, "reconstruct").keys()


def test_an_area_gives_what_the_whole_run_gives_there(flight_run: Path, area_run: Path) -> None:
    """Also where a worker was killed."""
    mine, whole = newest(area_run, "reconstruct"), newest(flight_run, "reconstruct")
    assert 0 < len(mine) < len(whole)
    assert all(r["outputs"] == whole[u]["outputs"] for u, r in mine.items())
    for product in ("dsm", "dtm", "ortho", "points"):
        ending = "laz" if product == "points" else "tif"
        path = f"products/{product}/{EAST}.{ending}"
        assert (area_run / path).read_bytes() == (flight_run / path).read_bytes(), path


def test_a_cell_that_fits_no_tile_is_refused_with_those_that_do(
    cityflow: Commands, small_flight: SmallFlight, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    done = cityflow.run(small_flight, run, "--set", "images.cell_m=0.13", ok=False)
    assert "images.cell_m" in done.err
    assert "0.125" in done.err
    assert not run.exists()


@contextmanager
def changed(flight: SmallFlight, name: str, data: bytes) -> Iterator[None]:
    """An image of other contents, for a while."""
    whole = flight.image(name).read_bytes()
    flight.image(name).write_bytes(data)
    try:
        yield
    finally:
        flight.image(name).write_bytes(whole)


def forget(run: Path, stage: str, unit: str) -> None:
    """As if this had not been done yet."""
    shutil.rmtree(run / "records" / stage / unit)
    (run / "ledger.sqlite").unlink()


def test_the_same_picture_in_other_bytes_is_ingested_again_and_no_more(
    cityflow: Commands, small_flight: SmallFlight, flight_run: Path, tmp_path: Path
) -> None:
    run = copy_of(flight_run, tmp_path / "run")
    where = ("--catalog", small_flight.catalog, "--out", run)
    with changed(small_flight, "n1", small_flight.image("n1").read_bytes() + bytes(16)):
        small_flight.describe()
        planned = cityflow("plan", small_flight.workflow, *where)
        again = redone(run, lambda: cityflow("run", small_flight.workflow, *where))
    small_flight.describe()
    assert planned.code == 0, planned.text
    assert "1 × inputs changed" in planned.out
    assert again == {("ingest", "n1")}
    assert contents(run) == contents(flight_run)


def test_an_image_that_breaks_after_the_catalog_is_named_and_heals(
    cityflow: Commands, small_flight: SmallFlight, area_run: Path, tmp_path: Path
) -> None:
    run = copy_of(area_run, tmp_path / "run")
    whole = small_flight.image("n8").read_bytes()
    forget(run, "ingest", "n8")
    with changed(small_flight, "n8", whole[: len(whole) // 2]):
        done = cityflow.run(small_flight, run, "--aoi", AREA, *FEW, ok=False)
    assert "n8" in done.err
    ingested, matched = newest(run, "ingest"), newest(run, "match")
    assert [u for u, r in ingested.items() if r["status"] == "failed"] == ["n8"]
    hurt = {u: r for u, r in matched.items() if r["status"] != "done"}
    assert all("n8" in u + r["reason"] for u, r in hurt.items())
    assert {r["status"] for r in hurt.values()} == {"failed", "degraded"}
    assert any(r["status"] == "done" for r in matched.values())
    assert newest(run, "reconstruct").keys() == newest(area_run, "reconstruct").keys()
    assert cityflow("rerun", run, "--failed").code == 0
    assert contents(run) == contents(area_run)


def test_a_flight_with_an_outline_less_is_an_update_without_matching(
    cityflow: Commands, small_flight: SmallFlight, flight_run: Path, tmp_path: Path
) -> None:
    """Only outlines differ: surfaces, orthos and all other models stay."""
    run, later = copy_of(flight_run, tmp_path / "run"), make_flight(tmp_path / "later", described=False)
    outlines = geopandas.read_file(later.outlines)
    gone = str(outlines["id"].iloc[0])
    outlines.iloc[1:].to_file(later.outlines)
    later.describe()
    done: list[Done] = []
    again = redone(run, lambda: done.append(cityflow("update", run, "--catalog", later.catalog)))
    assert done[0].code == 0, done[0].text
    tree = json.loads((run / "updates/1/changes.json").read_text())
    assert [(c["kind"], c["before"]) for c in tree["changes"]] == [("gone", gone)]
    assert tree["untouched"] + tree["compared"] == HOUSES - 1
    assert {stage for stage, _ in again} & {"match", "fuse", "surface", "ortho", "frame", "walls"} == set()
    assert ("ingest", "n1") not in again
