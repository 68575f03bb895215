from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
import shapely

import facade_scene
from cityflow.core.camera import FISHEYE, Camera, OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.pixels import ArrayPixels
from cityflow.core.run_lengths import RunLengthMask
from cityflow.core.texture import FIRST_IMAGE, INTERPOLATED, OUTSIDE, FaceGrid, FacePlane, Patch
from cityflow.errors import CatalogError
from cityflow.geometry.polygon_triangulation import triangulate_polygon
from cityflow.texture.patches.compose import FaceSources
from cityflow.texture.patches.make import FacePatches, make_patches
from cityflow.texture.patches.patch_parameters import PatchParameters
from cityflow.texture.source_image import Source, UnitSources, sources_of
from cityflow.texture.unit_radiometry import balance, face_samples
from facade_scene import Panel, as_pixels, looking_at, plain, plane, storeys, wall

LENS = (-0.08, 0.02, 0.0005, -0.0004, 0.0)


class Scene:
    """A face, what stands before it, and the images of it in the order of their rank."""

    def __init__(
        self, face: FacePlane, cameras: list[OrientedImage], before: tuple[Panel, ...] = (), cell: float = 0.4
    ) -> None:
        self.face, self.cameras = face, cameras
        self.panels = [Panel(face, storeys), *before]
        self.grid = FaceGrid.over(face.polygon, cell)
        self.seen = [facade_scene.seen_face(self.panels, face, c, k, self.grid) for k, c in enumerate(cameras)]
        self.pictures = [facade_scene.photograph(self.panels, c, 2 if c.camera.is_pinhole else 1) for c in cameras]

    def visible(self, image: int, xyz: np.ndarray) -> np.ndarray:
        return facade_scene.sees(self.panels, self.face, self.cameras[image], xyz)

    def sources(self, exposures: dict[int, tuple[float, float]] | None = None) -> list[Source]:
        found = []
        for k, (camera, picture) in enumerate(zip(self.cameras, self.pictures, strict=True)):
            gain, offset = (exposures or {}).get(k, (1.0, 0.0))
            found.append(Source.of(ColourImage(camera, as_pixels(picture, gain, offset))))
        return found

    def made(self, sources: list[Source], exact: bool = True, alike: bool = True, **parameters: float) -> FacePatches:
        models = balance([face_samples(self.face, self.grid, self.seen, sources)]) if alike else {}
        found = make_patches(
            self.face,
            FaceSources(self.grid, self.seen, len(self.seen)),
            UnitSources(sources, models),
            self.visible if exact else None,
            PatchParameters(**parameters),
        )
        assert found is not None
        return found


TREE = Panel(plane([np.array([[4, -6, 0], [8, -6, 0], [8, -6, 7], [4, -6, 7.0]])], 9), plain(20, 160, 40))


@pytest.fixture(scope="module")
def behind_a_tree() -> Scene:
    cameras = [
        looking_at("a", (6, -70, 40), (7, 0, 5)),
        looking_at("b", (-20, -70, 45), (7, 0, 5)),
        looking_at("c", (45, -65, 42), (8, 0, 5)),
    ]
    return Scene(wall(), cameras, (TREE,))


def rendered(patch: Patch, face: FacePlane, st: np.ndarray, divide: bool = True) -> np.ndarray:
    """(N, 2) column, row at which a renderer samples points of the face: linear over its triangles, with division by the third or without."""
    corners, flat = np.concatenate(patch.corners), np.concatenate([face.on_plane(r) for r in face.rings])
    triplets = np.column_stack([corners[:, :2] * corners[:, 2:], corners[:, 2]]) if divide else corners
    out = np.full((len(st), 2), np.nan)
    for triangle in triangulate_polygon([face.on_plane(r) for r in face.rings]):
        a, b, c = flat[triangle]
        share = np.linalg.solve(np.column_stack([b - a, c - a]), (st - a).T).T
        weight = np.column_stack([1 - share.sum(axis=1), share])
        inside = (weight >= -1e-9).all(axis=1)
        value = weight[inside] @ triplets[triangle]
        out[inside] = value[:, :2] / value[:, 2:] if divide else value[:, :2]
    return out


def own_points(face: FacePlane, margin: float, step: float = 0.15) -> np.ndarray:
    s_0, t_0, s_1, t_1 = face.polygon.bounds
    s, t = np.meshgrid(np.arange(s_0 + step / 2, s_1, step), np.arange(t_0 + step / 2, t_1, step))
    st = np.column_stack([s.ravel(), t.ravel()])
    return np.asarray(st[shapely.contains_xy(face.polygon.buffer(-margin), st[:, 0], st[:, 1])])


def away_from_edges(st: np.ndarray, by: float) -> np.ndarray:
    """(N,) bool, where the façade's paint is the same all around."""
    shifts = [(by, 0), (-by, 0), (0, by), (0, -by), (by, by), (-by, -by), (by, -by), (-by, by)]
    window = [storeys(st + shift)[:, 0] < 60 for shift in ((0, 0), *shifts)]
    return np.asarray(np.all(window, axis=0) | ~np.any(window, axis=0))


def errors(patch: Patch, face: FacePlane, margin: float = 0.3) -> np.ndarray:
    """(N,) greatest difference of the bands from the paint, where that has no edge."""
    st = own_points(face, margin)
    st = st[away_from_edges(st, 0.3)]
    col, row = np.floor(rendered(patch, face, st)).astype(int).T
    assert patch.mask[row, col].all()
    return np.asarray(np.abs(patch.pixels[row, col].astype(float) - storeys(st)).max(axis=1))


def test_the_root_image_is_not_resampled(behind_a_tree: Scene) -> None:
    patch = behind_a_tree.made(behind_a_tree.sources(), alike=False, feather_px=0.0).raw
    root = patch.index == FIRST_IMAGE
    camera, corner = behind_a_tree.cameras[0], patch.corners[0][0]
    first = np.rint(camera.project(behind_a_tree.face.rings[0][:1])[0][0] - corner[:2]).astype(int)
    window = as_pixels(behind_a_tree.pictures[0]).array[first[1] :, first[0] :][: root.shape[0], : root.shape[1]]
    same = (patch.pixels == window).all(axis=2)
    # padding, and pixels at the rim, are those beside them
    inner = root.copy()
    inner[:8], inner[-8:], inner[:, :14], inner[:, -14:] = False, False, False, False
    assert inner.sum() > 8000
    assert same[inner].all()


def test_what_a_tree_hides_comes_from_the_others(behind_a_tree: Scene) -> None:
    made = behind_a_tree.made(behind_a_tree.sources())
    for patch in (made.raw, made.rectified):
        assert set(np.unique(patch.index)) == {OUTSIDE, FIRST_IMAGE, FIRST_IMAGE + 1, FIRST_IMAGE + 2}
        off = errors(patch, behind_a_tree.face)
        assert np.mean(off < 12) > 0.995
        assert np.median(off) < 2.0
        green = patch.pixels[..., 1].astype(int) - patch.pixels[..., 0]
        assert (green[patch.mask] < 25).all()
    figures = made.raw.figures
    assert (figures.images, figures.candidates, figures.interpolated) == (3, 3, 0.0)
    assert 0.08 < figures.occluded < 0.14


def test_the_index_says_where_pixels_came_from(behind_a_tree: Scene) -> None:
    patch = behind_a_tree.made(behind_a_tree.sources()).raw
    st = own_points(behind_a_tree.face, 0.3)
    col, row = np.floor(rendered(patch, behind_a_tree.face, st)).astype(int).T
    said = patch.index[row, col].astype(int) - FIRST_IMAGE
    xyz = behind_a_tree.face.world(st)
    sees = np.array([behind_a_tree.visible(k, xyz) for k in range(3)])
    told = sees[said, np.arange(len(st))]
    assert np.mean(told) > 0.998
    # near to what hides a face the next image may come first
    assert np.mean(said == np.argmax(sees, axis=0)) > 0.95


def test_exposures_off_by_four_leave_no_seam(behind_a_tree: Scene) -> None:
    made = behind_a_tree.made(behind_a_tree.sources({1: (0.25, 3.0), 2: (1.2, -8.0)}))
    off = errors(made.rectified, behind_a_tree.face)
    others = np.concatenate([errors(p, behind_a_tree.face) for p in (made.raw, made.rectified)])
    assert np.mean(off) < 3.0
    assert np.mean(others < 14) > 0.99


def test_what_nobody_sees_is_interpolated_and_not_black() -> None:
    hedge = Panel(
        plane([np.array([[3, -0.5, 0], [9, -0.5, 0], [9, -0.5, 2.5], [3, -0.5, 2.5]])], 9), plain(20, 160, 40)
    )
    scene = Scene(
        wall(), [looking_at("a", (6, -70, 20), (7, 0, 5)), looking_at("b", (0, -70, 25), (7, 0, 5))], (hedge,)
    )
    made = scene.made(scene.sources())
    for patch in (made.raw, made.rectified):
        hidden = patch.index == INTERPOLATED
        assert 0.05 < hidden.sum() / patch.mask.sum() < 0.2
        colours = patch.pixels[hidden].astype(int)
        assert (colours.max(axis=1) > 40).all()
        assert (colours[:, 1] - colours[:, 0] < 25).all()
    assert made.raw.figures.interpolated == pytest.approx(0.1, abs=0.04)


def test_masks_of_the_grid_do_where_nobody_is_asked(behind_a_tree: Scene) -> None:
    made = behind_a_tree.made(behind_a_tree.sources(), exact=False)
    assert np.mean(errors(made.raw, behind_a_tree.face) < 12) > 0.97


def test_nothing_seen_is_no_patch(behind_a_tree: Scene) -> None:
    sources = UnitSources(behind_a_tree.sources())
    blind = FaceSources(behind_a_tree.grid, behind_a_tree.seen, 3)
    assert make_patches(behind_a_tree.face, blind, sources, lambda image, xyz: np.zeros(len(xyz), bool)) is None
    assert make_patches(behind_a_tree.face, FaceSources(behind_a_tree.grid, [], 3), sources) is None


# ---- perspective ------------------------------------------------------------------------------------------------------------------------------


def near_camera(camera: Camera | None = None) -> OrientedImage:
    """Low and from the side, so that the far end is half as large as the near one."""
    return looking_at(
        "near", (-9.0, -13.0, 9.0), (6.0, 0.0, 4.5), camera or Camera(450, 350, 310.0, 310.0, 225.0, 175.0)
    )


def test_triplets_keep_lines_straight_and_pairs_do_not() -> None:
    scene = Scene(wall(), [near_camera()])
    patch = scene.made(scene.sources()).raw
    first = np.rint(scene.cameras[0].project(scene.face.rings[0][:1])[0][0] - patch.corners[0][0, :2])
    along = np.linspace(0.01, 0.99, 400)
    for start, end in (((0, 0), (15, 10)), ((0.5, 9), (14.5, 2)), ((0, 5), (15, 5)), ((7, 0), (7, 10))):
        st = np.array(start) + along[:, None] * (np.array(end) - np.array(start))
        truth = scene.cameras[0].project(scene.face.world(st))[0] - first
        assert np.linalg.norm(rendered(patch, scene.face, st) - truth, axis=1).max() < 1e-6
        assert np.linalg.norm(rendered(patch, scene.face, st, divide=False) - truth, axis=1).max() > 7.0


def test_d_is_the_distance_from_the_plane_of_the_camera() -> None:
    scene = Scene(wall(), [near_camera()])
    made = scene.made(scene.sources())
    camera = scene.cameras[0]
    assert made.raw.corners[0][:, 2] == pytest.approx(np.abs((scene.face.rings[0] - camera.centre) @ camera.axis))
    assert (made.rectified.corners[0][:, 2] == 1.0).all()
    upright = made.rectified.corners[0][:, :2]
    assert upright[0] - upright[3] == pytest.approx([0.0, 10 / 15 * (upright[1] - upright[0])[0]])


def test_a_gentle_lens_stays_within_a_pixel_and_is_not_resampled() -> None:
    camera = Camera(450, 350, 700.0, 700.0, 225.0, 175.0, LENS)
    scene = Scene(wall(), [looking_at("lens", (2.0, -40.0, 22.0), (7.0, 0.0, 5.0), camera)])
    made = scene.made(scene.sources())
    assert made.notes == ()
    first = np.rint(scene.cameras[0].project(scene.face.rings[0][:1])[0][0] - made.raw.corners[0][0, :2])
    st = own_points(scene.face, 0.0)
    truth = scene.cameras[0].project(scene.face.world(st))[0] - first
    assert np.linalg.norm(rendered(made.raw, scene.face, st) - truth, axis=1).max() < 0.6
    assert np.median(errors(made.rectified, scene.face)) < 2.0


@pytest.mark.parametrize("kind", ["strong", "fisheye"])
def test_a_lens_that_bends_the_face_is_rectified(kind: str) -> None:
    camera = Camera(450, 350, 310.0, 310.0, 225.0, 175.0, (-0.2, 0.05, 0.0, 0.0), "perspective")
    if kind == "fisheye":
        camera = replace(camera, distortion=(0.02, 0.0, 0.0, 0.0), kind=FISHEYE)
    scene = Scene(wall(), [near_camera(camera)])
    made = scene.made(scene.sources())
    assert made.raw is made.rectified
    assert made.notes
    assert (made.raw.corners[0][:, 2] == 1.0).all()
    assert np.mean(errors(made.raw, scene.face) < 12) > 0.99


def test_a_face_that_ends_behind_the_camera_is_rectified() -> None:
    long_wall = wall(60.0, 6.0)
    scene = Scene(
        long_wall,
        [looking_at("street", (20.0, -8.0, 2.0), (60.0, 0.0, 3.0), Camera(800, 600, 500.0, 500.0, 400.0, 300.0))],
    )
    made = scene.made(scene.sources(), largest_px=512)
    assert made.raw is made.rectified
    assert made.raw.figures.interpolated > 0.2
    seen = made.raw.index[made.raw.mask] == FIRST_IMAGE
    assert 0.3 < seen.mean() < 0.8


def test_what_is_outside_the_frame_comes_from_the_next_image() -> None:
    scene = Scene(wall(30.0), [looking_at("a", (10, -70, 30), (5, 0, 5)), looking_at("b", (25, -70, 30), (25, 0, 5))])
    made = scene.made(scene.sources())
    assert made.notes == ()
    assert made.raw.figures.interpolated == 0.0
    assert made.raw.figures.occluded > 0.2
    assert np.mean(errors(made.raw, scene.face) < 12) > 0.99


# ---- odd faces --------------------------------------------------------------------------------------------------------------------------------


def test_padding_has_the_colours_of_the_face() -> None:
    """Next to the wall stands a green one, above is the sky; neither is in the padding."""
    green = Panel(plane([np.array([[15, 0, 0], [30, 0, 0], [30, 0, 10], [15, 0, 10.0]])], 9), plain(20, 160, 40))
    scene = Scene(wall(), [looking_at("a", (6, -70, 40), (7, 0, 5))], (green,))
    for patch in (scene.made(scene.sources()).raw, scene.made(scene.sources(), padding_px=4).rectified):
        colours = patch.pixels[patch.mask].astype(int)
        assert (colours[:, 1] - colours[:, 0] < 20).all()
        assert (colours[:, 2] - colours[:, 1] < 30).all()
        assert (patch.index[patch.mask] != OUTSIDE).all()
        assert (patch.index[~patch.mask] == OUTSIDE).all()
        assert (patch.pixels[~patch.mask] == 0).all()


def test_padding_is_as_wide_as_asked(behind_a_tree: Scene) -> None:
    for width in (2, 4):
        patch = behind_a_tree.made(behind_a_tree.sources(), padding_px=width).rectified
        corners = patch.corners[0][:, :2]
        middle = int(corners[:, 1].mean())
        taken = np.flatnonzero(patch.mask[middle])
        assert corners[:, 0].min() - taken[0] == pytest.approx(width + 0.5, abs=0.6)
        assert taken[-1] + 1 - corners[:, 0].max() == pytest.approx(width + 0.5, abs=0.6)


def test_holes_of_a_face_stay_holes() -> None:
    ring = np.array([[0, 0, 0], [15, 0, 0], [15, 0, 10], [0, 0, 10.0]])
    hole = np.array([[5, 0, 3], [5, 0, 7], [10, 0, 7], [10, 0, 3.0]])
    scene = Scene(plane([ring, hole]), [looking_at("a", (6, -70, 40), (7, 0, 5))])
    made = scene.made(scene.sources())
    for patch in (made.raw, made.rectified):
        assert len(patch.corners) == 2
        col, row = np.floor(patch.corners[1][:, :2].mean(axis=0)).astype(int)
        assert not patch.mask[row, col]
        colours = patch.pixels[patch.mask].astype(int)
        assert (colours[:, 2] - colours[:, 1] < 30).all()


@pytest.mark.parametrize("size", [0.004, 0.05, 0.2])
def test_faces_smaller_than_a_pixel_have_a_patch(size: float) -> None:
    big = wall()
    face = plane([np.array([[6, 0, 4], [6 + size, 0, 4], [6 + size, 0, 4 + size], [6, 0, 4 + size]])])
    camera = looking_at("a", (6, -70, 40), (7, 0, 5))
    scene = Scene(face, [camera], cell=size)
    scene.pictures = [facade_scene.photograph([Panel(big, storeys)], camera)]
    made = scene.made(scene.sources())
    for patch in (made.raw, made.rectified):
        assert patch.mask.any()
        assert np.abs(patch.pixels[patch.mask].astype(int) - storeys(np.array([[6.0, 4.0]]))).max() < 30
        col, row = patch.corners[0][:, 0], patch.corners[0][:, 1]
        assert (col > 1).all()
        assert (row > 1).all()
        assert patch.mask[row.astype(int), col.astype(int)].all()


def test_a_sliver_has_a_patch_of_its_colours() -> None:
    face = plane([np.array([[1, 0, 9.4], [14, 0, 9.4], [14, 0, 9.43]])])
    camera = looking_at("a", (6, -70, 40), (7, 0, 5))
    scene = Scene(face, [camera], cell=0.01)
    scene.pictures = [facade_scene.photograph([Panel(wall(), storeys)], camera)]
    made = scene.made(scene.sources())
    xyz = np.column_stack([np.linspace(2, 13, 40), np.zeros(40), np.full(40, 9.401)])
    for patch in (made.raw, made.rectified):
        col, row = np.floor(rendered(patch, face, face.on_plane(xyz))).astype(int).T
        assert patch.mask[row, col].all()
        assert np.abs(patch.pixels[row, col] - storeys(xyz[:, [0, 2]])).max() < 45


def test_a_face_of_200_m_is_scaled_to_the_page() -> None:
    face = wall(200.0, 12.0)
    cameras = [
        looking_at(
            str(k), (20 + 40.0 * k, -70, 30), (20 + 40.0 * k, 0, 5), Camera(700, 300, 900.0, 900.0, 350.0, 150.0)
        )
        for k in range(5)
    ]
    scene = Scene(face, cameras, cell=1.0)
    made = scene.made(scene.sources(), largest_px=1024, most_outside=0.9)
    assert max(made.rectified.pixels.shape) <= 1024
    assert max(made.raw.pixels.shape) <= 1024
    assert any("largest size" in note for note in made.notes)
    assert made.rectified.figures.images == 5
    assert np.mean(errors(made.rectified, face, 1.0) < 30) > 0.95


def test_level_roofs_are_seen_from_above() -> None:
    roof = plane([np.array([[0, 0, 9], [15, 0, 9], [15, 10, 9], [0, 10, 9.0]])])
    scene = Scene(roof, [looking_at("a", (6, -40, 70), (7, 5, 9))])
    made = scene.made(scene.sources())
    assert np.mean(errors(made.raw, roof) < 12) > 0.99
    assert np.mean(errors(made.rectified, roof) < 12) > 0.99
    top = made.rectified.corners[0]
    assert top[3, 1] < top[0, 1]
    assert top[1, 0] > top[0, 0]


# ---- odd images -------------------------------------------------------------------------------------------------------------------------------


def test_grey_deep_and_infrared_images_stand_beside_each_other(behind_a_tree: Scene) -> None:
    first, second, third = (np.clip(np.rint(p), 0, 255) for p in behind_a_tree.pictures)
    arrays = [
        np.dstack([first, np.full(first.shape[:2], 222)]).astype(np.uint8),
        second.mean(axis=2, keepdims=True).astype(np.uint8),
        (third * 16).astype(np.uint16),
    ]
    pictures = [ColourImage(c, ArrayPixels(a)) for c, a in zip(behind_a_tree.cameras, arrays, strict=True)]
    made = behind_a_tree.made(sources_of(pictures))
    assert made.raw.pixels.dtype == np.uint8
    assert made.raw.pixels.shape[2] == 3
    off = errors(made.raw, behind_a_tree.face)
    assert np.mean(off < 20) > 0.97
    assert set(np.unique(made.raw.index)) >= {FIRST_IMAGE, FIRST_IMAGE + 1, FIRST_IMAGE + 2}


def test_an_image_that_cannot_be_read_is_left_out_and_named(behind_a_tree: Scene) -> None:
    class Damaged(ArrayPixels):
        def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int = 0) -> np.ndarray:
            raise CatalogError("the file is damaged", where="a.tif")

    sources = behind_a_tree.sources()
    for lost in (0, 1):
        broken = list(sources)
        broken[lost] = replace(
            sources[lost], colour=replace(sources[lost].colour, pixels=Damaged(np.zeros((300, 400, 3), np.uint8)))
        )
        made = behind_a_tree.made(broken)
        assert FIRST_IMAGE + lost not in made.raw.index
        assert made.raw.figures.images == 2
        assert any("a.tif" in note for note in made.notes)
        assert np.mean(errors(made.raw, behind_a_tree.face) < 25) > 0.95


def test_where_an_image_has_no_data_the_next_one_shows(behind_a_tree: Scene) -> None:
    sources = behind_a_tree.sources()
    array = as_pixels(behind_a_tree.pictures[0]).array.copy()
    array[:, 230:] = 0
    cut = [replace(sources[0], colour=replace(sources[0].colour, pixels=ArrayPixels(array))), *sources[1:]]
    made = behind_a_tree.made(cut)
    assert made.raw.figures.occluded > 0.3
    assert made.raw.pixels[made.raw.mask].max(axis=1).min() > 40
    assert np.mean(errors(made.raw, behind_a_tree.face) < 14) > 0.98
    black = UnitSources(
        [replace(sources[0], colour=replace(sources[0].colour, pixels=ArrayPixels(np.zeros_like(array))))]
    )
    alone = FaceSources(behind_a_tree.grid, behind_a_tree.seen[:1], 1)
    assert make_patches(behind_a_tree.face, alone, black, behind_a_tree.visible) is None


def test_only_windows_are_read(behind_a_tree: Scene) -> None:
    class Watched(ArrayPixels):
        def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int = 0) -> np.ndarray:
            if level == 0:
                asked.append((rows[1] - rows[0]) * (cols[1] - cols[0]))
            return super().window(rows, cols, level)

    asked: list[int] = []
    wide = replace(behind_a_tree.cameras[0].camera, width=4000, height=3000, cx=2000.0, cy=1500.0)
    camera = replace(behind_a_tree.cameras[0], camera=wide)
    array = np.zeros((3000, 4000, 3), np.uint8)
    array[1350:1650, 1800:2200] = as_pixels(behind_a_tree.pictures[0]).array
    source = Source(ColourImage(camera, Watched(array)), 255.0)
    made = make_patches(
        behind_a_tree.face,
        FaceSources(behind_a_tree.grid, behind_a_tree.seen[:1], 1),
        UnitSources([source]),
        behind_a_tree.visible,
    )
    assert made is not None
    assert sum(asked) < 40_000


def test_the_same_input_gives_the_same_bytes(behind_a_tree: Scene) -> None:
    one, two = (behind_a_tree.made(behind_a_tree.sources({1: (0.5, 0.0)})) for _ in range(2))
    for a, b in ((one.raw, two.raw), (one.rectified, two.rectified)):
        assert a.pixels.tobytes() == b.pixels.tobytes()
        assert a.index.tobytes() == b.index.tobytes()


def test_73_faces_of_12_images_take_seconds(behind_a_tree: Scene) -> None:
    sources = behind_a_tree.sources()
    twelve = UnitSources([sources[k % 3] for k in range(12)])
    empty = RunLengthMask.of(np.zeros((behind_a_tree.grid.rows, behind_a_tree.grid.cols), bool))
    assert empty.count == 0
    kept = [
        replace(behind_a_tree.seen[k % 3], view=replace(behind_a_tree.seen[k % 3].view, image=k)) for k in range(12)
    ]
    views = FaceSources(behind_a_tree.grid, kept, 100)

    def speckled(image: int, xyz: np.ndarray) -> np.ndarray:
        return np.asarray(np.sin(xyz @ [1.3, 0.0, 2.1] + image) > 0.6)

    make_patches(behind_a_tree.face, views, twelve, speckled)
    start = time.process_time()
    for _ in range(5):
        make_patches(behind_a_tree.face, views, twelve, speckled)
    assert (time.process_time() - start) / 5 * 73 < 30.0
