"""Models, training, evaluation and export; torch, shards, no bags."""

from __future__ import annotations

from typing import TYPE_CHECKING

from graspe_data.lazy_names import lazy_names

if TYPE_CHECKING:
    from model_zoo.batches import BatchLoader as BatchLoader
    from model_zoo.checkpoints import load_checkpoint as load_checkpoint
    from model_zoo.evaluation.evaluate import evaluate as evaluate
    from model_zoo.export import export_bundle as export_bundle
    from model_zoo.registry import create_model as create_model
    from model_zoo.training.train import train as train

_NAMES = {
    "BatchLoader": "model_zoo.batches",
    "create_model": "model_zoo.registry",
    "evaluate": "model_zoo.evaluation.evaluate",
    "export_bundle": "model_zoo.export",
    "load_checkpoint": "model_zoo.checkpoints",
    "train": "model_zoo.training.train",
}
__all__ = ["BatchLoader", "create_model", "evaluate", "export_bundle", "load_checkpoint", "train"]

__getattr__ = lazy_names(__name__, _NAMES)
