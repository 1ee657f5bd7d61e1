"""Checkpoints: a trained model in a folder, sealed with the digests of its files."""

from model_zoo.checkpoints.calibration import TemperatureScaling, Uncalibrated, fit_temperature
from model_zoo.checkpoints.load import Checkpoint, load_checkpoint
from model_zoo.checkpoints.write import TrainedModel, write_checkpoint

__all__ = [
    "Checkpoint",
    "TemperatureScaling",
    "TrainedModel",
    "Uncalibrated",
    "fit_temperature",
    "load_checkpoint",
    "write_checkpoint",
]
