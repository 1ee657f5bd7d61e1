"""Where models come from: the files in ``models/``, and modules registered from outside.

A model is known by its class: a subclass of ``SuccessModel`` with a ``name`` of its own. Outside
this project a module with such classes is registered either by an entry point of its package in
the group ``graspe.models``, or by its import name in the environment's GRASPE_MODELS. Both are the
user's own settings: a checkpoint names a model, and never what is imported.
"""

from __future__ import annotations

import difflib
import importlib
import inspect
import os
import pkgutil
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.metadata import entry_points
from types import ModuleType

from graspe_data.errors import ZooError
from model_zoo import models
from model_zoo.contract import SuccessModel

GROUP = "graspe.models"
VARIABLE = "GRASPE_MODELS"
"""Import names with commas between them."""

Models = Mapping[str, type[SuccessModel]]


def models_within(module: ModuleType) -> Iterator[type[SuccessModel]]:
    """The models that a module defines, in its order; what it imports or only derives is none."""
    for found in vars(module).values():
        if (
            inspect.isclass(found)
            and issubclass(found, SuccessModel)
            and found.__module__ == module.__name__
            and "name" in vars(found)
        ):
            yield found


def _shipped() -> Iterator[type[SuccessModel]]:
    for module in pkgutil.iter_modules(models.__path__):
        yield from models_within(importlib.import_module(f"{models.__name__}.{module.name}"))


SHIPPED: Models = {model.name: model for model in sorted(_shipped(), key=lambda it: it.name)}
"""The models of this project."""


def known_models() -> Models:
    """The models by name: those of this project, then those registered from outside.

    Raises:
        ZooError: A registered module cannot be imported, has no model, or one whose name is taken.
    """
    return _listed_models(os.environ.get(VARIABLE, ""))


def nearest_of(name: str, known: Iterable[str]) -> str:
    """What an error says of an unknown name: those that are known, and the nearest."""
    names = sorted(known)
    nearest = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    advice = f" Did you mean {nearest[0]!r}?" if nearest else ""
    return f"known are {', '.join(names)}.{advice}"


@cache
def _listed_models(listed: str) -> Models:
    models = dict(SHIPPED)
    for where, module in _registered(listed):
        for model in _import(where, module):
            if models.setdefault(model.name, model) is not model:
                raise ZooError(
                    f"{where}: {module} has a model {model.name!r}, a name that is taken by "
                    f"{models[model.name].__module__}. Give it another name."
                )
    return models


def _registered(listed: str) -> Iterator[tuple[str, str]]:
    """What registers a module, for errors, and its import name."""
    for point in entry_points(group=GROUP):
        yield f"entry point {point.name!r} in {GROUP}", point.module
    for module in filter(None, (part.strip() for part in listed.split(","))):
        yield VARIABLE, module


def _import(where: str, module: str) -> list[type[SuccessModel]]:
    try:
        found = list(models_within(importlib.import_module(module)))
    except Exception as error:  # whatever a module does when it is imported
        raise ZooError(f"{where}: {module} cannot be imported: {error}.") from error
    if not found:
        raise ZooError(
            f"{where}: {module} has no model: expected a subclass of "
            "model_zoo.contract.SuccessModel with a name and a settings_type."
        )
    return found
