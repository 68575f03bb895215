"""Resident memory of a process and of those that it started."""

from __future__ import annotations

import psutil


def resident_mb(process: psutil.Process, *, descendants: bool) -> float:
    """MB; 0 of a process that is gone. Finding descendants reads all of /proc."""
    try:
        own = process.memory_info().rss
        others = sum(p.memory_info().rss for p in process.children(recursive=True)) if descendants else 0
    except psutil.Error:
        return 0.0
    return float(own + others) / (1 << 20)
