"""Views asked for by place: as each view answers alone."""

from __future__ import annotations

import numpy as np
import shapely

from cityflow.core.camera import Camera, OrientedImage
from cityflow.orientation.sights import sights
from cityflow.orientation.view_index import ViewIndex
from cityflow.orientation.views import View
from cityflow.synthetic.flight import FlightParameters, Head, plan_flight

HEADS = (
    Head(),
    Head(name="fore", direction="forward", tilt_deg=45.0),
    Head(name="left", direction="left", tilt_deg=45.0),
)
FLIGHT = FlightParameters(gsd_m=0.2, width_px=600, height_px=400, heads=HEADS, distortion=(-0.1, 0.05, 0.001, 0.002))


def views() -> list[View]:
    flown = [View(image, (40.0, 70.0)) for image in plan_flight((0, 0, 300, 200), 40.0, FLIGHT)]
    level_camera = Camera(600, 400, 500.0, 500.0, 300.0, 200.0)
    northwards = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    level = OrientedImage("street", level_camera, northwards, np.array([150.0, 50.0, 42.0]))
    return [*flown, View(level, (40.0, 70.0))]


def alone(view: View, box: np.ndarray) -> bool:
    """Corners behind the camera count as inside."""
    uv, depth = view.image.project(box)
    if (depth <= 0).any():
        return bool((depth > 0).any())
    camera = view.image.camera
    return bool((uv.max(axis=0) > 0).all() and (uv.min(axis=0) < (camera.width, camera.height)).all())


def test_each_view_answers_as_if_it_were_asked_alone() -> None:
    known = views()
    index = ViewIndex(known, sights(known))
    rng = np.random.default_rng(3)
    answers = []
    for x, y in rng.uniform((-50, -50), (350, 250), (60, 2)):
        box = np.array([(a, b, z) for a in (x, x + 12) for b in (y, y + 9) for z in (40.0, 70.0)])
        found = index.have_in_frame(np.arange(len(known)), box)
        assert found.tolist() == [alone(v, box) for v in known]
        answers.extend(found.tolist())
    assert 0.05 < np.mean(answers) < 0.95


def test_plans_that_meet_a_box_come_in_order_with_their_heights() -> None:
    known = [View(v.image, (40.0 - k, 70.0 + k)) for k, v in enumerate(views())]
    plans = sights(known)
    index = ViewIndex(known, plans)
    bounds = (100.0, 80.0, 110.0, 95.0)
    found = index.over(bounds)
    assert found.tolist() == [k for k, plan in enumerate(plans) if plan.intersects(shapely.box(*bounds))]
    assert index.heights == (41.0 - len(known), 69.0 + len(known))


def test_many_boxes_have_the_answers_of_each_alone() -> None:
    known = [View(v.image, (40.0 - k, 70.0 + k)) for k, v in enumerate(views())]
    index = ViewIndex(known, sights(known))
    rng = np.random.default_rng(5)
    low = np.vstack([rng.uniform((-50, -50), (350, 250), (20, 2)), [[1e6, 1e6]]])
    boxes = np.hstack([low, low + 12.0])
    box, view = index.over_each(boxes)
    heights = index.heights_over_each(boxes)
    for k, bounds in enumerate(boxes.tolist()):
        found = index.over(tuple(bounds))
        assert view[box == k].tolist() == found.tolist()
        if len(found):
            assert heights[k].tolist() == [40.0 - found.max(), 70.0 + found.max()]
        else:
            assert np.isnan(heights[k]).all()
    x, y, near = low[3, 0], low[3, 1], view[box == 3]
    corners = np.array([(a, b, z) for a in (x, x + 12) for b in (y, y + 12) for z in (40.0, 70.0)])
    each = np.repeat(corners[None], len(near), axis=0)
    assert index.have_in_frame(near, each).tolist() == index.have_in_frame(near, corners).tolist()


def test_a_corner_in_the_frame_tells_the_same_as_all_eight() -> None:
    known = views()
    index = ViewIndex(known, sights(known))
    rng = np.random.default_rng(7)
    low = rng.uniform((-80, -80, 30), (380, 280, 60), (80, 3))
    x, y, z = low.T
    corners = [np.column_stack([a, b, c]) for a in (x, x + 12) for b in (y, y + 9) for c in (z, z + 25)]
    boxes = np.stack(corners, axis=1)
    box, view = (a.ravel() for a in np.meshgrid(np.arange(len(boxes)), np.arange(len(known)), indexing="ij"))
    found = index.have_each_in_frame(view, boxes, box)
    assert found.tolist() == index.have_in_frame(view, boxes[box]).tolist()
    assert 0.05 < found.mean() < 0.95
