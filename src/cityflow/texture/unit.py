"""Textures of all faces of one unit: ranking, visibility, redundancy, radiometry, patches."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import OUTLINE_SIGMA_M, Polyhedron, Semantic
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.core.texture import Colour, FaceGrid, FaceKey, FacePlane, PlainFace, SeenFace, UnitTexture
from cityflow.errors import CityflowError
from cityflow.texture.alignment.align import aligned
from cityflow.texture.beside_wall import Wall, without_beside
from cityflow.texture.burnt_out import burnt_cells, without_burnt
from cityflow.texture.doubtful import without_doubtful
from cityflow.texture.ortho_image import is_ortho
from cityflow.texture.patches.compose import FaceSources, Visible
from cityflow.texture.patches.make import FacePatches, make_patches
from cityflow.texture.patches.patch_parameters import PatchParameters
from cityflow.texture.placement.place import PlacementParameters
from cityflow.texture.plain_colours import WallColours
from cityflow.texture.ranking.face_views import views_of
from cityflow.texture.ranking.field_of_view import in_frame
from cityflow.texture.ranking.ranking_parameters import RankingParameters
from cityflow.texture.ranking.rankings import METHODS
from cityflow.texture.ranking.usable import grazing
from cityflow.texture.readable import watched
from cityflow.texture.redundancy import RedundancyParameters, kept
from cityflow.texture.source_image import LinearModel, Source, UnitSources, sources_of
from cityflow.texture.unit_radiometry import FaceSamples, RadiometryParameters, balance, face_samples
from cityflow.texture.visibility.scene import Scene
from cityflow.texture.visibility.seen import coarse_grid, seen_faces
from cityflow.texture.visibility.visibility_parameters import VisibilityParameters

COARSE_CELLS = 1500
"""Cells of a face, at most, on which all images are tried before a few are kept; set by hand, to save time."""

NO_IMAGE = "no image shows it"
HIDDEN = "it is hidden in all images"
DOUBTFUL = "all images see it too obliquely and may show something else"
USUAL: Mapping[Semantic, Colour] = {
    Semantic.ROOF: (150, 110, 95), Semantic.WALL: (190, 183, 172), Semantic.OUTER_CEILING: (160, 150, 138),
    Semantic.OUTER_FLOOR: (150, 145, 138),
}  # fmt: skip
"""Colours of faces of a unit of which no image shows any of the same kind."""


class TextureParameters(Parameters):
    """How the faces of a unit are textured."""

    when: Literal["auto", "photographs", "never"] = Field(
        "auto",
        description="auto: where the catalog has images or orthos; photographs: a catalog without images is refused",
    )
    most_images: int = Field(150, ge=1, le=2000, description="images per unit, the nearest ones")
    around_m: float = Field(
        40.0, ge=0, le=200, description="models this far around a unit may stand between it and a camera, m"
    )
    halo_m: float = Field(
        60.0, ge=0, le=300, description="the surface this far around a unit may stand between it and a camera, m"
    )
    ranking: Literal["worst_gsd", "share_angle_gsd"] = Field(
        "worst_gsd",
        description="order of the images of a face: by their coarsest sampling distance on it (Frommholz), or by share seen, angle, sampling distance (Gross)",
    )
    align_px: float = Field(
        6.0, ge=0, le=30,
        description="photographs that significantly show models' edges beside where poses have them are moved, by up to this along each axis, pixels; 0: never",
    )  # fmt: skip
    rank: RankingParameters = RankingParameters()
    visibility: VisibilityParameters = VisibilityParameters()
    redundancy: RedundancyParameters = RedundancyParameters()
    radiometry: RadiometryParameters = RadiometryParameters()
    patches: PatchParameters = PatchParameters()
    placement: PlacementParameters = PlacementParameters()


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """What may stand between a unit and the cameras.

    Attributes
    ----------
    own : the unit's solid with its party walls cut, and what stands out beyond it
    others : the same of the units around
    heights : (rows, cols) float64 surface on `grid`, world metres; NaN where unknown
    wall_sigma_m : how exactly the unit's walls are known across, standard deviation
    """

    own: Sequence[Polyhedron]
    others: Sequence[Polyhedron]
    heights: FloatArray
    grid: Grid
    wall_sigma_m: float = OUTLINE_SIGMA_M


@dataclass(frozen=True, slots=True, eq=False)
class TexturedUnit:
    """Textures of a unit.

    Attributes
    ----------
    figures : on how they came about
    notes : what was done otherwise than asked for → on how many faces
    lost : image name → why it could not be read; the textures are made without these images
    moved : image name → pixels to the right and down by which its pose was moved to the edges of the models
    """

    texture: UnitTexture
    figures: Mapping[str, float | int]
    notes: Mapping[str, int] = field(default_factory=dict)
    lost: Mapping[str, str] = field(default_factory=dict)
    moved: Mapping[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class _Face:
    """A face and the images that really see it: those that see something of it, and which of these remain, the root first; some see too little for certain."""

    plane: FacePlane
    grid: FaceGrid
    candidates: int
    doubtful: int
    seen: tuple[SeenFace, ...]
    kept: tuple[int, ...]

    @property
    def seen_share(self) -> float:
        """Of its area, 0 to 1."""
        cells = np.any([s.mask.mask() for s in self.seen], axis=0).sum() if self.seen else 0
        return float(min(cells * self.grid.cell**2 / self.plane.polygon.area, 1.0))


def texture_unit(
    faces: Sequence[FacePlane], images: Sequence[ColourImage], around: Surroundings, parameters: TextureParameters
) -> TexturedUnit:
    """Patches of all faces that some image sees, a plain colour and the reason for the others.

    An image that cannot be read is left out, as if it had never been taken.
    """
    lost: dict[str, str] = {}
    left = list(images)
    while True:
        known = len(lost)
        made = _attempted(faces, watched(left, lost), around, parameters)
        if made is not None and len(lost) == known:
            return replace(made, lost=lost)
        left = [i for i in left if i.image.name not in lost]


def _attempted(
    faces: Sequence[FacePlane], images: Sequence[ColourImage], around: Surroundings, parameters: TextureParameters
) -> TexturedUnit | None:
    """Textures of a unit; None where the white level or the place of an image cannot be told because it cannot be read."""
    scene = Scene.of(around.heights, around.grid, around.own, around.others, parameters.visibility)
    try:
        sources, moved = aligned(sources_of(images), [*around.own, *around.others], scene, parameters.align_px)
    except CityflowError:
        return None
    looked = [_looked_at(f, sources, scene, around, parameters) for f in faces]
    used = {image for f in looked for image in _own(f)}
    orthos = {k for k, s in enumerate(sources) if is_ortho(s.image)}
    samples = {f.plane.key: _samples(f, used, sources, parameters.rank) for f in looked if f.kept}
    models = balance(list(samples.values()), parameters.radiometry, orthos)
    unit, walls = UnitSources(sources, models), _wall_colours(looked, samples, models)
    made = {f.plane.key: _patches(f, unit, scene, walls, parameters) for f in looked}
    found = {key: p for key, p in made.items() if p is not None}
    plain = dict(_plain(looked, found, walls))
    texture = UnitTexture(
        tuple(s.image.name for s in sources), tuple(p.raw for p in found.values()), tuple(p.rectified for p in found.values()), plain
    )  # fmt: skip
    notes = Counter(note for p in found.values() for note in p.notes)
    return TexturedUnit(texture, _figures(looked, found), dict(sorted(notes.items())), moved=moved)


def _looked_at(
    face: FacePlane, sources: Sequence[Source], scene: Scene, around: Surroundings, parameters: TextureParameters
) -> _Face:
    """What the images see of a face on coarse cells, and which of them remain."""
    images = [s.image for s in sources]
    views = views_of(face, images)
    finest = min((v.gsd_m for v in views), default=1.0)
    grid = coarse_grid(face, finest, COARSE_CELLS)
    facing = [v for v in views if v.incidence_deg <= parameters.rank.steepest_deg]
    seen = tuple(s for s in seen_faces(face, facing, images, scene, grid) if s.mask.count)
    before = len(seen)
    if face.semantic is Semantic.WALL:
        seen = without_doubtful(face, grid, seen, images, around.wall_sigma_m)
        wall = Wall.of(face, grid, around.heights, around.grid, around.wall_sigma_m)
        seen = without_beside(wall, seen, sources, scene, lambda views: _kept(face, views, parameters))
    doubtful = before - len(seen)
    chosen = _kept(face, seen, parameters)
    if any(burnt_cells(face, grid, seen[k], sources[seen[k].view.image]).any() for k in chosen):
        seen = tuple(s for s in without_burnt(face, grid, seen, sources, parameters.rank) if s.mask.count)
        chosen = _kept(face, seen, parameters)
    return _Face(face, grid, len(views), doubtful, seen, chosen)


def _kept(face: FacePlane, seen: Sequence[SeenFace], parameters: TextureParameters) -> tuple[int, ...]:
    order = METHODS[parameters.ranking](face, seen, parameters.rank)
    return kept(seen, order, parameters.redundancy)


def _samples(face: _Face, used: set[int], sources: Sequence[Source], rank: RankingParameters) -> FaceSamples:
    """Colours of a face in all images that are used anywhere; those that graze it say something only where they are its own."""
    own = _own(face)
    told = [s for s in face.seen if s.view.image in own or (s.view.image in used and not grazing(s, rank))]
    return face_samples(face.plane, face.grid, told, sources)


def _own(face: _Face) -> set[int]:
    """Images that a face gets its pixels from."""
    return {face.seen[k].view.image for k in face.kept}


def _wall_colours(
    faces: Sequence[_Face], samples: Mapping[FaceKey, FaceSamples], models: Mapping[int, LinearModel]
) -> WallColours:
    """Of the walls that some image sees."""
    walls = [f for f in faces if f.plane.semantic is Semantic.WALL and f.kept]
    return WallColours([(f.plane.key, samples[f.plane.key], f.seen_share, f.plane.polygon.area) for f in walls], models)


def _patches(
    face: _Face, unit: UnitSources, scene: Scene, walls: WallColours, parameters: TextureParameters
) -> FacePatches | None:
    plain = walls.of(face.plane.key) if face.plane.semantic is Semantic.WALL else None
    views = FaceSources(face.grid, [face.seen[k] for k in face.kept], face.candidates, plain)
    return make_patches(face.plane, views, unit, _eye(face.plane, unit, scene), parameters.patches)


def _eye(face: FacePlane, unit: UnitSources, scene: Scene) -> Visible:
    """Whether an image sees points of the face, asked ray by ray."""

    def visible(image: int, xyz: FloatArray) -> BoolArray:
        seen = unit.sources[image].image
        framed = in_frame(seen, xyz)
        framed[framed] = scene.visible(xyz[framed], face.normal, seen.centre)
        return framed

    return visible


def _plain(
    faces: Sequence[_Face], found: Mapping[FaceKey, FacePatches], walls: WallColours
) -> Iterator[tuple[FaceKey, PlainFace]]:
    """Faces without a texture get the colour of their kind on this unit: walls that of its walls, others the median of what images show."""
    usual: dict[Semantic, Colour] = dict(USUAL)
    for semantic in USUAL:
        parts = [found[f.plane.key].rectified for f in faces if f.plane.semantic is semantic and f.plane.key in found]
        if parts:
            pixels = np.concatenate([p.pixels[p.mask] for p in parts])
            red, green, blue = (int(v) for v in np.rint(np.median(pixels, axis=0)))
            usual[semantic] = (red, green, blue)
    usual[Semantic.WALL] = walls.common or usual[Semantic.WALL]
    for face in faces:
        if face.plane.key not in found:
            yield face.plane.key, PlainFace(usual[face.plane.semantic], _reason(face))


def _reason(face: _Face) -> str:
    """Why a face has no texture."""
    if face.doubtful and not face.seen:
        return DOUBTFUL
    return HIDDEN if face.candidates else NO_IMAGE


def _figures(faces: Sequence[_Face], found: Mapping[FaceKey, FacePatches]) -> dict[str, float | int]:
    """For the record: sources before and after redundancy, and how much of the area has a texture."""
    area = {f.plane.key: float(f.plane.polygon.area) for f in faces}
    total, textured = sum(area.values()), sum(area[k] for k in found)
    interpolated = sum(area[k] * p.rectified.figures.interpolated for k, p in found.items())
    return {
        "faces": len(faces), "textured": len(found), "area_m2": round(total, 2),
        "textured_share": round(textured / total, 4) if total else 0.0,
        "interpolated_share": round(interpolated / textured, 4) if textured else 0.0,
        "candidates": max((f.candidates for f in faces), default=0), "seen": max((len(f.seen) for f in faces), default=0),
        "kept": max((len(f.kept) for f in faces), default=0),
        "images": len({int(i) for p in found.values() for i in np.unique(p.raw.index) if i >= 2}),
    }  # fmt: skip
