from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from cluster.small_city import S3, WEST_AREA, Commands, SmallCity, make_city
from cluster.small_flight import SmallFlight, make_flight
from flow.conftest import free_port
from flow.processes import Cluster


@pytest.fixture(scope="session")
def two_workers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    cluster = Cluster(tmp_path_factory.mktemp("cluster"))
    with pytest.MonkeyPatch.context() as patch:
        for name, value in S3.items():
            patch.setenv(name, value)
        try:
            cluster.start(free_port(), 2)
            yield cluster
        finally:
            cluster.stop()


@pytest.fixture(scope="session")
def cityflow(two_workers: Cluster) -> Commands:
    return Commands(two_workers.address)


@pytest.fixture(scope="session")
def small_city(tmp_path_factory: pytest.TempPathFactory) -> SmallCity:
    return make_city(tmp_path_factory.mktemp("town"))


@pytest.fixture(scope="session")
def small_run(small_city: SmallCity, cityflow: Commands, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of the small town; read only."""
    run = tmp_path_factory.mktemp("run") / "run"
    cityflow.run(small_city, run)
    return run


@pytest.fixture(scope="session")
def fifty_run(small_city: SmallCity, cityflow: Commands, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same with tiles of 50 m and index cells of 25 m; read only."""
    run = tmp_path_factory.mktemp("fifty") / "run"
    cityflow.run(small_city, run, "--set", "tiles.tile_m=50", "--set", "tiles.index_cell_m=25")
    return run


@pytest.fixture(scope="session")
def west_run(small_city: SmallCity, cityflow: Commands, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of an area of the small town; read only."""
    run = tmp_path_factory.mktemp("west") / "run"
    cityflow.run(small_city, run, *WEST_AREA)
    return run


@pytest.fixture
def copied_run(small_run: Path, tmp_path: Path) -> Path:
    """A copy of the finished run, to be changed."""
    shutil.copytree(small_run, tmp_path / "copy")
    return tmp_path / "copy"


@pytest.fixture(scope="session")
def small_flight(tmp_path_factory: pytest.TempPathFactory) -> SmallFlight:
    return make_flight(tmp_path_factory.mktemp("flight"))


@pytest.fixture(scope="session")
def flight_run(small_flight: SmallFlight, cityflow: Commands, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of the small flight; read only."""
    run = tmp_path_factory.mktemp("flown") / "run"
    cityflow.run(small_flight, run, "--set", "orient.refine=auto")
    return run
