"""The joint choice over a row: which stations are borders, given their odds and how wide units are.

A row is a sequence of units. Each border adds the logarithm of its odds, each unit a value by its width. In a regular row the units are about as wide as one
another, whatever that width is: a mode for each such width, and one without. All sequences are summed over by dynamic programming, so that what is returned are
probabilities, not one best sequence.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit

ANY = -1
"""Group of every station where nothing is known of the borders."""


class Row(NamedTuple):
    """Odds and freedom of a row.

    Attributes
    ----------
    odds : (S,) logarithms, at evenly spaced stations
    first, last : distance of the ends of the row from station 0 and station S − 1, in stations, at least 0; −1 where the row goes on
    group : (S,) `ANY`; or of known borders, for fitting: the number of the border that a station may be, or −2 for a station that is none
    groups : number of known borders
    """

    odds: FloatArray
    first: int
    last: int
    group: IntArray
    groups: int


class Choice(NamedTuple):
    """What comes of the sum over all sequences.

    Attributes
    ----------
    log_sum : its logarithm
    border : (S,) probability of a border at each station
    units : (M, D) expected number of units by mode and width
    modes : (M,) probability of each mode
    """

    log_sum: float
    border: FloatArray
    units: FloatArray
    modes: FloatArray


@njit(cache=True, nogil=True)
def choose(row: Row, widths: FloatArray, weights: FloatArray) -> Choice:
    """Sum over all sequences of borders.

    Parameters
    ----------
    widths : (M, D) factors of a unit of d stations in each mode; d = 0 is one whose other end is not known
    weights : (M,) factors of the modes
    """
    n, (modes, most) = len(row.odds), widths.shape
    gain = np.exp(row.odds)
    total, border = 0.0, np.zeros(n)
    units, of_mode = np.zeros((modes, most)), np.zeros(modes)
    known = row.group.max() != ANY if n else False
    may = np.flatnonzero((gain > 0) & ((row.group >= 0) | (not known)))
    for m in range(modes):
        before, after = np.zeros(n), np.zeros(n)
        all_of = _whole(widths[m], row, n) if not known or row.groups == 0 else 0.0
        units[m, _width(row.first, n - 1 + row.last, row.last, most)] += all_of * weights[m]
        for j in may:
            value = _end(widths[m], row.first, j) if not known or row.group[j] == 0 else 0.0
            for i in may:
                if j - most < i < j and (not known or row.group[i] == row.group[j] - 1):
                    value += before[i] * widths[m, j - i]
            before[j] = value * gain[j]
            if not known or row.group[j] == row.groups - 1:
                all_of += before[j] * _end(widths[m], row.last, n - 1 - j)
        for i in may[::-1]:
            value = _end(widths[m], row.last, n - 1 - i) if not known or row.group[i] == row.groups - 1 else 0.0
            for j in may:
                if i < j < i + most and (not known or row.group[j] == row.group[i] + 1):
                    value += after[j] * gain[j] * widths[m, j - i]
            after[i] = value
        all_of *= weights[m]
        total += all_of
        of_mode[m] = all_of
        for j in may:
            border[j] += before[j] * after[j] * weights[m]
            if not known or row.group[j] == 0:
                end = _end(widths[m], row.first, j)
                units[m, _width(row.first, j, 0, most)] += end * gain[j] * after[j] * weights[m]
            if not known or row.group[j] == row.groups - 1:
                end = _end(widths[m], row.last, n - 1 - j)
                units[m, _width(row.last, n - 1 - j, 0, most)] += before[j] * end * weights[m]
            for i in may:
                if j - most < i < j and (not known or row.group[i] == row.group[j] - 1):
                    units[m, j - i] += before[i] * widths[m, j - i] * gain[j] * after[j] * weights[m]
    return Choice(np.log(total), border / total, units / total, of_mode / total)


@njit(cache=True, nogil=True)
def _width(end: int, along: int, other: int, most: int) -> int:
    """Stations between an end of the row and a border; 0 where the row goes on."""
    return 0 if end < 0 or other < 0 else min(along + end, most - 1)


@njit(cache=True, nogil=True)
def _end(widths: FloatArray, end: int, along: int) -> float:
    return widths[_width(end, along, 0, len(widths))]


@njit(cache=True, nogil=True)
def _whole(widths: FloatArray, row: Row, n: int) -> float:
    return widths[_width(row.first, n - 1 + row.last, row.last, len(widths))]
