"""Which tests run in one process, after the other: those that use the same cluster, finished runs, browser or made scenes.

All others of a file stay together, since they share what is compiled and made once. The first here are begun first: they take longest, and wait
while their workers are at work. A long file that would come last by its name is here, too: one process alone would end it.
"""

from __future__ import annotations

from pathlib import Path

from xdist.scheduler import LoadFileScheduling

TOGETHER = {
    "towns and surveys on a cluster": ("cluster",),
    "clusters that are killed": ("flow/test_cluster.py", "flow/test_spread.py"),
    "toy tasks": ("flow/test_drafts.py", "flow/test_executor.py"),
    "an object store": (
        "flow/test_store.py",
        "flow/test_heartbeat.py",
        "flow/test_deploy.py",
        "flow/test_store_outage.py",
    ),
    "a browser and the painted town": (
        "api/test_finished_run.py",
        "browser",
        "reporting/test_report_pages.py",
        "reporting/test_view.py",
        "workflow/test_desk.py",
    ),
    "orientations on a cluster": (
        "workflow/test_orient.py",
        "workflow/test_orient_bad_photographs.py",
        "workflow/test_orient_held.py",
        "workflow/test_orient_photographs.py",
        "workflow/test_orient_video.py",
    ),
    "windows": ("windows",),
    "made surfaces": ("surface/test_dtm.py", "surface/test_tile_surface.py"),
}
"""Files or folders below `tests`."""


def group(path: str) -> str:
    """What a file belongs to; the file itself where that is nothing else."""
    parts = Path(path).parts
    below = "/".join(parts[parts.index("tests") + 1 :] if "tests" in parts else parts)
    return next((g for g, files in TOGETHER.items() if below.startswith(files)), path)


def turn(path: str) -> int:
    """Place in the order of groups; files of none come last."""
    return [*TOGETHER, path].index(group(path))


class Scheduling(LoadFileScheduling):  # type: ignore[misc]  # xdist has no types
    """As ``--dist loadfile``, with groups in place of files."""

    def _split_scope(self, nodeid: str) -> str:
        return group(nodeid.split("::", 1)[0])
