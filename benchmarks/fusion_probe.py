"""The encoders or the fusion? Fresh fusion layers on features that trained encoders made.

What two models of GrASPE's family differ by lies after their encoders, but the encoders were
trained through it. Here each model's encoders are held, and each model's fusion learns from them.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from benchmarks.candidate_truth import rank, read_arguments
from benchmarks.publish import publish
from graspe_data.shards import Dataset
from model_zoo.checkpoints import Checkpoint, load_checkpoint
from model_zoo.contract import masked_cross_entropy
from model_zoo.models.graspe import GraspeFamily
from model_zoo.registry import create_model
from model_zoo.training.candidates import ranking_loss

BATCH, STEPS, LEARNING_RATE, TRAINED_EVERY = 16, 1500, 2e-3, 2
RELIABILITIES = ("r_img", "r_point")


@dataclass(frozen=True)
class Encoded:
    """f_vec (N, K, 120) of N scenes and their candidates; success (N, K, T); reliabilities (N,)."""

    vectors: Tensor
    success: Tensor
    reliabilities: dict[str, Tensor]


def main() -> int:
    """Probe every pair of the checkpoints' encoders and fusions, and store the table."""
    arguments = read_arguments(__doc__, every=2)
    checkpoints = [load_checkpoint(path) for path in arguments.checkpoints]
    lines = ["| encoders | fusion | AU-ROC, all | within a scene |", "| --- | --- | --- | --- |"]
    for path, held in zip(arguments.checkpoints, checkpoints, strict=True):
        known = encode(held, arguments.data, "train", TRAINED_EVERY)
        examined = encode(held, arguments.data, arguments.split, arguments.every)
        through = examined.success.bool().all(dim=2).numpy()
        fusions = {f"{name}, fresh": learn(name, known) for name in _names(checkpoints)}
        for name, model in ({"its own": family_member(held)} | fusions).items():
            ranking = rank(through, least_success(model, examined))
            figures = f"{ranking.pooled:.3f} | {ranking.within:.3f}"
            lines.append(f"| {path.parent.name} | {name} | {figures} |")
            sys.stderr.write(lines[-1] + "\n")
    publish(lines, arguments.out)
    return 0


def encode(checkpoint: Checkpoint, data: Path, split: str, every: int) -> Encoded:
    """What the encoders make of every so many rows of a split."""
    model = family_member(checkpoint).eval()
    columns = (*(name for name in model.scene_columns if name not in RELIABILITIES), *RELIABILITIES)
    dataset = Dataset(
        data, split, (*columns, "candidate_image", "candidate_success"), check="sha256"
    )
    rows = np.arange(0, len(dataset), every)
    parts = []
    for start in range(0, len(rows), BATCH):
        read = dataset.batch(rows[start : start + BATCH])
        batch = {name: torch.from_numpy(array) for name, array in read.items()}
        images = batch["candidate_image"]
        with torch.inference_mode():
            features = model.encode(batch)
            repeated = {k: v.repeat_interleave(images.shape[1], 0) for k, v in features.items()}
            vectors = model.encoders.join(repeated, images.flatten(0, 1))
        known = {name: batch[name].float() for name in RELIABILITIES}
        parts.append((vectors.view(*images.shape[:2], -1), batch["candidate_success"], known))
    return Encoded(
        torch.cat([part[0] for part in parts]),
        torch.cat([part[1] for part in parts]).float(),
        {name: torch.cat([part[2][name] for part in parts]) for name in RELIABILITIES},
    )


def learn(name: str, scenes: Encoded, **overrides: Any) -> GraspeFamily:
    """A model of preset ``small`` whose fusion has learned from encoded scenes."""
    torch.manual_seed(0)
    model = cast("GraspeFamily", create_model(name, "small", **overrides)).train()
    fusion = [w for n, w in model.named_parameters() if not n.startswith("encoders.")]
    adam = torch.optim.Adam(fusion, LEARNING_RATE, weight_decay=1.5e-4)
    decay = torch.optim.lr_scheduler.CosineAnnealingLR(adam, STEPS)
    draw = np.random.default_rng(0)
    for _ in range(STEPS):
        rows = torch.from_numpy(draw.integers(0, len(scenes.vectors), BATCH))
        target = scenes.success[rows].flatten(0, 1)
        logits = _fuse(model, scenes, rows)
        judged = torch.ones_like(target, dtype=torch.bool)
        loss = masked_cross_entropy(logits, target, judged, target.new_ones(len(target)))
        loss = loss + ranking_loss(logits, target, judged, len(rows))
        adam.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(fusion, 5.0)
        adam.step()
        decay.step()
    return model.eval()


def least_success(model: GraspeFamily, examined: Encoded) -> NDArray[np.float64]:
    """min(E) of each candidate, (N, K)."""
    model.eval()
    found = []
    with torch.inference_mode():
        for rows in torch.arange(len(examined.vectors)).split(BATCH):  # type: ignore[no-untyped-call]
            least = torch.sigmoid(_fuse(model, examined, rows).double()).min(dim=1).values
            found.append(least.view(len(rows), -1))
    return torch.cat(found).double().numpy()


def _fuse(model: GraspeFamily, scenes: Encoded, rows: Tensor) -> Tensor:
    vectors = scenes.vectors[rows]
    number = vectors.shape[1]
    reliabilities = {
        name: values[rows].repeat_interleave(number)
        for name, values in scenes.reliabilities.items()
    }
    return model.fuse(vectors.flatten(0, 1), reliabilities)


def family_member(checkpoint: Checkpoint) -> GraspeFamily:
    """The checkpoint's model, which must be one of GrASPE's family."""
    if not isinstance(checkpoint.model, GraspeFamily):
        raise SystemExit(f"{checkpoint.config.model}: expected a model of GrASPE's family")
    return checkpoint.model


def _names(checkpoints: list[Checkpoint]) -> list[str]:
    return list(dict.fromkeys(checkpoint.config.model for checkpoint in checkpoints))


if __name__ == "__main__":
    raise SystemExit(main())
