"""What the export of a tile leaves for the merge above it, and its STAC item."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cityflow.core.building import Building
from cityflow.core.coarse import Coarse
from cityflow.core.grid import Bounds
from cityflow.flow.workspace import Workspace
from cityflow.handover.coarse_files import COARSE, encode_coarse
from cityflow.handover.export_summary import SUMMARY, Summary, encode_summary, worst_of
from cityflow.handover.hull_input import Hull
from cityflow.handover.product_metadata import ProductMetadata
from cityflow.handover.unit_counts import counts_of
from cityflow.io.city_models.cityjson import overhang_rows
from cityflow.io.city_models.coarse_merge import for_above
from cityflow.io.city_models.tiles3d import FOLDER as TILES3D
from cityflow.io.city_models.tiles3d import PORTABLE, RAW
from cityflow.io.city_models.tiles3d_tree import TileRoot
from cityflow.stages.export.items import PRODUCTS, item_of


def leave_summary(
    workspace: Workspace, tile: str, bounds: Bounds, rows: Mapping[str, Mapping[str, Any]],
    others: Mapping[str, str], metadata: ProductMetadata, parent: str, coarse: Coarse | None = None,
) -> None:  # fmt: skip
    """Write item and summary of a tile whose products are written.

    Parameters
    ----------
    rows : unit → its row (`handover.export_rows`)
    others : products of other tasks that stand on the tile, path → digest
    parent : path of the catalog that the item hangs on
    coarse : what the tile looks like from far away
    """
    item = item_of(tile, bounds, {**workspace.outputs, **others}, metadata, parent)
    workspace.publish(f"{PRODUCTS}{item.path}", item.data)
    files = {f"{TILES3D}/{tile}/{name}": name for name in (PORTABLE, RAW)}
    roots = {n: TileRoot.of(f"{tile}/{n}", workspace.read(p)) for p, n in files.items() if p in workspace.outputs}
    summary = Summary(tile, bounds, 1, counts_of(rows.values()), item.box, roots, {}, worst_of(tile, rows))
    workspace.write(SUMMARY, encode_summary(summary))
    if coarse is not None and roots:
        workspace.write(COARSE, encode_coarse(for_above(coarse)))


def row_of(building: Building | None, hull: Hull) -> dict[str, Any]:
    """What the report and the status map say of a unit."""
    if building is None:
        return {"status": str(hull.status), "reason": hull.reason, "attributes": None}
    return {
        "status": str(building.status), "reason": building.reason, "attributes": dict(building.attributes),
        "overhangs": overhang_rows(building.overhangs),
    }  # fmt: skip
