"""Removes users, passwords and keys from addresses before they reach records, reports and logs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

_USER = re.compile(r"(?<=://)[^/?#@\s]*@")
_QUERY = re.compile(
    r"(?i)([?&][^=&\s]*(?:token|key|secret|signature|sig|password|passwd|pwd|credential|auth|sas)[^=&\s]*=)[^&\s#'\")]*"
)


def without_credentials(text: str) -> str:
    """A text whose addresses have lost user and password, and the values of keys and tokens.

    >>> without_credentials("https://joe:pass@host/a?X-Amz-Signature=ab12&x=1")
    'https://host/a?X-Amz-Signature=…&x=1'
    >>> without_credentials("s3://bucket/town@night/a.laz")
    's3://bucket/town@night/a.laz'
    """
    return _QUERY.sub(r"\1…", _USER.sub("", text))


def stripped(value: Any) -> Any:
    """A JSON value, every text in it `without_credentials`."""
    if isinstance(value, int | float):
        return value
    if isinstance(value, str):
        return without_credentials(value) if "://" in value else value
    if isinstance(value, Mapping):
        return {key: stripped(inner) for key, inner in value.items()}
    return [stripped(inner) for inner in value] if isinstance(value, list | tuple) else value
