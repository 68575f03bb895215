"""What the driver knows of a run: the catalog, the lattice, the records so far. Names and digests, no data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import shapely

from cityflow.core.building import OUTLINE_SIGMA_M, Status
from cityflow.core.edits import Edits
from cityflow.core.grid import Bounds, Grid, Tile, bounds_meet, grid_over, grown, tiles_over
from cityflow.core.parameters import Parameters, merged
from cityflow.core.points import BUILDING, GROUND
from cityflow.flow.task import Json, Limits, Record, digest_of
from cityflow.io.catalog.stac_assets import Catalog, ImageAsset, LidarAsset, RasterAsset
from cityflow.io.tables.edits_gpkg import read_edits
from cityflow.outlines.from_walls.wall_lines import WallLineParameters
from cityflow.outlines.from_walls.wall_points import WallPointParameters
from cityflow.surface.overview import overview_factor
from cityflow.survey.image_survey import ImageSurvey, nearest_cell
from cityflow.survey.parameters import OutlineParameters, SurveyParameters

UNREAD = "without the points of {}, which could not be read"
ZARR, OVERVIEW, FRAMES = "surface.zarr", "surface.zarr/overview", "surface.zarr/frames"
"""The rasters of a run; a surface from images has a coarser copy for what works on half a metre, and one group per local frame."""

LIDAR, IMAGES, RASTERS = "lidar", "images", "rasters"
"""The doors into a run."""

STAGE_MATCH = "match"
ACCURACY = "outline_accuracy"
"""Unit of the stage ``ingest`` that says how exact given outlines are."""
HULL = "hull.city.jsonl"
"""What reconstruction leaves of a unit."""

WALL_MARGIN_M = 1.0
"""Files this near to an outline are named as the sources of its unit."""

SEEN_AROUND_M = 5.0
"""A unit waits for the surfaces this far beyond its outline, and looks no farther."""


@dataclass(frozen=True, slots=True)
class UnitEntry:
    """One unit as the driver sees it: where it stands, and where its outline is written.

    Attributes
    ----------
    tile : name of the tile that owns it
    digest : of the outline's line in `path`, which starts at byte `start` and is `length` bytes long
    neighbours : units whose outlines share an edge, and the tiles that own these
    """

    id: str
    tile: str
    path: str
    start: int
    length: int
    digest: str
    bounds: Bounds
    point: tuple[float, float]
    neighbours: tuple[str, ...]
    neighbour_tiles: tuple[str, ...]

    @classmethod
    def of(cls, tile: str, entry: Mapping[str, Any]) -> UnitEntry:
        x_min, y_min, x_max, y_max = entry["bounds"]
        x, y = entry["point"]
        return cls(
            entry["id"], tile, entry["path"], entry["start"], entry["length"], entry["digest"],
            (x_min, y_min, x_max, y_max), (x, y), tuple(entry["neighbours"]), tuple(entry["neighbour_tiles"]),
        )  # fmt: skip


class Survey:
    """Catalog, parameters and the records so far, with the questions that tasks are built from."""

    def __init__(
        self, catalog: Catalog, parameters: SurveyParameters, overrides: Mapping[tuple[str, str], Mapping[str, Json]]
    ) -> None:
        self.catalog = catalog
        self.parameters = parameters
        self.overrides = overrides
        self.records: dict[tuple[str, str], Record] = {}
        self.files: dict[str, LidarAsset] = {f.name: f for f in sorted(catalog.lidar, key=lambda f: f.name)}
        if self.door != LIDAR:
            self.files = {}
        self.images = ImageSurvey(catalog, parameters)
        self._boxes = shapely.STRtree([shapely.box(*f.bounds) for f in self.files.values()])
        self._pieces: dict[tuple[str, str], tuple[str, str]] = {}
        self._given: dict[str, dict[str, str]] = {}
        self._sampled_from = ""
        self._outline_sigma_m: float | None = None
        self._beside: dict[str, list[str]] = {}

    def learn(self, record: Record) -> None:
        """Keep what later tasks ask of a record, and no more: a city has very many."""
        if record.stage == "ingest" and record.unit == "outlines":
            self._given = {_stem(path): {path: digest} for path, digest in record.outputs.items()}
            self._sampled_from = str(record.result.get("sampled_from", ""))
            self._beside = {str(t): list(map(str, near)) for t, near in record.result.get("beside", {}).items()}
        elif record.stage == "ingest" and record.unit == ACCURACY:
            self._outline_sigma_m = record.result.get("sigma_m")
        elif record.stage == self._indexed_by:
            for path, digest in record.outputs.items():
                if path.startswith("work/") and path.endswith(".laz"):
                    self._pieces[record.unit, _stem(path)] = path, digest
        kept = {k: v for k, v in record.result.items() if k in ("digest", "refused")}
        inputs = record.inputs if record.stage == "outline" else {}
        self.records[record.stage, record.unit] = replace(
            record, result=kept, parameters={}, inputs=inputs, traceback=""
        )

    @property
    def door(self) -> str:
        """Where the surface comes from: ``lidar``, ``images`` or ``rasters``."""
        source = self.parameters.points.source
        if source != "auto":
            return source
        if self.catalog.lidar:
            return LIDAR
        return IMAGES if self.catalog.images or "dsm" not in self.catalog.rasters else RASTERS

    @property
    def outlines_given(self) -> bool:
        source = self.parameters.outline.source
        return source == "given" or (source == "auto" and self.catalog.outlines is not None)

    @property
    def splits(self) -> bool:
        """Whether outlines are split into units: those that a cadastre gives are units already."""
        drawn = bool(self.edits.cut_lines) and self.parameters.split.when != "never"
        return self.looks_for_borders or drawn

    @property
    def looks_for_borders(self) -> bool:
        """Whether borders of units are looked for, and not only taken from what a person drew."""
        wish = self.parameters.split.when
        return wish == "always" or (wish == "found" and not self.outlines_given)

    @property
    def sees_walls(self) -> bool:
        """Whether façades take part in finding outlines."""
        return self.door == IMAGES and not self.outlines_given

    @property
    def sees_facades(self) -> bool:
        """Whether points on façades may tell where walls stand: those of images, or a laser's echoes."""
        return self.door in (LIDAR, IMAGES)

    @property
    def reads_own_orthos(self) -> bool:
        """Whether orthos are made from the survey's images; else those that the catalog names are looked at."""
        return self.door == IMAGES

    def given_orthos(self) -> dict[str, RasterAsset]:
        """Orthos that the catalog names, one for each epoch, by kind."""
        if self.reads_own_orthos:
            return {}
        return {k: r for k, r in sorted(self.catalog.rasters.items()) if k.startswith("ortho")}

    @cached_property
    def outline_parameters(self) -> OutlineParameters:
        """Those of the workflow; lines of walls, too, go by the survey's own ground sampling distance unless the workflow states one."""
        asked = self.parameters.outline
        if states_gsd(asked.found.walls) or self.door != IMAGES:
            return asked
        lines = asked.found.walls.model_copy(update={"gsd_m": self.images.cell_m})
        return asked.model_copy(update={"found": asked.found.model_copy(update={"walls": lines})})

    @cached_property
    def edits(self) -> Edits:
        """What a person has drawn; nothing where no file is named. Raises CatalogError where it cannot be read."""
        path = self.parameters.edits.path
        return read_edits(path, self.catalog.reference) if path else Edits()

    @cached_property
    def wall_parameters(self) -> WallPointParameters:
        """Those of the workflow, with the survey's own ground sampling distance unless the workflow states one."""
        asked = self.parameters.walls
        return asked if states_gsd(asked) else asked.model_copy(update={"gsd_m": self.images.cell_m})

    @cached_property
    def tiles(self) -> dict[str, Tile]:
        """Ground tiles that meet a surveyed file, or that images see, south-west first."""
        if self.door == IMAGES:
            return self.images.tiles
        size = self.parameters.tiles.tile_m
        given = (
            [self.catalog.rasters["dsm"].bounds] if self.door == RASTERS else [f.bounds for f in self.files.values()]
        )
        found = {t for bounds in given for t in tiles_over(bounds, size)}
        return {t.name: t for t in sorted(found, key=lambda t: (t.row, t.col))}

    @cached_property
    def grid(self) -> Grid:
        """The grid on which terrain, classes and outlines stand: all tiles, so that one chunk is one tile."""
        return grid_over(self.tiles.values(), self.cell_m)

    @cached_property
    def product_grid(self) -> Grid:
        """The grid of the DSM, DTM and ortho that are delivered: as fine as the images are, else `grid`."""
        return self.grid if self.door == LIDAR else grid_over(self.tiles.values(), self._fine_cell_m)

    @cached_property
    def _fine_cell_m(self) -> float:
        if self.door == IMAGES:
            return self.images.cell_m
        given = [r.cell for k, r in self.catalog.rasters.items() if k in ("dsm", "ortho")]
        return self.parameters.images.cell_m or nearest_cell(min(given))

    @property
    def overview_factor(self) -> int:
        """Fine cells along one cell of `grid`."""
        return 1 if self.door == LIDAR else overview_factor(self._fine_cell_m)

    @property
    def place(self) -> str:
        """Digest of the grid, which decides on the chunk that is a tile's, and of its CRS, which is written into every raster."""
        return digest_of([list(self.grid.bounds), self.catalog.reference.code])

    @cached_property
    def cell_m(self) -> float:
        """Cell of `grid`, metres."""
        if self.door == LIDAR:
            return self.parameters.surface.cell_m
        return self._fine_cell_m * self.overview_factor

    @property
    def ortho_kind(self) -> tuple[int, str]:
        """Bands and dtype of the ortho."""
        return (self.images.bands, self.images.dtype) if self.door == IMAGES else (3, "uint8")

    @property
    def zarr(self) -> str:
        """The group whose layers stand on `grid`."""
        return ZARR if self.door == LIDAR else OVERVIEW

    @property
    def _indexed_by(self) -> str:
        """The stage that leaves the points that buildings are made of: as they were read, or as they were matched."""
        return "ingest" if self.door == LIDAR else "surface"

    def tiled_image(self, name: str) -> str | None:
        """Where the ingested image is written; None where it could not be read."""
        record = self.records.get(("ingest", name))
        return next(iter(record.outputs), None) if record and record.status is not Status.FAILED else None

    def depth_maps(self, tiles: Iterable[str]) -> dict[str, tuple[str, str]]:
        """Flight tile → path and digest of the depth map, of those over `tiles` that left one."""
        units = [f.name for t in tiles for f in self.images.flight_tiles(self.tiles[t])]
        found = {u: self.records[STAGE_MATCH, u].outputs for u in units if (STAGE_MATCH, u) in self.records}
        return {u: next(iter(outputs.items())) for u, outputs in sorted(found.items()) if outputs}

    def ring(self, name: str) -> list[str]:
        """The tile and those of its eight neighbours that exist."""
        tile = self.tiles[name]
        around = [f"{tile.col + i}_{tile.row + j}" for j in (-1, 0, 1) for i in (-1, 0, 1)]
        return [n for n in around if n in self.tiles]

    def near(self, name: str, reach_m: float) -> list[str]:
        """The tile and all others that lie within `reach_m` of it, south-west first."""
        return [
            t.name
            for t in tiles_over(self.tiles[name].buffered(reach_m), self.parameters.tiles.tile_m)
            if t.name in self.tiles
        ]

    def files_over(self, bounds: Bounds) -> list[LidarAsset]:
        """Files whose extents meet `bounds`, by name."""
        assets = list(self.files.values())
        near = sorted(self._boxes.query(shapely.box(*bounds)).tolist())
        return [assets[i] for i in near if bounds_meet(assets[i].bounds, bounds)]

    def files_near(self, tile: Tile) -> list[LidarAsset]:
        """Files that hold points of the tile or of its halo."""
        return self.files_over(tile.buffered(self.parameters.surface.halo_m))

    def tiles_under(self, unit: UnitEntry) -> list[str]:
        """Every tile of which a task of the unit reads a cell or a point: what it does not wait for it must not see."""
        over = tiles_over(grown(unit.bounds, SEEN_AROUND_M), self.parameters.tiles.tile_m)
        return [t.name for t in over if t.name in self.tiles]

    def tiles_over_bounds(self, bounds: Bounds) -> list[str]:
        """The tiles of the survey that meet `bounds`, south-west first."""
        return [t.name for t in tiles_over(bounds, self.parameters.tiles.tile_m) if t.name in self.tiles]

    @property
    def textures(self) -> bool:
        """Whether faces get textures: where the catalog has images or orthos to take them from."""
        return self.parameters.texture.when == "auto" and bool(self.images.assets or self.given_orthos())

    def unmatched(self, tiles: Iterable[str]) -> list[str]:
        """Flight tiles over `tiles` that have failed."""
        units = sorted(f.name for t in tiles for f in self.images.flight_tiles(self.tiles[t]))
        found = {u: self.records.get((STAGE_MATCH, u)) for u in units}
        return [u for u, record in found.items() if record is not None and record.status is Status.FAILED]

    def pieces(self, bounds: Bounds) -> dict[str, str]:
        """Path → digest of the index pieces that meet `bounds`, of the files or tiles that do, in a fixed order.

        A file that only shares a cell with `bounds` is left out: nobody has waited for it.
        """
        cells = [t.name for t in tiles_over(bounds, self.parameters.tiles.index_cell_m)]
        over = self.files_over(bounds) if self.door == LIDAR else tiles_over(bounds, self.parameters.tiles.tile_m)
        keys = [(part.name, cell) for part in over for cell in cells]
        return dict(sorted(self._pieces[k] for k in keys if k in self._pieces))

    def given_outlines(self, tile: str) -> dict[str, str]:
        """Path → digest of the given outlines that a tile owns; empty where there are none."""
        return self._given.get(tile, {})

    def given_outlines_beside(self, tile: str) -> dict[str, str]:
        """Path → digest of the files of those tiles whose given outlines touch ones of this tile."""
        return {p: d for t in self._beside.get(tile, []) for p, d in self.given_outlines(t).items()}

    @property
    def outline_sample(self) -> tuple[str, dict[str, str]]:
        """The LiDAR file that tells how exact given outlines are, and path → digest of outlines that stand in it."""
        return self._sampled_from, self._given.get("sample", {})

    @property
    def outline_sigma_m(self) -> float:
        """How exact given outlines are (standard deviation): as the workflow says, else by the survey's own buildings, else as outlines are in general."""
        stated = self.parameters.reconstruct.overhangs.outline_sigma_m
        own = OUTLINE_SIGMA_M if self._outline_sigma_m is None else self._outline_sigma_m
        return own if stated is None else stated

    def pieces_of_file(self, name: str) -> dict[str, str]:
        """Path → digest of the index pieces of one LiDAR file."""
        return dict(sorted(piece for (part, _), piece in self._pieces.items() if part == name))

    def unread(self, bounds: Bounds) -> dict[str, str]:
        """Name → why: the files that should hold points within `bounds` but could not be read."""
        found = {}
        for asset in self.files_over(bounds):
            record = self.records.get(("ingest", asset.name))
            if record is not None and record.status is Status.FAILED:
                found[asset.name] = record.reason
        return found

    @property
    def has_ground_class(self) -> bool:
        """Whether the survey tells ground from the rest, as its catalog says."""
        return any(GROUND in f.classes for f in self.files.values())

    @property
    def has_building_class(self) -> bool:
        """Whether the survey tells buildings from the rest: a matter of the survey, not of a tile or a single house."""
        return any(BUILDING in f.classes for f in self.files.values())

    def parameters_for(self, stage: str, unit: str, model: Parameters) -> dict[str, Json]:
        """The stage's parameters as JSON with the unit's overrides laid over them."""
        over = self.overrides.get((stage, unit))
        tree = model.model_dump(mode="json")
        if not over:
            return tree
        return type(model).model_validate(merged(tree, over)).model_dump(mode="json")

    def digest_of_result(self, stage: str, unit: str) -> str:
        """What downstream digests take in of an upstream unit: its contents, or how it failed."""
        record = self.records.get((stage, unit))
        if record is None:
            return "missing"
        return str(record.result.get("digest") or f"{record.status}: {record.reason}")

    def outputs_of(self, stage: str, unit: str) -> dict[str, str]:
        """Path → digest of what a task left; nothing where it has not run or failed."""
        record = self.records.get((stage, unit))
        return dict(record.outputs) if record is not None else {}

    def reason_of(self, stage: str, unit: str) -> str:
        """Why a task did less than it should; empty where all is well."""
        record = self.records.get((stage, unit))
        return record.reason if record is not None and record.status is not Status.DONE else ""

    def failure_of(self, stage: str, unit: str) -> str:
        """Why a task failed; empty where it has not."""
        record = self.records.get((stage, unit))
        return record.reason if record is not None and record.status is Status.FAILED else ""

    def outline_files(self, tile: str) -> dict[str, str]:
        """Path → digest of the file that holds the outlines of a tile; none where the tile has none."""
        return self._files_of("outline", tile)

    def unit_files(self, tile: str) -> dict[str, str]:
        """Path → digest of the file that holds the units of a tile: its outlines where nothing is split."""
        return self._files_of("units" if self.splits else "outline", tile)

    def split_files(self, tile: str) -> dict[str, str]:
        """Path → digest of the file that says how the outlines of a tile were split."""
        return {p: d for p, d in self.outputs_of("units", tile).items() if p.endswith(".ndjson")}

    def _files_of(self, stage: str, tile: str) -> dict[str, str]:
        record = self.records.get((stage, tile))
        known = (record.outputs, record.inputs if stage == "outline" else {}) if record else ()
        files = ({p: d for p, d in sorted(paths.items()) if p.endswith(".jsonl")} for paths in known)
        return next(filter(None, files), {})

    def hull(self, unit: str) -> dict[str, Json]:
        """Where a unit's hull is written, or why there is none."""
        record = self.records.get(("reconstruct", unit))
        if record is None:
            return {"path": None, "status": "failed", "reason": "was not reconstructed"}
        path = next((p for p in record.outputs if p.endswith(HULL)), None)
        return {"path": path, "status": str(record.status), "reason": record.reason}

    def digest_of_hull(self, unit: str) -> str:
        """Of the hull's contents, or of how the unit failed."""
        record = self.records.get(("reconstruct", unit))
        if record is None:
            return "missing"
        hulls = (digest for path, digest in record.outputs.items() if path.endswith(HULL))
        return next(hulls, f"{record.status}: {record.reason}")

    def products_of(self, stage: str, unit: str) -> dict[str, str]:
        """Path → digest of the products of a task."""
        record = self.records.get((stage, unit))
        return {p: d for p, d in record.outputs.items() if p.startswith("products/")} if record else {}

    def refused_outlines(self) -> dict[str, str]:
        """Outlines and units that cannot be buildings, or that a person has rejected, with the reason."""
        return {str(u): str(why) for r in self._refusing() for u, why in r.result.get("refused", [])}

    def refused_files(self) -> dict[str, str]:
        """Path → digest of the files that hold their polygons."""
        return {p: d for r in self._refusing() for p, d in r.outputs.items() if p.endswith("/refused.json")}

    def _refusing(self) -> list[Record]:
        """What the tasks that may refuse outlines have left."""
        given = self.records.get(("ingest", "outlines"))
        others = [r for (stage, _), r in sorted(self.records.items()) if stage in ("outline", "units")]
        return others if given is None else [given, *others]

    @property
    def date(self) -> str:
        """Of the newest survey, YYYY-MM-DD; empty where none is known."""
        return max((a.date or "" for a in self._sources), default="")

    @property
    def _sources(self) -> list[LidarAsset | ImageAsset | RasterAsset]:
        if self.door == RASTERS:
            return [self.catalog.rasters["dsm"]]
        return list(self.images.assets.values()) if self.door == IMAGES else list(self.files.values())

    @property
    def said(self) -> dict[str, str]:
        """What products say of the survey as a whole; part of the digest of whatever writes it."""
        c = self.catalog
        return {
            "crs": c.reference.code,
            "title": c.title,
            "date": self.date,
            "licence": c.licence,
            "attribution": c.attribution,
        }

    def source_attributes(self, bounds: Bounds) -> dict[str, Json]:
        """What is known of the data that a unit was made from."""
        found = self.files_over(bounds) if self.door == LIDAR else self._sources
        dates = sorted({f.date for f in found if f.date})
        return {"source": self.catalog.title, "source_date": dates[-1] if dates else None}

    def limits(self, stage: str) -> Limits:
        return self.parameters.execution.limits_of(stage)


def states_gsd(parameters: WallPointParameters | WallLineParameters) -> bool:
    """Whether a workflow states a sampling distance: the default stands for the survey's own, also where a run's description lists all defaults."""
    return bool(parameters.gsd_m != type(parameters).model_fields["gsd_m"].default)


def _stem(path: str) -> str:
    return path.rsplit("/", 1)[-1].rsplit(".", 1)[0]
