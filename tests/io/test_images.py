"""Pictures of all kinds become tiled pyramids with the very same pixels; damaged ones are named."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
import rasterio
from PIL import Image

from cityflow.core.camera import Camera
from cityflow.core.pixels import ArrayPixels, level_shape
from cityflow.errors import CatalogError
from cityflow.io.images.tiled_images import TilingParameters, check_against, image_header, open_image, tile_image


def _picture(height: int = 611, width: int = 1037, bands: int = 3, top: int = 255, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    waves = [np.sin(x / (20 + 7 * b)) * np.cos(y / (31 - 5 * b)) for b in range(bands)]
    noisy = (np.stack(waves, axis=-1) + 1) / 2 * 0.9 * top + rng.uniform(0, 0.1 * top, (height, width, bands))
    return noisy.astype(np.uint8 if top <= 255 else np.uint16)


def _write(path: Path, array: np.ndarray, **options: object) -> Path:
    with rasterio.open(
        path, "w", height=array.shape[0], width=array.shape[1], count=array.shape[2], dtype=array.dtype, **options
    ) as dataset:
        dataset.write(np.moveaxis(array, -1, 0))
    return path


SOURCES: dict[str, tuple[dict[str, int], dict[str, str]]] = {
    "grey8.png": ({"bands": 1}, {}),
    "rgb8.png": ({}, {}),
    "rgb12in16.tif": ({"top": 4095}, {}),
    "grey16.png": ({"bands": 1, "top": 65535}, {}),
    "rgbnir16.tif": ({"bands": 4, "top": 65535}, {"photometric": "RGB", "alpha": "NO"}),
    "tall.tif": ({"height": 1300, "width": 90}, {}),
    "tiny.tif": ({"height": 3, "width": 5}, {}),
}
"""What a picture is of, and how it is written."""


@pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")
@pytest.mark.parametrize("name", SOURCES)
@pytest.mark.parametrize("tiling", [TilingParameters(), TilingParameters(tile_px=256, compression="deflate")])
def test_every_level_is_the_mean_of_the_source(tmp_path: Path, name: str, tiling: TilingParameters) -> None:
    kind, options = SOURCES[name]
    array = _picture(**kind)
    tile_image(_write(tmp_path / name, array, **options), tmp_path / "out.tif", tiling)
    image, truth = open_image(tmp_path / "out.tif"), ArrayPixels(array)
    assert (image.height, image.width, image.bands, image.dtype) == (*array.shape, array.dtype)
    for level in range(image.levels + 2):
        rows, cols = level_shape(image.height, image.width, level)
        whole = truth.window((0, rows), (0, cols), level)
        np.testing.assert_array_equal(image.window((0, rows), (0, cols), level), whole)
        part = (rows // 3, rows), (cols // 4, cols // 2 + 1)
        np.testing.assert_array_equal(image.window(*part, level), whole[slice(*part[0]), slice(*part[1])])
    image.close()


@pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")
def test_the_same_picture_gives_the_same_bytes_and_survives_pickling(tmp_path: Path) -> None:
    source = _write(tmp_path / "a.png", _picture())
    tile_image(source, tmp_path / "one.tif")
    tile_image(source, tmp_path / "two.tif")
    assert (tmp_path / "one.tif").read_bytes() == (tmp_path / "two.tif").read_bytes()
    image = open_image(tmp_path / "one.tif")
    first = image.window((10, 20), (30, 50))
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(image)).window((10, 20), (30, 50)), first)
    with pytest.raises(ValueError, match="do not lie inside"):
        image.window((0, 612), (0, 10))


def test_palette_becomes_colours_and_alpha_goes(tmp_path: Path) -> None:
    flat = np.repeat(np.repeat(np.arange(6, dtype=np.uint8).reshape(2, 3) * 40, 50, 0), 50, 1)
    rgb = np.stack([flat, 255 - flat, flat // 2], axis=-1)
    Image.fromarray(rgb).quantize(6, method=Image.Quantize.MEDIANCUT).save(tmp_path / "palette.png")
    stored = np.asarray(Image.open(tmp_path / "palette.png").convert("RGB"))
    Image.fromarray(np.dstack([rgb, np.full(flat.shape, 128, np.uint8)])).save(tmp_path / "alpha.png")
    for name, truth in (("palette.png", stored), ("alpha.png", rgb)):
        tile_image(tmp_path / name, tmp_path / f"{name}.tif")
        assert image_header(tmp_path / name).bands == 3
        np.testing.assert_array_equal(open_image(tmp_path / f"{name}.tif").window((0, 100), (0, 150)), truth)


@pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")
@pytest.mark.parametrize("kind", ["rgba", "grey and alpha", "palette", "rgba of 16 bits", "no data", "mask"])
def test_what_a_file_does_not_show_is_black(tmp_path: Path, kind: str) -> None:
    shown, picture = np.ones((600, 120), bool), _picture(600, 120).clip(30, 250)
    shown[:, :50] = False
    picture[~shown] = 255
    path, opaque = tmp_path / "a.png", np.where(shown, 255, 0).astype(np.uint8)
    truth = np.where(shown[..., None], picture, 0)
    if kind == "rgba":
        Image.fromarray(np.dstack([picture, opaque])).save(path)
    elif kind == "grey and alpha":
        Image.fromarray(np.dstack([picture[..., 0], opaque]), "LA").save(path)
        truth = truth[..., :1]
    elif kind == "palette":
        image = Image.fromarray(np.where(shown, 1, 0).astype(np.uint8), "P")
        image.putpalette([255, 255, 255, 90, 80, 70])
        image.save(path, transparency=0)
        truth = np.where(shown[..., None], np.array([90, 80, 70]), 0)
    elif kind == "rgba of 16 bits":
        path = _write(
            tmp_path / "a.tif", np.dstack([picture, opaque]).astype(np.uint16) * 9, photometric="RGB", alpha="YES"
        )
        truth = truth.astype(np.uint16) * 9
    else:
        path = _write(tmp_path / "a.tif", picture, photometric="RGB", **({"nodata": 255} if kind == "no data" else {}))
        if kind == "mask":
            with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True), rasterio.open(path, "r+") as dataset:
                dataset.write_mask(shown)
    tile_image(path, tmp_path / "out.tif")
    np.testing.assert_array_equal(open_image(tmp_path / "out.tif").window((0, 600), (0, 120)), truth)


@pytest.mark.parametrize("progressive", [False, True])
def test_a_jpeg_is_decoded_as_others_decode_it(tmp_path: Path, progressive: bool) -> None:
    # without subsampling, as builds of libjpeg interpolate chroma in different ways
    Image.fromarray(_picture()).save(tmp_path / "a.jpg", quality=92, progressive=progressive, subsampling=0)
    tile_image(tmp_path / "a.jpg", tmp_path / "a.tif")
    mine = open_image(tmp_path / "a.tif").window((0, 611), (0, 1037)).astype(int)
    other = np.asarray(Image.open(tmp_path / "a.jpg")).astype(int)
    assert np.abs(mine - other).max() <= 2  # two builds of libjpeg may round differently


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "TIFF"])
@pytest.mark.parametrize("share", [0.2, 0.6, 0.97])
def test_a_cut_file_is_named(tmp_path: Path, kind: str, share: float) -> None:
    path = tmp_path / f"cut.{kind.lower()}"
    Image.fromarray(_picture()).save(path, format=kind)
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    with pytest.raises(CatalogError) as caught:
        tile_image(path, tmp_path / "out.tif")
    assert "cut." in caught.value.where


def test_a_jpeg_damaged_in_its_middle_is_named(tmp_path: Path) -> None:
    path = tmp_path / "hole.jpg"
    Image.fromarray(_picture()).save(path, quality=90)
    data = bytearray(path.read_bytes())
    middle = len(data) // 2
    del data[middle : middle + 20000]  # what a lost block of a disk leaves
    path.write_bytes(bytes(data))
    with pytest.raises(CatalogError, match="damaged"):
        tile_image(path, tmp_path / "out.tif")


def test_what_is_no_picture_is_named(tmp_path: Path) -> None:
    (tmp_path / "text.jpg").write_text("no picture")
    with pytest.raises(CatalogError, match="no image"):
        image_header(tmp_path / "text.jpg")
    with pytest.raises(CatalogError, match="no such image"):
        image_header(tmp_path / "nowhere.jpg")
    Image.fromarray(np.zeros((20, 20), np.float32)).save(tmp_path / "float.tif")
    with pytest.raises(CatalogError, match="float32"):
        image_header(tmp_path / "float.tif")
    Image.fromarray(_picture(20, 20)).save(tmp_path / "plain.png")
    with pytest.raises(CatalogError, match="not tiled"):
        open_image(tmp_path / "plain.png")


def _tagged(path: Path, orientation: int) -> Path:
    exif = Image.Exif()
    exif[0x0112], exif[0x010F], exif[0x0110] = orientation, "Maker", "Model 1"
    fine = exif.get_ifd(0x8769)
    fine[0x9003], fine[0xA431] = "2026:05:04 10:11:12", "S17"
    Image.fromarray(_picture(60, 80)).save(path, exif=exif)
    return path


@pytest.mark.parametrize("suffix", ["jpg", "png"])
def test_the_header_tells_what_exif_holds(tmp_path: Path, suffix: str) -> None:
    header = image_header(_tagged(tmp_path / f"a.{suffix}", 1))
    assert (header.width, header.height, header.bands, header.dtype) == (80, 60, 3, "uint8")
    assert (header.taken, header.camera, header.orientation) == ("2026:05:04 10:11:12", "Maker Model 1", 1)
    assert header.serial == "S17"


def test_what_cannot_be_the_cameras_image_is_refused(tmp_path: Path) -> None:
    header = image_header(_tagged(tmp_path / "a.jpg", 1))
    check_against(header, Camera(80, 60, 70.0, 70.0, 40.0, 30.0))
    with pytest.raises(CatalogError, match="wrong size"):
        check_against(header, Camera(160, 120, 70.0, 70.0, 40.0, 30.0))
    with pytest.raises(CatalogError, match="turned"):
        check_against(header, Camera(60, 80, 70.0, 70.0, 40.0, 30.0))
    with pytest.raises(CatalogError, match="rotated EXIF"):
        check_against(image_header(_tagged(tmp_path / "b.jpg", 6)), Camera(80, 60, 70.0, 70.0, 40.0, 30.0))
