"""The STAC items of products: of a tile, a district, the city."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from cityflow.core.grid import Bounds
from cityflow.handover.product_metadata import ProductMetadata
from cityflow.io.catalog.products_catalog import COLLECTION, ItemFile, ProductFile, ProductItem, Source, item_file
from cityflow.io.crs import resolve
from cityflow.io.export_formats import formats

PRODUCTS = "products/"
TITLES = {
    "dsm": "Digital surface model", "dtm": "Digital terrain model", "ortho": "True ortho", "points": "Points with classes (LAZ)",
    **formats.TITLES, "city": formats.TITLES["cityjson"], "outlines": "Outlines, units and their status", "textures": "Pages of textures",
    "units": "Units with all attributes (GeoParquet)", "index": "Index of units (GeoParquet)",
}  # fmt: skip


def source_of(metadata: ProductMetadata) -> Source:
    """Where the products come from."""
    return Source(metadata.title, licence=metadata.licence, attribution=metadata.attribution, date=metadata.date)


def item_of(
    name: str, bounds: Bounds, found: Mapping[str, str], metadata: ProductMetadata, parent: str = COLLECTION
) -> ItemFile:
    """The item of what stands at one place; `found` is path in RUN → digest, `parent` the path of the catalog that it hangs on."""
    return item_file(ProductItem(name, bounds, _files(found)), source_of(metadata), resolve(metadata.crs), parent)


def _files(found: Mapping[str, str]) -> dict[str, ProductFile]:
    """Asset key → product: the folder's name, or the file's own where it stands alone or where the folder has several of its kind."""
    files: dict[str, ProductFile] = {}
    products = {p.removeprefix(PRODUCTS): d for p, d in sorted(found.items()) if p.startswith(PRODUCTS)}
    several = Counter(map(_key, products))
    for inside, sha256 in products.items():
        key = _key(inside) if several[_key(inside)] == 1 else inside.replace("/", "-")
        files[key] = ProductFile(inside, TITLES.get(inside.split("/")[0].split(".")[0], inside), sha256=sha256)
    return files


def _key(inside: str) -> str:
    """Folder and ending of a file among the products; its name where it is in none."""
    return inside if "/" not in inside else f"{inside.split('/')[0]}-{inside.rsplit('.', 1)[-1]}"
