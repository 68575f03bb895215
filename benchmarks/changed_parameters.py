"""Parameters of the choice from KEY=VALUE pairs, for benchmarks that compare their values."""

from __future__ import annotations

from collections.abc import Iterable

from cityflow.reconstruction.choose import ReconstructParameters


def changed_parameters(pairs: Iterable[str]) -> ReconstructParameters:
    """Parameters with some values: each pair is ``key.of.a.tree=value``."""
    changed: dict[str, object] = {}
    for pair in pairs:
        _set(changed, *pair.split("=", 1))
    return ReconstructParameters.model_validate(changed)


def _set(tree: dict[str, object], key: str, value: str) -> None:
    head, _, rest = key.partition(".")
    if rest:
        branch = tree.setdefault(head, {})
        assert isinstance(branch, dict)
        _set(branch, rest, value)
    else:
        tree[head] = value
