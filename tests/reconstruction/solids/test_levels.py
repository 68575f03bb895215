from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from shapely import Polygon, box
from shapely.affinity import translate

from cityflow.core.building import Lod, Polyhedron, Semantic
from cityflow.geometry.polyhedron import volume
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.extruded import extrude
from cityflow.reconstruction.model import ModelParameters, model
from cityflow.reconstruction.partition.plane_energy import PartitionParameters
from cityflow.reconstruction.partition.roof_partition import partition_roof
from cityflow.reconstruction.solids.levels import LevelParameters, block_levels
from roof_cases import ORIGIN, roof_cases
from roof_scenes import OUTLINE, gable, scan

CASES = roof_cases()


def levels_of(name: str, jump: float = 2.0) -> Mapping[Lod, Polyhedron]:
    case = CASES[name]
    segments = case.segments(0)
    partition, _ = partition_roof(case.outline, segments, PartitionParameters())
    world = translate(case.outline, *ORIGIN[:2])
    return block_levels(partition, segments.coefficients, 1.0, ORIGIN, world).by(LevelParameters(jump=jump))


@pytest.mark.parametrize("name", sorted(CASES))
def test_every_level_is_valid(name: str) -> None:
    for solid in levels_of(name).values():
        assert check_polyhedron(solid) == []
        assert all(
            len({z for _, _, z in solid.ring(f.rings[0]).tolist()}) == 1 for f in solid.of_semantic(Semantic.ROOF)
        )


def test_one_block_at_the_percentile() -> None:
    # A gable of 0.8 over 8 m rises from 5 to 8.2: 70 % of its area lies below 5 + 0.7 · 3.2.
    assert volume(levels_of("gable")[Lod.LOD12]) == pytest.approx(96 * (5 + 0.7 * 3.2 - 1), rel=0.01)


@pytest.mark.parametrize("method", ["orientation_histogram", "roof_types"])
def test_one_percentile_is_that_of_all_methods(method: str) -> None:
    evidence = scan(gable, OUTLINE, 8.0, 0.03, 1)
    tops = []
    for percentile in (0.0, 100.0):
        asked = ModelParameters(methods=(method,), levels=LevelParameters(percentile=percentile), with_overhangs=False)
        made = model(evidence, asked).candidate
        assert made.method == method
        tops.append(float(made.blocks[Lod.LOD12].vertices[:, 2].max()))
    heights = evidence.points.xyz[:, 2]
    assert tops == pytest.approx([np.quantile(heights, 0.01), heights.max()], abs=0.3)


def test_blocks_part_at_jumps_only() -> None:
    assert len(levels_of("hip")[Lod.LOD13].of_semantic(Semantic.ROOF)) == 1
    assert len(levels_of("tower")[Lod.LOD13].of_semantic(Semantic.ROOF)) == 2
    assert len(levels_of("tower", jump=5.0)[Lod.LOD13].of_semantic(Semantic.ROOF)) == 1


def test_blocks_have_their_own_heights() -> None:
    solid = levels_of("step")[Lod.LOD13]
    tops = sorted(solid.ring(f.rings[0])[0, 2] for f in solid.of_semantic(Semantic.ROOF))
    assert tops == pytest.approx([5.0, 8.0], abs=1e-3)
    assert volume(solid) == pytest.approx(box(0, 0, 5, 8).area * 4 + box(5, 0, 12, 8).area * 7, rel=0.01)


def test_blocks_are_made_when_somebody_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[float] = []

    def counted(outline: Polygon, floor: float, top: float) -> Polyhedron:
        made.append(top)
        return extrude(outline, floor, top)

    monkeypatch.setattr("cityflow.reconstruction.solids.levels.extrude", counted)
    blocks = levels_of("gable")
    assert set(blocks) == {Lod.LOD12, Lod.LOD13}
    assert not made
    assert volume(blocks[Lod.LOD12]) > 0
    assert check_polyhedron(blocks[Lod.LOD12]) == []
    assert len(made) == 1
