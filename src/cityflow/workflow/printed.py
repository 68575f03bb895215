"""JSON on standard output, for programs."""

from __future__ import annotations

import json
import sys
from typing import Any


def print_json(tree: Any) -> None:
    """One value, indented, as UTF-8; nothing else goes to standard output then."""
    sys.stdout.write(json.dumps(tree, ensure_ascii=False, indent=1) + "\n")
