"""Run-length encoded bitmaps, for the visibility of faces in many images."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class RunLengthMask:
    """A binary raster, row after row, as lengths of runs.

    Attributes
    ----------
    rows, cols : size
    ends : (R,) int64, where each run ends, counted in cells from the upper left; runs are false and true in turn, the first is false (it may be empty)
    """

    rows: int
    cols: int
    ends: IntArray

    @classmethod
    def of(cls, mask: BoolArray) -> RunLengthMask:
        """Of a (rows, cols) boolean raster.

        >>> RunLengthMask.of(np.array([[True, True], [False, True]])).ends.tolist()
        [0, 2, 3, 4]
        """
        flat = np.asarray(mask, bool).ravel()
        changes = np.flatnonzero(flat[1:] != flat[:-1]) + 1
        first = [0] if flat.size and flat[0] else []
        ends = np.concatenate([first, changes, [flat.size]]).astype(np.int64)
        return cls(int(mask.shape[0]), int(mask.shape[1]), ends)

    def mask(self) -> BoolArray:
        """(rows, cols) the raster again."""
        lengths = np.diff(self.ends, prepend=0)
        values = np.arange(len(lengths)) % 2 == 1
        return np.repeat(values, lengths).reshape(self.rows, self.cols)

    @property
    def count(self) -> int:
        """Number of true cells.

        >>> RunLengthMask.of(np.array([[True, True], [False, True]])).count
        3
        """
        return int(np.diff(self.ends, prepend=0)[1::2].sum())

    def overlap(self, other: RunLengthMask) -> int:
        """Number of cells that are true in both; of the same size."""
        # positions where either changes; both are constant between them
        marks = np.union1d(self.ends, other.ends)
        lengths = np.diff(marks, prepend=0)
        starts = marks - lengths
        both = self._at(starts) & other._at(starts)
        return int(lengths[both].sum())

    def _at(self, cells: IntArray) -> BoolArray:
        """Values of the cells."""
        return np.asarray(np.searchsorted(self.ends, cells, side="right") % 2 == 1)
