"""Which images look alike: visual words of the survey itself (Sivic and Zisserman 2003), weighted by how rare they are."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray

WORDS = 1024
"""Of the vocabulary; set by hand on two flights of 28 and 120 photographs, as are those below."""
SAMPLE = 40_000
"""Descriptors of which it is made, evenly from all images."""
ROUNDS = 8
"""Of Lloyd's algorithm; neighbours are the same after them."""
AT_ONCE = 4096
"""Descriptors that are compared at once; bounds memory."""


def sampled(descriptors: np.ndarray, images: int) -> np.ndarray:
    """Some descriptors of an image, evenly, of which the vocabulary of so many images is made."""
    wanted = min(len(descriptors), max(1, SAMPLE // max(images, 1)))
    return descriptors[np.linspace(0, len(descriptors) - 1, wanted).astype(np.int64)]


def vocabulary(sample: np.ndarray) -> np.ndarray:
    """(W, 128) float32 words: centres of clusters of (N, 128) descriptors of unit length; the same for the same ones."""
    if len(sample) <= WORDS:
        return sample
    words = sample[np.linspace(0, len(sample) - 1, WORDS).astype(np.int64)].copy()
    for _ in range(ROUNDS):
        nearest = _nearest(sample, words)
        order = np.argsort(nearest, kind="stable")
        used, starts = np.unique(nearest[order], return_index=True)
        sums = np.add.reduceat(sample[order], starts, axis=0)
        words[used] = sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-9)
    return words


def word_counts(descriptors: np.ndarray, words: np.ndarray) -> IntArray:
    """(W,) how many descriptors of an image are nearest to each word."""
    return np.bincount(_nearest(descriptors, words), minlength=len(words)) if len(words) else np.zeros(0, np.int64)


def similarity(counts: IntArray) -> FloatArray:
    """(N, N) cosines between images' weighted words, 0 to 1; 0 on the diagonal.

    Parameters
    ----------
    counts : (N, W) of each image
    """
    holding = np.sum(counts > 0, axis=0)
    rarity = np.log(np.maximum(len(counts), 1) / np.maximum(holding, 1))
    vectors = np.sqrt(counts) * rarity
    vectors /= np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
    alike = np.round(vectors @ vectors.T, 6)
    np.fill_diagonal(alike, 0.0)
    return np.asarray(alike)


def _nearest(descriptors: np.ndarray, words: np.ndarray) -> IntArray:
    parts = [(descriptors[k : k + AT_ONCE] @ words.T).argmax(axis=1) for k in range(0, len(descriptors), AT_ONCE)]
    return np.concatenate(parts) if parts else np.zeros(0, np.int64)
