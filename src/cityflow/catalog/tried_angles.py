"""Angles of a table, tried in each convention against the pictures: the reading with which ties of some pairs agree is taken, and said."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product

import numpy as np

from cityflow.catalog.file_questions import Question, Reading
from cityflow.catalog.height_ranges import HeightRange
from cityflow.catalog.image_files import ImageFiles, sizes_of
from cityflow.catalog.orientation import ImageSource, read_model
from cityflow.core.camera import OrientedImage
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import AngleUnit, RotationOrder
from cityflow.handover.reading_trial import Verdict, VerifiedPair, verdict, verified_pairs
from cityflow.handover.source_file import SourceFile
from cityflow.handover.tie_sample import PAIRS, QUICK_PX, Star, StarImage
from cityflow.io.orientation.oriented_images import OrientationModel
from cityflow.io.orientation.readers import READERS, option
from cityflow.orientation.rotation_doubts import GRAD, PHI_FIRST, looking_down, other_readings
from cityflow.orientation.sights import looks_level
from cityflow.orientation.tie_pairs import star_sample
from cityflow.orientation.views import View

UNIT, ORDER = "angle_unit", "rotation_order"
FEWEST = 3
"""Images below which nothing is tried; set by hand, as are those below."""
FEWEST_PAIRS = 3
"""With fewer, pairs of other readings are looked at, too."""
MOSTLY = 0.5
"""Share of the images that look down in a reading whose pairs are looked at."""
OWN_STARS = 2
"""Of the angles as they were read; other readings have one each, and only where the first ones leave a doubt."""


@dataclass(frozen=True, slots=True)
class AngleTable:
    """Where the angles come from, the CRS of the catalog, and the pictures."""

    source: ImageSource
    reference: Reference
    files: ImageFiles

    @property
    def has_angles(self) -> bool:
        """Whether the format leaves open what its angles mean."""
        name = next(iter(self.source.orientation))
        return {UNIT, ORDER} <= READERS[name].options.keys()

    def read(self, options: Mapping[str, str]) -> OrientationModel:
        """The model with other options; raises CatalogError where the table does not fit them."""
        source = replace(self.source, options={**self.source.options, **options})
        return read_model(source, self.reference, sizes_of(self.files)).moved(source.origin)


@dataclass(frozen=True, slots=True)
class TriedAngles:
    """The model with the angles as they are taken, whether the pictures agree with them clearly, and what a user should know."""

    model: OrientationModel
    is_clear: bool = False
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A reading in words, the model that it makes, and the options of the command that it needs."""

    what: str
    model: OrientationModel
    options: Mapping[str, str] = field(default_factory=dict)


def with_tried_angles(
    table: AngleTable, model: OrientationModel, heights: HeightRange, reading: Reading
) -> TriedAngles:
    """Try the readings of a table of angles; the model stays as it is where its format leaves nothing open.

    Parameters
    ----------
    model : of the table, as it is read by default or as options say
    """
    if not table.has_angles or len(model.images) < FEWEST:
        return TriedAngles(model)
    tried = list(_candidates(table, model))
    names = [i.name for i in model.images]
    images = [[{i.name: i for i in c.model.images}[n] for n in names] for c in tried]
    pairs = _pairs(table.files, [images[0]], heights, OWN_STARS, reading)
    found = verdict(images, pairs, heights.whole[0])
    if found.chosen is None or found.pairs < FEWEST_PAIRS:
        others = [r for r in images[1:] if _looks_down(r)]
        pairs = [*pairs, *_pairs(table.files, others, heights, 1, reading)]
        found = verdict(images, pairs, heights.whole[0])
    return _decided(table, tried, found)


def _candidates(table: AngleTable, model: OrientationModel) -> Iterator[_Candidate]:
    """As it was read first, then other units and orders, then other meanings of the rotations."""
    given = table.source.options
    own = {UNIT: given.get(UNIT, AngleUnit.DEGREE).lower(), ORDER: given.get(ORDER, RotationOrder.OMEGA_PHI_KAPPA).lower()}  # fmt: skip
    names = {i.name for i in model.images}
    yield _Candidate(f"{own[ORDER]} in {own[UNIT]}s", model)
    for unit, order in product(AngleUnit, RotationOrder):
        options = {UNIT: unit.value, ORDER: order.value}
        if options == own:
            continue
        try:
            other = table.read(options)
        except CatalogError:
            continue
        if {i.name for i in other.images} == names:
            yield _Candidate(f"{order} in {unit}s", other, {k: v for k, v in options.items() if v != own[k]})
    for reading in other_readings(model.images):
        if reading.what not in (GRAD, PHI_FIRST):
            turned = [replace(i, rotation=r) for i, r in zip(model.images, reading.rotations, strict=True)]
            yield _Candidate(reading.what, replace(model, images=tuple(turned)))


def _pairs(
    files: ImageFiles, readings: Sequence[Sequence[OrientedImage]], heights: HeightRange, most: int, reading: Reading
) -> list[VerifiedPair]:
    """Of a few stars of each reading, those that show the same."""
    stars: list[Star] = []
    for images in readings:
        flown = [i for i in images if not looks_level(i, heights.whole[1]) and files.of_name(i.name) is not None]
        views = [View(i, heights.over(i)) for i in flown]
        stars += [Star(tuple(_star_image(files, views[k]) for k in star)) for star in star_sample(views, most, PAIRS)]
    question = Question("pairs of pictures", partial(verified_pairs, most_px=QUICK_PX))
    answers = reading.answers(question, stars, len(stars))
    return [pair for answer in answers if isinstance(answer, tuple) for pair in answer]


def _star_image(files: ImageFiles, view: View) -> StarImage:
    return StarImage(SourceFile(str(files.of_name(view.image.name)), 0, ""), view.image, view.heights, 0.0)


def _looks_down(images: Sequence[OrientedImage]) -> bool:
    return looking_down(np.array([i.rotation for i in images])) > MOSTLY


def _decided(table: AngleTable, tried: Sequence[_Candidate], found: Verdict) -> TriedAngles:
    own, model = tried[0], tried[0].model
    sample = f"{found.ties:,} ties of {found.pairs} pairs of pictures"
    if found.chosen is None:
        what = f"no reading of them agrees clearly with {sample}" if found.pairs else "no pair of pictures could be found that shows the same"  # fmt: skip
        return TriedAngles(model, False, (f"angles stay as they were read ({own.what}): {what}",))
    best = tried[found.chosen]
    told = f"{sample} lie off by {found.errors_px[found.chosen]:.1f} px"
    rivals = " or ".join(tried[k].what for k in found.rivals)
    unclear = f"; the pictures do not tell it from {rivals} → state what is right (--angle-unit, --rotation-order)" if rivals else ""  # fmt: skip
    if found.chosen == 0:
        how = f"stay as they were read ({own.what})" if rivals else f"are read as {own.what}"
        stay = f"angles {how}: {told}, {_next_best(tried, found)}{unclear}"
        return TriedAngles(model, not found.rivals, (stay,))
    against = f"{told} then, by {_pixels(found.errors_px[0])} if they are read as {own.what}{unclear}"
    stated = [k for k in best.options if k in table.source.options]
    if stated:
        remedy = ", ".join(f"{option(k)} {best.options[k]}" for k in stated)
        note = f"doubtful orientation: angles look like {best.what}: {against}; they stay as stated → {remedy}"
        return TriedAngles(model, False, (note,))
    return TriedAngles(best.model, True, (f"angles are read as {best.what}: {against}",))


def _next_best(tried: Sequence[_Candidate], found: Verdict) -> str:
    errors = found.errors_px
    k = min(range(1, len(tried)), key=lambda k: errors[k])
    return f"by {_pixels(errors[k])} in the next best reading ({tried[k].what})"


def _pixels(error: float) -> str:
    return f"{error:.1f} px" if error < float("inf") else "so much that they lie behind the cameras"
