"""Methods of reconstruction by name, for benchmarks."""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.reconstruction.choose import ReconstructParameters, choose
from cityflow.reconstruction.model import ModelParameters, model


def method_of(name: str, settings: Sequence[str] = ()) -> Callable[[Evidence], Candidate]:
    """`model`, `model=a+b`, `choose`, `choose=a+b`, a module of `cityflow.reconstruction`, or `module:function`; settings as ``key.of.it=value``."""
    whole, _, among = name.partition("=")
    chosen: dict[str, Any] = {"methods": tuple(among.split("+"))} if among else {}
    if whole == "model":
        finished = _with(ModelParameters(**chosen), settings)
        return lambda evidence: model(evidence, finished).candidate
    if whole == "choose":
        parameters = _with(ReconstructParameters(**chosen), settings)
        return lambda evidence: choose(evidence, parameters).candidate
    module_name, _, function = name.partition(":")
    module = importlib.import_module(module_name if function else f"cityflow.reconstruction.{name}")
    return partial(getattr(module, function or "reconstruct"), parameters=_with(_parameters_of(module), settings))


def _parameters_of(module: Any) -> Parameters:
    """The class of parameters that the module itself defines: the one that others are part of."""
    own = [c for c in vars(module).values() if isinstance(c, type) and issubclass(c, Parameters) and c.__module__ == module.__name__]  # fmt: skip
    wanted = module.__name__.rsplit(".", 1)[-1].replace("_", "") + "parameters"
    named = [c for c in own if c.__name__.lower() == wanted]
    return (named or own)[0]()


def _with(parameters: Any, settings: Sequence[str]) -> Any:
    tree = parameters.model_dump()
    for setting in settings:
        path, _, text = setting.partition("=")
        *branches, leaf = path.split(".")
        place = tree
        for branch in branches:
            place = place[branch]
        try:
            place[leaf] = json.loads(text)
        except json.JSONDecodeError:
            place[leaf] = text
    return type(parameters).model_validate(tree)
