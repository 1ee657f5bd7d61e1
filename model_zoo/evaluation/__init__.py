"""Evaluation: scores with intervals, latency, and the comparison of models."""

from model_zoo.evaluation.compare import compare
from model_zoo.evaluation.evaluate import evaluate
from model_zoo.evaluation.evaluation import Evaluation, read_evaluation

__all__ = ["Evaluation", "compare", "evaluate", "read_evaluation"]
