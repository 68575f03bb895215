"""Where the object store is."""

from __future__ import annotations

import os


def s3_endpoint() -> str:
    """Address of the S3 server by the environment; empty: Amazon's own."""
    return os.environ.get("AWS_ENDPOINT_URL_S3") or os.environ.get("AWS_ENDPOINT_URL") or ""
