"""Rows of the report: one per building, stage and problem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Scalar, Status
from cityflow.core.orientation_figures import OrientationFigures
from cityflow.viewer.image_rows import CheckpointRow, ImageFigures, PosesRow
from cityflow.viewer.picture import Picture
from cityflow.viewer.texture_rows import TextureFigures

if TYPE_CHECKING:
    from cityflow.viewer.unit_figures import UnitFigures


@dataclass(frozen=True, slots=True)
class UnitRow:
    """One building.

    Attributes
    ----------
    id, tile : names;  status, reason : how it ended
    method : the method whose model was chosen;  lod : highest level of detail reached, as ``2.2``
    planes : roof planes
    nmad, rmse, bias, le95 : metres, of the roof's points to the model; None where not measured
    share_explained : 0 to 1, of the roof's points near a roof plane
    seconds, peak_mb : time and memory of the task
    rings : exterior, then holes, (n, 2) world metres
    attributes : more to show when the building is chosen
    reaches_m : how far the roof stands out, of every edge where it does, metres
    verdict : ``good``, ``look`` or ``poor``; empty if not judged;  verdict_reason : reasons against the model
    good_probability : estimated probability that 95 % of the roof are within 20 cm of the truth
    """

    id: str
    tile: str
    status: Status
    reason: str = ""
    method: str = ""
    lod: str = ""
    planes: int = 0
    nmad: float | None = None
    rmse: float | None = None
    bias: float | None = None
    le95: float | None = None
    share_explained: float | None = None
    seconds: float = 0.0
    peak_mb: float = 0.0
    rings: tuple[FloatArray, ...] = ()
    attributes: Mapping[str, Scalar] = field(default_factory=dict)
    reaches_m: tuple[float, ...] = ()
    verdict: str = ""
    verdict_reason: str = ""
    good_probability: float | None = None


@dataclass(frozen=True, slots=True)
class StageRow:
    """One stage: tasks by status, their time (s) and the greatest memory of one (MB)."""

    stage: str
    units: int
    done: int
    degraded: int
    failed: int
    refused: int
    seconds_total: float
    seconds_median: float
    seconds_max: float
    peak_mb: float


@dataclass(frozen=True, slots=True)
class DistrictRow:
    """A part of a large city: a square of ground tiles, or a tile.

    Attributes
    ----------
    bounds : x_min, y_min, x_max, y_max, world metres
    tiles : that are exported;  buildings : on them
    good, look, poor : by verdict;  degraded, failed, refused : by how they ended
    nmad_median : metres, None where none was measured
    """

    name: str
    bounds: tuple[float, float, float, float]
    tiles: int
    buildings: int
    good: int
    look: int
    poor: int
    degraded: int
    failed: int
    refused: int
    nmad_median: float | None


@dataclass(frozen=True, slots=True)
class ProblemRow:
    """A task, not of a building, that did not end as asked."""

    stage: str
    unit: str
    status: Status
    reason: str


@dataclass(frozen=True, slots=True)
class EditRow:
    """Something that a person has drawn and that has no effect.

    Attributes
    ----------
    layer : of the file of edits;  name : its id or roof type, may be empty
    place : x, y, world metres
    reason, remedy : why it has none, and what to do
    """

    layer: str
    name: str
    place: tuple[float, float]
    reason: str
    remedy: str

    @property
    def text(self) -> str:
        """As one line."""
        named = f" '{self.name}'" if self.name else ""
        return f"{self.layer}{named} at {self.place[0]:.2f}, {self.place[1]:.2f}: {self.reason}"


@dataclass(frozen=True, slots=True)
class Product:
    """A file or folder of the run: path relative to the report, and what it holds."""

    path: str
    title: str
    description: str = ""


@dataclass(frozen=True, slots=True)
class Source:
    """A data source: its name, licence and who must be named."""

    title: str
    licence: str
    attribution: str


@dataclass(frozen=True, slots=True)
class ReportData:
    """All that the report shows.

    Attributes
    ----------
    title : of the survey;  workflow : name of the workflow
    crs, vertical_datum : as a person reads them
    versions : library → version;  parameters : stage → parameters as used, nested
    unit_stage : the stage whose tasks the units are
    overrides : unit → stage → parameters that were set for it alone
    pictures : of what has been made;  relief : of the surface, below the map of buildings, with its bounds
    images : None where the survey has none
    orientation : what `cityflow orient` has found of them; None where it has not made the catalog
    checkpoints : residuals of products at points of known position
    unused_edits : what a person has drawn without effect
    crops : small pictures of single buildings;  pages : address of a building's own page, relative to the report
    pages_left_out : buildings that did not end as asked and have no page, because there are so many
    textures : None where none are made
    placing : how the city was placed on the globe: what was done, and its accuracy; empty if unknown
    changed : parameters that differ from the defaults: dotted key, value, default
    run : where the run lies, as commands name it
    waiting : rings of outlines that are not processed yet, by id
    view : address of the page that shows the city in a browser, relative to the report; empty where there is none
    changes : pages of changes by updates, the last first: address, relative to the report, and what it says in short
    districts : of a large city
    whole : figures of all buildings, where `units` are those of a large city that a person shall see; its failed units are among the `problems`
    poses : what the run found out about the poses of images before it matched them; None where it has not looked
    """

    title: str
    workflow: str
    crs: str
    vertical_datum: str
    units: tuple[UnitRow, ...] = ()
    stages: tuple[StageRow, ...] = ()
    problems: tuple[ProblemRow, ...] = ()
    products: tuple[Product, ...] = ()
    sources: tuple[Source, ...] = ()
    versions: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    overrides: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    unit_stage: str = "reconstruct"
    pictures: tuple[Picture, ...] = ()
    relief: Picture | None = None
    images: ImageFigures | None = None
    orientation: OrientationFigures | None = None
    checkpoints: tuple[CheckpointRow, ...] = ()
    unused_edits: tuple[EditRow, ...] = ()
    crops: Mapping[str, Picture] = field(default_factory=dict)
    pages: Mapping[str, str] = field(default_factory=dict)
    pages_left_out: int = 0
    textures: TextureFigures | None = None
    placing: Mapping[str, str | float] = field(default_factory=dict)
    changed: tuple[tuple[str, Any, Any], ...] = ()
    run: str = "RUN"
    waiting: Mapping[str, tuple[FloatArray, ...]] = field(default_factory=dict)
    view: str = ""
    changes: tuple[tuple[str, str], ...] = ()
    districts: tuple[DistrictRow, ...] = ()
    whole: UnitFigures | None = None
    poses: PosesRow | None = None
