"""Polygons cut by half-spaces (Sutherland and Hodgman), for many cameras at once.

A ring that is cut apart stays one ring, whose parts hang together by edges that lie on top of each other; its area is right all the same.
"""

from __future__ import annotations

import numpy as np

from cityflow.core.kernels import njit


@njit(cache=True, nogil=True)
def cut(ring, a, b, c, d):  # type: ignore[no-untyped-def]
    """What of a ring (n, 3) lies where a·x + b·y + c·z + d ≥ 0."""
    n = ring.shape[0]
    out = np.empty((2 * n, 3))
    count = 0
    for i in range(n):
        j = (i + 1) % n
        here = a * ring[i, 0] + b * ring[i, 1] + c * ring[i, 2] + d
        there = a * ring[j, 0] + b * ring[j, 1] + c * ring[j, 2] + d
        if here >= 0.0:
            out[count] = ring[i]
            count += 1
        if (here >= 0.0) != (there >= 0.0):
            share = here / (here - there)
            for k in range(3):
                out[count, k] = ring[i, k] + share * (ring[j, k] - ring[i, k])
            count += 1
    return out[:count]


@njit(cache=True, nogil=True)
def in_pyramids(rings, ring_start, rotations, centres, reach, near, pieces):  # type: ignore[no-untyped-def]
    """Rings in the frames of cameras, cut by a near plane and by the pyramid of what each camera can show.

    Parameters
    ----------
    rings : (V, 3), one after the other, and `ring_start` (R + 1,)
    rotations, centres : (I, 3, 3), (I, 3)
    reach : (I, 4) least and greatest x/z, least and greatest y/z
    near : least depth, metres
    pieces : (I,) into how many pieces every edge is to be cut afterwards, because the lens bends it

    Returns
    -------
    (K, 3) points in the camera frames, and (I · R + 1,) where the points of ring r of image i begin, at i · R + r
    """
    images, count = rotations.shape[0], ring_start.shape[0] - 1
    start = np.zeros(images * count + 1, np.int64)
    out = np.empty((max(64, 2 * rings.shape[0] * images), 3))
    filled = 0
    for i in range(images):
        for r in range(count):
            ring = _in_camera(rings[ring_start[r] : ring_start[r + 1]], rotations[i], centres[i])
            ring = cut(ring, 0.0, 0.0, 1.0, -near)
            ring = cut(ring, 1.0, 0.0, -reach[i, 0], 0.0)
            ring = cut(ring, -1.0, 0.0, reach[i, 1], 0.0)
            ring = cut(ring, 0.0, 1.0, -reach[i, 2], 0.0)
            ring = cut(ring, 0.0, -1.0, reach[i, 3], 0.0)
            wanted = filled + ring.shape[0] * pieces[i]
            if wanted > out.shape[0]:
                more = np.empty((2 * wanted, 3))
                more[:filled] = out[:filled]
                out = more
            filled = _dense(ring, pieces[i], out, filled)
            start[i * count + r + 1] = filled
    return out[:filled], start


@njit(cache=True, nogil=True)
def in_frames(points, start, sizes):  # type: ignore[no-untyped-def]
    """Rings of image coordinates cut by the frames of their images.

    Parameters
    ----------
    points : (K, 3) u, v, anything, and `start` (N + 1,) where each ring begins
    sizes : (N, 2) width and height of each ring's image

    Returns
    -------
    (L, 3) points and (N + 1,) where each ring begins
    """
    begin = np.zeros(start.shape[0], np.int64)
    out = np.empty((2 * points.shape[0] + 16, 3))
    filled = 0
    for n in range(start.shape[0] - 1):
        ring = points[start[n] : start[n + 1]]
        ring = cut(ring, 1.0, 0.0, 0.0, 0.0)
        ring = cut(ring, -1.0, 0.0, 0.0, sizes[n, 0])
        ring = cut(ring, 0.0, 1.0, 0.0, 0.0)
        ring = cut(ring, 0.0, -1.0, 0.0, sizes[n, 1])
        if filled + ring.shape[0] > out.shape[0]:
            more = np.empty((2 * (filled + ring.shape[0]), 3))
            more[:filled] = out[:filled]
            out = more
        out[filled : filled + ring.shape[0]] = ring
        filled += ring.shape[0]
        begin[n + 1] = filled
    return out[:filled], begin


@njit(cache=True, nogil=True)
def ring_measures(st, start):  # type: ignore[no-untyped-def]
    """(N, 3) area (positive counter-clockwise) and centroid of rings of s, t; centroid of the vertices where there is no area."""
    out = np.zeros((start.shape[0] - 1, 3))
    for n in range(start.shape[0] - 1):
        first, last = start[n], start[n + 1]
        if last == first:
            continue
        area, x, y, mean_x, mean_y = 0.0, 0.0, 0.0, 0.0, 0.0
        s_0, t_0 = st[first, 0], st[first, 1]
        for i in range(first, last):
            j = i + 1 if i + 1 < last else first
            a_s, a_t, b_s, b_t = st[i, 0] - s_0, st[i, 1] - t_0, st[j, 0] - s_0, st[j, 1] - t_0
            cross = a_s * b_t - a_t * b_s
            area += cross / 2
            x += cross * (a_s + b_s) / 6
            y += cross * (a_t + b_t) / 6
            mean_x += a_s / (last - first)
            mean_y += a_t / (last - first)
        safe = abs(area) > 1e-12
        out[n, 0] = area
        out[n, 1] = s_0 + (x / area if safe else mean_x)
        out[n, 2] = t_0 + (y / area if safe else mean_y)
    return out


@njit(cache=True, nogil=True)
def _in_camera(ring, rotation, centre):  # type: ignore[no-untyped-def]
    out = np.empty(ring.shape)
    for i in range(ring.shape[0]):
        x, y, z = ring[i, 0] - centre[0], ring[i, 1] - centre[1], ring[i, 2] - centre[2]
        for k in range(3):
            out[i, k] = rotation[k, 0] * x + rotation[k, 1] * y + rotation[k, 2] * z
    return out


@njit(cache=True, nogil=True)
def _dense(ring, pieces, out, filled):  # type: ignore[no-untyped-def]
    n = ring.shape[0]
    for i in range(n):
        j = (i + 1) % n
        for p in range(pieces):
            share = p / pieces
            for k in range(3):
                out[filled, k] = ring[i, k] + share * (ring[j, k] - ring[i, k])
            filled += 1
    return filled
