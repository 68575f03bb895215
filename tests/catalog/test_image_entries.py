from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import rasterio
import shapely
from PIL import Image
from rasterio.transform import from_origin
from scipy.ndimage import gaussian_filter

from cityflow.catalog.check import check_catalog
from cityflow.catalog.create import CreatedCatalog, SurveyFiles, SurveyText, create_catalog
from cityflow.catalog.findings import Level
from cityflow.catalog.image_files import unit_names
from cityflow.catalog.orientation import ImageSource, image_source
from cityflow.core.camera import Camera, OrientedImage
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import from_omega_phi_kappa
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.orientation.colmap import write_colmap
from survey_files import write_outlines

BORUSZYN = Path(__file__).parents[2] / "catalogs" / "boruszyn"
ORIGIN = (340_600.0, 548_100.0, 0.0)
CAMERA = Camera(160, 120, 150.0, 150.0, 80.0, 60.0)
GROUND, ROOF = 60.0, 72.0
EXPOSURES = (1.0, 1.0, 0.5, 1.0, 0.5, 1.0)


def _poses() -> list[OrientedImage]:
    """Two strips of three, 100 m above the ground, some tilted."""
    return [
        OrientedImage(
            f"img_{i}.jpg", CAMERA, from_omega_phi_kappa(0.1 * (i % 2), -0.05 * i, 0.3),
            np.array([25.0 * (i % 3), 30.0 * (i // 3), GROUND + 100.0]),
        )
        for i in range(6)
    ]  # fmt: skip


def _texture(seed: int) -> np.ndarray:
    """(400, 400) brightness of the ground, half a metre a cell, from (−70, −80) on."""
    noise = np.random.default_rng(seed).normal(size=(400, 400))
    field = gaussian_filter(noise, 6)
    return np.asarray(110 + 45 * field / np.abs(field).max())


def _photograph(image: OrientedImage, ground: np.ndarray, exposure: float) -> np.ndarray:
    u, v = np.meshgrid(np.arange(160) + 0.5, np.arange(120) + 0.5)
    rays = image.rays(np.column_stack([u.ravel(), v.ravel()]))
    xy = image.centre[:2] + rays[:, :2] * ((GROUND - image.centre[2]) / rays[:, 2])[:, None]
    cells = np.clip(((xy + np.array([70, 80])) / 0.5).astype(int), 0, 399)
    grey = ground[cells[:, 1], cells[:, 0]].reshape(120, 160) * exposure
    return np.repeat(np.rint(grey)[..., None], 3, axis=2).astype(np.uint8)


@pytest.fixture
def survey(tmp_path: Path) -> Path:
    """A folder with images and a COLMAP model whose points are ground, roofs, and two blunders."""
    folder = tmp_path / "survey"
    (folder / "images").mkdir(parents=True)
    ground = _texture(1)
    for image, exposure in zip(_poses(), EXPOSURES, strict=True):
        Image.fromarray(_photograph(image, ground, exposure)).save(folder / "images" / image.name, quality=95)
    rng = np.random.default_rng(2)
    xy = rng.uniform((-40, -50), (90, 80), (3000, 2))
    z = np.where(rng.random(3000) < 0.1, ROOF, GROUND) + rng.normal(0, 0.1, 3000)
    sparse = np.vstack([np.column_stack([xy, z]), [[10.0, 10.0, -50.0], [20.0, 0.0, 140.0]]])
    write_colmap(folder / "sparse", _poses(), sparse)
    return folder


def _made(survey: Path, crs: str = "EPSG:2180", **options: object) -> CreatedCatalog:
    source = ImageSource(survey / "images", {"colmap": survey / "sparse"}, origin=ORIGIN, **options)  # type: ignore[arg-type]
    return create_catalog(survey / "c", SurveyFiles(images=source), crs=crs, text=SurveyText(attribution="x"))


def _notes(made: CreatedCatalog) -> str:
    return "\n".join(made.notes)


def _evened(made: CreatedCatalog, grey: float) -> np.ndarray:
    """What each image's balance makes of a thing that it shows by its exposure, mean of the bands, in the middle of the image."""
    shown = []
    for asset, exposure in zip(made.catalog.images, EXPOSURES, strict=True):
        gamma = np.array(asset.gamma or (1.0, 1.0, 1.0))
        shown.append(float(np.mean(np.array(asset.gain) * 255 * (grey * exposure / 255) ** gamma)))
    return np.array(shown)


def test_what_is_written_is_what_is_read(survey: Path) -> None:
    made = _made(survey)
    catalog = read_catalog(survey / "c")
    assert catalog == made.catalog
    assert [a.name for a in catalog.images] == [f"img_{i}" for i in range(6)]
    for asset, given in zip(catalog.images, _poses(), strict=True):
        assert np.abs(asset.oriented.centre - (given.centre + ORIGIN)).max() < 1e-9
        assert np.abs(asset.oriented.rotation - given.rotation).max() < 1e-12
        assert asset.oriented.camera == CAMERA
        assert Path(asset.href) == survey / "images" / given.name
        assert (asset.bands, asset.dtype) == (3, "uint8")
    assert catalog.sparse is not None
    assert catalog.sparse.points == 3002
    assert Path(catalog.sparse.href).parent == survey / "c" / "data"


def test_heights_are_those_of_ground_and_roofs(survey: Path) -> None:
    """Blunders 110 m below and 70 m above do not count; there is room of a few metres."""
    for asset in _made(survey).catalog.images:
        low, high = asset.heights
        assert GROUND - 6 < low < GROUND - 1
        assert ROOF + 1 < high < ROOF + 6


def test_gains_undo_the_exposures(survey: Path) -> None:
    made = _made(survey)
    for grey in (70.0, 110.0, 150.0):
        shown = _evened(made, grey)
        assert shown == pytest.approx(np.full(6, shown.mean()), rel=0.03)
    assert "2 groups of exposures" in _notes(made)
    assert "exposures" in check_catalog(survey / "c").text()
    assert {a.gain for a in _made(survey, gains=False).catalog.images} == {(1.0, 1.0, 1.0)}


def test_another_curve_and_corners_that_lack_light_are_found(survey: Path) -> None:
    """Photographs of one exposure are taken with another curve, and all get dark towards the corners."""
    u, v = np.meshgrid(np.arange(160) + 0.5 - 80, np.arange(120) + 0.5 - 60)
    dimming = np.exp(-0.3 * (u**2 + v**2) / (80**2 + 60**2))[..., None]
    for image, exposure in zip(_poses(), EXPOSURES, strict=True):
        plain = _photograph(image, _texture(1), 1.0) / 255 * dimming
        curved = plain if exposure == 1.0 else 0.8 * plain**1.5
        Image.fromarray(np.rint(curved * 255).astype(np.uint8)).save(survey / "images" / image.name, quality=95)
    assets = _made(survey).catalog.images
    assert [a.gamma == () for a in assets] == [e == 1.0 for e in EXPOSURES]
    assert all(a.gamma == pytest.approx((1 / 1.5,) * 3, abs=0.07) for a in assets if a.gamma)
    assert [a.falloff for a in assets] == pytest.approx([0.3] * 6, abs=0.06)
    assert read_catalog(survey / "c").images == assets


def test_catalogs_that_know_gains_alone_stay_readable(survey: Path) -> None:
    made = _made(survey)
    for path in sorted((survey / "c" / "items").glob("img_*.json")):
        tree = json.loads(path.read_text())
        for key in ("cityflow:gamma", "cityflow:falloff", "cityflow:shoulder"):
            tree["properties"].pop(key, None)
        path.write_text(json.dumps(tree))
    read = read_catalog(survey / "c").images
    assert {(a.gamma, a.falloff, a.shoulder) for a in read} == {((), 0.0, 0.0)}
    assert [a.gain for a in read] == [a.gain for a in made.catalog.images]


def test_photographs_exposed_for_a_bright_part_get_a_shoulder(survey: Path) -> None:
    """In the east the ground is half as bright again, and exposed less; the balance would lift it beyond white."""
    ground = 1.4 * _texture(1)
    ground[:, 190:] *= 1.5
    for image in _poses():
        exposure = 0.68 if image.centre[0] > 20 else 1.3
        shown = np.minimum(4 * _photograph(image, ground, exposure / 4).astype(int), 255)
        Image.fromarray(shown.astype(np.uint8)).save(survey / "images" / image.name, quality=95)
    made = _made(survey).catalog.images
    (shoulder,) = {a.shoulder for a in made}
    assert shoulder > 0.0
    assert read_catalog(survey / "c").images == made


def test_items_follow_the_extension(survey: Path) -> None:
    _made(survey)
    item = json.loads((survey / "c" / "items" / "img_3.json").read_text())
    p = item["properties"]
    assert any("perspective-imagery" in e for e in item["stac_extensions"])
    assert p["pers:interior_orientation"]["sensor_array_dimensions"] == [160, 120]
    assert p["pers:crs"] == 2180
    assert np.radians([p["pers:omega"], p["pers:phi"], p["pers:kappa"]]) == pytest.approx((0.1, -0.15, 0.3))
    assert item["assets"]["data"]["href"].startswith("../../images/")
    assert len(json.dumps(item)) < 4000


def test_a_forgotten_origin_is_named(survey: Path) -> None:
    made = create_catalog(
        survey / "c", SurveyFiles(images=ImageSource(survey / "images", {"colmap": survey / "sparse"})), crs="EPSG:2180"
    )
    assert "--origin" in _notes(made)
    assert check_catalog(survey / "c").has_errors


def test_outlines_are_placed_among_footprints(survey: Path) -> None:
    x, y = ORIGIN[:2]
    inside, outside = shapely.box(x + 20, y + 10, x + 30, y + 20), shapely.box(x + 5000, y, x + 5010, y + 10)
    outlines = write_outlines(survey / "o.gpkg", [inside, outside], "EPSG:2180")
    source = ImageSource(survey / "images", {"colmap": survey / "sparse"}, origin=ORIGIN)
    create_catalog(survey / "c", SurveyFiles(images=source, outlines=outlines), crs="EPSG:2180")
    report = check_catalog(survey / "c")
    assert not report.has_errors
    assert report.summary["outlines"] == "2, 1 in the survey, 1 outside"


def test_a_copied_catalog_can_be_moved(survey: Path) -> None:
    source = ImageSource(survey / "images", {"colmap": survey / "sparse"}, origin=ORIGIN)
    create_catalog(survey / "c", SurveyFiles(images=source), crs="local", copy=True)
    (survey / "c").rename(survey / "moved")
    for asset in read_catalog(survey / "moved").assets:
        assert Path(asset.href).parent == survey / "moved" / "data"
        assert Path(asset.href).exists()


def _broken(survey: Path) -> None:
    """One image of each kind of fault; three stay whole."""
    images = survey / "images"
    (images / "img_0.jpg").unlink()
    whole = (images / "img_1.jpg").read_bytes()
    (images / "img_1.jpg").write_bytes(whole[: len(whole) // 2])
    Image.open(images / "img_2.jpg").resize((80, 60)).save(images / "img_2.jpg")
    turned = Image.open(images / "img_3.jpg")
    exif = turned.getexif()
    exif[0x0112] = 6
    turned.save(images / "img_3.jpg", exif=exif)


def test_bad_images_are_left_out_by_name_and_the_rest_goes_on(survey: Path) -> None:
    _broken(survey)
    made = _made(survey)
    assert [a.name for a in made.catalog.images] == ["img_4", "img_5"]
    notes = {n.split(":")[1].strip(): n for n in made.notes if n.startswith("left out")}
    assert "in the model, but not in images/" in notes["img_0.jpg"]
    assert "truncated" in notes["img_1.jpg"]
    assert "80 × 60" in notes["img_2.jpg"]
    assert "EXIF" in notes["img_3.jpg"]
    report = check_catalog(survey / "c")
    assert not report.has_errors


def test_a_single_image_is_refused(survey: Path) -> None:
    for i in range(1, 6):
        (survey / "images" / f"img_{i}.jpg").unlink()
    with pytest.raises(CatalogError, match=r"1 image can be used.*5 left out"):
        _made(survey)
    assert not (survey / "c").exists()


def test_an_unknown_camera_model_is_named(survey: Path) -> None:
    cameras = survey / "sparse" / "cameras.txt"
    cameras.write_text(cameras.read_text() + "2 FOV 160 120 150 150 80 60 0.9\n")
    images = survey / "sparse" / "images.txt"
    images.write_text(images.read_text().replace(" 1 img_5.jpg", " 2 img_5.jpg"))
    made = _made(survey)
    assert len(made.catalog.images) == 5
    assert "img_5.jpg: the camera model FOV" in _notes(made)


def test_images_without_orientation_and_pixels_cut_later_are_told(survey: Path) -> None:
    Image.new("RGB", (160, 120)).save(survey / "images" / "spare.jpg")
    assert "1 images have no orientation and are not used (spare.jpg)" in _notes(_made(survey))
    path = survey / "images" / "img_2.jpg"
    path.write_bytes(path.read_bytes()[:-500])
    report = check_catalog(survey / "c")
    assert any("img_2.jpg" in f.where and "truncated" in f.problem for f in report.of(Level.WARNING))
    assert not report.has_errors
    assert "5, " in report.summary["images"]


def test_without_anything_that_tells_heights_they_must_be_given(survey: Path) -> None:
    (survey / "sparse" / "points3D.txt").unlink()
    with pytest.raises(CatalogError, match="--heights"):
        _made(survey)
    made = _made(survey, heights=(55.0, 90.0))
    assert {a.heights for a in made.catalog.images} == {(55.0, 90.0)}
    assert made.catalog.sparse is None
    shown = _evened(made, 110.0)
    assert shown == pytest.approx(np.full(6, shown.mean()), rel=0.15)


def _terrain(path: Path, height: float) -> Path:
    transform = from_origin(ORIGIN[0] - 200, ORIGIN[1] + 200, 2.0, 2.0)
    profile = {"driver": "GTiff", "height": 200, "width": 200, "count": 1, "dtype": "float32", "crs": "EPSG:2180"}
    with rasterio.open(path, "w", transform=transform, **profile) as raster:
        raster.write(np.full((1, 200, 200), height, np.float32))
    return path


@pytest.mark.parametrize(("height", "said"), [(GROUND, False), (GROUND - 36.5, True)])
def test_heights_of_another_datum_are_named(survey: Path, height: float, said: bool) -> None:
    source = ImageSource(survey / "images", {"colmap": survey / "sparse"}, origin=ORIGIN)
    dtm = _terrain(survey / "dtm.tif", height)
    made = create_catalog(survey / "c", SurveyFiles(images=source, dtm=dtm), crs="EPSG:2180")
    for text in (_notes(made), check_catalog(survey / "c").text()):
        told = re.search(r"points lie ([\d.]+) m above the given heights", text)
        assert (told is not None) is said
        assert told is None or float(told[1]) == pytest.approx(36.5, abs=0.5)


def test_terrain_tells_the_heights_where_no_points_do(survey: Path) -> None:
    (survey / "sparse" / "points3D.txt").unlink()
    source = ImageSource(survey / "images", {"colmap": survey / "sparse"}, origin=ORIGIN)
    made = create_catalog(
        survey / "c", SurveyFiles(images=source, dtm=_terrain(survey / "dtm.tif", GROUND)), crs="EPSG:2180"
    )
    for asset in made.catalog.images:
        assert asset.heights[0] < GROUND < GROUND + 90 < asset.heights[1]


def test_grads_given_as_degrees_are_named(survey: Path) -> None:
    """Kappas beyond 360 cannot be degrees; right or wrong, the catalog is made."""
    lines = []
    for i in range(6):
        kappa = (i % 4) * 95.0 + 100.0
        lines.append(f"img_{i}.jpg,{25.0 * (i % 3)},{30.0 * (i // 3)},{GROUND + 100},0.5,-0.4,{kappa}")
    (survey / "opk.csv").write_text("\n".join(lines) + "\n")
    (survey / "cameras.json").write_text(json.dumps([{"id": "c", "width": 160, "height": 120, "focal_px": 150}]))
    for unit in ("grad", "degree"):
        files = {"opk": str(survey / "opk.csv"), "cameras": str(survey / "cameras.json"), "angle_unit": unit}
        source = image_source(survey / "images", files, "340600,548100,0", "55,90")
        made = create_catalog(survey / "c", SurveyFiles(images=source), crs="EPSG:2180")
        assert len(made.catalog.images) == 6
        rotation = made.catalog.images[1].oriented.rotation
        kappa = np.radians(195 if unit == "degree" else 195 * 0.9)
        assert np.cos(np.arctan2(rotation[0, 1], rotation[0, 0]) - kappa) == pytest.approx(1, abs=1e-3)
        assert ("--angle-unit grad" in _notes(made)) is (unit == "degree")


def test_views_that_do_not_meet_are_named(survey: Path) -> None:
    apart = [OrientedImage(i.name, i.camera, i.rotation, i.centre * (40, 40, 1)) for i in _poses()]
    write_colmap(survey / "sparse", apart, np.empty((0, 3)))
    source = ImageSource(survey / "images", {"colmap": survey / "sparse"}, heights=(55.0, 90.0))
    made = create_catalog(survey / "c", SurveyFiles(images=source), crs="local")
    assert "meet none of" in _notes(made)
    assert "6 images meet no other" in check_catalog(survey / "c").text()


def test_maps_are_written_and_say_what_is_seen(survey: Path) -> None:
    _made(survey)
    report = check_catalog(survey / "c", survey / "maps")
    assert "GSD" in report.summary
    with rasterio.open(survey / "maps" / "views.tif") as views:
        assert views.crs.to_epsg() == 2180
        row, col = views.index(ORIGIN[0] + 25, ORIGIN[1] + 15)
        seen = views.read(1)[row, col]
    inside = [i.holds(i.project(np.array([[25.0, 15.0, GROUND - 4]]))[0])[0] for i in _poses()]
    assert seen == pytest.approx(sum(inside), abs=1)
    with rasterio.open(survey / "maps" / "walls.tif") as walls:
        assert walls.count == 8
    page = (survey / "maps" / "maps.html").read_text()
    assert page.count("<figure>") >= 12
    assert (survey / "maps" / "footprints.gpkg").exists()


@pytest.mark.parametrize(
    ("names", "units"),
    [
        (["a.jpg", "b.tif"], ["a", "b"]),
        (["a.jpg", "a.tif"], ["a.jpg", "a.tif"]),
        (["x/1.jpg", "y/1.jpg"], ["x-1", "y-1"]),
        (["Bild 1 (neu).jpg", "ä.jpg"], ["Bild-1-neu", "image"]),
        (["dtm.jpg", "a b.jpg", "a-b.jpg"], ["dtm.jpg", "a-b.jpg-2", "a-b.jpg-3"]),
    ],
)
def test_names_are_fit_for_units_and_unique(names: list[str], units: list[str]) -> None:
    assert unit_names(names, {"dtm"}) == units


def test_options_that_make_no_sense_are_named(tmp_path: Path) -> None:
    with pytest.raises(CatalogError, match="--images"):
        image_source(None, {"colmap": str(tmp_path)})
    for options, remedy in (
        ({}, "--cameras"),
        ({"cameras": str(tmp_path), "angle_unit": "gon"}, "degree, grad, radian"),
    ):
        source = image_source(tmp_path, {"opk": str(tmp_path / "o.csv"), **options})
        with pytest.raises(CatalogError, match=remedy):
            create_catalog(tmp_path / "c", SurveyFiles(images=source), crs="local")
    with pytest.raises(CatalogError, match="3 numbers"):
        image_source(tmp_path, {"colmap": str(tmp_path)}, "1,2")
    with pytest.raises(CatalogError, match="without orientation"):
        create_catalog(tmp_path / "c", SurveyFiles(images=ImageSource(tmp_path)), crs="local")


def test_boruszyn_is_whole() -> None:
    report = check_catalog(BORUSZYN)
    assert not report.has_errors
    assert report.summary["images"].startswith("28, ")
    catalog = read_catalog(BORUSZYN)
    assert "Zaborowski" in catalog.attribution
    assert all(Path(a.href).parent == BORUSZYN / "data" for a in catalog.images)
