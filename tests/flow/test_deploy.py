"""Files of `deploy/`: they can be read, and name what is there."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest
import yaml

DEPLOY = Path(__file__).parents[2] / "deploy"
PRELOAD = "cityflow.flow.run_page"


def module(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(name, DEPLOY / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def commands() -> list[list[str]]:
    """Of all containers."""
    services = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"].values()
    found = [service["command"] for service in services if "command" in service]
    cluster = next(
        d for d in yaml.safe_load_all((DEPLOY / "kubernetes.yaml").read_text()) if d["kind"] == "DaskCluster"
    )
    for part in ("worker", "scheduler"):
        (container,) = cluster["spec"][part]["spec"]["containers"]
        found.append(container["args"])
        if "lifecycle" in container:
            found.append(container["lifecycle"]["preStop"]["exec"]["command"])
    return found


def test_containers_call_modules_and_files_that_are_there() -> None:
    found = commands()
    named = [word for command in found for word in command if word.startswith("cityflow.")]
    assert named.count(PRELOAD) == 2
    assert "cityflow.flow.retire" in named
    assert all(importlib.util.find_spec(name) for name in named)
    assert all((DEPLOY.parent / word).is_file() for command in found for word in command if word.endswith(".py"))
    workers = [command for command in found if "worker" in command]
    assert len(workers) == 2
    assert all(c[c.index("--nthreads") :][:2] == ["--nthreads", "1"] and "--memory-limit" in c for c in workers)


def test_ports_of_compose_are_bound_to_this_machine() -> None:
    services = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"].values()
    assert all(port.startswith("127.0.0.1:") for service in services for port in service.get("ports", []))


@pytest.mark.parametrize(("hours", "walltime", "lifetime"), [(12.0, "12:00:00", "705m"), (0.5, "00:30:00", "15m")])
def test_workers_on_slurm_end_before_their_job(hours: float, walltime: str, lifetime: str) -> None:
    slurm = module("slurm")
    settings = slurm.job_settings(slurm.options(["--queue", "main", "--hours", str(hours), "--cores", "4"]))
    assert settings["walltime"] == walltime
    assert lifetime in settings["worker_extra_args"]
    assert settings["processes"] == settings["cores"] == 4


def test_buckets_are_made_once(s3_url: str) -> None:
    import s3fs

    bucket = f"{s3_url.removeprefix('s3://')}-made"
    for _ in range(2):
        module("buckets").make([bucket])
    assert s3fs.S3FileSystem(skip_instance_cache=True).exists(bucket)
