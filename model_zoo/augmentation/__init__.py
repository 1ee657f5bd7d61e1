"""Batches with mirrored rows and failing sensors, their reliabilities computed anew."""

from model_zoo.augmentation.augment import augment, check_lidar_may_fail, columns_needed
from model_zoo.augmentation.conditions import (
    CONDITIONS,
    FAILING_SENSOR,
    KNOWN_CONDITIONS,
    Condition,
    apply_condition,
    chosen_conditions,
)
from model_zoo.augmentation.mirror import mirror
from model_zoo.augmentation.settings import AugmentationSettings

__all__ = [
    "CONDITIONS",
    "FAILING_SENSOR",
    "KNOWN_CONDITIONS",
    "AugmentationSettings",
    "Condition",
    "apply_condition",
    "augment",
    "check_lidar_may_fail",
    "chosen_conditions",
    "columns_needed",
    "mirror",
]
