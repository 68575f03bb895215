"""Environment of the child processes that run tasks."""

from __future__ import annotations

ONE_THREAD = dict.fromkeys(
    (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "NUMEXPR_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
        "NUMBA_NUM_THREADS",
        "GDAL_NUM_THREADS",
        "RAYON_NUM_THREADS",
        "BLOSC_NTHREADS",
        "OPENCV_FOR_THREADS_NUM",
        "ZARR_THREADING__MAX_WORKERS",
    ),
    "1",
)
"""One worker thread is one core; libraries that start more would fight over it, and sums would depend on it."""

KEPT_HEAP = {
    "GLIBC_TUNABLES": "glibc.malloc.trim_threshold=4294967296:glibc.malloc.mmap_threshold=1073741824",
    "MALLOC_TRIM_THRESHOLD_": "4294967296",
}
"""Large arrays come and go all the time; fetching their pages from the system anew each time took half of the time of matching. The child hands
its heap back after a task. Dask sets the second one low for its workers."""
