"""Bundles: a checkpoint as graphs that a planner runs without torch."""

from model_zoo.export.export import export_bundle

__all__ = ["export_bundle"]
