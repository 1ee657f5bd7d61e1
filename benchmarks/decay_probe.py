"""What lambda and the reliabilities are worth to the graph: fresh A-GNNs on held encoders.

Equation (6) has lambda, which nobody printed, and the reliabilities, of which the weights beta of
equation (5) are a part. All that beta can do is move r_point; beside the reliabilities as they were
made, the graph is taught with sensors that are always trusted and with sensors that never are.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import cast

import torch

from benchmarks.candidate_truth import rank, read_arguments
from benchmarks.fusion_probe import TRAINED_EVERY, Encoded, encode, learn, least_success
from benchmarks.publish import publish
from model_zoo.checkpoints import load_checkpoint
from model_zoo.contract import SuccessModel
from model_zoo.models.graspe import Graspe, GraspeSettings
from model_zoo.registry import model_settings

DECAYS = (2.0, 5.0, 20.0, 80.0)


def main() -> int:
    """Probe every checkpoint's encoders, and store the table."""
    arguments = read_arguments(__doc__, every=2)
    lines = [
        "| encoders | lambda | reliabilities | AU-ROC, all | within a scene |",
        "| --- | --- | --- | --- | --- |",
    ]
    for path in arguments.checkpoints:
        checkpoint = load_checkpoint(path)
        training = encode(checkpoint, arguments.data, "train", TRAINED_EVERY)
        examined = encode(checkpoint, arguments.data, arguments.split, arguments.every)
        taught = _decay_of(checkpoint.model)
        for decay, trust in [(decay, None) for decay in DECAYS] + [(taught, 1.0), (taught, 0.0)]:
            figures = probe(decay, _trusting(training, trust), _trusting(examined, trust))
            trust_text = "as made" if trust is None else f"all {trust:g}"
            lines.append(f"| {path.parent.name} | {decay:g} | {trust_text} | {figures} |")
            sys.stderr.write(lines[-1] + "\n")
    publish(lines, arguments.out)
    return 0


def probe(decay: float, training: Encoded, examined: Encoded) -> str:
    """How a fresh A-GNN ranks that has learned from encoded scenes."""
    through = examined.success.bool().all(dim=2).numpy()
    model = learn("graspe", training, graph={"decay": decay})
    ranking = rank(through, least_success(model, examined))
    return f"{ranking.pooled:.3f} | {ranking.within:.3f}"


def _decay_of(model: SuccessModel) -> float:
    """The lambda that the encoders were taught with; for those of other models, the preset's."""
    settings = model.settings if isinstance(model, Graspe) else model_settings("graspe", "small")
    return cast("GraspeSettings", settings).graph.decay


def _trusting(scenes: Encoded, trust: float | None) -> Encoded:
    if trust is None:
        return scenes
    held = {name: torch.full_like(r, trust) for name, r in scenes.reliabilities.items()}
    return replace(scenes, reliabilities=held)


if __name__ == "__main__":
    raise SystemExit(main())
