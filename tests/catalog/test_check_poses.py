"""``catalog check`` tells poses that contradict each other from exact ones, by a sample of rendered pictures."""

from __future__ import annotations

from pathlib import Path

from cityflow.catalog.check import check_catalog
from cityflow.catalog.findings import Level
from ground_flight import ground_catalog, ground_flight, turned


def test_exact_poses_are_measured_and_not_complained_about(tmp_path: Path) -> None:
    images = ground_flight()
    report = check_catalog(ground_catalog(tmp_path, images, images))
    row = report.summary["relative error"]
    assert float(row.split("by poses ")[1].split(" px")[0]) < 0.15
    assert "a sample of 2 pairs of 3 of 9 images" in row
    assert not [f for f in report.findings if "contradict" in f.problem]


def test_poses_that_are_off_are_said_with_what_they_cost_and_an_unreadable_image_is_left_out(tmp_path: Path) -> None:
    images = ground_flight()
    catalog = ground_catalog(tmp_path, images, turned(images, 2.0))
    report = check_catalog(catalog)
    found = [f for f in report.of(Level.WARNING) if "contradict" in f.problem]
    assert len(found) == 1
    assert "GSD (NMAD)" in found[0].problem
    assert "cityflow orient" in found[0].remedy
    for asset in catalog.images[3:5]:
        Path(asset.href).write_bytes(b"no image")
    spoiled = check_catalog(catalog)
    assert "of 7 images" in spoiled.summary["relative error"]
