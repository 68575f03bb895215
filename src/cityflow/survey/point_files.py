"""Locations of the points for buildings: a file for each index cell of a LiDAR file, or of a tile."""

from __future__ import annotations

from cityflow.core.grid import Bounds, tile_names_over
from cityflow.flow.task import Record
from cityflow.survey.results import Results
from cityflow.survey.surface_source import LIDAR, Source
from cityflow.survey.survey_parameters import TileParameters


class PointIndex:
    """Pieces by the file or ground tile whose task left them, and by cell."""

    def __init__(self, source: Source, tiles: TileParameters, results: Results) -> None:
        self._source, self._sizes, self._results = source, tiles, results
        self._pieces: dict[tuple[str, str], tuple[str, str]] = {}

    def learn(self, record: Record) -> None:
        """Keep what a task has written."""
        if record.stage == self._source.indexed_by:
            for path, digest in record.outputs.items():
                if path.startswith("work/") and path.endswith(".laz"):
                    self._pieces[record.unit, stem(path)] = path, digest

    def over(self, bounds: Bounds) -> dict[str, str]:
        """Path → digest of the pieces that meet `bounds`, of the files or tiles that do, in a fixed order.

        A file that only shares a cell with `bounds` is left out: nobody has waited for it.
        """
        cells = tile_names_over(bounds, self._sizes.index_cell_m)
        ended = [
            name for name in self._parts_over(bounds) if self._results.of(self._source.indexed_by, name) is not None
        ]
        keys = [(name, cell) for name in ended for cell in cells]
        return dict(sorted(self._pieces[k] for k in keys if k in self._pieces))

    def _parts_over(self, bounds: Bounds) -> list[str]:
        """Files or ground tiles that meet `bounds`."""
        if self._source.kind == LIDAR:
            return [asset.name for asset in self._source.assets_over(bounds)]
        return tile_names_over(bounds, self._sizes.tile_m)

    def of_file(self, name: str) -> dict[str, str]:
        """Path → digest of the pieces of one LiDAR file; none where its task has not ended."""
        if self._results.of(self._source.indexed_by, name) is None:
            return {}
        return dict(sorted(piece for (part, _), piece in self._pieces.items() if part == name))


def stem(path: str) -> str:
    """Name of a file without folders and ending."""
    return path.rsplit("/", 1)[-1].rsplit(".", 1)[0]
