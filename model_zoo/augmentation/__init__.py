"""Batches with mirrored rows and failing sensors, their reliabilities computed anew."""

from model_zoo.augmentation.augment import augment, check_lidar_may_fail, columns_needed
from model_zoo.augmentation.conditions import CONDITIONS, Condition, apply_condition
from model_zoo.augmentation.mirror import mirror
from model_zoo.augmentation.settings import AugmentationSettings

__all__ = [
    "CONDITIONS",
    "AugmentationSettings",
    "Condition",
    "apply_condition",
    "augment",
    "check_lidar_may_fail",
    "columns_needed",
    "mirror",
]
