"""Reads the files of a catalog again, and compares their digests."""

from __future__ import annotations

from cityflow.catalog.check_results import Seen
from cityflow.catalog.file_questions import Reading
from cityflow.catalog.file_reading import CHECKED_FILES, CheckedFile, CheckJob, Digest
from cityflow.catalog.findings import Level
from cityflow.errors import CityflowError
from cityflow.io.catalog.stac import Asset, Catalog, ImageAsset, LidarAsset

KIND_OF = {LidarAsset: "lidar", ImageAsset: "image"}
"""Assets of which more than the digest is read."""
MADE_AGAIN = "fetch the file again, or make the catalog again if the new file is meant"


def read_files(catalog: Catalog, reading: Reading) -> list[CheckedFile]:
    """Digest and contents of every file, in the order of the assets."""
    jobs = [CheckJob(a.href, KIND_OF.get(type(a), "")) for a in catalog.assets]
    answers = reading.answers(CHECKED_FILES, jobs, len(jobs), sum(a.size for a in catalog.assets))
    return [a if isinstance(a, CheckedFile) else CheckedFile(a, a) for a in answers]


def check_file(asset: Asset, digest: Digest | Exception, seen: Seen) -> None:
    """Is it there, and is it the file that the catalog was made from? A run goes on without an image, but not without another file."""
    level, before = Level.WARNING if isinstance(asset, ImageAsset) else Level.ERROR, len(seen.findings)
    _compare_file(asset, digest, level, seen)
    if isinstance(asset, ImageAsset) and len(seen.findings) > before:
        seen.bad_images.append(asset.name)


def _compare_file(asset: Asset, digest: Digest | Exception, level: Level, seen: Seen) -> None:
    if isinstance(digest, CityflowError):
        seen.say(level, digest.where or asset.href, digest.problem, digest.remedy)
    elif isinstance(digest, FileNotFoundError):
        seen.say(level, asset.href, "the file is missing", "put it back, or make the catalog again without it")
    elif isinstance(digest, Exception):
        seen.say(level, asset.href, f"the file cannot be read ({digest})", "check its permissions or address")
    elif digest.size < asset.size:
        problem = f"the file is truncated or was replaced: {digest.size:,} bytes instead of {asset.size:,}"
        seen.say(level, asset.href, problem, MADE_AGAIN)
    elif digest.checksum != asset.checksum:
        seen.say(level, asset.href, "the file has changed since the catalog was made: its checksum differs", MADE_AGAIN)
