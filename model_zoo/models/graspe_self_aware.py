"""Beyond the paper: GrASPE whose picture and cloud each foretell how wrong they will be.

Equations (1) to (5) measure what can make a sensor fail: darkness, few corners, scattered returns.
They cannot see a failure that looks like a scene, as a frozen picture or rain that returns the
light. Here each of both sensors has a judge of its own, who knows that sensor, the trajectory and
the velocities alone, and a foreteller of the judge's cross-entropy, who knows the reliabilities as
well. The sensor then counts by exp(-s e), e the error foretold: as in ``graspe_gated``, of its
features before the graph and of its nodes before they are read.

Shapes as in ``graspe``: B rows, K candidates, N = 120 nodes, T = 10 steps.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn.functional import binary_cross_entropy_with_logits, smooth_l1_loss, softplus

from model_zoo.bounds import Share, Units, Weight
from model_zoo.contract import Features, Loss, Observation, masked_cross_entropy
from model_zoo.layers.pointnet import penalised
from model_zoo.models.graspe import FeatureCounts, Graspe, GraspeSettings
from model_zoo.models.graspe_gated import NodeGates, faded, kept_sensors


class SelfAwareSettings(GraspeSettings):
    """The numbers of GrASPE, and those of its judges.

    Attributes:
        judge_hidden: Of the first of a judge's two dense layers, and of a foreteller's.
        judge_weight: Of the judges' cross-entropy in the loss.
        foretelling_weight: Of the foretellers' error in the loss.
        sensor_dropout: As in ``graspe_gated``.
    """

    judge_hidden: Units = 32
    judge_weight: Weight = 0.3
    foretelling_weight: Weight = 0.3
    sensor_dropout: Share = 0.2


class Judgement(NamedTuple):
    """What one sensor makes of K candidates.

    ``logits``: log-odds of success by this sensor alone, (K, T). ``error``: the mean cross-entropy
    of them that is foretold, (K,), in nats, above 0.
    """

    logits: Tensor
    error: Tensor


class SensorJudge(nn.Module):
    """The judge of one sensor, and the foreteller of the judge's error."""

    def __init__(self, features: int, moving: int, horizon: int, hidden: int) -> None:
        """Make the layers.

        Args:
            features: Of the sensor.
            moving: Features of trajectory and velocities.
            horizon: T.
            hidden: Of the first dense layers.
        """
        super().__init__()
        self.judge = nn.Sequential(
            nn.Linear(features + moving, hidden), nn.ReLU(), nn.Linear(hidden, horizon)
        )
        self.foreteller = nn.Sequential(
            nn.Linear(features + moving + 2, hidden), nn.ReLU(), nn.Linear(hidden, 1)
        )

    def forward(self, sensor: Tensor, moving: Tensor, reliabilities: Tensor) -> Judgement:
        """Judge by one sensor.

        Args:
            sensor: Its features, (K, F).
            moving: Those of trajectory and velocities, (K, M).
            reliabilities: r_img and r_point, (K, 2).
        """
        seen = torch.cat((sensor, moving), dim=1)
        # What is foretold teaches the foreteller, and not the features to be foretold well.
        known = torch.cat((seen.detach(), reliabilities), dim=1)
        return Judgement(self.judge(seen), softplus(self.foreteller(known))[:, 0])


class Judged(NamedTuple):
    """Log-odds of success (K, T) by all sensors, and what picture and cloud make of it alone."""

    logits: Tensor
    picture: Judgement
    cloud: Judgement


class GraspeSelfAware(Graspe):
    """GrASPE that weighs picture and cloud by the error that each foretells of itself."""

    name = "graspe_self_aware"
    settings_type = SelfAwareSettings

    def __init__(self, settings: SelfAwareSettings) -> None:
        """Make the model with random weights."""
        super().__init__(settings)
        self.weights = settings
        counts: FeatureCounts = self.counts
        moving, horizon = counts.trajectory + counts.velocity, settings.horizon
        self.picture = SensorJudge(counts.image, moving, horizon, settings.judge_hidden)
        self.cloud = SensorJudge(counts.point, moving, horizon, settings.judge_hidden)
        self.strictness = nn.Parameter(torch.zeros(2))
        self.node_gates = NodeGates(counts)

    def fuse(self, vector: Tensor, candidates: Observation) -> Tensor:
        """Log-odds of success (K, T) by A-GNN, each sensor as far as it trusts itself."""
        return self.judge(vector, candidates).logits

    def judge(self, vector: Tensor, candidates: Observation) -> Judged:
        """Judge by each sensor alone, then by both, from f_vec (K, 120)."""
        counts = self.counts
        sizes = [counts.image, counts.point, counts.trajectory + counts.velocity]
        picture, cloud, moving = torch.split(vector, sizes, dim=1)
        rows = vector.shape[0]
        r_img, r_point = (candidates[name].expand(rows) for name in ("r_img", "r_point"))
        reliabilities = torch.stack((r_img, r_point), dim=1)
        # Each sensor alone, and how wrong it expects to be.
        by_picture = self.picture(picture, moving, reliabilities)
        by_cloud = self.cloud(cloud, moving, reliabilities)
        # What counts of it: exp(-s e), s above 0 and at first 1.
        strictness = softplus(self.strictness) / softplus(torch.zeros_like(self.strictness))
        trust_picture = torch.exp(-strictness[0] * by_picture.error)
        trust_cloud = torch.exp(-strictness[1] * by_cloud.error)
        if self.training:
            keep_picture, keep_cloud = kept_sensors(
                rows, self.weights.sensor_dropout, vector.device
            )
            r_img, r_point = r_img * keep_picture, r_point * keep_cloud
            trust_picture, trust_cloud = trust_picture * keep_picture, trust_cloud * keep_cloud
        # Both, as far as they count.
        gate = self.node_gates(trust_picture, trust_cloud)
        nodes = self.graph.propagate(faded(vector, gate), r_img, r_point)
        return Judged(self.graph.read_out(nodes, gate), by_picture, by_cloud)

    def loss(self, observation: Observation, success: Tensor, mask: Tensor, weight: Tensor) -> Loss:
        """GrASPE's, the judges' cross-entropies, and how wrongly these were foretold."""
        features, transform = self.encoders.scene(observation)
        judged = self._judge_each(features, observation)
        loss = Loss(masked_cross_entropy(judged.logits, success, mask, weight), judged.logits)
        loss = penalised(loss, transform, self.settings.orthogonality)
        alone = [judged.picture, judged.cloud]
        entropies = [_row_entropy(each.logits, success, mask) for each in alone]
        rows = mask.any(1) * weight
        errors = [
            smooth_l1_loss(each.error, entropy.detach(), reduction="none")
            for each, entropy in zip(alone, entropies, strict=True)
        ]
        judges = _mean(entropies[0] + entropies[1], rows)
        foretold = _mean(errors[0] + errors[1], rows)
        total = (
            loss.total
            + self.weights.judge_weight * judges
            + self.weights.foretelling_weight * foretold
        )
        parts = loss.parts | {"judges": judges, "foretelling": foretold}
        return Loss(total, loss.logits, parts, loss.entropy_scale)

    def _judge_each(self, features: Features, observation: Observation) -> Judged:
        paired, candidates = self.paired(features, observation)
        vector = self.encoders.join(paired, candidates["trajectory_image"])
        return self.judge(vector, candidates)


def _row_entropy(logits: Tensor, success: Tensor, mask: Tensor) -> Tensor:
    """The mean cross-entropy of each row's judged steps, (K,)."""
    every = binary_cross_entropy_with_logits(logits.float(), success, reduction="none")
    return (every * mask).sum(1) / mask.sum(1).clamp_min(1)


def _mean(values: Tensor, weight: Tensor) -> Tensor:
    return (values * weight).sum() / weight.sum().clamp_min(1e-9)
