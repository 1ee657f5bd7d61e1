"""Columns on disk: write, map, verify."""

from graspe_data.shards.dataset import Dataset
from graspe_data.shards.epoch_order import EpochOrder

__all__ = ["Dataset", "EpochOrder"]
